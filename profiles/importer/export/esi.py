"""Export of a profile as an EtherCAT slave information file.

Source: ETG.2000 v1.0.10. Data that the profile does not contain (sizes of text, pictures, groups)
are left out or written in the smallest form that the format allows.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterable
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from profiles.bring_up import BringUp, ClockMode, InitCommand, SyncSignal
from profiles.schema import INTEGER_RANGE, DataType, Parameter, PdoPart, PdoSet, Profile, Raw

_NAME: dict[DataType, str] = {
    "BOOL": "BOOL", "INT8": "SINT", "INT16": "INT", "INT32": "DINT", "INT64": "LINT",
    "UINT8": "USINT", "UINT16": "UINT", "UINT32": "UDINT", "UINT64": "ULINT", "REAL32": "REAL",
}  # fmt: skip
_BITS: dict[DataType, int] = {
    "BOOL": 1, "INT8": 8, "INT16": 16, "INT32": 32, "INT64": 64, "UINT8": 8, "UINT16": 16,
    "UINT32": 32, "UINT64": 64, "REAL32": 32,
}  # fmt: skip
_TEXT_BYTES = 32
"""Length of a text of unknown size."""
#: Characters that no XML file may contain; texts of EDS files may.
_FORBIDDEN = re.compile(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_MANAGER_NAMES = {
    "mailbox_out": "MBoxOut",
    "mailbox_in": "MBoxIn",
    "outputs": "Outputs",
    "inputs": "Inputs",
}
_PROTOCOLS = {"aoe": "AoE", "eoe": "EoE", "foe": "FoE", "soe": "SoE", "voe": "VoE"}


def export_esi(profile: Profile) -> bytes:
    """Return the profile's identity, objects, PDOs and bring-up data as XML in UTF-8.

    Parameters that only Modbus can access have no object and are left out.
    """
    root = Element("EtherCATInfo", Version="1.0")
    vendor = SubElement(root, "Vendor")
    # An unknown number is left out: a wrong one would match another drive.
    if profile.identity.vendor_id is not None:
        _text(vendor, "Id", _hex(profile.identity.vendor_id, 8))
    _text(vendor, "Name", profile.identity.maker)
    device = SubElement(
        SubElement(SubElement(root, "Descriptions"), "Devices"), "Device", Physics="YY"
    )
    kind = _text(device, "Type", profile.identity.model)
    for name, value in (
        ("ProductCode", profile.identity.product_code),
        ("RevisionNo", profile.identity.revision),
    ):
        if value is not None:
            kind.set(name, _hex(value, 8))
    _text(device, "Name", profile.identity.model).set("LcId", "1033")
    rules = profile.bring_up or BringUp(source="")
    _timeouts(device, rules)
    _dictionary(device, profile)
    _managers(device, rules)
    for each in profile.pdo.sets if profile.pdo is not None else ():
        _pdo(device, each, profile)
    _mailbox(device, rules, profile)
    if rules.clock_modes:
        clocks = SubElement(device, "Dc")
        for mode in rules.clock_modes:
            _mode(clocks, mode)
    _registers(device, rules)
    indent(root)
    return bytes(tostring(root, encoding="utf-8", xml_declaration=True)) + b"\n"


def _text(parent: Element, tag: str, text: str) -> Element:
    element = SubElement(parent, tag)
    element.text = _FORBIDDEN.sub("", text)
    return element


def _hex(value: int, digits: int = 4) -> str:
    return f"#x{value:0{digits}X}"


def _flag(said: bool | None) -> str | None:  # three values: it may be unknown
    return None if said is None else str(int(said))


def _set(element: Element, **attributes: str | None) -> None:
    for name, value in attributes.items():
        if value is not None:
            element.set(name, value)


def _optional(parent: Element, rows: Iterable[tuple[str, int | None]]) -> None:
    for tag, value in rows:
        if value is not None:
            _text(parent, tag, str(value))


def _timeouts(device: Element, rules: BringUp) -> None:
    limits = rules.timeouts
    states = (
        ("PreopTimeout", limits.preop_ms),
        ("SafeopOpTimeout", limits.safeop_op_ms),
        ("BackToInitTimeout", limits.back_to_init_ms),
        ("BackToSafeopTimeout", limits.back_to_safeop_ms),
    )
    mailbox = (
        ("RequestTimeout", limits.mailbox_request_ms),
        ("ResponseTimeout", limits.mailbox_response_ms),
    )
    info = Element("Info")
    for tag, rows in (("StateMachine", states), ("Mailbox", mailbox)):
        if any(value is not None for _, value in rows):
            _optional(SubElement(SubElement(info, tag), "Timeout"), rows)
    if len(info):
        device.append(info)


def _dictionary(device: Element, profile: Profile) -> None:
    dictionary = SubElement(SubElement(device, "Profile"), "Dictionary")
    types, objects = SubElement(dictionary, "DataTypes"), SubElement(dictionary, "Objects")
    for name, bits in _plain_types(profile):
        data_type = SubElement(types, "DataType")
        _text(data_type, "Name", name)
        _text(data_type, "BitSize", str(bits))
    members: dict[int, list[Parameter]] = {}
    for parameter in profile.parameters:
        if parameter.index is not None:
            members.setdefault(parameter.index, []).append(parameter)
    for index, own in sorted(members.items()):
        own.sort(key=lambda p: p.subindex or 0)
        _object(types, objects, index, own)


def _plain_types(profile: Profile) -> list[tuple[str, int]]:
    return sorted({(_type(p), _bits(p)) for p in profile.parameters if p.index is not None})


def _object(types: Element, objects: Element, index: int, members: list[Parameter]) -> None:
    element = SubElement(objects, "Object")
    _text(element, "Index", _hex(index))
    single = len(members) == 1 and not members[0].subindex
    titles = {p.name.partition(":")[0].strip() for p in members}
    title = members[0].name if single else titles.pop() if len(titles) == 1 else f"{index:04X}h"
    _text(element, "Name", title)
    if single:
        _text(element, "Type", _type(members[0]))
        _text(element, "BitSize", str(_bits(members[0])))
        _info(SubElement(element, "Info"), members[0])
        _flags(element, members[0])
        return
    record = SubElement(types, "DataType")
    _text(record, "Name", f"DT{index:04X}")
    size = _text(record, "BitSize", "0")
    _text(element, "Type", f"DT{index:04X}")
    own_size = _text(element, "BitSize", "0")
    info = SubElement(element, "Info")
    # ETG.2000: subindex 0 occupies 16 bits of the record, of which 8 are used.
    start = 16
    if not any(p.subindex == 0 for p in members):
        _member(record, 0, "SubIndex 000", "USINT", 8, 0)
        count = SubElement(SubElement(info, "SubItem"), "Info")
        _text(count, "DefaultData", f"{members[-1].subindex or 0:02X}")
        count_item = info[-1]
        count_item.insert(0, _named("SubIndex 000"))
    for parameter in members:
        name = parameter.name.partition(":")[2].strip() or parameter.name
        subindex = parameter.subindex or 0
        unique = f"{name} {subindex}" if name in {i.findtext("Name") for i in info} else name
        bits = _bits(parameter)
        at = 0 if subindex == 0 else start
        _flags(_member(record, subindex, unique, _type(parameter), bits, at), parameter)
        item = SubElement(info, "SubItem")
        item.append(_named(unique))
        _info(SubElement(item, "Info"), parameter)
        start = max(start, at + bits)
    size.text = own_size.text = str(start)
    # Members without a mapping of their own would have that of the object.
    alike = len({p.pdo for p in members}) == 1
    _flags(element, members[-1] if alike else members[-1].model_copy(update={"pdo": "none"}))


def _named(name: str) -> Element:
    element = Element("Name")
    element.text = name
    return element


def _member(record: Element, subindex: int, name: str, kind: str, bits: int, at: int) -> Element:
    item = SubElement(record, "SubItem")
    for tag, text in (
        ("SubIdx", str(subindex)),
        ("Name", name),
        ("Type", kind),
        ("BitSize", str(bits)),
        ("BitOffs", str(at)),
    ):
        _text(item, tag, text)
    return item


def _flags(element: Element, parameter: Parameter) -> None:
    flags = SubElement(element, "Flags")
    _text(flags, "Access", parameter.access)
    mapping = {"rx": "R", "tx": "T", "rxtx": "RT"}.get(parameter.pdo)
    if mapping is not None:
        _text(flags, "PdoMapping", mapping)


def _info(info: Element, parameter: Parameter) -> None:
    default = parameter.default_raw
    if isinstance(default, str):
        _text(info, "DefaultString", default)
    # The bytes of a negative maximum are also those of "no limit", as many files have them.
    as_numbers = parameter.is_integer and (parameter.max_raw or 0) < 0
    for tag, value in (
        ("Min", parameter.min_raw),
        ("Max", parameter.max_raw),
        ("Default", None if isinstance(default, str) else default),
    ):
        data = _data(value, parameter.type)
        if data is None:
            continue
        if as_numbers:
            _text(info, f"{tag}Value", str(value))
        else:
            _text(info, f"{tag}Data", data)


def _data(value: Raw | None, kind: DataType) -> str | None:
    """Return the bytes as transferred, in hex; None without a value of this type."""
    if value is None or isinstance(value, str):
        return None
    if kind == "REAL32":
        return struct.pack("<f", value).hex().upper()
    limits = INTEGER_RANGE.get(kind)
    if limits is None or not limits[0] <= value <= limits[1]:
        return None
    size = max(_BITS[kind] // 8, 1)
    return int(value).to_bytes(size, "little", signed=value < 0).hex().upper()


def _type(parameter: Parameter) -> str:
    if parameter.type == "STRING":
        return f"STRING({_bits(parameter) // 8})"
    return _NAME.get(parameter.type, f"OCTET_STRING({_TEXT_BYTES})")


def _bits(parameter: Parameter) -> int:
    if parameter.type == "STRING":
        default = parameter.default_raw
        return 8 * max(_TEXT_BYTES, len(default.encode()) if isinstance(default, str) else 0)
    return _BITS.get(parameter.type, 8 * _TEXT_BYTES)


def _managers(device: Element, rules: BringUp) -> None:
    for each in rules.sync_managers:
        element = _text(device, "Sm", _MANAGER_NAMES[each.kind])
        _set(
            element,
            MinSize=_number(each.min_size),
            MaxSize=_number(each.max_size),
            DefaultSize=_number(each.default_size),
            StartAddress=None if each.start is None else _hex(each.start),
            ControlByte=None if each.control is None else _hex(each.control, 2),
            Enable=_number(each.enable),
        )


def _number(value: int | None) -> str | None:
    return None if value is None else str(value)


def _pdo(device: Element, each: PdoSet, profile: Profile) -> None:
    element = SubElement(device, "RxPdo" if each.direction == "rx" else "TxPdo")
    _set(
        element,
        Sm=_number(each.sync_manager),
        Fixed="1" if each.fixed else None,
        Mandatory="1" if each.mandatory else None,
    )
    _text(element, "Index", _hex(each.index))
    _text(element, "Name", f"{'RxPDO' if each.direction == 'rx' else 'TxPDO'} {each.index:04X}h")
    for index in each.exclude:
        _text(element, "Exclude", _hex(index))
    whole = [
        PdoPart(key=key, bits=_bits(profile.by_key[key]))
        for key in each.entries
        if key in profile.by_key
    ]
    for part in each.layout or whole:
        item = SubElement(element, "Entry")
        parameter = profile.by_key.get(part.key) if part.key is not None else None
        if parameter is None or parameter.index is None:
            _text(item, "Index", "#x0")
            _text(item, "BitLen", str(part.bits))
            continue
        for tag, text in (
            ("Index", _hex(parameter.index)),
            ("SubIndex", str(parameter.subindex or 0)),
            ("BitLen", str(part.bits)),
            ("Name", parameter.name),
            ("DataType", _type(parameter)),
        ):
            _text(item, tag, text)


def _mailbox(device: Element, rules: BringUp, profile: Profile) -> None:
    mailbox = SubElement(device, "Mailbox")
    _set(mailbox, DataLinkLayer="1" if rules.data_link_layer else None)
    link = profile.link("ethercat")
    protocols = set(rules.protocols) | ({"foe"} if link is not None and link.foe else set())
    for protocol, tag in _PROTOCOLS.items():
        if protocol in protocols:
            SubElement(mailbox, tag)
    if profile.bring_up is not None and "coe" not in protocols and not rules.init_commands:
        return  # a station without CoE; objects of a profile without such rules are read by CoE
    coe = SubElement(mailbox, "CoE")
    complete = rules.coe.complete_access
    if complete is None and link is not None and link.complete_access:
        complete = True
    _set(
        coe,
        SdoInfo=_flag(rules.coe.sdo_info),
        PdoAssign=_flag(rules.coe.pdo_assign),
        PdoConfig=_flag(rules.coe.pdo_config),
        PdoUpload=_flag(rules.coe.pdo_upload),
        CompleteAccess=_flag(complete),
    )
    for command in rules.init_commands:
        _command(coe, command)


def _command(coe: Element, command: InitCommand) -> None:
    element = SubElement(coe, "InitCmd")
    _set(
        element,
        Fixed="1" if command.fixed else None,
        CompleteAccess="1" if command.complete_access else None,
    )
    for tag, text in (
        ("Transition", command.transition),
        ("Index", _hex(command.index)),
        ("SubIndex", str(command.subindex)),
        ("Data", command.data),
    ):
        _text(element, tag, text)
    if command.comment:
        _text(element, "Comment", command.comment)


def _mode(clocks: Element, mode: ClockMode) -> None:
    element = SubElement(clocks, "OpMode")
    _text(element, "Name", mode.name)
    if mode.description:
        _text(element, "Desc", mode.description)
    _text(element, "AssignActivate", _hex(mode.assign_activate))
    for number, signal in (("0", mode.sync0), ("1", mode.sync1)):
        if signal is not None:
            _signal(element, number, signal)
    for each in mode.pdos:
        manager = SubElement(element, "Sm", No=str(each.sync_manager))
        for index in each.pdos:
            _text(manager, "Pdo", _hex(index))


def _signal(element: Element, number: str, signal: SyncSignal) -> None:
    cycle = _text(element, f"CycleTimeSync{number}", str(signal.cycle_ns))
    cycle.set("Factor", str(signal.factor))
    _text(element, f"ShiftTimeSync{number}", str(signal.shift_ns))


def _registers(device: Element, rules: BringUp) -> None:
    held = (
        ("Reg0400", rules.watchdog.divider),
        ("Reg0410", rules.watchdog.pdi),
        ("Reg0420", rules.watchdog.process_data),
    )
    if any(value is not None for _, value in held):
        _optional(SubElement(device, "ESC"), held)
    if rules.eeprom_bytes is not None or rules.eeprom_config:
        eeprom = SubElement(device, "Eeprom")
        _optional(eeprom, (("ByteSize", rules.eeprom_bytes),))
        if rules.eeprom_config:
            _text(eeprom, "ConfigData", rules.eeprom_config)
