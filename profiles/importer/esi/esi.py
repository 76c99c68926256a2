"""EtherCAT slave information (ESI) files.

Source: ETG.2000 v1.0.10. Parsed without DTDs and entities and with a size limit, since these files
come from untrusted sources.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, ParseError
from xml.parsers.expat import ErrorString

from defusedxml.common import DefusedXmlException
from defusedxml.ElementTree import fromstring

from profiles.bring_up import BringUp
from profiles.importer.description import (
    MAX_ENTRIES,
    DescribedEntry,
    DescribedPdo,
    Description,
)
from profiles.importer.esi.bring_up import read_bring_up
from profiles.importer.esi.modules import dictionaries_of, module_list, overwritten, parts_of
from profiles.importer.esi.objects import DictionaryReader
from profiles.importer.esi.pdo import PdoReader
from profiles.importer.esi.xml_repair import mended
from profiles.importer.esi.xml_tree import (
    attribute_of,
    child,
    children,
    flag_of,
    name_of,
    simplify_tags,
    text_of,
)
from profiles.importer.report import ImportFailed, ImportReport
from profiles.importer.texts import check_size, decode_xml
from profiles.importer.values import tidy, whole_number

MAX_BYTES = 32 * 2**20
_LARGEST_IDENTITY = 2**32 - 1
_PDO_TAGS: tuple[tuple[str, Literal["rx", "tx"]], ...] = (("RxPdo", "rx"), ("TxPdo", "tx"))
_ROOTS = {name.lower(): name for name in ("EtherCATInfo", "EtherCATInfoList", "EtherCATConfig")}


@dataclass(frozen=True, slots=True)
class EsiDevice:
    """One device of an ESI file for selection: a file often describes a whole series."""

    number: int
    name: str
    vendor_id: int | None
    product_code: int | None
    revision: int | None
    has_control_word: bool = False
    """Whether it describes 6040h: a bootloader in the same file does not."""


@dataclass(slots=True)
class EsiFile:
    """A parsed ESI file."""

    name: str
    report: ImportReport
    root: Element
    devices: list[Element]


def esi_devices(file: EsiFile) -> tuple[EsiDevice, ...]:
    """Return the devices of a file, in its order."""
    quiet = replace(file, report=ImportReport())
    return tuple(_choice(quiet, n) for n in range(len(file.devices)))


def read_device(file: EsiFile, device: int = 0) -> Description:
    """Read one device of an ESI file.

    Raises:
        ImportFailed: no such device, or it has no objects.
    """
    name = file.name
    if not 0 <= device < len(file.devices):
        raise ImportFailed(
            "description.no-device-number", file=name, devices=len(file.devices), number=device
        )
    element = file.devices[device]
    choice = _choice(file, device)
    entries, pdos = _contents(file, element)
    if not entries:
        raise ImportFailed("description.no-esi-objects", file=name, device=choice.name)
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
        bring_up=_bring_up(file, element),
    )


def _bring_up(file: EsiFile, element: Element) -> BringUp:
    """Return the device's prescriptions, with the list of its modules if that is to be written."""
    rules = read_bring_up(element, file.name, file.report)
    modules = module_list(file.root, element)
    if modules is None:
        return rules
    return rules.model_copy(update={"init_commands": (modules, *rules.init_commands)})


