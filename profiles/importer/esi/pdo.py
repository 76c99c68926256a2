"""Process data objects of an ESI device (ETG.2000 clause 6.10)."""

from __future__ import annotations

from typing import Literal
from xml.etree.ElementTree import Element

from profiles.importer.description import MAX_ENTRIES, DescribedEntry, DescribedPdo
from profiles.importer.esi.modules import Part
from profiles.importer.esi.xml_tree import attribute_of, child, children, flag_of, name_of, text_of
from profiles.importer.report import ImportReport
from profiles.importer.values import named_type, tidy, whole_number
from profiles.schema import Access

#: Bits of a whole object by its type; for others, the file states the mapped bits.
_BITS = {
    "BOOL": 1, "INT8": 8, "UINT8": 8, "INT16": 16, "UINT16": 16, "INT32": 32, "UINT32": 32,
    "INT64": 64, "UINT64": 64, "REAL32": 32,
}  # fmt: skip
_MOST_BITS = 64 * 8
#: Process data of one station fit into a frame: 1486 bytes (ETG.1000.4 clause 5.4).
_MOST_PADDING = 1486 * 8


class PdoReader:
    """Reads ``RxPdo`` and ``TxPdo``; objects that occur only in a PDO are added to ``entries``."""

    def __init__(
        self,
        file: str,
        report: ImportReport,
        entries: list[DescribedEntry],
        seen: set[str],
        part: Part,
    ) -> None:
        self._part_of_device = part
        self._file = file
        self._report = report
        self._entries = entries
        self._by_key = {entry.key: entry for entry in entries}
        self._seen = seen

    def read(self, pdo: Element, direction: Literal["rx", "tx"]) -> list[DescribedPdo]:
        """Return the PDO in a list; empty if it has no index, or is fixed and empty.

        A PDO without contents that can be written is kept, to be filled.
        """
        place = f"{self._file}: {'RxPdo' if direction == 'rx' else 'TxPdo'}"
        index = whole_number(text_of(child(pdo, "Index")), place, self._report)
        if index is None:
            self._report.left_out(place, "description.pdo-no-index")
            return []
        if flag_of(child(pdo, "Index"), "DependOnSlot"):
            index += self._part_of_device.pdo_shift
        where = f"{place} {index:04X}h"
        layout: list[tuple[str | None, int]] = []
        keys: list[str] = []
        for item in children(pdo, "Entry"):
            for part in self._parts(item, direction, where):
                layout.append(part)
                if part[0] is not None and part[0] not in keys:
                    keys.append(part[0])
        fixed = flag_of(pdo, "Fixed")
        if not keys and fixed:
            return []
        exclude = (
            whole_number(text_of(item), where, self._report) for item in children(pdo, "Exclude")
        )
        return [
            DescribedPdo(
                index=index,
                direction=direction,
                entries=tuple(keys),
                fixed=fixed,
                source=self._file,
                layout=() if self._whole_objects(layout) else tuple(layout),
                sync_manager=whole_number(attribute_of(pdo, "Sm"), where, self._report),
                mandatory=flag_of(pdo, "Mandatory"),
                exclude=tuple(number for number in exclude if number is not None),
            )
        ]

    def _parts(
        self, item: Element, direction: Literal["rx", "tx"], where: str
    ) -> list[tuple[str | None, int]]:
        """Return the parts of one entry of the PDO; index 0 is padding.

        Long padding is split. Empty: the entry cannot be interpreted.
        """
        object_index = whole_number(text_of(child(item, "Index")), where, self._report)
        bits = whole_number(text_of(child(item, "BitLen")), where, self._report)
        if object_index and flag_of(child(item, "Index"), "DependOnSlot"):
            object_index += self._part_of_device.index_shift
        if not object_index:
            return self._padding(bits, where)
        subindex = whole_number(text_of(child(item, "SubIndex")), where, self._report) or 0
        if not 0x1000 <= object_index <= 0xFFFF or not 0 <= subindex <= 255:
            self._report.left_out(
                where, "description.pdo-entry-invalid", index=object_index, subindex=subindex
            )
            return self._padding(bits, where)
        key = f"{object_index:04X}:{subindex:02X}"
        if key not in self._seen and len(self._entries) < MAX_ENTRIES:
            kind = named_type(text_of(child(item, "DataType")), bits) or named_type("", bits)
            if kind is None:
                self._report.left_out(where, "description.mapped-type-unknown", key=key)
                return self._padding(bits, where)
            access: Access = "rw" if direction == "rx" else "ro"
            name = tidy(name_of(item)) or f"Object {key}"
            entry = DescribedEntry(
                object_index, subindex, name, kind, access, direction, source=where
            )
            self._entries.append(entry)
            self._by_key[key] = entry
            self._seen.add(key)
        natural = self._natural_bits(key)
        if not bits or bits > _MOST_BITS:
            bits = natural
        return [(key, bits)] if bits else self._padding(bits, where)

    def _padding(self, bits: int | None, where: str) -> list[tuple[str | None, int]]:
        """Return padding, never dropped without a finding, as what follows keeps its offset."""
        if not bits or bits > _MOST_PADDING:
            self._report.left_out(where, "description.padding-unknown", bits=bits or 0)
            return []
        whole, rest = divmod(bits, _MOST_BITS)
        return [(None, length) for length in (*[_MOST_BITS] * whole, rest) if length]

    def _natural_bits(self, key: str) -> int | None:
        entry = self._by_key.get(key)
        return None if entry is None or entry.type is None else _BITS.get(entry.type)

    def _whole_objects(self, layout: list[tuple[str | None, int]]) -> bool:
        """Return whether the keys describe it fully: no padding, no single bits, no duplicates."""
        keys = [key for key, _ in layout]
        return len(set(keys)) == len(keys) and all(
            key is not None and bits % 8 == 0 and bits == self._natural_bits(key)
            for key, bits in layout
        )
