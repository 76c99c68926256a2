"""Start-up lists as XML: TwinCAT's CoE list and linuxcnc-ethercat's `lcec`; see `eni` for ENI."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any
from xml.etree.ElementTree import Comment, Element, SubElement, indent, tostring

from backend.records.handover.model import AxisHandover, MappedEntry, StartupWrite

#: Download request of CoE (ETG.2100 table of InitCmd: Ccs 1 is an SDO download).
_CCS_DOWNLOAD = 1
#: Types with a signed HAL pin in `lcec`, which has no 64-bit pins.
_SIGNED = ("INT8", "INT16", "INT32")


def child(parent: Element, tag: str, text: object = None, **attributes: str) -> Element:
    """Add an element; control characters, not permitted in XML 1.0, become spaces."""
    element = SubElement(parent, tag, attributes)
    if text is not None:
        element.text = "".join(c if c.isprintable() else " " for c in str(text))
    return element


def file_of(root: Element[str]) -> bytes:
    """An element tree as a file."""
    indent(root)
    text: bytes = tostring(root, encoding="utf-8", xml_declaration=True)
    return text + b"\n"


def note(text: str) -> Element[Any]:
    """A comment; two hyphens, which are not permitted in it, are separated."""
    plain = "".join(c if c.isprintable() else " " for c in text)
    return Comment(f" {plain.replace('--', '- -')} ")


def init_commands(parent: Element, writes: tuple[StartupWrite, ...]) -> Element:
    """`InitCmds`, which ETG.2000 (ESI) and ETG.2100 (ENI) have in common."""
    commands = child(parent, "InitCmds")
    for write in writes:
        init_command(commands, write)
    return commands


def init_command(commands: Element, write: StartupWrite) -> None:
    """One download; Data is hexadecimal in the order of transmission."""
    command = child(commands, "InitCmd")
    child(command, "Transition", write.transition)
    child(command, "Comment", write.name)
    child(command, "Timeout", 0)
    child(command, "Ccs", _CCS_DOWNLOAD)
    child(command, "Index", write.index)
    child(command, "SubIndex", write.subindex)
    child(command, "Data", write.data.hex())


def twincat(axis: AxisHandover) -> bytes:
    """The list that TwinCAT's CoE start-up page imports."""
    root = Element("EtherCATMailbox")
    init_commands(child(root, "CoE"), axis.writes)
    return file_of(root)


def lcec(axes: Sequence[AxisHandover]) -> bytes:
    """`masters` of linuxcnc-ethercat, with each drive as a slave of type generic, in cable order.

    Numbers are hexadecimal where its documentation has them so.

    Raises:
        NotAllowed: identity unknown.
    """
    root = Element("masters")
    cycle_ns = 1000 * max(axis.cycle_us for axis in axes)
    master = child(root, "master", idx="0", appTimePeriod=str(cycle_ns), refClockSyncCycles="1")
    for number, axis in enumerate(axes):
        _lcec_slave(master, axis, number, slave_name(axes, number))
    return file_of(root)


def slave_name(axes: Sequence[AxisHandover], number: int) -> str:
    """Name of a slave in HAL."""
    return "drive" if len(axes) == 1 else f"drive{number + 1}"


def _lcec_slave(master: Element, axis: AxisHandover, number: int, name: str) -> None:
    vendor, product = axis.identity()
    slave = child(
        master, "slave", idx=str(number), type="generic", name=name, vid=f"{vendor:08X}",
        pid=f"{product:08X}", configPdos="true",
    )  # fmt: skip
    if axis.assign_activate:
        child(
            slave,
            "dcConf",
            assignActivate=f"{axis.assign_activate:x}",
            sync0Cycle="*1",
            sync0Shift=str(axis.controller.shift_ns if axis.controller else 0),
        )
    for write in axis.writes:
        slave.append(note(f"{write.key} {write.name}"))
        config = child(slave, "sdoConfig", idx=f"{write.index:04X}", subIdx=f"{write.subindex:02X}")
        child(config, "sdoDataRaw", data=write.data.hex(" ").upper())
    for manager_number, direction, way in (("2", "rx", "out"), ("3", "tx", "in")):
        pdos = [p for p in axis.pdos if p.direction == direction]
        manager = child(slave, "syncManager", idx=manager_number, dir=way) if pdos else slave
        for pdo in pdos:
            element = child(manager, "pdo", idx=f"{pdo.index:04X}")
            for entry in pdo.entries:
                _lcec_entry(element, entry)


def _lcec_entry(pdo: Element, entry: MappedEntry) -> None:
    place = {"idx": f"{entry.index:04X}", "subIdx": f"{entry.subindex:02X}"}
    if entry.type is None or entry.bits > 32:
        # `lcec` maps a gap without a pin; for more than 32 bits it has no pin.
        child(pdo, "pdoEntry", **place, bitLen=str(entry.bits))
        return
    kind = "s32" if entry.type in _SIGNED else "u32"
    if entry.type == "REAL32":
        kind = "float-ieee"
    child(pdo, "pdoEntry", **place, bitLen=str(entry.bits), halPin=hal_pin(entry), halType=kind)


def hal_pin(entry: MappedEntry) -> str:
    """Name of a HAL pin: the readable name, made unique by the object's address."""
    word = "".join(c if c.isascii() and c.isalnum() else "-" for c in entry.name.lower())
    word = "-".join(part for part in word.split("-") if part)[:20].strip("-")
    return f"{word}-{entry.index:04x}-{entry.subindex:02x}"


def hal_stub(axes: Sequence[AxisHandover], file_name: str) -> bytes:
    """HAL file that loads the list; its pins must be connected by hand."""
    names = ", ".join(" ".join(axis.name.split()) for axis in axes)
    lines = [
        f"# Start of EtherCAT for {names}; connect the pins to your axes.",
        f"loadusr -W lcec_conf {file_name}",
        "loadrt lcec",
        "addf lcec.read-all servo-thread",
        "# addf of motion and of your axes come here",
        "addf lcec.write-all servo-thread",
        "",
    ]
    for number, axis in enumerate(axes):
        name = slave_name(axes, number)
        for pdo in axis.pdos:
            for entry in pdo.entries:
                if entry.type is not None and entry.bits <= 32:
                    way = "to the drive" if pdo.direction == "rx" else "from the drive"
                    pin = f"lcec.0.{name}.{hal_pin(entry)}"
                    lines.append(f"# net NAME {pin}   ({way}: {entry.name})")
    return "\n".join([*lines, ""]).encode()
