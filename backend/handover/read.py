"""Start-up lists of a controller, read back: what it will write, in its order.

A file is taken by its contents, not by its name. What is broken as a whole is refused with one
error; a bad row is refused with its place, for a list that is read in part compares wrongly.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator
from dataclasses import dataclass
from textwrap import shorten
from typing import Any
from xml.etree.ElementTree import Element, ParseError

import yaml
from defusedxml.common import DefusedXmlException
from defusedxml.ElementTree import fromstring

from backend.parameters.set_file import BadSet
from drivers.codec import encode, size_of
from drivers.errors import DriveError
from drivers.texts.message import text
from profiles.importer import ImportFailed, ImportReport, is_dcf, read_dcf_values
from profiles.importer.values import default_value
from profiles.schema import INTEGER_RANGE, DataType, Parameter, Profile

MAX_BYTES = 8_000_000
_MAX_WRITES = 20_000
_CCS_DOWNLOAD = 1
_UPWARD = ("IP", "PS", "SO")
#: What the parsers raise; LookupError is an encoding that nobody knows.
_DAMAGED = (
    ParseError, ImportFailed, ValueError, LookupError, yaml.YAMLError, csv.Error, RecursionError,
)  # fmt: skip
_DOWNLOAD = re.compile(r"^\s*ethercat\s+.*\bdownload\b(?P<rest>.*)$")
_SIZE = {"bool": 1, "int8": 1, "uint8": 1, "sm8": 1, "int16": 2, "uint16": 2, "sm16": 2,
         "int32": 4, "uint32": 4, "sm32": 4, "float": 4, "int64": 8, "uint64": 8,
         "sm64": 8, "double": 8}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Listed:
    """One write of a controller's list. ``transition`` is empty where the format states none."""

    index: int
    subindex: int
    data: bytes
    transition: str
    place: str

    @property
    def key(self) -> str:
        """As a profile's key, 6081:00."""
        return f"{self.index:04X}:{self.subindex:02X}"


@dataclass(frozen=True, slots=True)
class ControllerList:
    """A list: its format and writes in their order; ``ordered`` tells whether order counts."""

    format: str
    writes: tuple[Listed, ...]
    ordered: bool = True


class _Bad(ValueError):
    """A row that cannot be read; the message has its place."""


def read_list(
    data: bytes, profile: Profile, name: str = "the file", slave: int | None = None
) -> ControllerList:
    """A controller's list in any of the formats that are exported, but the Python script.

    ``slave`` counts from 1 in the order of the file, where that has several.

    Raises:
        BadSet: too large, of no such format, damaged, or without a single write.
    """
    if len(data) > MAX_BYTES:
        raise BadSet("handover.larger-bytes", name=name, max_bytes=MAX_BYTES)
    try:
        found = _by_contents(data, profile, name, slave)
    except DefusedXmlException as error:
        raise BadSet("handover.defines-xml-entities-no", name=name) from error
    except _DAMAGED as e:
        raise BadSet("handover.damaged", name=name, shorten=shorten(str(e), 200)) from e
    if not found.writes:
        raise BadSet("handover.writes-nothing-start-up", name=name)
    if len(found.writes) > _MAX_WRITES:
        raise BadSet("handover.more-writes", name=name, max_writes=_MAX_WRITES)
    return found


def _by_contents(data: bytes, profile: Profile, name: str, slave: int | None) -> ControllerList:
    head = data[:4096].lstrip(b"\xef\xbb\xbf \t\r\n")
    if head.startswith((b"<", b"\xff\xfe", b"\xfe\xff")):
        return _xml(data, profile, name, slave)
    if is_dcf(data):
        return _dcf(data, profile, name)
    text = data.decode("utf-8-sig")
    if head.startswith(b"Line;"):
        return ControllerList("codesys", tuple(_codesys(text)))
    if head.startswith(b"key,"):
        return ControllerList("csv", tuple(_csv(text)))
    if any(_DOWNLOAD.match(line) for line in text.splitlines()):
        return ControllerList("igh", tuple(_igh(text)))
    if re.search(r"^\s*(sdo|vendor_id|nodes)\s*:", text, re.M):
        return ControllerList("ros2", tuple(_ros2(text, profile, slave)))
    raise BadSet("handover.no-start-up-list", name=name)


