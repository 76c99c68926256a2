"""Bringing a slave from PREOP to process data, and back to them after a power cycle.

Transactions of steps; no I/O. Sources: ETG.1000.6 clause 5.6.7 (PDO assignment), ETG.1020 clause 22
(sync parameters), ETG.1000.4 clauses 6.3 (watchdog), 6.7 (sync managers) and 6.8 (DC).
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from drivers.errors import DriveError, LinkLost, NotAllowed, ProtocolError, Rejected
from drivers.ethercat.exchange.bring_up import (
    BEFORE_MAPPING,
    StationBringUp,
    send_commands,
    set_controls,
    set_watchdog_divider,
    timeout_s,
)
from drivers.ethercat.exchange.mapping import Assigned, Entry, Pdo
from drivers.ethercat.process.stations.station import STATE_TIMEOUT_S, Station, change_state
from drivers.ethercat.wire import coe, sii
from drivers.ethercat.wire.al_status import AlState
from drivers.ethercat.wire.registers import TRIES, read_again
from drivers.ethercat.wire.steps import Read, Steps, Write
from drivers.motion.interpolation import interpolation_period
from drivers.texts.message import text

FMMU, SYNC_MANAGERS = 0x600, 0x800
_FMMU_COUNT = 0x004
WATCHDOG_DIVIDER, WATCHDOG_TIME = 0x400, 0x420
_USUAL_DIVIDER = 0x09C2
"""Steps of 100 µs, the value after power-on (ETG.1000.4 clause 6.3); some controllers hold 0."""
_MANAGERS, _OUTPUTS, _SM_WATCHDOG = 4, 0x04, 0x40
"""Control byte of a sync manager (ETG.1000.4 clause 6.7): three buffers, written by the master."""

_PROCESS_MEMORY = 0x1000
"""End of the registers (ETG.1000.4 clause 6.1)."""

_DC_SYSTEM_TIME, _DC_OFFSET, _DC_DELAY = 0x910, 0x920, 0x928
_DC_CONTROL, _DC_ACTIVATE, _DC_START, _DC_CYCLE, _DC_SYNC1 = 0x980, 0x981, 0x990, 0x9A0, 0x9A4
_ASSIGN = {"rx": 0x1C12, "tx": 0x1C13}
_READ_ONLY = 0x06010002
_SETPOINTS = {0x6040, 0x607A, 0x60FF, 0x6071, 0x60B0, 0x60B1, 0x60B2}
_SYNC_LEAD_NS = 100_000_000
_SYNC1_BIT, _SYNC_TRY_S = 0x0400, 3.0


@dataclass(frozen=True, slots=True)
class StationSetup:
    """Process data of one station as chosen by the server; ``dc``: the segment has a clock."""

    rx: Assigned
    tx: Assigned
    cycle_ns: int
    dc: bool
    watchdog_ms: float
    rules: StationBringUp | None = None

    @property
    def bring_up(self) -> StationBringUp:
        """What the manufacturer's file prescribes, or the defaults without one."""
        return self.rules or StationBringUp(sync0_cycle_ns=self.cycle_ns)

    @property
    def sync0(self) -> bool:
        """Whether the drive gets SYNC0; otherwise its outputs take effect when they arrive."""
        return self.dc and self.bring_up.activate != 0


@dataclass(frozen=True, slots=True)
class Snapshot:
    """Registers of a configured slave, to configure it again after a power cycle."""

    fmmu: bytes
    sync_managers: bytes
    dc_delay: bytes


def spare(station: Station) -> Steps[None]:
    """Take a slave out of the process data: SOEM assigns FMMUs to every slave.

    Otherwise an unused slave may or may not count in the working counter, depending on its
    controller, and hide that another one is missing.
    """
    count = yield from read_again(_FMMU_COUNT, 1)
    if count is None:
        raise ProtocolError("ethercat.station-stopped-answering-left", station=station.number)
    for _ in range(TRIES if count[0] else 0):
        if (yield Write(FMMU, bytes(16 * count[0]))) is not None:
            return


