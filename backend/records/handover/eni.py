"""EtherCAT network information (ENI, ETG.2100) of a segment, ready to run in a master.

Element names, their order and the register commands follow files written by TwinCAT; addresses of
mailboxes and sync managers come from each drive's ESI file. Without ESI files a slave has its
start-up list alone, which a configurator can read but a master cannot run.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from xml.etree.ElementTree import Element

from backend.records.handover.eni_registers import (
    ADDRESS,
    AL_STATUS,
    FMMU,
    LOGICAL,
    SYNC_MANAGERS,
    Place,
    register_command,
    slave_registers,
)
from backend.records.handover.model import AxisHandover, MappedEntry, MappedPdo
from backend.records.handover.xml_lists import child, file_of, init_command, init_commands, note
from drivers.errors import NotAllowed
from drivers.texts import limits
from profiles.importer.esi.controller import SlaveController

#: Datagram commands (ETG.1000.4 clause 5.4).
_BRD, _BWR, _LRW, _ARMW = 7, 8, 12, 13
_ETHERNET_AND_HEADER, _DATAGRAM, _COUNTER, _FRAME = 16, 10, 2, 1514
_DC_TIME = 0x910
_TYPES = {
    "BOOL": "BOOL", "INT8": "SINT", "UINT8": "USINT", "INT16": "INT", "UINT16": "UINT",
    "INT32": "DINT", "UINT32": "UDINT", "INT64": "LINT", "UINT64": "ULINT", "REAL32": "REAL",
}  # fmt: skip


def is_complete(axes: Sequence[AxisHandover]) -> bool:
    """Whether a master can run the ENI: slave controllers and process data are all known."""
    return all(axis.controller is not None and axis.pdos for axis in axes)


def eni(axes: Sequence[AxisHandover]) -> bytes:
    """`EtherCATConfig` of the drives in the order of the cable.

    Raises:
        NotAllowed: an identity is unknown, or the process data do not fit one frame.
    """
    places = _places(axes)
    cycle_us = max(axis.cycle_us for axis in axes)
    complete = is_complete(axes)
    root = Element("EtherCATConfig", {"Version": "1.3"})
    config = child(root, "Config")
    _master(config, complete=complete)
    clocked = [p for p in places if complete and _clock(p.axis)]
    start = _ETHERNET_AND_HEADER + (_DATAGRAM + 8 + _COUNTER if clocked else 0) + _DATAGRAM
    for place in places:
        _slave(config, place, start if complete else 0, cycle_us, complete=complete)
    cyclic = child(config, "Cyclic")
    if not complete:
        cyclic.append(note("frames are laid out by the configurator, which has the ESI files"))
        child(cyclic, "CycleTime", cycle_us)
        return file_of(root)
    child(cyclic, "Comment", "one task")
    child(cyclic, "CycleTime", cycle_us)
    child(cyclic, "Priority", 1)
    child(cyclic, "TaskId", 1)
    size = _frame(child(cyclic, "Frame"), places, clocked)
    _process_image(config, places, start, size)
    return file_of(root)


def _places(axes: Sequence[AxisHandover]) -> list[Place]:
    sizes = [(_bytes_of(axis, "rx"), _bytes_of(axis, "tx")) for axis in axes]
    outputs = sum(out for out, _ in sizes)
    total = outputs + sum(back for _, back in sizes)
    if total > _FRAME - 100:
        raise NotAllowed(
            "handover.process-data-drives-take",
            limit=limits.size(_FRAME - 100),
            axes=len(axes),
            total_bytes=total,
            frame=_FRAME - 100,
        )
    places, out_at, in_at = [], 0, outputs
    for position, (axis, (out, back)) in enumerate(zip(axes, sizes, strict=True)):
        places.append(Place(axis, position, out_at, out, in_at, back))
        out_at += out
        in_at += back
    return places


def _pdos(axis: AxisHandover, direction: str) -> list[MappedPdo]:
    return [pdo for pdo in axis.pdos if pdo.direction == direction]


def _bytes_of(axis: AxisHandover, direction: str) -> int:
    bits = sum(entry.bits for pdo in _pdos(axis, direction) for entry in pdo.entries)
    return (bits + 7) // 8


def _clock(axis: AxisHandover) -> int:
    """AssignActivate; 0 where the drive runs without distributed clocks."""
    return axis.controller.assign_activate if axis.controller is not None else 0


# --- master -----------------------------------------------------------------------------


def _master(config: Element, *, complete: bool) -> None:
    master = child(config, "Master")
    info = child(master, "Info")
    child(info, "Name", "servodeck hand-over")
    child(info, "Destination", "ffffffffffff")
    child(info, "Source", "000000000000")
    child(info, "EtherType", "a488")
    if not complete:
        return
    commands = child(master, "InitCmds")
    for comment, register, data in (
        ("clear configured addresses", ADDRESS, b"\0\0"),
        ("clear fmmu", FMMU, bytes(256)),
        ("clear sm", SYNC_MANAGERS, bytes(256)),
        ("clear dc system time", _DC_TIME, bytes(32)),
        ("clear dc cycle cfg", 0x981, b"\0"),
        ("reset dc speed", 0x930, struct.pack("<H", 0x1000)),
        ("configure dc filter", 0x934, struct.pack("<H", 0x0C00)),
    ):
        command = register_command(commands, ("IP",), comment, _BWR, 0, register, data)
        command.insert(1, _element("BeforeSlave", "1"))


def _element(tag: str, text: str) -> Element:
    made = Element(tag)
    made.text = text
    return made


# --- one slave --------------------------------------------------------------------------


def _slave(config: Element, place: Place, start: int, cycle_us: int, *, complete: bool) -> None:
    axis, controller = place.axis, place.axis.controller
    vendor, product = axis.identity()
    slave = child(config, "Slave")
    info = child(slave, "Info")
    child(info, "Name", axis.name)
    child(info, "PhysAddr", place.address)
    child(info, "AutoIncAddr", place.auto_increment)
    child(info, "Physics", controller.physics if controller else "YY")
    child(info, "VendorId", vendor)
    child(info, "ProductCode", product)
    child(info, "RevisionNo", axis.revision or 0)
    child(info, "SerialNo", 0)
    if axis.pdos:
        _process_data(child(slave, "ProcessData"), place, start)
    mailbox = child(slave, "Mailbox")
    if controller is None:
        mailbox.append(note("start and length of the mailbox: from the drive's ESI file"))
    else:
        for tag, kind in (("Send", "mailbox_out"), ("Recv", "mailbox_in")):
            manager = controller.manager("mailbox_out" if kind == "mailbox_out" else "mailbox_in")
            assert manager is not None
            direction = child(mailbox, tag)
            child(direction, "Start", manager.start)
            child(direction, "Length", manager.length)
            if tag == "Recv":
                child(direction, "PollTime", 10)
    child(mailbox, "Protocol", "CoE")
    commands = init_commands(child(mailbox, "CoE"), ())
    if controller is not None:
        _assignment(commands, axis, controller)
    for write in axis.writes:
        init_command(commands, write)
    if complete and controller is not None:
        slave_registers(child(slave, "InitCmds"), place, controller, cycle_us)
    _dc(slave, place, cycle_us, complete=complete)


def _dc(slave: Element, place: Place, cycle_us: int, *, complete: bool) -> None:
    if not (_clock(place.axis) if complete else place.axis.distributed_clock):
        return
    clock = child(slave, "DC")
    if not complete:
        clock.append(note("AssignActivate 0300h (SYNC0): check with the drive's ESI file"))
    child(clock, "PotentialReferenceClock", 0)
    child(clock, "ReferenceClock", int(place.position == 0))
    child(clock, "CycleTime0", cycle_us * 1000)
    child(clock, "CycleTime1", 0)
    child(clock, "ShiftTime", place.axis.controller.shift_ns if place.axis.controller else 0)


def _assignment(commands: Element, axis: AxisHandover, controller: SlaveController) -> None:
    """Write the PDO assignment and mapping (ETG.1000.6 clause 5.6.7), as far as they can be set."""

    def write(comment: str, index: int, subindex: int, data: bytes) -> None:
        command = child(commands, "InitCmd", Fixed="1")
        for tag, text in (
            ("Transition", "PS"),
            ("Comment", comment),
            ("Timeout", 0),
            ("Ccs", 1),
            ("Index", index),
            ("SubIndex", subindex),
            ("Data", data.hex()),
        ):
            child(command, tag, text)

    if not controller.assigns:
        return
    for assign in (0x1C12, 0x1C13):
        write(f"clear sm pdos (0x{assign:04X})", assign, 0, b"\0")
    for pdo in axis.pdos if controller.configures else ():
        if pdo.fixed:
            continue
        write(f"clear pdo 0x{pdo.index:04X} entries", pdo.index, 0, b"\0")
        for number, entry in enumerate(pdo.entries, 1):
            word = entry.index << 16 | entry.subindex << 8 | entry.bits
            write(f"pdo 0x{pdo.index:04X} entry", pdo.index, number, struct.pack("<I", word))
        write(f"pdo 0x{pdo.index:04X} entry count", pdo.index, 0, bytes([len(pdo.entries)]))
    for assign, direction in ((0x1C12, "rx"), (0x1C13, "tx")):
        pdos = _pdos(axis, direction)
        for number, pdo in enumerate(pdos, 1):
            data = struct.pack("<H", pdo.index)
            write(f"pdo 0x{assign:04X}:{number:02X} index", assign, number, data)
        write(f"pdo 0x{assign:04X} count", assign, 0, bytes([len(pdos)]))


def _process_data(data: Element, place: Place, start: int) -> None:
    axis, controller = place.axis, place.axis.controller
    for tag, at, count in (
        ("Send", place.out_at, place.out_bytes),
        ("Recv", place.in_at, place.in_bytes),
    ):
        part = child(data, tag)
        child(part, "BitStart", 8 * (start + at))
        child(part, "BitLength", 8 * count)
    for direction, tag, kind in (("rx", "Sm2", "Outputs"), ("tx", "Sm3", "Inputs")):
        element = child(data, tag)
        child(element, "Type", kind)
        manager = (
            controller.manager("outputs" if direction == "rx" else "inputs")
            if (controller)
            else None
        )
        if manager is not None:
            child(element, "StartAddress", manager.start)
            child(element, "ControlByte", manager.control)
            child(element, "Enable", 1)
        for pdo in _pdos(axis, direction):
            child(element, "Pdo", pdo.index)
    for direction, tag, number in (("tx", "TxPdo", "3"), ("rx", "RxPdo", "2")):
        for pdo in _pdos(axis, direction):
            element = child(data, tag, Fixed="1" if pdo.fixed else "0", Sm=number)
            child(element, "Index", f"#x{pdo.index:04x}")
            child(element, "Name", f"{tag} {pdo.index:04X}h")
            for entry in pdo.entries:
                _entry(child(element, "Entry"), entry)


def _entry(element: Element, entry: MappedEntry) -> None:
    child(element, "Index", f"#x{entry.index:04x}")
    if entry.type is not None:
        child(element, "SubIndex", entry.subindex)
    child(element, "BitLen", entry.bits)
    if entry.type is not None:
        child(element, "Name", entry.name)
        child(element, "DataType", _type(entry))


def _type(entry: MappedEntry) -> str:
    return _TYPES.get(entry.type or "", f"BIT{entry.bits}")


# --- cyclic frame -----------------------------------------------------------------------


def _frame(frame: Element, places: Sequence[Place], clocked: Sequence[Place]) -> int:
    """Add the datagrams of one cycle; return the size of the frame [bytes]."""
    at = _ETHERNET_AND_HEADER
    if clocked:
        first = clocked[0].auto_increment
        states = ("PREOP", "SAFEOP", "OP")
        at = _command(frame, states, _ARMW, at, 8, adp=first, ado=_DC_TIME)
    total = sum(place.out_bytes + place.in_bytes for place in places)
    # Working counter of a read-write command: reading counts 1, writing 2 (ETG.1000.4 clause 5.4).
    count = sum(2 * bool(place.out_bytes) + bool(place.in_bytes) for place in places)
    at = _command(frame, ("SAFEOP", "OP"), _LRW, at, total, address=LOGICAL, count=count)
    states = ("PREOP", "SAFEOP", "OP")
    return _command(frame, states, _BRD, at, 2, adp=0, ado=AL_STATUS, count=len(places))


def _command(
    frame: Element, states: Sequence[str], command: int, at: int, length: int, *,
    adp: int = 0, ado: int = 0, address: int | None = None, count: int | None = None,
) -> int:  # fmt: skip
    made = child(frame, "Cmd")
    for state in states:
        child(made, "State", state)
    child(made, "Comment", "cyclic cmd")
    child(made, "Cmd", command)
    if address is not None:
        child(made, "Addr", address)
    else:
        child(made, "Adp", adp)
        child(made, "Ado", ado)
    child(made, "DataLength", length)
    if count is not None:
        child(made, "Cnt", count)
    child(made, "InputOffs", at)
    child(made, "OutputOffs", at)
    return at + _DATAGRAM + length + _COUNTER


def _process_image(config: Element, places: Sequence[Place], start: int, size: int) -> None:
    image = child(config, "ProcessImage")
    for tag, direction in (("Inputs", "tx"), ("Outputs", "rx")):
        side = child(image, tag)
        child(side, "ByteSize", size)
        for place in places:
            bit = 8 * (start + (place.in_at if direction == "tx" else place.out_at))
            for pdo in _pdos(place.axis, direction):
                for entry in pdo.entries:
                    if entry.type is not None:
                        variable = child(side, "Variable")
                        child(variable, "Name", f"{place.axis.name}.{entry.name}")
                        child(variable, "DataType", _type(entry))
                        child(variable, "BitSize", entry.bits)
                        child(variable, "BitOffs", bit)
                    bit += entry.bits
