"""EtherCAT slave information (ESI) files.

Source: ETG.2000 v1.0.10. Parsed without DTDs and entities and with a size limit, since these
files come from anywhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal
from xml.etree.ElementTree import Element, ParseError

from defusedxml.common import DefusedXmlException
from defusedxml.ElementTree import fromstring

from profiles.importer.description import (
    MAX_ENTRIES,
    DescribedEntry,
    DescribedPdo,
    Description,
)
from profiles.importer.esi_types import EsiTypes, Member
from profiles.importer.report import ImportFailed, ImportReport
from profiles.importer.texts import check_size, decode_xml
from profiles.importer.values import (
    fit,
    named_type,
    parse_access,
    parse_number,
    tidy,
    unit_of_code,
    unit_of_name,
)
from profiles.importer.xml_tree import child, children, strip_namespaces, text_of
from profiles.schema import Access, DataType, PdoMapping, Raw

MAX_BYTES = 32 * 2**20
_ENGLISH = "1033"


@dataclass(frozen=True, slots=True)
class EsiDevice:
    """One device of an ESI file, to choose from: a file often holds a whole series."""

    number: int
    name: str
    vendor_id: int | None
    product_code: int | None
    revision: int | None


@dataclass(slots=True)
class _File:
    name: str
    report: ImportReport
    root: Element
    devices: list[Element]


def esi_devices(data: bytes, name: str, report: ImportReport) -> tuple[EsiDevice, ...]:
    """The devices of a file. Raises ImportFailed where it is no ESI file."""
    file = _open(data, name, report)
    return tuple(_choice(file, n) for n in range(len(file.devices)))


def read_esi(data: bytes, name: str, report: ImportReport, device: int = 0) -> Description:
    """Read one device of an ESI file.

    Raises:
        ImportFailed: not XML, not ESI, forbidden constructs, no such device, or nothing in it.
    """
    file = _open(data, name, report)
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
        maker=_name(vendor) or "unknown maker",
        model=choice.name,
        vendor_id=choice.vendor_id,
        product_code=choice.product_code,
        revision=choice.revision,
        entries=tuple(entries),
        pdos=tuple(pdos),
        complete_access=_flag(mailbox, "CompleteAccess"),
        foe=child(child(element, "Mailbox"), "FoE") is not None,
    )


def _open(data: bytes, name: str, report: ImportReport) -> _File:
    check_size(data, MAX_BYTES, name)
    try:
        root: Element = fromstring(decode_xml(data, name, report), forbid_dtd=True)
    except ParseError as error:
        raise ImportFailed(f"{name} is not well-formed XML: {error}") from error
    except (DefusedXmlException, ValueError) as error:
        raise ImportFailed(
            f"{name} holds a DTD or entities, which are not read: {error}"
        ) from error
    strip_namespaces(root)
    if root.tag == "EtherCATInfoList":
        report.noted(name, "a list of descriptions, as a master prints it: the first is read")
        root = next(iter(children(root, "EtherCATInfo")), root)
    if root.tag == "EtherCATConfig":
        raise ImportFailed(
            f"{name} is a network configuration (ENI), not a device description (ESI)"
        )
    if root.tag != "EtherCATInfo":
        raise ImportFailed(f"{name} is not an ESI file: its root is <{root.tag[:40]}>")
    devices = children(child(child(root, "Descriptions"), "Devices"), "Device")
    if not devices:
        raise ImportFailed(f"{name} describes no device")
    return _File(name, report, root, devices)


def _choice(file: _File, number: int) -> EsiDevice:
    element = file.devices[number]
    kind = child(element, "Type")
    place = f"{file.name}: device {number}"
    vendor = child(file.root, "Vendor")
    name = _name(element) or text_of(kind)
    return EsiDevice(
        number=number,
        name=tidy(name) or f"device {number}",
        vendor_id=_whole(text_of(child(vendor, "Id")), place, file.report),
        product_code=_whole(_attribute(kind, "ProductCode"), place, file.report),
        revision=_whole(_attribute(kind, "RevisionNo"), place, file.report),
    )


def _contents(file: _File, element: Element) -> tuple[list[DescribedEntry], list[DescribedPdo]]:
    """Dictionary and PDOs of a device, or of its first module where the device has none."""
    owner, dictionaries = element, _dictionaries(element)
    if not dictionaries:
        modules = children(child(child(file.root, "Descriptions"), "Modules"), "Module")
        with_dictionary = [m for m in modules if _dictionaries(m)]
        if with_dictionary:
            owner = with_dictionary[0]
            dictionaries = _dictionaries(owner)
            file.report.noted(
                file.name, f"a device of modules: the objects are those of {_name(owner)!r}"
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
    for source in {id(e): e for e in (element, owner)}.values():
        for tag, direction in (("RxPdo", "rx"), ("TxPdo", "tx")):
            for pdo in children(source, tag):
                pdos += _pdo(file, pdo, "rx" if direction == "rx" else "tx", entries, seen)
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

    def __init__(self, file: _File, dictionary: Element) -> None:
        self._file = file
        self._report = file.report
        self._types = EsiTypes(child(dictionary, "DataTypes"), file.name, file.report)
        self._objects = children(child(dictionary, "Objects"), "Object")

    def entries(self) -> list[DescribedEntry]:
        return [entry for element in self._objects for entry in self._object(element)]

    def _object(self, element: Element) -> list[DescribedEntry]:
        index_text = text_of(child(element, "Index"))
        place = f"{self._file.name}: object {index_text[:12]}"
        index = _whole(index_text, place, self._report)
        if index is None or not 0x1000 <= index <= 0xFFFF:
            if index is None:
                self._report.left_out(place, "an object without a usable index")
            return []
        place = f"{self._file.name}: {index:04X}h"
        title = tidy(_name(element)) or f"Object {index:04X}h"
        type_name = text_of(child(element, "Type"))
        members = self._types.members(type_name)
        info = child(element, "Info")
        infos = children(info, "SubItem")
        if not members and not infos:
            bits = _whole(text_of(child(element, "BitSize")), place, self._report)
            member = Member(0, title, type_name, bits, child(element, "Flags"))
            return [self._entry(index, member, "", info, element, place)]
        if not members:
            self._report.repaired(
                place, f"its data type {type_name[:30]!r} is not described, taken from the values"
            )
            members = [
                Member(n, tidy(_name(item)), "", None, child(element, "Flags"))
                for n, item in enumerate(infos)
            ]
        return [
            self._entry(index, member, title, _info_of(infos, position, member), element, place)
            for position, member in enumerate(members)
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
        access, pdo = _rights(flags, child(element, "Flags"), place, self._report)
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


def _info_of(infos: list[Element], position: int, member: Member) -> Element | None:
    """Values of a member: by name where the names are unique, else by place."""
    named = [i for i in infos if member.name and _name(i) == member.name]
    if len(named) == 1:
        return child(named[0], "Info")
    return child(infos[position], "Info") if position < len(infos) else None


def _rights(
    flags: Element | None, fallback: Element | None, place: str, report: ImportReport
) -> tuple[Access, PdoMapping]:
    access_element = child(flags, "Access")
    if access_element is None:
        access_element = child(fallback, "Access")
    access: Access = "ro"
    if access_element is not None:
        writes = _attribute(access_element, "WriteRestrictions")
        access = parse_access(text_of(access_element) or "ro", place, report)
        if writes.lower() in ("preop", "preop_safeop"):
            report.noted(place, f"may be written in {writes} only")
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
    if pdo in ("rx", "rxtx") and access == "ro":
        report.repaired(place, "it can be in the drive's inputs but is marked read-only")
        access = "rw"
    return access, pdo


def _pdo(
    file: _File,
    pdo: Element,
    direction: Literal["rx", "tx"],
    entries: list[DescribedEntry],
    seen: set[str],
) -> list[DescribedPdo]:
    place = f"{file.name}: {pdo.tag}"
    index = _whole(text_of(child(pdo, "Index")), place, file.report)
    if index is None:
        file.report.left_out(place, "a PDO without an index")
        return []
    keys: list[str] = []
    for item in children(pdo, "Entry"):
        where = f"{place} {index:04X}h"
        object_index = _whole(text_of(child(item, "Index")), where, file.report)
        if not object_index:
            continue  # index 0 only fills space (ETG.2000 clause 6.10)
        subindex = _whole(text_of(child(item, "SubIndex")), where, file.report) or 0
        if not 0x1000 <= object_index <= 0xFFFF or not 0 <= subindex <= 255:
            file.report.left_out(where, f"entry {object_index:#x}:{subindex}")
            continue
        key = f"{object_index:04X}:{subindex:02X}"
        if key not in seen and len(entries) < MAX_ENTRIES:
            bits = _whole(text_of(child(item, "BitLen")), where, file.report)
            kind = named_type(text_of(child(item, "DataType")), bits) or named_type("", bits)
            if kind is None:
                file.report.left_out(where, f"{key} has no known type")
                continue
            name = tidy(_name(item)) or f"Object {key}"
            access: Access = "rw" if direction == "rx" else "ro"
            entries.append(
                DescribedEntry(object_index, subindex, name, kind, access, direction, source=where)
            )
            seen.add(key)
        keys.append(key)
    fixed = _attribute(pdo, "Fixed").strip().lower() in ("1", "true")
    return [DescribedPdo(index, direction, tuple(keys), fixed, file.name)] if keys else []


def _unit(info: Element | None, element: Element) -> str:
    for owner in (info, element, child(element, "Info")):
        text = text_of(child(owner, "Unit"))
        if text:
            return unit_of_code(text) or tidy(text, 20)
    return ""


def _name(element: Element | None) -> str:
    """The English name where there are several, else the first."""
    names = children(element, "Name")
    for name in names:
        if (name.get("LcId") or _ENGLISH).strip() in (_ENGLISH, "9"):
            return text_of(name)
    return text_of(names[0]) if names else ""


def _attribute(element: Element | None, name: str) -> str:
    if element is None:
        return ""
    lowered = {key.lower(): value for key, value in element.attrib.items()}
    return lowered.get(name.lower(), "")


def _flag(element: Element | None, name: str) -> bool:
    return _attribute(element, name).strip().lower() in ("1", "true")


def _whole(text: str, place: str, report: ImportReport) -> int | None:
    number = parse_number(text, place, report)
    return None if number is None or number != int(number) or number < 0 else int(number)