def write_mapping(station: Station, setup: StationSetup) -> Steps[None]:
    """Write mapping, assignment, cycle time and synchronisation of a slave in PREOP.

    Raises:
        NotAllowed: the drive refuses the mapping; the message states which object and why.
    """
    yield from send_commands(station, setup.bring_up, BEFORE_MAPPING)
    assign = yield from _assignments(station)
    for direction, assigned in (("rx", setup.rx), ("tx", setup.tx)):
        try:
            yield from _write_assigned(station, assign[direction], assigned)
        except Rejected as error:
            if (yield from _has_them_anyway(station, assign[direction], assigned)):
                continue
            raise NotAllowed(
                "ethercat.station-not-take-process-data",
                parameter=error.parameter,
                remedy=(
                    text("ethercat.try-process-data-fixed-others")
                    if error.abort_code == _READ_ONLY
                    else error.remedy_text
                ),
                station=station.number,
                cause=error.text,
            ) from error
    value, exponent = interpolation_period(setup.cycle_ns)
    for index, sub, data in (
        (0x60C2, 1, struct.pack("<B", value)),
        (0x60C2, 2, struct.pack("<b", exponent)),
        (0x1C32, 1, struct.pack("<H", 2 if setup.sync0 else 1)),
        (0x1C33, 1, struct.pack("<H", 2 if setup.sync0 else 0x22)),
        (0x1C32, 2, struct.pack("<I", setup.cycle_ns)),
        (0x1C33, 2, struct.pack("<I", setup.cycle_ns)),
    ):
        try:
            yield from coe.download(station.box, index, sub, data)
        except Rejected:
            # Many drives have these read-only or not at all, and synchronise to SYNC0 by
            # themselves.
            continue


def _write_assigned(station: Station, assign: int, assigned: Assigned) -> Steps[None]:
    """Write contents and assignment of one direction, as far as they can be written."""
    box = station.box
    before = b""
    if assigned.assign:
        before = yield from coe.upload(box, assign, 0)
        yield from coe.download(box, assign, 0, b"\0")
    for pdo in assigned.pdos:
        if not (pdo.write and pdo.entries):
            continue
        try:
            yield from _write_contents(station, pdo)
        except Rejected:
            # Its mapping is fixed: only the assignment has changed, and is restored.
            if assigned.assign:
                yield from coe.download(box, assign, 0, before[:1])
            raise
    if not assigned.assign:
        return
    chosen = [pdo for pdo in assigned.pdos if pdo.entries]
    for number, pdo in enumerate(chosen, start=1):
        yield from coe.download(box, assign, number, struct.pack("<H", pdo.index))
    if chosen:
        yield from coe.download(box, assign, 0, bytes([len(chosen)]))


def _write_contents(station: Station, pdo: Pdo) -> Steps[None]:
    yield from coe.download(station.box, pdo.index, 0, b"\0")
    for number, entry in enumerate(pdo.entries, start=1):
        yield from coe.download(station.box, pdo.index, number, struct.pack("<I", entry.word))
    yield from coe.download(station.box, pdo.index, 0, bytes([len(pdo.entries)]))


def _assignments(station: Station) -> Steps[dict[str, int]]:
    """Return the objects that assign outputs and inputs: those of their sync managers.

    Usually 1C12h and 1C13h; 1C00h shows whether a drive has them the other way round (ETG.1000.6
    clause 5.6.7.4.9: 3 is outputs, 4 is inputs).
    """
    kinds = yield from _read_list(station, 0x1C00, 1)
    if kinds[2:4] == [4, 3]:
        return {"rx": _ASSIGN["tx"], "tx": _ASSIGN["rx"]}
    return _ASSIGN


