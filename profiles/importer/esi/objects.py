"""Objects of an ESI file's dictionary (ETG.2000 v1.0.10 clause 6.8)."""

from __future__ import annotations

import re
from dataclasses import replace
from xml.etree.ElementTree import Element

from profiles.importer.description import DescribedEntry
from profiles.importer.esi.types import EsiTypes, Member
from profiles.importer.esi.xml_tree import attribute_of, child, children, flag_of, name_of, text_of
from profiles.importer.report import ImportReport
from profiles.importer.values import (
    fit,
    parse_access,
    parse_number,
    real_of_bits,
    tidy,
    unit_of_code,
    unit_of_name,
    whole_number,
)
from profiles.schema import Access, DataType, PdoMapping, Raw

_UNSIGNED_BITS = {"UINT8": 8, "UINT16": 16, "UINT32": 32, "UINT64": 64}
#: Names that only contain a number: "SubIndex 003", "Element 3".
_NUMBERED = re.compile(r"(?:sub\s*index|element|entry|item)?\s*\d+", re.I)


class DictionaryReader:
    """Objects of one ``Dictionary`` element."""

    def __init__(
        self, file: str, report: ImportReport, dictionary: Element, shift: int = 0
    ) -> None:
        self._file = file
        self._report = report
        self._shift = shift
        """Offset of a module's objects from those of the first slot."""
        self._types = EsiTypes(child(dictionary, "DataTypes"), file, report)
        self._objects = children(child(dictionary, "Objects"), "Object")
        self._preop_only: list[str] = []

    def entries(self) -> list[DescribedEntry]:
        """Return one entry per subindex, in the order of the file."""
        found = [entry for element in self._objects for entry in self._object(element)]
        writable = sum(entry.access != "ro" for entry in found)
        # If nearly every object has this restriction, the remark carries no information.
        if self._preop_only and 2 * len(self._preop_only) < writable:
            first = ", ".join(self._preop_only[:5])
            more = len(self._preop_only) - 5
            if more > 0:
                self._report.noted(
                    self._file, "description.written-before-op-more", objects=first, more=more
                )
            else:
                self._report.noted(self._file, "description.written-before-op", objects=first)
        return found

    def _object(self, element: Element) -> list[DescribedEntry]:
        index_text = text_of(child(element, "Index"))
        place = f"{self._file}: Object {index_text[:12]}"
        index = whole_number(index_text, place, self._report)
        if index is None or not 0x1000 <= index <= 0xFFFF:
            if index is None:
                self._report.left_out(place, "description.object-no-index")
            return []
        if self._shift and flag_of(child(element, "Index"), "DependOnSlot"):
            index += self._shift
        place = f"{self._file}: {index:04X}h"
        title = tidy(name_of(element)) or f"Object {index:04X}h"
        type_name = text_of(child(element, "Type"))
        members = self._types.members(type_name)
        info = child(element, "Info")
        infos = children(info, "SubItem")
        if not members and not infos:
            bits = whole_number(text_of(child(element, "BitSize")), place, self._report)
            member = Member(0, title, type_name, bits, child(element, "Flags"))
            return [self._entry(index, member, "", info, element, place)]
        if not members:
            self._report.repaired(place, "description.type-not-described", type=type_name[:30])
            members = [
                Member(n, tidy(name_of(item)), "", None, child(element, "Flags"))
                for n, item in enumerate(infos)
            ]
        names = {member.name for member in members if member.name}
        by_name = any(name_of(info) in names for info in infos)
        # Files without values for subindex 0 start their list with subindex 1.
        skipped = not by_name and members[0].subindex == 0 and len(infos) == len(members) - 1
        return [
            self._entry(index, named, title, info, element, place)
            for position, member in enumerate(members)
            for named, info in (_info_of(infos, position - skipped, member, names),)
            # Subindex 0 only contains the count (CiA 301 clause 7.4.4), as a byte. One of another
            # type is a value of its own, such as 1004h:00.
            if member.subindex > 0 or len(members) == 1 or self._is_value(member)
        ]

    def _is_value(self, member: Member) -> bool:
        kind = self._types.base(member.type, None) if member.type else None
        return kind is not None and kind not in ("UINT8", "INT8", "BOOL")

    def _entry(
        self,
        index: int,
        member: Member,
        title: str,
        info: Element | None,
        element: Element,
        place: str,
    ) -> DescribedEntry:
        place = f"{place}:{member.subindex:02X}"
        data_type = self._types.base(member.type, member.bits)
        flags = member.flags if member.flags is not None else child(element, "Flags")
        access, pdo, preop_only = _rights(flags, child(element, "Flags"), place, self._report)
        if preop_only and access != "ro":
            self._preop_only.append(f"{index:04X}:{member.subindex:02X}")
        plain, unit = unit_of_name(tidy(member.name))
        name = f"{title}: {plain}" if title and plain and plain != title else plain or title
        default: Raw | None = None
        low = high = None
        if data_type is not None:
            default = self._value(
                info, ("DefaultValue", "DefaultData", "DefaultString"), data_type, place
            )
            low = self._number(info, ("MinValue", "MinData"), data_type, place)
            high = self._number(info, ("MaxValue", "MaxData"), data_type, place)
        return DescribedEntry(
            index=index,
            subindex=member.subindex,
            name=name,
            type=data_type,
            access=access,
            pdo=pdo,
            default_raw=default,
            min_raw=low,
            max_raw=high,
            unit=_unit(info, element) or unit,
            group=tidy(text_of(child(element, "Group")), 60),
            enum=self._enumeration(member.type, data_type, place),
            help=tidy(text_of(child(element, "Comment")), 500),
            source=f"{self._file}: {index:04X}h",
        )

    def _enumeration(self, name: str, data_type: DataType | None, place: str) -> dict[int, str]:
        """Return texts by raw value. A negative value in an unsigned type is two's complement."""
        found: dict[int, str] = {}
        for value, words in self._types.enumeration(name).items():
            size = _UNSIGNED_BITS.get(data_type or "")
            if size and -(1 << size - 1) <= value < 0:
                self._report.repaired(
                    place, "description.enum-negative", value=value, raw=value + (1 << size)
                )
                found.setdefault(value + (1 << size), words)
                continue
            raw = value if data_type is None else fit(value, data_type, "Enum", place, self._report)
            if raw is not None:
                found.setdefault(int(raw), words)
        return found

    def _value(
        self,
        info: Element | None,
        tags: tuple[str, ...],
        data_type: DataType,
        place: str,
    ) -> Raw | None:
        if data_type != "STRING":
            return self._number(info, tags, data_type, place)
        return tidy(text_of(child(info, "DefaultString"))) or None

    def _number(
        self,
        info: Element | None,
        tags: tuple[str, ...],
        data_type: DataType,
        place: str,
    ) -> int | float | None:
        for tag in tags:
            text = text_of(child(info, tag))
            if not text:
                continue
            number: int | float | None
            if tag.endswith("Data"):
                number = _hex_data(text, f"{place} {tag}", self._report)
            else:
                number = parse_number(text, f"{place} {tag}", self._report)
            in_bits = tag.endswith("Data") or text[:2].lower() in ("#x", "0x")
            if data_type == "REAL32" and in_bits and number is not None:
                number = real_of_bits(int(number))
            return fit(number, data_type, tag, place, self._report)
        return None


