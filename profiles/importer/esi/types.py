"""Data types that an ESI file defines: records, arrays, enumerations."""

from __future__ import annotations

import re
from dataclasses import dataclass
from xml.etree.ElementTree import Element

from profiles.importer.esi.xml_tree import child, children, text_of
from profiles.importer.report import ImportReport
from profiles.importer.values import named_type, parse_number, tidy
from profiles.schema import DataType

_DEEPEST = 8
_LONGEST_ARRAY = 255
#: Arrays of base types (ETG.1020 clause 5): `ARRAY [0..27] OF BYTE` is an octet string of 28 bytes.
_INLINE = re.compile(r"ARRAY\s*\[\s*(\d{1,3})\s*\.\.\s*(-?\d{1,3})\s*\]\s*OF\s+(\w+)")


@dataclass(frozen=True, slots=True)
class Member:
    """One subindex of a type. ``flags`` is its own Flags element, if it has one."""

    subindex: int
    name: str
    type: str
    bits: int | None
    flags: Element | None


class EsiTypes:
    """The ``DataTypes`` of one dictionary. Types may refer to others, wrongly even in a cycle."""

    def __init__(self, element: Element | None, file: str, report: ImportReport) -> None:
        self._file = file
        self._report = report
        self._types: dict[str, Element] = {}
        for data_type in children(element, "DataType"):
            name = text_of(child(data_type, "Name"))
            if name and name not in self._types:
                self._types[name] = data_type

    def members(self, name: str) -> list[Member]:
        """Return the subindices of a record or array type; empty for a plain one."""
        element = self._types.get(name)
        members: list[Member] = []
        for position, item in enumerate(children(element, "SubItem")):
            members += self._sub_item(name, position, item)
        seen: set[int] = set()
        unique = []
        for member in members:
            if member.subindex in seen:
                self._report.noted(
                    f"{self._file}: {name[:30]}",
                    "description.subindex-twice",
                    subindex=member.subindex,
                )
            elif 0 <= member.subindex <= 255:
                seen.add(member.subindex)
                unique.append(member)
        return unique

    def _sub_item(self, name: str, position: int, item: Element) -> list[Member]:
        place = f"{self._file}: {name[:30]}"
        type_name = text_of(child(item, "Type"))
        flags = child(item, "Flags")
        given = parse_number(text_of(child(item, "SubIdx")), place, self._report)
        # An array type without a name and with a subindex of its own is one value of many bytes.
        array = (
            None if given is not None and _INLINE.fullmatch(type_name) else self._array(type_name)
        )
        if array is not None:
            first, count, base = array
            if first + count - 1 > _LONGEST_ARRAY:
                self._report.left_out(
                    place,
                    "description.array-too-long",
                    elements=count,
                    first=first,
                    last=_LONGEST_ARRAY,
                )
            return [
                Member(first + n, f"{first + n}", base, None, flags)
                for n in range(min(count, _LONGEST_ARRAY - first + 1))
            ]
        bits = parse_number(text_of(child(item, "BitSize")), place, self._report)
        return [
            Member(
                position if given is None else int(given),
                tidy(text_of(child(item, "Name"))),
                type_name,
                None if bits is None else int(bits),
                flags,
            )
        ]

    def _array(self, name: str) -> tuple[int, int, str] | None:
        """Return first subindex, number and element type of an array type."""
        element = self._types.get(name)
        info = child(element, "ArrayInfo")
        if info is not None:
            place = f"{self._file}: {name[:30]}"
            first = parse_number(text_of(child(info, "LBound")), place, self._report)
            count = parse_number(text_of(child(info, "Elements")), place, self._report)
            base = text_of(child(element, "BaseType"))
            if count is None or count < 1 or self._resolves_to_text(base, name):
                return None
            return max(int(first or 1), 1), int(count), base
        match = _INLINE.fullmatch(name)
        if match is None or element is not None:
            return None
        return max(int(match[1]), 1), int(match[2]) - int(match[1]) + 1, match[3]

    def _resolves_to_text(self, base: str, name: str) -> bool:
        """Return whether an array of characters is text or bytes instead of subindices."""
        return base.upper() in ("BYTE", "CHAR") and not re.search(r"ARR", name, re.I)

    def base(self, name: str, bits: int | None) -> DataType | None:
        """Return the plain type to which ``name`` resolves."""
        if _INLINE.fullmatch(name):
            return "OCTETS"  # although some files define it again with a base type BYTE
        seen: set[str] = set()
        for _ in range(_DEEPEST):
            element = self._types.get(name)
            if element is None or name in seen:
                break
            seen.add(name)
            size = parse_number(text_of(child(element, "BitSize")), self._file, self._report)
            bits = int(size) if size is not None else bits
            following = text_of(child(element, "BaseType"))
            if not following and child(element, "SubItem") is not None:
                return "OCTETS"  # a record within a record: its bytes, whatever their number
            if not following:
                break
            name = following
        found = named_type(name, bits)
        # Enumerations and similar types have a name of their own and only a length.
        return found if found is not None else named_type("", bits)

    def enumeration(self, name: str) -> dict[int, str]:
        """Return the texts of an enumeration's values; empty for other types."""
        element = self._types.get(name)
        texts: dict[int, str] = {}
        for info in children(element, "EnumInfo"):
            value = parse_number(text_of(child(info, "Enum")), self._file, self._report)
            names = [t for t in children(info, "Text") if (t.get("LcId") or "1033") == "1033"]
            text = text_of(names[0]) if names else text_of(child(info, "Text"))
            if value is not None and value == int(value) and len(texts) < 1000:
                texts[int(value)] = tidy(text)
        return texts