def _has_them_anyway(station: Station, assign: int, assigned: Assigned) -> Steps[bool]:
    """Return whether a drive with a fixed assignment already carries just these process data."""
    pdos = [pdo for pdo in assigned.pdos if pdo.entries]
    if (yield from _read_list(station, assign, 2)) != [pdo.index for pdo in pdos]:
        return False
    for pdo in pdos:
        words = yield from _read_list(station, pdo.index, 4)
        if words != list(pdo.mapping_words):
            return False
    return True


def assigned_bytes(station: Station) -> Steps[int]:
    """Return the bytes of all process data that a slave has mapped by itself."""
    total = 0
    for assign in _ASSIGN.values():
        bits = 0
        for pdo in (yield from _read_list(station, assign, 2)):
            for word in (yield from _read_list(station, pdo, 4)):
                bits += word & 0xFF
        total += (bits + 7) // 8
    return total


def _read_list(station: Station, index: int, size: int) -> Steps[list[int]]:
    try:
        count = (yield from coe.upload(station.box, index, 0))[0]
        found = []
        for sub in range(1, count + 1):
            data = yield from coe.upload(station.box, index, sub)
            found.append(int.from_bytes(data[:size], "little"))
    except Rejected:
        return []
    return found


def initial_outputs(station: Station, entries: Sequence[Entry]) -> Steps[list[int]]:
    """Return the present values of the mapped objects, so that the first cycle changes nothing.

    A mapped torque limit or mode must not become zero just because it entered the process data.
    Setpoints start at zero; the loop makes the position setpoint follow the axis until it is
    enabled.
    """
    values = []
    for entry in entries:
        if entry.code == "x":
            continue
        value = 0
        if entry.index not in _SETPOINTS:
            try:
                data = yield from coe.upload(station.box, entry.index, entry.subindex)
                # Some drives state no length, or a longer one: the rest is padding.
                held = data[: entry.size] if not any(data[entry.size :]) else data
                (value,) = struct.unpack("<" + entry.code, held)
            except (Rejected, struct.error):
                key = f"{entry.index:04X}:{entry.subindex:02X}"
                station.notes.append(text("ethercat.note-starts-at-zero", parameter=key))
        values.append(value)
    return values


def arm_watchdog(station: Station, setup: StationSetup) -> Steps[None]:
    """Set the process-data watchdog of the slave, triggered by its outputs; read both back.

    Raises:
        NotAllowed: the slave does not accept it. No axis may then be moved over this bus, because
            nothing would stop it if the computer failed.
    """
    limit_ns, of_file = setup.bring_up.watchdog_limit_ns, setup.bring_up.watchdog_divider
    milliseconds = min(setup.watchdog_ms, (limit_ns or 1 << 62) / 1e6)
    if of_file is not None:
        yield from set_watchdog_divider(station, of_file)
    ticks = yield from _watchdog_ticks(station, milliseconds)
    if ticks is None and of_file is None:
        yield from set_watchdog_divider(station, _USUAL_DIVIDER)
        ticks = yield from _watchdog_ticks(station, milliseconds)
    if ticks is None:
        raise NotAllowed(
            "ethercat.watchdog-ms-not-fit", milliseconds_ms=milliseconds, station=station.number
        )
    yield Write(WATCHDOG_TIME, struct.pack("<H", ticks))
    reported = yield from read_again(WATCHDOG_TIME, 2)
    watched = yield from _watch_outputs()
    if reported != struct.pack("<H", ticks) or watched < bool(setup.rx.size):
        raise NotAllowed("ethercat.station-not-take-process", station=station.number)


def _watchdog_ticks(station: Station, milliseconds: float) -> Steps[int | None]:
    """Return the value of 0420h for the slave's divider; None if it does not fit the register."""
    divider = yield from read_again(WATCHDOG_DIVIDER, 2)
    if divider is None:
        raise ProtocolError("ethercat.station-not-answer-watchdog", station=station.number)
    # ETG.1000.4 clause 6.3: unit is 40 ns times (divider + 2).
    ticks = round(milliseconds * 1e6 / (40 * (int.from_bytes(divider, "little") + 2)))
    return ticks if 0 < ticks <= 0xFFFF else None