def _hex_data(text: str, place: str, report: ImportReport) -> int | None:
    """Decode ``xs:hexBinary`` of ETG.2000: bytes as transferred, lowest first, or a number."""
    bare = text.strip()
    if bare.lower().startswith(("#x", "0x")):
        number = parse_number(bare, place, report)
        return None if number is None else int(number)
    try:
        return int.from_bytes(bytes.fromhex(bare), "little") if len(bare) <= 16 else None
    except ValueError:
        report.left_out(place, "description.not-hexadecimal", value=bare[:20])
        return None


def _info_of(
    infos: list[Element], position: int, member: Member, names: set[str]
) -> tuple[Member, Element | None]:
    """Return a member with its values: by name if the names are unique, else by position.

    Values under the name of another member (``names``) belong to that one. An element of an array
    has only its number as a name, and the object may name it.
    """
    named = [i for i in infos if member.name and name_of(i) == member.name]
    found = named[0] if len(named) == 1 else None
    if found is None and 0 <= position < len(infos):
        own = tidy(name_of(infos[position]))
        if own != member.name and own in names:
            return member, None
        found = infos[position]
        if member.name.isdecimal() and own and not _NUMBERED.fullmatch(own):
            member = replace(member, name=own)
    return member, child(found, "Info")


def _rights(
    flags: Element | None, fallback: Element | None, place: str, report: ImportReport
) -> tuple[Access, PdoMapping, bool]:
    """Return access, mapping, and whether it is writable in PreOP or SafeOP only."""
    preop_only = False
    access_element = child(flags, "Access")
    if access_element is None:
        access_element = child(fallback, "Access")
    access: Access = "ro"
    if access_element is not None:
        writes = attribute_of(access_element, "WriteRestrictions")
        access = parse_access(text_of(access_element) or "ro", place, report)
        preop_only = writes.lower() in ("preop", "preop_safeop")
    mapping = (
        text_of(child(flags, "PdoMapping")) or text_of(child(fallback, "PdoMapping"))
    ).upper()
    pdo: PdoMapping = "none"
    if "R" in mapping and "T" in mapping:
        pdo = "rxtx"
    elif "R" in mapping:
        pdo = "rx"
    elif "T" in mapping:
        pdo = "tx"
    return access, pdo, preop_only


def _unit(info: Element | None, element: Element) -> str:
    for owner in (info, element, child(element, "Info")):
        text = text_of(child(owner, "Unit"))
        if text:
            return unit_of_code(text) or tidy(text, 20)
    return ""
