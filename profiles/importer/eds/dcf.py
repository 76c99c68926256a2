"""Values in a device configuration file (CiA 306-1 v1.3 clause 5.3)."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

from profiles.importer.eds.eds import MAX_BYTES, compare_with_lists, identity_of
from profiles.importer.eds.sections import (
    COMPACT,
    LINE_END,
    OBJECT,
    SUBOBJECT,
    Section,
    node_id_of,
    read_sections,
)
from profiles.importer.report import ImportFailed, ImportReport
from profiles.importer.texts import check_size, decode_text
from profiles.importer.values import TYPE_BY_CODE, node_relative, parse_number
from profiles.schema import DataType


@dataclass(frozen=True, slots=True)
class ConfiguredValue:
    """One ``ParameterValue`` of the file, with the node-ID added where the file refers to it.

    ``type`` is the type stated by the file, None if it states none.
    """

    index: int
    subindex: int
    text: str
    line: int
    type: DataType | None = None


#: Headings of an object's section, or of one of its subindices.
_ANY_OBJECT = re.compile(r"(?:0x)?([0-9a-f]{4})h?(?:$|\s*_?sub)")
_VALUE_LINE = re.compile(r"\s*(parametervalue|\d{1,3})\s*=", re.I)


def is_dcf(data: bytes) -> bool:
    """Return whether the data look like a DCF or EDS: lists in other formats lack such sections."""
    start = data[:8192].lower()
    if start[:2] in (b"\xff\xfe", b"\xfe\xff") or b"\0" in start[:2]:  # UTF-16
        start = start.replace(b"\0", b"")
    return b"[fileinfo]" in start or b"[deviceinfo]" in start


def read_dcf_values(data: bytes, name: str, report: ImportReport) -> Iterator[ConfiguredValue]:
    """Return the values to be configured, in the file's order, without the EDS defaults.

    Raises:
        ImportFailed: too large, or no object has a value.
    """
    check_size(data, MAX_BYTES, name)
    text = _without_cut(decode_text(data, name, report), name, report)
    sections = read_sections(text, name, report)
    present = {int(match[1], 16) for title in sections if (match := _ANY_OBJECT.match(title))}
    compare_with_lists(sections, name, present, report)
    node_id = node_id_of(sections, name)
    found = [
        replace(value, text=_of_node(value, node_id, name, report))
        for value in _values(sections, name)
    ]
    if not found:
        raise ImportFailed("description.no-values", file=name)
    return iter(found)


def _without_cut(text: str, name: str, report: ImportReport) -> str:
    """Leave out a value in a last line without line end: of 12000, a cut file may have 12."""
    lines = re.split(r"(?<=[\r\n])", text)
    if not _VALUE_LINE.match(lines[-1]):
        return text
    place = f"{name}:{len(LINE_END.split(text))}"
    report.left_out(place, "description.cut-off", line=lines[-1].strip()[:60])
    return "".join(lines[:-1])


def read_dcf_identity(data: bytes, name: str) -> tuple[int | None, int | None]:
    """Return vendor and product number of the drive of this file, None where not stated.

    Raises:
        ImportFailed: too large.
    """
    check_size(data, MAX_BYTES, name)
    quiet = ImportReport()
    sections = read_sections(decode_text(data, name, quiet), name, quiet)
    return identity_of(sections, name, quiet)


def _values(sections: dict[str, Section], name: str) -> Iterator[ConfiguredValue]:
    """Iterate over the objects with a ``ParameterValue``.

    Values of arrays in compact storage are in a section of their own, such as ``[607DValue]``.
    """
    for title, section in sections.items():
        if (match := COMPACT.match(title)) and match[2] == "value":
            kind = _type_of(sections.get(match[1], section), name)
            for key, text in section.values.items():
                if key.isdecimal() and len(key) <= 3 and 1 <= int(key) <= 254 and text:
                    yield ConfiguredValue(int(match[1], 16), int(key), text, section.line, kind)
            continue
        value = section.get("parametervalue")
        found = SUBOBJECT.match(title) or OBJECT.match(title)
        if value and found:
            subindex = int(found[2], 16) if found.lastindex == 2 else 0
            kind = _type_of(section, name)
            yield ConfiguredValue(int(found[1], 16), subindex, value, section.line, kind)


def _type_of(section: Section, name: str) -> DataType | None:
    code = parse_number(section.word("datatype"), name, ImportReport())
    return TYPE_BY_CODE.get(int(code)) if code is not None else None


def _of_node(value: ConfiguredValue, node_id: int | None, name: str, report: ImportReport) -> str:
    if value.type == "STRING":
        return value.text  # which may contain anything
    added = node_relative(value.text, f"{name}:{value.line}", report)
    return value.text if added is None or node_id is None else f"{added + node_id:#x}"