def _watch_outputs() -> Steps[int]:
    """Make every sync manager of outputs trigger the watchdog, usually number 2.

    Return their number; 0 if one of them does not accept it.
    """
    managers = yield from read_again(SYNC_MANAGERS, 8 * _MANAGERS)
    watching = 0
    if managers is None:
        return 0
    for number in range(_MANAGERS):
        base = SYNC_MANAGERS + 8 * number
        control, active = managers[8 * number + 4], managers[8 * number + 6]
        if not active & 1 or control & 0x0F != _OUTPUTS:
            continue
        if not control & _SM_WATCHDOG:
            yield Write(base + 6, b"\0")
            yield Write(base + 4, bytes([control | _SM_WATCHDOG]))
            yield Write(base + 6, b"\x01")
        after = yield from read_again(base + 4, 1)
        if after is None or not after[0] & _SM_WATCHDOG:
            return 0
        watching += 1
    return watching


class FoundInPart(ProtocolError):
    """The EEPROM states more than the search learned: one of its frames was lost or late."""


def check_places(station: Station, setup: StationSetup, clock: Callable[[], float]) -> Steps[None]:
    """Check that the process data lie in the slave's process memory, as its EEPROM must state.

    Raises:
        NotAllowed: they do not; outputs would be lost, or be written to registers.
        FoundInPart: the EEPROM states it, but the search has not read it.
    """
    managers = yield from read_again(SYNC_MANAGERS, 8 * _MANAGERS)
    if managers is None:
        raise ProtocolError("ethercat.station-stopped-answering-being", station=station.number)
    placed = 0
    for number in range(2, _MANAGERS):
        start, length = struct.unpack_from("<HH", managers, 8 * number)
        active = managers[8 * number + 6] & 1
        placed += bool(active and length and start >= _PROCESS_MEMORY)
    needed = bool(setup.rx.size) + bool(setup.tx.size)
    if placed < needed:
        reported, within_reach = yield from sii.process_data_places(clock)
        if reported >= needed and not within_reach:
            raise NotAllowed("ethercat.station-eeprom-tells-process", station=station.number)
        if reported >= needed:
            raise FoundInPart("ethercat.station-found-part-eeprom", station=station.number)
        raise NotAllowed("ethercat.station-eeprom-not-tell", station=station.number)


def take_snapshot() -> Steps[Snapshot]:
    """Read the registers that a power cycle clears."""
    fmmu = yield from read_again(FMMU, 48)
    managers = yield from read_again(SYNC_MANAGERS, 32)
    delay = yield from read_again(_DC_DELAY, 4)
    if fmmu is None or managers is None:
        raise ProtocolError("ethercat.slave-stopped-answering-being")
    return Snapshot(fmmu, managers, delay or bytes(4))


def restore_mailbox(station: Station, managers: bytes, clock: Callable[[], float]) -> Steps[None]:
    """Go from INIT to PREOP with the previous mailbox settings."""
    yield from change_state(station, AlState.INIT, clock)
    for number in (0, 1):
        yield Write(SYNC_MANAGERS + 8 * number, managers[8 * number : 8 * number + 8])
    yield from change_state(station, AlState.PREOP, clock)
    station.box.unsettled = False


def restore(
    station: Station,
    setup: StationSetup,
    snapshot: Snapshot,
    dc_time: Callable[[], int],
    clock: Callable[[], float],
) -> Steps[None]:
    """Go from any state back to SAFEOP, restoring all that a power cycle cleared.

    Raises:
        DriveError: the slave does not follow; the message states why.
    """
    yield from restore_mailbox(station, snapshot.sync_managers, clock)
    yield from write_mapping(station, setup)
    for number in (2, 3):
        part = snapshot.sync_managers[8 * number : 8 * number + 8]
        yield Write(SYNC_MANAGERS + 8 * number, part)
    yield from set_controls(station, setup.bring_up)
    yield Write(FMMU, snapshot.fmmu)
    yield from arm_watchdog(station, setup)
    if setup.dc:
        yield from _restore_clock(snapshot, dc_time)
        yield from start_sync0(station, setup, clock)
    yield from to_safeop(station, setup, clock)


