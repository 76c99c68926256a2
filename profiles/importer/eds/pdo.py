"""Process data objects of EDS and DCF files (CiA 301 clauses 7.5.2.35 to 7.5.2.38)."""

from __future__ import annotations

from typing import Literal

from profiles.importer.description import DescribedEntry, DescribedPdo
from profiles.importer.eds.sections import SUBOBJECT, Section
from profiles.importer.report import ImportReport
from profiles.importer.values import node_relative, parse_number
from profiles.schema import DataType, PdoIdentifier

_IDENTIFIER = 0x7FF
#: The frame has an identifier of 29 bits; also set in FFFFFFFFh, which templates contain.
_EXTENDED = 1 << 29
#: Bits of a whole object by its type; a boolean takes one byte as a value of its own.
_BITS: dict[DataType, int] = {
    "BOOL": 8, "INT8": 8, "UINT8": 8, "INT16": 16, "UINT16": 16, "INT32": 32, "UINT32": 32,
    "INT64": 64, "UINT64": 64, "REAL32": 32,
}  # fmt: skip


def read_pdos(
    entries: list[DescribedEntry], sections: dict[str, Section], name: str, report: ImportReport
) -> list[DescribedPdo]:
    """Read default mappings from the defaults of 1600h… and 1A00h…."""
    by_key = {e.key: e for e in entries}
    keys = set(by_key)
    defaults = _defaults(sections)
    pdos: list[DescribedPdo] = []
    by_index: dict[int, list[DescribedEntry]] = {}
    for entry in entries:
        if 0x1600 <= entry.index < 0x1800 or 0x1A00 <= entry.index < 0x1C00:
            by_index.setdefault(entry.index, []).append(entry)
    for index, mapping in sorted(by_index.items()):
        layout = _layout(index, mapping, defaults, keys, name, report)
        mapped = tuple(dict.fromkeys(key for key, _ in layout if key is not None))
        fixed = all(e.access == "ro" for e in mapping)
        if mapped or not fixed:
            direction: Literal["rx", "tx"] = "rx" if index < 0x1A00 else "tx"
            pdos.append(
                DescribedPdo(
                    index,
                    direction,
                    mapped,
                    fixed,
                    name,
                    layout=() if _whole_objects(layout, by_key) else tuple(layout),
                    identifier=_identifier(index, by_key, defaults, name, report),
                )
            )
    return pdos


def _whole_objects(layout: list[tuple[str | None, int]], by_key: dict[str, DescribedEntry]) -> bool:
    """Return whether the keys describe it fully: no padding, no parts of objects, no duplicates."""
    keys = [key for key, _ in layout]
    return len(set(keys)) == len(keys) and all(
        key is not None and bits == _BITS.get(by_key[key].type or "OCTETS") for key, bits in layout
    )


def _layout(
    index: int,
    mapping: list[DescribedEntry],
    defaults: dict[tuple[int, int], str],
    keys: set[str],
    name: str,
    report: ImportReport,
) -> list[tuple[str | None, int]]:
    """Return keys and bits of the default mapping. Entries beyond subindex 0's count are unused."""
    place = f"{name} [{index:04X}]"
    count = parse_number(defaults.get((index, 0), ""), place, report)
    layout: list[tuple[str | None, int]] = []
    for entry in sorted(mapping, key=lambda e: e.subindex):
        value = entry.default_raw
        if entry.subindex == 0 or not isinstance(value, int) or value == 0:
            continue
        # If the count is 0 although there are entries, it is a template that was not filled in.
        if count and entry.subindex > count:
            report.noted(
                place, "description.mapping-behind-count", subindex=entry.subindex, count=count
            )
            continue
        key = f"{value >> 16 & 0xFFFF:04X}:{value >> 8 & 0xFF:02X}"
        bits = value & 0xFF
        if key in keys:
            layout.append((key, bits))
        elif bits:
            layout.append((None, bits))
            if value >> 16 & 0xFFFF >= 0x20:  # lower indices are dummies for padding
                report.left_out(place, "description.mapped-not-described", key=key)
    return layout


def _identifier(
    index: int,
    by_key: dict[str, DescribedEntry],
    defaults: dict[tuple[int, int], str],
    name: str,
    report: ImportReport,
) -> PdoIdentifier | None:
    """Return the default COB-ID; None if the file states no valid one."""
    communication = index - 0x200
    text = defaults.get((communication, 1), "")
    place = f"{name} [{communication:04X}sub1]"
    added = node_relative(text, place, report)
    number = added if added is not None else parse_number(text, place, report)
    if not isinstance(number, int) or not number & _IDENTIFIER or number & _EXTENDED:
        return None
    entry = by_key.get(f"{communication:04X}:01")
    return PdoIdentifier(
        cob_id=number & _IDENTIFIER,
        of_node=added is not None,
        fixed=entry is not None and entry.access == "ro",
    )


def _defaults(sections: dict[str, Section]) -> dict[tuple[int, int], str]:
    """Return default values by index and subindex, whatever the spelling of their headings."""
    return {
        (int(match[1], 16), int(match[2], 16)): section.word("defaultvalue")
        for title, section in sections.items()
        if (match := SUBOBJECT.match(title))
    }
