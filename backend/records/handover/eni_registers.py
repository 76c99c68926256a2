"""Register commands of an ENI, which a master sends to a slave in every transition.

Their order and comments follow files written by TwinCAT; masters identify some by their comment.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree.ElementTree import Element

from backend.records.handover.model import AxisHandover
from backend.records.handover.xml_lists import child
from profiles.importer.esi.controller import SlaveController, SyncManager

#: Datagram commands (ETG.1000.4 clause 5.4).
_APRD, _APWR, _FPRD, _FPWR = 1, 2, 4, 5
_FIRST_ADDRESS = 1001
#: Logical address of the process data of a segment.
LOGICAL = 0x0100_0000
_AL_CONTROL, _EEPROM = 0x120, 0x500
#: Registers that master and slaves both use: AL status, configured address, FMMUs, sync managers.
AL_STATUS, ADDRESS, FMMU, SYNC_MANAGERS = 0x130, 0x10, 0x600, 0x800
#: Watchdog of 100 µs × 1000, written explicitly; it is the default (ETG.1000.4 clause 6.3).
_WATCHDOG = ((0x400, 2498), (0x420, 1000))
_TIMEOUTS_MS = {1: 3000, 2: 3000, 4: 10000, 8: 10000}
_DOWNWARD = ("SI", "OI", "SP", "OP")


@dataclass(frozen=True, slots=True)
class Place:
    """Position of a slave in segment and frame; offsets in bytes within the LRW datagram."""

    axis: AxisHandover
    position: int
    out_at: int
    out_bytes: int
    in_at: int
    in_bytes: int

    @property
    def address(self) -> int:
        """Configured station address."""
        return _FIRST_ADDRESS + self.position

    @property
    def auto_increment(self) -> int:
        """Position address: 0, 65535, 65534…"""
        return -self.position & 0xFFFF


def register_command(
    commands: Element, when: Sequence[str], comment: str, command: int, adp: int, ado: int,
    data: bytes, *, count: int | None = None, validate: tuple[bytes, bytes, int] | None = None,
) -> Element:  # fmt: skip
    """One register access at these transitions.

    ``count``: expected working counter. ``validate``: data, mask and timeout [ms] of a read that is
    repeated until it matches.
    """
    made = child(commands, "InitCmd")
    for transition in when:
        child(made, "Transition", transition)
    child(made, "Comment", comment)
    child(made, "Requires", "cycle")
    child(made, "Cmd", command)
    child(made, "Adp", adp)
    child(made, "Ado", ado)
    child(made, "Data", data.hex())
    if count is not None:
        child(made, "Cnt", count)
    child(made, "Retries", 3)
    if validate is not None:
        wanted, mask, timeout_ms = validate
        element = child(made, "Validate")
        child(element, "Data", wanted.hex())
        child(element, "DataMask", mask.hex())
        child(element, "Timeout", timeout_ms)
    return made


def slave_registers(
    commands: Element, place: Place, controller: SlaveController, cycle_us: int
) -> None:
    """Register commands of every transition, in the order in which a master sends them."""
    position, address = place.auto_increment, place.address
    vendor, product = place.axis.identity()
    _state(commands, ("PI", "SI", "OI", "IP"), _APWR, position, 1)
    register_command(
        commands, ("IP",), "assign EEPROM to ECAT", _APWR, position, _EEPROM, b"\0", count=1
    )
    for word, name, value in ((8, "vendor id", vendor), (10, "product code", product)):
        ask = struct.pack("<HI", 0x0100, word)
        register_command(commands, ("IP",), f"check {name}", _APWR, position, 0x502, ask, count=1)
        register_command(
            commands, ("IP",), f"check {name}", _APRD, position, 0x508, bytes(4), count=1,
            validate=(struct.pack("<I", value), b"\xff" * 4, 100),
        )  # fmt: skip
    own = struct.pack("<H", address)
    register_command(
        commands, ("IP",), "set physical address", _APWR, position, ADDRESS, own, count=1
    )
    for register, value in _WATCHDOG:
        data = struct.pack("<H", value)
        register_command(commands, ("IP",), "set watchdog", _FPWR, address, register, data, count=1)
    for manager in controller.sync_managers:
        if manager.kind.startswith("mailbox"):
            _manager(commands, "IP", address, manager, manager.length)
    register_command(
        commands, ("IP", *_DOWNWARD), "clear DC activation", _FPWR, address, 0x980, b"\0\0"
    )
    _state(commands, ("IP",), _FPWR, address, 2)
    for manager in controller.sync_managers:
        size = {"outputs": place.out_bytes, "inputs": place.in_bytes}.get(manager.kind)
        if size:
            _manager(commands, "PS", address, manager, size)
    _fmmus(commands, place, controller)
    if controller.assign_activate:
        _sync(commands, address, controller, cycle_us)
    _state(commands, ("PS", "OS"), _FPWR, address, 4)
    _state(commands, ("SO",), _FPWR, address, 8)
    _state(commands, ("SP", "OP"), _FPWR, address, 2)


def _state(commands: Element, when: Sequence[str], command: int, address: int, state: int) -> None:
    """Request an AL state and wait for it; Init and Pre-Op also acknowledge an error."""
    name = {1: "INIT", 2: "PREOP", 4: "SAFEOP", 8: "OP"}[state]
    data = bytes([state | (0x10 if state <= 2 else 0), 0])
    text = f"device state {name}"
    register_command(commands, when, f"set {text}", command, address, _AL_CONTROL, data, count=1)
    read = _APRD if command == _APWR else _FPRD
    wanted = bytes([state, 0, 0, 0, 0, 0])
    register_command(
        commands, when, f"check {text}", read, address, AL_STATUS, bytes(6), count=1,
        validate=(wanted, b"\x1f\0\0\0\0\0", _TIMEOUTS_MS[state]),
    )  # fmt: skip


def _manager(commands: Element, when: str, address: int, manager: SyncManager, length: int) -> None:
    data = struct.pack("<HHBBBB", manager.start, length, manager.control, 0, 1, 0)
    text = f"set sm {manager.number} ({manager.kind.replace('_', ' ')})"
    register = SYNC_MANAGERS + 8 * manager.number
    register_command(commands, (when,), text, _FPWR, address, register, data, count=1)


def _fmmus(commands: Element, place: Place, controller: SlaveController) -> None:
    """Map logical to physical memory (ETG.1000.4 clause 6.6); type 2: written, type 1: read."""
    for number, (kind, at, size, way) in enumerate(
        (("outputs", place.out_at, place.out_bytes, 2), ("inputs", place.in_at, place.in_bytes, 1))
    ):
        manager = controller.manager("outputs" if kind == "outputs" else "inputs")
        if manager is None or not size:
            continue
        data = struct.pack("<IHBBHBBB3x", LOGICAL + at, size, 0, 7, manager.start, 0, way, 1)
        register = FMMU + 16 * number
        text = f"set fmmu {number} ({kind})"
        register_command(commands, ("PS",), text, _FPWR, place.address, register, data, count=1)


def _sync(commands: Element, address: int, controller: SlaveController, cycle_us: int) -> None:
    """Activate SYNC0 (ETG.1000.4 clause 6.8). The master replaces the start time 0."""
    cycle = struct.pack("<II", cycle_us * 1000, 0)
    activate = struct.pack("<H", controller.assign_activate)
    for text, register, data in (
        ("set DC cycle time", 0x9A0, cycle),
        ("set DC start time", 0x990, bytes(8)),
        ("set DC activation", 0x980, activate),
    ):
        register_command(commands, ("PS",), text, _FPWR, address, register, data, count=1)