def _parsed(text: str) -> Element:
    """Return the root of a document without DTD.

    The reader of defusedxml refuses a DTD at the cost of Python's slow parser. Without this string
    there is no DTD, and so no entity either: the fast parser then gives the same result.
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
    text = decode_xml(data, name, report)
    try:
        try:
            root = _parsed(text)
        except ParseError:
            root = _parsed(mended(text))
            report.repaired(name, "description.xml-repaired")
    except ParseError as error:
        line, column = error.position
        raise ImportFailed(
            "description.no-xml",
            file=name,
            line=line,
            column=column,
            detail=ErrorString(error.code),
        ) from error
    except (DefusedXmlException, ValueError) as error:
        raise ImportFailed("description.dtd", file=name, detail=str(error)) from error
    simplify_tags(root)
    root.tag = _ROOTS.get(root.tag.lower(), root.tag)
    if root.tag == "EtherCATInfoList":
        report.noted(name, "description.list-of-descriptions")
        inner = child(root, "EtherCATInfo")
        if inner is not None:
            root = inner
            root.tag = "EtherCATInfo"
    if root.tag == "EtherCATConfig":
        raise ImportFailed("description.network-configuration", file=name)
    if root.tag == "ISO15745ProfileContainer":
        raise ImportFailed("description.xdd", file=name)
    if root.tag in ("EtherCATDict", "EtherCATModule"):
        raise ImportFailed("description.part-of-esi", file=name, root=root.tag)
    if root.tag != "EtherCATInfo":
        raise ImportFailed("description.no-esi", file=name, root=root.tag[:40])
    devices = children(child(child(root, "Descriptions"), "Devices"), "Device")
    if not devices:
        raise ImportFailed("description.no-devices", file=name)
    return EsiFile(name, report, root, devices)


def _choice(file: EsiFile, number: int) -> EsiDevice:
    element = file.devices[number]
    kind = child(element, "Type")
    place = f"{file.name}: Device {number}"
    vendor = child(file.root, "Vendor")
    name = name_of(element) or text_of(kind)
    return EsiDevice(
        number=number,
        name=tidy(name) or f"device {number}",
        vendor_id=_identity(text_of(child(vendor, "Id")), "Id", place, file.report),
        product_code=_identity(
            attribute_of(kind, "ProductCode"), "ProductCode", place, file.report
        ),
        revision=_identity(attribute_of(kind, "RevisionNo"), "RevisionNo", place, file.report),
        has_control_word=_has_control_word(file, element),
    )


def _identity(text: str, name: str, place: str, report: ImportReport) -> int | None:
    """Return a number of the identity, which has 32 bits (1018h)."""
    number = whole_number(text, place, report)
    if number is not None and number > _LARGEST_IDENTITY:
        report.left_out(place, "description.does-not-fit", name=name, value=number, type="UINT32")
        return None
    return number


def _has_control_word(file: EsiFile, element: Element) -> bool:
    """Return whether the device or a module of it describes 6040h, in its dictionary or a PDO."""
    return any(
        text_of(child(item, "Index")).lower().lstrip("#0x").lstrip("0") == "6040"
        or text_of(child(item, "Index")).strip() == str(0x6040)
        for part in parts_of(file.root, element)
        for item in (
            *(entry for pdo in children(part.element, "RxPdo") for entry in children(pdo, "Entry")),
            *(
                each
                for dictionary in dictionaries_of(part.element)
                for each in children(child(dictionary, "Objects"), "Object")
            ),
        )
    )


def _contents(file: EsiFile, element: Element) -> tuple[list[DescribedEntry], list[DescribedPdo]]:
    """Read dictionary and PDOs of a device and of its default modules."""
    parts = parts_of(file.root, element)
    for part in parts[1:]:
        file.report.noted(file.name, "description.module", module=tidy(name_of(part.element)))
    entries: list[DescribedEntry] = []
    seen: set[str] = set()
    described = False
    for part in parts:
        for dictionary in dictionaries_of(part.element):
            described = True
            reader = DictionaryReader(file.name, file.report, dictionary, part.index_shift)
            for entry in reader.entries():
                if entry.key in seen:
                    file.report.noted(file.name, "description.object-twice", key=entry.key)
                elif len(entries) < MAX_ENTRIES:
                    seen.add(entry.key)
                    entries.append(entry)
    if not described:
        elsewhere = [
            text_of(child(profile, "DictionaryFile")) for profile in children(element, "Profile")
        ]
        named = tidy(", ".join(filter(None, elsewhere)), 80)
        if named:
            file.report.noted(file.name, "description.objects-elsewhere", files=named)
        else:
            file.report.noted(file.name, "description.no-dictionary")
    pdos = []
    for part in parts:
        pdo_reader = PdoReader(file.name, file.report, entries, seen, part)
        others = parts[1:] if part is parts[0] else []
        for tag, direction in _PDO_TAGS:
            for pdo in children(part.element, tag):
                if not overwritten(pdo, part, others):
                    pdos += pdo_reader.read(pdo, direction)
    return entries, pdos
