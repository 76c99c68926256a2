"""Reading start-up lists of a controller: its writes in their order.

A file is recognised by its contents, not by its name. A damaged file is refused with one error. A
bad row is refused with its place, as a list that is read only in part would compare wrongly.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Iterator
from itertools import islice
from textwrap import shorten
from typing import TypeVar
from xml.etree.ElementTree import Element, ParseError

import yaml
from defusedxml.common import DefusedXmlException
from defusedxml.ElementTree import fromstring

from backend.axes.parameters.set_file import BadSet
from backend.records.handover import read_text
from backend.records.handover.listed import (
    BadRow,
    ControllerList,
    Listed,
    SeveralSlaves,
    chosen,
    line_of,
    listed,
    number,
    row_of_bytes,
)
from drivers.errors import DriveError
from drivers.objects.codec import encode, size_of
from drivers.texts.imports import failure_text
from drivers.texts.message import Text, prose, text
from profiles.importer import (
    ImportFailed,
    ImportReport,
    decode_text,
    decode_xml,
    is_dcf,
    read_dcf_values,
)
from profiles.importer.values import default_value
from profiles.schema import INTEGER_RANGE, DataType, Profile

_Row = TypeVar("_Row")
MAX_BYTES = 8_000_000
_MAX_WRITES = 20_000
#: Largest number of XML tags: twice that of an ENI with 20 000 writes of eight elements each.
_MAX_TAGS = 640_000
_CCS_DOWNLOAD = 1
_UPWARD = ("IP", "PS", "SO")
_COMMANDS = ".//CoE/InitCmds/InitCmd"
#: Errors that the parsers raise; LookupError for an unknown encoding.
_DAMAGED = (
    ParseError,
    ValueError,
    LookupError,
    yaml.YAMLError,
    csv.Error,
    RecursionError,
)
#: Parameters of lcec's drivers that select pins, PDOs and names. All others are values that the
#: driver itself writes to the slave at its start.
_SETS_PINS = re.compile(r"(?:cia|pdo|enable|fsoe)\w*|\w*(?:channels|name)", re.I)
#: Size of the entries [bytes] of PDO mapping and PDO assignment objects (ETG.1000.6 clauses 5.6.7.4
#: and 5.6.7.5): mapped objects with their lengths, or numbers of PDOs.
_PDO_LISTS = ((range(0x1600, 0x1C00), 4), (range(0x1C10, 0x1C30), 2))


def read_list(
    data: bytes, profile: Profile, name: str = "the file", slave: int | None = None
) -> ControllerList:
    """A controller's list in any of the exported formats except the Python script.

    ``slave``: number of the slave in a file with several, counted from 1.

    Raises:
        BadSet: too large, not such a format, damaged, or without any write.
    """
    if len(data) > MAX_BYTES:
        raise BadSet("handover.larger-bytes", name=name, max_bytes=MAX_BYTES)
    try:
        found = _by_contents(data, profile, name, slave)
    except DefusedXmlException as error:
        raise BadSet("handover.defines-xml-entities-no", name=name) from error
    except SeveralSlaves as several:
        known = (
            "handover.try-say-slave-counted" if several.slaves else "handover.try-give-another-file"
        )
        raise BadSet(
            "handover.drive-compared-time-2",
            remedy=text(known),
            name=name,
            elements=several.slaves,
        ) from several
    except BadRow as error:
        raise BadSet("handover.damaged", name=name, shorten=error.why) from error
    except ImportFailed as error:
        raise BadSet("handover.damaged", name=name, shorten=failure_text(error)) from error
    except _DAMAGED as e:
        raise BadSet("handover.damaged", name=name, shorten=shorten(str(e), 200)) from e
    if not found.writes:
        raise BadSet("handover.writes-nothing-start-up", name=name)
    if len(found.writes) > _MAX_WRITES:
        raise BadSet("handover.more-writes", name=name, max_writes=_MAX_WRITES)
    return found


def _by_contents(data: bytes, profile: Profile, name: str, slave: int | None) -> ControllerList:
    report = ImportReport()
    head = data[:4096].lstrip(b"\xef\xbb\xbf\xff\xfe\0 \t\r\n")
    if head.startswith(b"<"):
        if data.count(b"<") > _MAX_TAGS:
            raise BadSet("handover.more-tags", name=name, max_tags=_MAX_TAGS)
        return _xml(decode_xml(data, name, report), profile, name, slave)
    if is_dcf(data):
        return _dcf(data, profile, name)
    if concise := read_text.concise_dcf(data, _MAX_WRITES + 1):
        return ControllerList("dcf", concise)
    words = decode_text(data, name, report)
    if table := read_text.table_of(words):
        form, separator = table
        rows = read_text.codesys if form == "codesys" else read_text.csv_table
        return ControllerList(form, tuple(_first(rows(words, separator))))
    if read_text.is_script(words):
        return ControllerList("igh", tuple(_of_slave(_first(read_text.igh(words, profile)), slave)))
    if re.search(r"^[^\S\n]*(sdo|vendor_id|nodes)[^\S\n]*:", words, re.M):
        return ControllerList("ros2", tuple(read_text.ros2(words, profile, slave)))
    raise BadSet("handover.no-start-up-list", name=name)


def _first(rows: Iterator[_Row]) -> Iterator[_Row]:
    """The rows up to the first one beyond the limit; the rest is not read, to save time."""
    return islice(rows, _MAX_WRITES + 1)


def _of_slave(downloads: Iterable[read_text.Download], slave: int | None) -> list[Listed]:
    """The writes to one slave of a script, in their order; a script may write to several slaves."""
    found: dict[tuple[str, str, str], list[Listed]] = {}
    for each in downloads:
        found.setdefault(each.slave, []).append(each.write)
    return chosen(list(found.values()), slave)


def _xml(content: str, profile: Profile, name: str, slave: int | None) -> ControllerList:
    root = fromstring(content, forbid_dtd=True)
    for element in root.iter():
        # Some programs write a namespace, others do not.
        element.tag = str(element.tag).rpartition("}")[2]
    if root.tag == "masters":
        return ControllerList("lcec", tuple(_lcec(root, profile, name, slave)))
    if root.tag in ("EtherCATMailbox", "EtherCATConfig", "TreeItem"):
        form = "eni" if root.tag == "EtherCATConfig" else "twincat"
        return ControllerList(form, tuple(_init_commands(root, profile, slave)))
    raise BadSet("handover.xml-another-kind-root", name=name, tag=str(root.tag)[:60])


def _slave_of_eni(root: Element, slave: int | None) -> Element:
    """The chosen slave; without a choice, slaves without a mailbox (couplers) do not count."""
    slaves = root.findall("./Config/Slave")
    if slave is None:
        slaves = [each for each in slaves if each.find("Mailbox") is not None] or slaves
    return chosen(slaves, slave)


def _init_commands(root: Element, profile: Profile, slave: int | None) -> Iterator[Listed]:
    within = root
    if root.tag == "EtherCATConfig":
        within = _slave_of_eni(root, slave)
    for position, command in enumerate(within.iterfind(_COMMANDS), 1):
        place = prose(f"InitCmd {position}")
        if command.get("Disabled", "0").lower() in ("1", "true"):
            continue
        ccs = command.findtext("Ccs")
        data = row_of_bytes(command.findtext("Data"), place)
        # CiA 301: 1 is a download, 2 an upload; programs with the opposite coding still write data.
        if ccs is not None and number(ccs, place) != _CCS_DOWNLOAD and not data:
            continue
        transitions = [
            (each.text or "").strip(" <>\r\n\t") for each in command.findall("Transition")
        ]
        upward = [each for each in transitions if each in _UPWARD] or transitions
        index = number(command.findtext("Index"), place)
        subindex = number(command.findtext("SubIndex"), place)
        when = upward[0] if upward else ""
        if command.get("CompleteAccess", "0").lower() in ("1", "true"):
            yield from _parts(profile, index, subindex, data, when, place)
        else:
            yield listed(index, subindex, data, when, place)


def _parts(
    profile: Profile, index: int, first: int, data: bytes, transition: str, place: Text
) -> Iterator[Listed]:
    """Single writes of a complete access (ETG.1000.6 clause 5.6.2).

    It begins at subindex 0 or 1; subindex 0 is padded to 16 bits, the others have the length of
    their types, without gaps.
    """
    sizes = _sizes(profile, index)
    if first not in (0, 1) or not sizes:
        raise BadRow(
            text(
                "handover.row-no-complete-access",
                place=place,
                title=profile.title,
                key=f"{index:04X}h:{first}"[:40],
            )
        )
    at = 2 if first == 0 else 0
    if first == 0 and len(data) == at and any(index in each for each, _ in _PDO_LISTS):
        yield listed(index, 0, data[:1], transition, place)  # an empty list of PDOs or objects
    for subindex, size in enumerate(sizes, 1):
        if at >= len(data):
            break
        if size is None:
            raise BadRow(
                text("handover.row-place-unknown", place=place, index=index, subindex=subindex)
            )
        part = data[at : at + size]
        at += size
        if len(part) == size:
            yield listed(index, subindex, part, transition, place)
    if at != len(data):
        raise BadRow(text("handover.row-bytes-left", place=place, bytes=len(data), index=index))


def _sizes(profile: Profile, index: int) -> list[int | None]:
    """Sizes of the entries from subindex 1 on [bytes]; None where a size is not known."""
    for indexes, size in _PDO_LISTS:
        if index in indexes:
            return [size] * 254
    entries = {p.subindex: p for p in profile.parameters if p.index == index and p.subindex}
    return [
        size_of(entries[n].type) if n in entries else None
        for n in range(1, max(entries, default=0) + 1)
    ]


def _lcec(root: Element, profile: Profile, name: str, slave: int | None) -> Iterator[Listed]:
    within = chosen(root.findall("./master/slave"), slave)
    elsewhere = within.find("initCmds")
    if elsewhere is not None:
        # A comparison with only a part of the writes would report the rest as unchanged.
        file = (elsewhere.get("filename") or "").strip()[:80]
        raise BadSet("handover.list-in-another-file", name=name, file=file)
    written = [
        parameter
        for each in within.findall("modParam")
        if not _SETS_PINS.fullmatch(parameter := (each.get("name") or "").strip()[:40])
    ]
    if written:
        raise BadSet(
            "handover.list-in-driver",
            name=name,
            driver=(within.get("type") or "").strip()[:40],
            parameters=", ".join(written[:10]),
        )
    for position, config in enumerate(within.findall("sdoConfig"), 1):
        place = prose(f"sdoConfig {position}")
        index = number(config.get("idx"), place, base=16)
        data = b"".join(
            row_of_bytes(each.get("data"), place) for each in config.findall("sdoDataRaw")
        )
        if (config.get("subIdx") or "").lower() == "complete":
            yield from _parts(profile, index, 0, data, "PS", place)
            continue
        subindex = number(config.get("subIdx"), place, base=16)
        yield listed(index, subindex, data, "PS", place)


def _dcf(data: bytes, profile: Profile, name: str) -> ControllerList:
    """Values of a DCF, whose order is that of the objects and not that of writing."""
    report = ImportReport()
    writes = []
    for value in read_dcf_values(data, name, report):
        place = line_of(value.line)
        parameter = profile.by_key.get(f"{value.index:04X}:{value.subindex:02X}")
        kind: DataType = parameter.type if parameter else value.type or "UINT32"
        if kind not in INTEGER_RANGE and kind != "REAL32":
            continue
        raw, _ = default_value(value.text, kind, f"{name}:{value.line}", report, "ParameterValue")
        if raw is None:
            raise BadRow(
                text("handover.row-no-value", place=place, word=value.text[:40], type=kind)
            )
        try:
            writes.append(listed(value.index, value.subindex, encode(kind, raw), "", place))
        except DriveError as error:
            why = text("handover.row-refused", place=place, cause=error.text)
            raise BadRow(why) from error
    return ControllerList("dcf", tuple(writes), ordered=False)
