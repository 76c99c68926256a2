"""Export of a profile as CANopen EDS and, with values, as device configuration file (DCF).

Source: CiA 306-1 v1.3.
"""

from __future__ import annotations

import struct
from collections.abc import Collection, Mapping
from datetime import datetime

from profiles.schema import DataType, Parameter, Profile, Raw

_CODE: dict[DataType, int] = {
    "BOOL": 0x01, "INT8": 0x02, "INT16": 0x03, "INT32": 0x04, "UINT8": 0x05, "UINT16": 0x06,
    "UINT32": 0x07, "REAL32": 0x08, "STRING": 0x09, "OCTETS": 0x0A, "INT64": 0x15, "UINT64": 0x1B,
}  # fmt: skip
_MANDATORY = (0x1000, 0x1001, 0x1018)
_BAUDRATES = (10, 20, 50, 125, 250, 500, 800, 1000)
_RECORD, _VARIABLE = 9, 7
_NUMBERS = ("DefaultValue", "ParameterValue", "LowLimit", "HighLimit")


def export_eds(profile: Profile, created: datetime, file_name: str | None = None) -> str:
    """Return the profile's objects as EDS text with CRLF line ends.

    Parameters that only Modbus can access have no object and are left out. ``created`` is written
    to the file, so that the same profile and time give the same text.
    """
    return _file(profile, created, file_name or f"{profile.drive}.eds", [], {})


def export_dcf(
    profile: Profile,
    values: Mapping[str, Raw],
    created: datetime,
    *,
    file_name: str,
    node_name: str = "",
    node_id: int | None = None,
    reals_as_bits: bool = False,
) -> str:
    """Return a DCF: the same with ``ParameterValue`` for each key of ``values`` (clause 5.3).

    Values for which `holds` is false are left out.

    ``reals_as_bits`` writes a REAL32 as the hexadecimal number of its bits, as some tools require;
    others require decimal.
    """
    commissioning = ["[DeviceComissioning]"]  # spelled as in the standard
    if node_id is not None:
        commissioning.append(f"NodeID=0x{node_id:02X}")
    commissioning += [f"NodeName={_text(node_name)}", "CANopenManager=0", ""]
    text = _file(profile, created, file_name, commissioning, values)
    return _with_bits(text) if reals_as_bits else text


def _with_bits(text: str) -> str:
    """Write numbers of REAL32 objects as their IEEE 754 bits, in hexadecimal."""
    lines, real = [], False
    for line in text.split("\r\n"):
        name, equals, value = line.partition("=")
        if line.startswith("["):
            real = False
        elif name == "DataType":
            real = int(value, 0) == _CODE["REAL32"]
        elif real and value and name in _NUMBERS:
            lines.append(f"{name}{equals}0x{struct.pack('>f', float(value)).hex().upper()}")
            continue
        lines.append(line)
    return "\r\n".join(lines)


def _file(
    profile: Profile,
    created: datetime,
    file_name: str,
    commissioning: list[str],
    values: Mapping[str, Raw],
) -> str:
    objects: dict[int, list[Parameter]] = {}
    for parameter in profile.parameters:
        if parameter.index is not None:
            objects.setdefault(parameter.index, []).append(parameter)
    for members in objects.values():
        members.sort(key=lambda p: p.subindex or 0)
    lines = _head(profile, created, file_name, objects) + commissioning
    lines += _lists({*objects, *_MANDATORY})
    pdos = _Pdos(profile)
    for index in sorted({*objects, *_MANDATORY}):
        known = objects.get(index)
        lines += _object(index, known, values, pdos) if known else _mandatory(index, profile)
    return "\r\n".join(lines) + "\r\n"