def _number(text: str | None, place: str, *, base: int = 0) -> int:
    """A number; with base 0 also #x, 16# and 0x."""
    word = (text or "").strip()
    for prefix in ("#x", "16#", "0x", "0X"):
        if word.lower().startswith(prefix):
            word, base = word[len(prefix) :], 16
    try:
        # A decimal with leading zeros is none of Python's, but of everybody else's.
        return int(word, base or 10)
    except ValueError as error:
        raise _Bad(f"{place}: {word[:40]!r} is no number") from error


def _listed(index: int, subindex: int, data: bytes, transition: str, place: str) -> Listed:
    if not 0 <= index <= 0xFFFF or not 0 <= subindex <= 0xFF:
        raise _Bad(f"{place}: {index:X}h:{subindex} is no object")
    if not data:
        raise _Bad(f"{place}: {index:04X}h:{subindex} has no data")
    return Listed(index, subindex, data, transition, place)


def _hex(text: str | None, place: str) -> bytes:
    try:
        return bytes.fromhex((text or "").strip())
    except ValueError as error:
        raise _Bad(f"{place}: {(text or '')[:40]!r} is no row of bytes") from error


def _sized(value: int, size: int, place: str) -> bytes:
    if not -(1 << (8 * size - 1)) <= value < 1 << (8 * size):
        raise _Bad(f"{place}: {value} does not fit {size} bytes")
    return (value % (1 << (8 * size))).to_bytes(size, "little")


def _xml(data: bytes, profile: Profile, name: str, slave: int | None) -> ControllerList:
    root = fromstring(data, forbid_dtd=True)
    if root.tag == "masters":
        return ControllerList("lcec", tuple(_lcec(root, profile, name, slave)))
    if root.tag in ("EtherCATMailbox", "EtherCATConfig", "TreeItem"):
        form = "eni" if root.tag == "EtherCATConfig" else "twincat"
        return ControllerList(form, tuple(_init_commands(root, profile, name, slave)))
    raise BadSet("handover.xml-another-kind-root", name=name, tag=str(root.tag)[:60])


def _chosen(elements: list[Element], what: str, name: str, slave: int | None) -> Element:
    """The one, or the one that was asked for."""
    if slave is None and len(elements) == 1:
        return elements[0]
    if slave is not None and 1 <= slave <= len(elements):
        return elements[slave - 1]
    raise BadSet(
        "handover.drive-compared-time-2",
        remedy=(
            text("handover.try-say-slave-counted")
            if elements
            else text("handover.try-give-another-file")
        ),
        name=name,
        elements=len(elements),
        what=what,
    )


def _init_commands(
    root: Element, profile: Profile, name: str, slave: int | None
) -> Iterator[Listed]:
    within = root
    if root.tag == "EtherCATConfig":
        within = _chosen(root.findall("./Config/Slave"), "slaves", name, slave)
    for number, command in enumerate(within.iterfind(".//CoE/InitCmds/InitCmd"), 1):
        place = f"InitCmd {number}"
        if command.get("Disabled", "0").lower() in ("1", "true"):
            continue
        ccs = command.findtext("Ccs")
        data = _hex(command.findtext("Data"), place)
        # CiA 301: 1 is a download, 2 an upload; tools that count the other way give data with it.
        if ccs is not None and _number(ccs, place) != _CCS_DOWNLOAD and not data:
            continue
        transitions = [(each.text or "").strip() for each in command.findall("Transition")]
        upward = [each for each in transitions if each in _UPWARD] or transitions
        index = _number(command.findtext("Index"), place)
        subindex = _number(command.findtext("SubIndex"), place)
        when = upward[0] if upward else ""
        if command.get("CompleteAccess", "0").lower() in ("1", "true"):
            yield from _parts(profile, index, subindex, data, when, place)
        else:
            yield _listed(index, subindex, data, when, place)


