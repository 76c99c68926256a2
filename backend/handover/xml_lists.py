"""Start-up lists as XML: TwinCAT's CoE list, ENI (ETG.2100) and linuxcnc-ethercat's `lcec`."""

from __future__ import annotations

from typing import Any
from xml.etree.ElementTree import Comment, Element, SubElement, indent, tostring

from backend.handover.model import ASSIGN_ACTIVATE, AxisHandover, MappedEntry, StartupWrite

#: Download request of CoE (ETG.2100 table of InitCmd: Ccs 1 is an SDO download).
_CCS_DOWNLOAD = 1
#: Words of a `lcec` HAL type by width and sign; `lcec` has no 64-bit pin.
_SIGNED = ("INT8", "INT16", "INT32")


def _child(parent: Element, tag: str, text: object = None, **attributes: str) -> Element:
    element = SubElement(parent, tag, attributes)
    if text is not None:
        element.text = str(text)
    return element


def _file(root: Element[str]) -> bytes:
    indent(root)
    text: bytes = tostring(root, encoding="utf-8", xml_declaration=True)
    return text + b"\n"


def _note(text: str) -> Element[Any]:
    """A comment; two hyphens would end it."""
    return Comment(f" {text.replace('--', '- -')} ")


def _init_commands(parent: Element, writes: tuple[StartupWrite, ...]) -> None:
    """`InitCmds` as ETG.2000 (ESI) and ETG.2100 (ENI) share them; Data is hexadecimal in the
    order of travel."""
    commands = _child(parent, "InitCmds")
    for write in writes:
        command = _child(commands, "InitCmd")
        _child(command, "Transition", write.transition)
        _child(command, "Comment", write.name)
        _child(command, "Timeout", 0)
        _child(command, "Ccs", _CCS_DOWNLOAD)
        _child(command, "Index", write.index)
        _child(command, "SubIndex", write.subindex)
        _child(command, "Data", write.data.hex())


def twincat(axis: AxisHandover) -> bytes:
    """The list that TwinCAT's CoE start-up page imports."""
    root = Element("EtherCATMailbox")
    _init_commands(_child(root, "CoE"), axis.writes)
    return _file(root)


def eni(axis: AxisHandover) -> bytes:
    """`EtherCATConfig` of one slave, as far as it can be stated without the drive's ESI file.

    Addresses of mailbox and sync managers are the ESI file's, and are not in it.

    Raises:
        NotAllowed: identity unknown.
    """
    vendor, product = axis.identity()
    root = Element("EtherCATConfig", {"Version": "1.3"})
    config = _child(root, "Config")
    master = _child(_child(config, "Master"), "Info")
    _child(master, "Name", "servodeck hand-over")
    _child(master, "Destination", "ffffffffffff")
    _child(master, "Source", "000000000000")
    _child(master, "EtherType", "a488")
    slave = _child(config, "Slave")
    info = _child(slave, "Info")
    _child(info, "Name", axis.name)
    _child(info, "PhysAddr", 1001)
    _child(info, "AutoIncAddr", 0)
    _child(info, "Physics", "YY")
    _child(info, "VendorId", vendor)
    _child(info, "ProductCode", product)
    if axis.revision is not None:
        _child(info, "RevisionNo", axis.revision)
    _process_data(slave, axis)
    mailbox = _child(slave, "Mailbox")
    mailbox.append(_note("start and length of the mailbox: from the drive's ESI file"))
    _child(mailbox, "Protocol", "CoE")
    _init_commands(_child(mailbox, "CoE"), axis.writes)
    if axis.distributed_clock:
        clock = _child(slave, "DC")
        clock.append(_note("AssignActivate 0300h (SYNC0): check with the drive's ESI file"))
        _child(clock, "CycleTime0", axis.cycle_us * 1000)
        _child(clock, "CycleTime1", 0)
        _child(clock, "ShiftTime", 0)
    cyclic = _child(config, "Cyclic")
    cyclic.append(_note("frames are laid out by the configurator, which knows the segment"))
    _child(cyclic, "CycleTime", axis.cycle_us)
    return _file(root)


def _process_data(slave: Element, axis: AxisHandover) -> None:
    if not axis.pdos:
        return
    data = _child(slave, "ProcessData")
    at = 0
    for direction, tag in (("rx", "Send"), ("tx", "Recv")):
        bits = sum(e.bits for p in axis.pdos if p.direction == direction for e in p.entries)
        place = _child(data, tag)
        _child(place, "BitStart", at)
        _child(place, "BitLength", bits)
        at += bits
    for direction, tag, kind in (("rx", "Sm2", "Outputs"), ("tx", "Sm3", "Inputs")):
        manager = _child(data, tag)
        _child(manager, "Type", kind)
        for pdo in axis.pdos:
            if pdo.direction == direction:
                _child(manager, "Pdo", pdo.index)
    for pdo in axis.pdos:
        tag, number = ("RxPdo", "2") if pdo.direction == "rx" else ("TxPdo", "3")
        element = _child(data, tag, Fixed="1" if pdo.fixed else "0", Sm=number)
        _child(element, "Index", f"#x{pdo.index:04x}")
        _child(element, "Name", f"{tag} {pdo.index:04X}h")
        for entry in pdo.entries:
            _eni_entry(_child(element, "Entry"), entry)