def to_safeop(
    station: Station, setup: StationSetup | None, clock: Callable[[], float]
) -> Steps[None]:
    """Go to SAFEOP within the time that the drive's file allows."""
    rules = None if setup is None else setup.rules
    limit_s = timeout_s(rules, STATE_TIMEOUT_S[AlState.SAFEOP])
    yield from change_state(station, AlState.SAFEOP, clock, limit_s)


def start_sync0(station: Station, setup: StationSetup, clock: Callable[[], float]) -> Steps[None]:
    """Start SYNC0 on the grid of the distributed clock, and check that it was in time.

    If the start time has passed at activation, SYNC0 comes only after the clock has wrapped
    (ETG.1000.4 clause 6.7.3), and the drive then refuses OP: a lost frame or a pause of this
    computer must not cause that. If the drive gets no SYNC0, that of an earlier exchange is
    stopped.

    Raises:
        LinkLost: frames are lost repeatedly.
    """
    deadline = clock() + _SYNC_TRY_S
    while not (yield from _sync0_started(setup)):
        if clock() > deadline:
            raise LinkLost("ethercat.station-sync0-not-started", station=station.number)


def _sync0_started(setup: StationSetup) -> Steps[bool]:
    """Try once; False if a frame was lost, or the start time passed before the activation."""
    rules = setup.bring_up
    stopped = yield Write(_DC_ACTIVATE, b"\0")
    assigned = yield Write(_DC_CONTROL, bytes([rules.activate & 0xFF]))
    if not setup.sync0:
        return stopped is not None and assigned is not None
    here = yield Read(_DC_SYSTEM_TIME, 8)
    if here is None or stopped is None:
        return False
    start_ns = _sync_start(int.from_bytes(here, "little"), setup)
    # 990h cannot be read back: some chips show the next pulse there.
    written = []
    if rules.activate & _SYNC1_BIT:
        written.append((yield Write(_DC_SYNC1, struct.pack("<I", rules.sync1_ns))))
    written += [
        (yield Write(_DC_CYCLE, struct.pack("<I", rules.sync0_cycle_ns))),
        (yield Write(_DC_START, struct.pack("<Q", start_ns))),
        (yield Write(_DC_ACTIVATE, bytes([rules.activate >> 8]))),
    ]
    now = yield Read(_DC_SYSTEM_TIME, 8)
    if now is None or None in written:
        return False
    # Some chips count 32 bits only.
    ahead_ns = (start_ns - int.from_bytes(now, "little")) & 0xFFFF_FFFF
    return 0 < ahead_ns <= _SYNC_LEAD_NS + abs(rules.sync0_shift_ns)


def _sync_start(now_ns: int, setup: StationSetup) -> int:
    """Return a multiple of the cycle, shared by all stations, plus the drive's own shift [ns]."""
    grid_ns = (now_ns + _SYNC_LEAD_NS) // setup.cycle_ns * setup.cycle_ns
    return grid_ns + setup.bring_up.sync0_shift_ns


def _restore_clock(snapshot: Snapshot, dc_time: Callable[[], int]) -> Steps[None]:
    """Shift the restarted clock to the reference clock; the cyclic frames correct the rest."""
    yield Write(_DC_ACTIVATE, b"\0")
    yield Write(_DC_DELAY, snapshot.dc_delay)
    offset = yield Read(_DC_OFFSET, 8)
    here = yield Read(_DC_SYSTEM_TIME, 8)
    if offset is None or here is None:
        raise DriveError("ethercat.slave-stopped-answering-clock")
    shifted = struct.unpack("<q", offset)[0] + dc_time() - struct.unpack("<q", here)[0]
    yield Write(_DC_OFFSET, struct.pack("<q", shifted))