def _parts(
    profile: Profile, index: int, first: int, data: bytes, transition: str, place: str
) -> Iterator[Listed]:
    """Subindexes of a complete access (ETG.1000.6 clause 5.6.2): from 0 or 1 on, subindex 0 filled
    up to 16 bits, the others as long as their types and without a gap."""
    entries = sorted(
        (p for p in profile.parameters if p.index == index and p.subindex), key=_by_subindex
    )
    if first not in (0, 1) or not entries:
        raise _Bad(f"{place}: {profile.title} knows no complete access to {index:04X}h:{first}")
    at = 2 if first == 0 else 0
    for wanted, entry in enumerate(entries, 1):
        size = size_of(entry.type)
        if entry.subindex != wanted or size is None:
            raise _Bad(f"{place}: where {index:04X}h:{wanted} lies in the data is not known")
        part = data[at : at + size]
        at += size
        if len(part) == size:
            yield _listed(index, wanted, part, transition, place)
        if at >= len(data):
            break
    if at != len(data):
        raise _Bad(f"{place}: {len(data)} bytes do not fit the entries of {index:04X}h")


def _by_subindex(parameter: Parameter) -> int:
    return parameter.subindex or 0


def _lcec(root: Element, profile: Profile, name: str, slave: int | None) -> Iterator[Listed]:
    within = _chosen(root.findall("./master/slave"), "slaves", name, slave)
    for number, config in enumerate(within.findall("sdoConfig"), 1):
        place = f"sdoConfig {number}"
        index = _number(config.get("idx"), place, base=16)
        data = b"".join(_hex(each.get("data"), place) for each in config.findall("sdoDataRaw"))
        if config.get("subIdx") == "complete":
            yield from _parts(profile, index, 0, data, "PS", place)
            continue
        subindex = _number(config.get("subIdx"), place, base=16)
        yield _listed(index, subindex, data, "PS", place)