def _eni_entry(element: Element, entry: MappedEntry) -> None:
    _child(element, "Index", f"#x{entry.index:04x}")
    if entry.type is None:
        _child(element, "BitLen", entry.bits)
        return
    _child(element, "SubIndex", entry.subindex)
    _child(element, "BitLen", entry.bits)
    _child(element, "Name", entry.name)
    words = {
        "BOOL": "BOOL", "INT8": "SINT", "UINT8": "USINT", "INT16": "INT", "UINT16": "UINT",
        "INT32": "DINT", "UINT32": "UDINT", "INT64": "LINT", "UINT64": "ULINT", "REAL32": "REAL",
    }  # fmt: skip
    _child(element, "DataType", words.get(entry.type, f"BIT{entry.bits}"))


def lcec(axis: AxisHandover) -> bytes:
    """`masters` of linuxcnc-ethercat with one slave of type generic; numbers are hexadecimal
    where its documentation has them so.

    Raises:
        NotAllowed: identity unknown.
    """
    vendor, product = axis.identity()
    root = Element("masters")
    master = _child(
        root, "master", idx="0", appTimePeriod=str(axis.cycle_us * 1000), refClockSyncCycles="1"
    )
    slave = _child(
        master, "slave", idx="0", type="generic", name="drive", vid=f"{vendor:08X}",
        pid=f"{product:08X}", configPdos="true",
    )  # fmt: skip
    if axis.distributed_clock:
        _child(
            slave, "dcConf", assignActivate=f"{ASSIGN_ACTIVATE:x}", sync0Cycle="*1", sync0Shift="0"
        )
    for write in axis.writes:
        slave.append(_note(f"{write.key} {write.name}"))
        config = _child(
            slave, "sdoConfig", idx=f"{write.index:04X}", subIdx=f"{write.subindex:02X}"
        )
        _child(config, "sdoDataRaw", data=write.data.hex(" ").upper())
    for number, direction, way in (("2", "rx", "out"), ("3", "tx", "in")):
        pdos = [p for p in axis.pdos if p.direction == direction]
        manager = _child(slave, "syncManager", idx=number, dir=way) if pdos else slave
        for pdo in pdos:
            element = _child(manager, "pdo", idx=f"{pdo.index:04X}")
            for entry in pdo.entries:
                _lcec_entry(element, entry)
    return _file(root)


def _lcec_entry(pdo: Element, entry: MappedEntry) -> None:
    place = {"idx": f"{entry.index:04X}", "subIdx": f"{entry.subindex:02X}"}
    if entry.type is None or entry.bits > 32:
        # A gap that `lcec` maps without a pin; it has no pin of 64 bits.
        _child(pdo, "pdoEntry", **place, bitLen=str(entry.bits))
        return
    kind = "s32" if entry.type in _SIGNED else "u32"
    if entry.type == "REAL32":
        kind = "float-ieee"
    _child(pdo, "pdoEntry", **place, bitLen=str(entry.bits), halPin=hal_pin(entry), halType=kind)


def hal_pin(entry: MappedEntry) -> str:
    """Name of a HAL pin: unique by its object, readable by its name."""
    word = "".join(c if c.isascii() and c.isalnum() else "-" for c in entry.name.lower())
    word = "-".join(part for part in word.split("-") if part)[:20].strip("-")
    return f"{word}-{entry.index:04x}-{entry.subindex:02x}"


def hal_stub(axis: AxisHandover, file_name: str) -> bytes:
    """HAL file that loads the list; its pins are to be connected by hand."""
    lines = [
        f"# Start of EtherCAT for {' '.join(axis.name.split())}; connect the pins to your axis.",
        f"loadusr -W lcec_conf {file_name}",
        "loadrt lcec",
        "addf lcec.read-all servo-thread",
        "# addf of motion and of your axis come here",
        "addf lcec.write-all servo-thread",
        "",
    ]
    for pdo in axis.pdos:
        for entry in pdo.entries:
            if entry.type is not None and entry.bits <= 32:
                way = "to the drive" if pdo.direction == "rx" else "from the drive"
                lines.append(f"# net NAME lcec.0.drive.{hal_pin(entry)}   ({way}: {entry.name})")
    return "\n".join([*lines, ""]).encode()
