"""EtherCAT slave information (ESI) files.

Source: ETG.2000 v1.0.10. Parsed without DTDs and entities and with a size limit, since these
files come from anywhere.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, ParseError

from defusedxml.common import DefusedXmlException
from defusedxml.ElementTree import fromstring

from profiles.importer.description import (
    MAX_ENTRIES,
    DescribedEntry,
    DescribedPdo,
    Description,
)
from profiles.importer.esi_bring_up import read_bring_up
from profiles.importer.esi_pdo import PdoReader
from profiles.importer.esi_types import EsiTypes, Member
from profiles.importer.report import ImportFailed, ImportReport
from profiles.importer.texts import check_size, decode_xml
from profiles.importer.values import (
    fit,
    parse_access,
    parse_number,
    tidy,
    unit_of_code,
    unit_of_name,
    whole_number,
)
from profiles.importer.xml_tree import (
    attribute_of,
    child,
    children,
    flag_of,
    name_of,
    simplify_tags,
    text_of,
)
from profiles.schema import Access, DataType, PdoMapping, Raw

MAX_BYTES = 32 * 2**20
#: Names that only count: "SubIndex 003", "Element 3".
_NUMBERED = re.compile(r"(?:sub\s*index|element|entry|item)?\s*\d+", re.I)


@dataclass(frozen=True, slots=True)
class EsiDevice:
    """One device of an ESI file, to choose from: a file often holds a whole series."""

    number: int
    name: str
    vendor_id: int | None
    product_code: int | None
    revision: int | None
    has_control_word: bool = False
    """Whether it describes 6040h: a bootloader in the same file does not."""


@dataclass(slots=True)
class EsiFile:
    """An ESI file that has been parsed."""

    name: str
    report: ImportReport
    root: Element
    devices: list[Element]


def esi_devices(file: EsiFile) -> tuple[EsiDevice, ...]:
    """The devices of a file, in its order."""
    quiet = replace(file, report=ImportReport())
    return tuple(_choice(quiet, n) for n in range(len(file.devices)))


def read_device(file: EsiFile, device: int = 0) -> Description:
    """Read one device of an ESI file.

    Raises:
        ImportFailed: no such device, or nothing in it.
    """
    name = file.name
    if not 0 <= device < len(file.devices):
        raise ImportFailed(f"{name} has {len(file.devices)} devices, there is no number {device}")
    element = file.devices[device]
    choice = _choice(file, device)
    entries, pdos = _contents(file, element)
    if not entries:
        raise ImportFailed(
            f"{name} describes no objects of {choice.name}: take the dictionary of the drive itself"
        )
    mailbox = child(child(element, "Mailbox"), "CoE")
    vendor = child(file.root, "Vendor")
    return Description(
        file=name,
        link="ethercat",
        maker=name_of(vendor) or "unknown maker",
        model=choice.name,
        vendor_id=choice.vendor_id,
        product_code=choice.product_code,
        revision=choice.revision,
        entries=tuple(entries),
        pdos=tuple(pdos),
        complete_access=flag_of(mailbox, "CompleteAccess"),
        foe=child(child(element, "Mailbox"), "FoE") is not None,
        bring_up=read_bring_up(element, name, file.report),
    )


def _parsed(text: str) -> Element:
    """The root of a document without DTD.

    The reader of defusedxml refuses a DTD at the cost of Python's slow parser. Without these
    letters there is none, and so no entity either: then the fast one reads the same.
    """
    if "<!DOCTYPE" in text:
        refused: Element = fromstring(text, forbid_dtd=True)
        return refused
    return ElementTree.fromstring(text)  # noqa: S314 - no DTD, see above


def open_esi(data: bytes, name: str, report: ImportReport) -> EsiFile:
    """Parse an ESI file.

    Raises:
        ImportFailed: not XML, not ESI, too large, or with forbidden constructs.
    """
    check_size(data, MAX_BYTES, name)
    try:
        root = _parsed(decode_xml(data, name, report))
    except ParseError as error:
        raise ImportFailed(f"{name} is not well-formed XML: {error}") from error
    except (DefusedXmlException, ValueError) as error:
        raise ImportFailed(
            f"{name} holds a DTD or entities, which are not read: {error}"
        ) from error
    simplify_tags(root)
    if root.tag == "EtherCATInfoList":
        report.noted(name, "a list of descriptions, as a master prints it: the first is read")
        inner = child(root, "EtherCATInfo")
        if inner is not None:
            root = inner
            root.tag = "EtherCATInfo"
    if root.tag == "EtherCATConfig":
        raise ImportFailed(
            f"{name} is a network configuration (ENI), not a device description (ESI)"
        )
    if root.tag != "EtherCATInfo":
        raise ImportFailed(f"{name} is not an ESI file: its root is <{root.tag[:40]}>")
    devices = children(child(child(root, "Descriptions"), "Devices"), "Device")
    if not devices:
        raise ImportFailed(f"{name} describes no device")
    return EsiFile(name, report, root, devices)


def _choice(file: EsiFile, number: int) -> EsiDevice:
    element = file.devices[number]
    kind = child(element, "Type")
    place = f"{file.name}: device {number}"
    vendor = child(file.root, "Vendor")
    name = name_of(element) or text_of(kind)
    return EsiDevice(
        number=number,
        name=tidy(name) or f"device {number}",
        vendor_id=whole_number(text_of(child(vendor, "Id")), place, file.report),
        product_code=whole_number(attribute_of(kind, "ProductCode"), place, file.report),
        revision=whole_number(attribute_of(kind, "RevisionNo"), place, file.report),
        has_control_word=_has_control_word(element),
    )


def _has_control_word(element: Element) -> bool:
    """Whether the device describes 6040h, in its dictionary or in a PDO."""
    objects = [
        item
        for dictionary in _dictionaries(element)
        for item in children(child(dictionary, "Objects"), "Object")
    ]
    entries = [entry for pdo in children(element, "RxPdo") for entry in children(pdo, "Entry")]
    return any(
        text_of(child(item, "Index")).lower().lstrip("#0x").lstrip("0") == "6040"
        or text_of(child(item, "Index")).strip() == str(0x6040)
        for item in (*entries, *objects)
    )


def _contents(file: EsiFile, element: Element) -> tuple[list[DescribedEntry], list[DescribedPdo]]:
    """Dictionary and PDOs of a device, or of its first module where the device has none."""
    owner, dictionaries = element, _dictionaries(element)
    if not dictionaries:
        modules = children(child(child(file.root, "Descriptions"), "Modules"), "Module")
        with_dictionary = [m for m in modules if _dictionaries(m)]
        if with_dictionary:
            owner = with_dictionary[0]
            dictionaries = _dictionaries(owner)
            file.report.noted(
                file.name, f"a device of modules: the objects are those of {name_of(owner)!r}"
            )
    entries: list[DescribedEntry] = []
    seen: set[str] = set()
    for dictionary in dictionaries:
        for entry in _Dictionary(file, dictionary).entries():
            if entry.key in seen:
                file.report.noted(file.name, f"{entry.key} comes twice, the first one counts")
            elif len(entries) < MAX_ENTRIES:
                seen.add(entry.key)
                entries.append(entry)
    if not dictionaries:
        file.report.noted(file.name, "there is no object dictionary: only what the PDOs name")
    pdos = []
    reader = PdoReader(file.name, file.report, entries, seen)
    for source in {id(e): e for e in (element, owner)}.values():
        for pdo in children(source, "RxPdo"):
            pdos += reader.read(pdo, "rx")
        for pdo in children(source, "TxPdo"):
            pdos += reader.read(pdo, "tx")
    return entries, pdos


def _dictionaries(element: Element) -> list[Element]:
    found = []
    for profile in children(element, "Profile"):
        dictionary = child(profile, "Dictionary")
        if dictionary is not None and child(dictionary, "Objects") is not None:
            found.append(dictionary)
    return found


class _Dictionary:
    """Objects of one ``Dictionary`` element."""

    def __init__(self, file: EsiFile, dictionary: Element) -> None:
        self._file = file
        self._report = file.report
        self._types = EsiTypes(child(dictionary, "DataTypes"), file.name, file.report)
        self._objects = children(child(dictionary, "Objects"), "Object")
        self._preop_only: list[str] = []

    def entries(self) -> list[DescribedEntry]:
        found = [entry for element in self._objects for entry in self._object(element)]
        writable = sum(entry.access != "ro" for entry in found)
        # Where nearly every object is so, the remark says nothing about any of them.
        if self._preop_only and 2 * len(self._preop_only) < writable:
            first = ", ".join(self._preop_only[:5])
            more = len(self._preop_only) - 5
            self._report.noted(
                self._file.name,
                f"may be written in PreOP or SafeOP only: {first}"
                + (f" and {more} more" if more > 0 else ""),
            )
        return found

    def _object(self, element: Element) -> list[DescribedEntry]:
        index_text = text_of(child(element, "Index"))
        place = f"{self._file.name}: object {index_text[:12]}"
        index = whole_number(index_text, place, self._report)
        if index is None or not 0x1000 <= index <= 0xFFFF:
            if index is None:
                self._report.left_out(place, "an object without a usable index")
            return []
        place = f"{self._file.name}: {index:04X}h"
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
            self._report.repaired(
                place, f"its data type {type_name[:30]!r} is not described, taken from the values"
            )
            members = [
                Member(n, tidy(name_of(item)), "", None, child(element, "Flags"))
                for n, item in enumerate(infos)
            ]
        names = {member.name for member in members if member.name}
        by_name = any(name_of(info) in names for info in infos)
        # Files that give no values for subindex 0 begin their list with subindex 1.
        skipped = not by_name and members[0].subindex == 0 and len(infos) == len(members) - 1
        return [
            self._entry(index, named, title, info, element, place)
            for position, member in enumerate(members)
            for named, info in (_info_of(infos, position - skipped, member, names),)
            # Subindex 0 only counts the others (CiA 301 clause 7.4.4).
            if member.subindex > 0 or len(members) == 1
        ]

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
            default = self._value(info, ("DefaultValue", "DefaultData", "DefaultString"), data_type,
                                  "default", place)  # fmt: skip
            low = self._number(info, ("MinValue", "MinData"), data_type, "minimum", place)
            high = self._number(info, ("MaxValue", "MaxData"), data_type, "maximum", place)
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
            enum=self._types.enumeration(member.type),
            help=tidy(text_of(child(element, "Comment")), 500),
            source=f"{self._file.name}: object {index:04X}h",
        )

    def _value(
        self,
        info: Element | None,
        tags: tuple[str, ...],
        data_type: DataType,
        what: str,
        place: str,
    ) -> Raw | None:
        if data_type != "STRING":
            return self._number(info, tags, data_type, what, place)
        return tidy(text_of(child(info, "DefaultString"))) or None

    def _number(
        self,
        info: Element | None,
        tags: tuple[str, ...],
        data_type: DataType,
        what: str,
        place: str,
    ) -> int | float | None:
        for tag in tags:
            text = text_of(child(info, tag))
            if not text:
                continue
            if tag.endswith("Data"):
                return fit(_hex_data(text, place, self._report), data_type, what, place,
                           self._report)  # fmt: skip
            number = parse_number(text, f"{place} {what}", self._report)
            return fit(number, data_type, what, place, self._report)
        return None


def _hex_data(text: str, place: str, report: ImportReport) -> int | None:
    """``xs:hexBinary`` of ETG.2000: bytes as they travel, lowest first. Some write a number."""
    bare = text.strip()
    if bare.lower().startswith(("#x", "0x")):
        number = parse_number(bare, place, report)
        return None if number is None else int(number)
    try:
        return int.from_bytes(bytes.fromhex(bare), "little") if len(bare) <= 16 else None
    except ValueError:
        report.left_out(place, f"{bare[:20]!r} is not hexadecimal data")
        return None


def _info_of(
    infos: list[Element], position: int, member: Member, names: set[str]
) -> tuple[Member, Element | None]:
    """A member with its values: by name where the names are unique, else by place.

    What stands at its place under the name of another member (``names``) is that one's.
    An element of an array has only its number for a name, and the object may name it.
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
    """Access, mapping, and whether it may be written in PreOP or SafeOP only."""
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