def _codesys(text: str) -> Iterator[Listed]:
    for number, row in enumerate(csv.DictReader(io.StringIO(text), delimiter=";"), 2):
        place = f"line {number}"
        index, _, subindex = (row.get("Index:Subindex") or "").partition(":")
        bits = _number(row.get("Bit length"), place)
        if bits % 8 or not 8 <= bits <= 64:
            raise _Bad(f"{place}: a bit length of {bits} is no whole number of bytes")
        value = _sized(_number(row.get("Value"), place), bits // 8, place)
        yield _listed(_number(index, place), _number(subindex, place), value, "PS", place)


def _csv(text: str) -> Iterator[Listed]:
    for number, row in enumerate(csv.DictReader(io.StringIO(text)), 2):
        place = f"line {number}"
        yield _listed(
            _number(row.get("index"), place), _number(row.get("subindex"), place),
            _hex(row.get("data"), place), row.get("transition") or "", place,
        )  # fmt: skip


def _igh(text: str) -> Iterator[Listed]:
    for number, line in enumerate(text.splitlines(), 1):
        match = _DOWNLOAD.match(line)
        if match is None:
            continue
        place = f"line {number}"
        kind, plain = _download_words(match["rest"].split())
        if len(plain) != 3 or kind not in _SIZE or kind in ("float", "double"):
            raise _Bad(f"{place}: a download of type, index, subindex and whole number is read")
        data = _sized(_number(plain[2], place), _SIZE[kind], place)
        yield _listed(_number(plain[0], place), _number(plain[1], place), data, "PS", place)


def _download_words(words: list[str]) -> tuple[str, list[str]]:
    """Type and the words that are no option."""
    kind, plain, rest = "", [], iter(words)
    for word in rest:
        if word in ("-t", "--type"):
            kind = next(rest, "")
        elif word.startswith("--type="):
            kind = word.removeprefix("--type=")
        elif word in ("-p", "-a", "-m", "--position", "--alias", "--master"):
            next(rest, "")
        elif word != "--":
            plain.append(word)
    return kind, plain


def _ros2(text: str, profile: Profile, slave: int | None) -> Iterator[Listed]:
    # Aliases make a small file as large as a bomb, and no slave file has them.
    for event in yaml.parse(text, yaml.SafeLoader):
        if isinstance(event, yaml.AliasEvent):
            raise _Bad("YAML aliases are not read")
    content = yaml.safe_load(text)
    rows = content.get("sdo") if isinstance(content, dict) else None
    if rows is None and isinstance(content, dict):
        nodes = _bus_nodes(content)
        chosen = (slave or 1) - 1
        known = chosen < len(nodes) and (slave is not None or len(nodes) == 1)
        rows = nodes[chosen] if known else None
    for number, row in enumerate(rows if isinstance(rows, list) else [], 1):
        place = f"sdo {number}"
        if not isinstance(row, dict):
            raise _Bad(f"{place}: is no row of index, sub_index and value")
        index, subindex, value = (_whole(row, f, place) for f in ("index", "sub_index", "value"))
        kind = row.get("type") or _profile_type(profile, index, subindex)
        if kind not in _SIZE:
            raise _Bad(f"{place}: type {str(kind)[:40]!r} is not known")
        data = _sized(value, _SIZE[kind], place)
        yield _listed(index, subindex, data, "PS", place)


def _bus_nodes(content: dict[Any, Any]) -> list[Any]:
    """Rows of each node of a bus.yml: under `nodes` with `defaults`, or each at the top."""
    named = content.get("nodes")
    if isinstance(named, list):
        named = {
            key: each for part in named if isinstance(part, dict) for key, each in part.items()
        }
    if isinstance(named, dict):
        defaults = content.get("defaults")
        shared = defaults.get("sdo") if isinstance(defaults, dict) else None
        found = [each.get("sdo", shared) for each in named.values() if isinstance(each, dict)]
        return [rows for rows in found if rows is not None]
    return [each["sdo"] for each in content.values() if isinstance(each, dict) and "sdo" in each]


def _profile_type(profile: Profile, index: int, subindex: int) -> str:
    """bus.yml gives no type: that of the object counts."""
    parameter = profile.by_key.get(f"{index:04X}:{subindex:02X}")
    if parameter is None:
        return "int32"
    return {"REAL32": "uint32"}.get(parameter.type, parameter.type.lower())


def _whole(row: dict[Any, Any], field: str, place: str) -> int:
    value = row.get(field)
    if isinstance(value, bool) or not isinstance(value, int):
        raise _Bad(f"{place}: {field} {str(value)[:40]!r} is no whole number")
    return value


def _dcf(data: bytes, profile: Profile, name: str) -> ControllerList:
    """Values of a DCF, whose order is that of the objects and says nothing of the writing."""
    report = ImportReport()
    writes = []
    for value in read_dcf_values(data, name, report):
        place = f"line {value.line}"
        parameter = profile.by_key.get(f"{value.index:04X}:{value.subindex:02X}")
        kind: DataType = parameter.type if parameter else "UINT32"
        if parameter is not None and kind not in INTEGER_RANGE and kind != "REAL32":
            continue
        raw, _ = default_value(value.text, kind, place, report)
        if raw is None:
            raise _Bad(f"{place}: {value.text[:40]!r} is no {kind}")
        try:
            writes.append(_listed(value.index, value.subindex, encode(kind, raw), "", place))
        except DriveError as error:
            raise _Bad(f"{place}: {error.message}") from error
    return ControllerList("dcf", tuple(writes), ordered=False)