def _head(
    profile: Profile, created: datetime, file_name: str, objects: dict[int, list[Parameter]]
) -> list[str]:
    identity = profile.identity
    link = profile.link("canopen")
    rates = {rate // 1000 for rate in link.baudrates} if link and link.baudrates else {1000}
    day, time = created.strftime("%m-%d-%Y"), created.strftime("%I:%M%p")
    return [
        "[FileInfo]", f"FileName={_text(file_name)}", "FileVersion=1", "FileRevision=0",
        "EDSVersion=4.0", f"Description={_text(profile.title)}", f"CreationTime={time}",
        f"CreationDate={day}", "CreatedBy=servodeck", f"ModificationTime={time}",
        f"ModificationDate={day}", "ModifiedBy=servodeck", "",
        "[DeviceInfo]", f"VendorName={_text(identity.maker)}",
        f"VendorNumber=0x{identity.vendor_id or 0:08X}", f"ProductName={_text(identity.model)}",
        f"ProductNumber=0x{identity.product_code or 0:08X}",
        f"RevisionNumber=0x{identity.revision or 0:08X}", "OrderCode=",
        *(f"BaudRate_{rate}={int(rate in rates)}" for rate in _BAUDRATES),
        "SimpleBootUpMaster=0", "SimpleBootUpSlave=1", "Granularity=8",
        "DynamicChannelsSupported=0", "GroupMessaging=0",
        f"NrOfRXPDO={sum(0x1600 <= i < 0x1800 for i in objects)}",
        f"NrOfTXPDO={sum(0x1A00 <= i < 0x1C00 for i in objects)}", "LSS_Supported=0", "",
        "[DummyUsage]", *(f"Dummy{n:04d}=0" for n in range(1, 8)), "",
    ]  # fmt: skip


def _lists(objects: Collection[int]) -> list[str]:
    mandatory = list(_MANDATORY)
    maker = [i for i in sorted(objects) if 0x2000 <= i < 0x6000]
    optional = [i for i in sorted(objects) if i not in mandatory and i not in maker]
    lines: list[str] = []
    for title, indices in (
        ("MandatoryObjects", mandatory),
        ("OptionalObjects", optional),
        ("ManufacturerObjects", maker),
    ):
        lines += [f"[{title}]", f"SupportedObjects={len(indices)}"]
        lines += [f"{n}=0x{index:04X}" for n, index in enumerate(indices, start=1)] + [""]
    return lines


def _mandatory(index: int, profile: Profile) -> list[str]:
    """Return objects that every device has (CiA 301 clause 7.5.1), if missing in the profile.

    Tools refuse a file without them. An unknown default stays empty.
    """

    def entry(section: str, name: str, code: int, default: int | None) -> list[str]:
        return [
            f"[{section}]",
            f"ParameterName={name}",
            f"ObjectType=0x{_VARIABLE:X}",
            f"DataType=0x{code:04X}",
            "AccessType=ro",
            f"DefaultValue={'' if default is None else f'0x{default:X}'}",
            "PDOMapping=0",
            "",
        ]

    if index == 0x1000:
        return entry("1000", "Device type", _CODE["UINT32"], None)
    if index == 0x1001:
        return entry("1001", "Error register", _CODE["UINT8"], None)
    known = profile.identity
    parts = (
        ("Vendor ID", known.vendor_id),
        ("Product code", known.product_code),
        ("Revision number", known.revision),
        ("Serial number", None),
    )
    lines = [
        "[1018]",
        "ParameterName=Identity object",
        f"ObjectType=0x{_RECORD:X}",
        "SubNumber=5",
        "",
        *entry("1018sub0", "Highest subindex", _CODE["UINT8"], 4),
    ]
    for number, (name, value) in enumerate(parts, 1):
        lines += entry(f"1018sub{number}", name, _CODE["UINT32"], value)
    return lines


def _object(
    index: int, members: list[Parameter], values: Mapping[str, Raw], pdos: _Pdos
) -> list[str]:
    if len(members) == 1 and members[0].subindex == 0:
        return [f"[{index:04X}]", *_entry(members[0], members[0].name, values, pdos), ""]
    titles = {p.name.partition(":")[0].strip() for p in members}
    title = titles.pop() if len(titles) == 1 else f"Object {index:04X}h"
    counted = [p for p in members if p.subindex]
    count = pdos.counts.get(index, counted[-1].subindex or 0)
    lines = [
        f"[{index:04X}]",
        f"ParameterName={_text(title)}",
        f"ObjectType=0x{_RECORD:X}",
        f"SubNumber={len(counted) + 1}",
        "",
        f"[{index:04X}sub0]",
    ]
    own = next((p for p in members if not p.subindex), None)
    if own is not None:
        # The number of mapped objects (1600h, 1C12h) can be written.
        if not own.default_raw:
            own = own.model_copy(update={"default_raw": count})
        lines += [*_entry(own, own.name, values, pdos), ""]
    else:
        lines += [
            "ParameterName=Highest subindex", f"ObjectType=0x{_VARIABLE:X}", "DataType=0x0005",
            "AccessType=ro", f"DefaultValue={count}", "PDOMapping=0", "",
        ]  # fmt: skip
    for parameter in counted:
        name = parameter.name.partition(":")[2].strip() or parameter.name
        lines.append(f"[{index:04X}sub{parameter.subindex or 0:X}]")
        lines += [*_entry(parameter, name, values, pdos), ""]
    return lines


def _entry(parameter: Parameter, name: str, values: Mapping[str, Raw], pdos: _Pdos) -> list[str]:
    access = parameter.access
    if access == "rw" and parameter.pdo in ("rx", "tx"):
        access_text = "rww" if parameter.pdo == "rx" else "rwr"
    else:
        access_text = access
    lines = [
        f"ParameterName={_text(name)}",
        f"ObjectType=0x{_VARIABLE:X}",
        f"DataType=0x{_CODE[parameter.type]:04X}",
        f"AccessType={access_text}",
        f"DefaultValue={_value(parameter, pdos)}",
        f"PDOMapping={int(parameter.pdo != 'none')}",
    ]
    if parameter.key in values and parameter.type != "OCTETS" and holds(values[parameter.key]):
        lines.append(f"ParameterValue={values[parameter.key]}")
    if parameter.min_raw is not None:
        lines.append(f"LowLimit={parameter.min_raw}")
    if parameter.max_raw is not None:
        lines.append(f"HighLimit={parameter.max_raw}")
    if parameter.unit:
        lines.append(f";Unit={_text(parameter.unit)}")
    return lines


#: COB-IDs of the first four PDOs (CiA 301 clause 7.3.3, pre-defined connection set), which depend
#: on the node number and so are not defaults of a profile. Without them clients use no PDO.
_COB_IDS = {
    f"{first + number:04X}:01": f"$NODEID+0x{base + 0x100 * number:X}"
    for first, base in ((0x1400, 0x200), (0x1800, 0x180))
    for number in range(4)
}


class _Pdos:
    """Data of the profile on its PDOs beyond the defaults of their objects."""

    def __init__(self, profile: Profile) -> None:
        sets = profile.pdo.sets if profile.pdo is not None else ()
        self.counts = {s.index: len(s.layout or s.entries) for s in sets if s.entries}
        """Entries in use: objects may have more subindices."""
        self.cob_ids = _COB_IDS | {
            f"{s.index - 0x200:04X}:01": (
                f"{'$NODEID+' if s.identifier.of_node else ''}0x{s.identifier.cob_id:X}"
            )
            for s in sets
            if s.identifier is not None
        }


def _value(parameter: Parameter, pdos: _Pdos) -> str:
    default = parameter.default_raw
    if default is None and parameter.key in pdos.cob_ids:
        return pdos.cob_ids[parameter.key]
    if default is None or parameter.type == "OCTETS":
        return ""
    return _text(str(default))


def holds(value: Raw) -> bool:
    """Return whether a value can be in a DCF without a change: a text in one line, not empty."""
    return not isinstance(value, str) or (
        value.isprintable() and value == value.strip() and value != ""
    )


def _text(text: str) -> str:
    """Return one line; CiA 306 allows at most 241 characters."""
    return " ".join(text.split())[:241]
