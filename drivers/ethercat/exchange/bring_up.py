"""What the manufacturer's file prescribes on the way to Operational, as the host applies it.

The server derives a `StationBringUp` from the profile; it is sent to the host as a plain map.
Source: ETG.2000 v1.0.10; ETG.1000.4 clauses 6.3 (watchdog), 6.7 (sync managers), 6.8 (clocks).
"""

from __future__ import annotations

import struct
from dataclasses import asdict, dataclass, replace

from drivers.errors import NotAllowed, ProtocolError, Rejected
from drivers.ethercat.process.protocol import Message
from drivers.ethercat.process.stations.station import Station
from drivers.ethercat.wire import coe
from drivers.ethercat.wire.registers import read_again
from drivers.ethercat.wire.steps import Steps, Write
from drivers.texts.message import Text, text
from profiles.bring_up import PLAIN_ACTIVATE, BringUp, ClockMode, InitCommand
from profiles.motion.classify import standard_rule
from profiles.schema import Profile

SYNC_MANAGERS, WATCHDOG_DIVIDER = 0x800, 0x400
_WATCHDOG_BIT = 0x40
_MODE_OF_OPERATION = 0x6060
_MAPPING = (
    range(0x1600, 0x1800),
    range(0x1A00, 0x1C00),
    range(0x1C12, 0x1C13),
    range(0x1C13, 0x1C14),
)
#: Transitions that this master makes on the way up, in their order.
BEFORE_MAPPING, BEFORE_OP = ("IP", "PS"), ("SO",)


@dataclass(frozen=True, slots=True)
class Command:
    """An object to write during a state transition."""

    transition: str
    index: int
    subindex: int
    data: bytes
    complete: bool
    comment: str


@dataclass(frozen=True, slots=True)
class StationBringUp:
    """Bring-up of one station. Times in ns unless the name says ms; None: not in the file."""

    commands: tuple[Command, ...] = ()
    activate: int = PLAIN_ACTIVATE
    """Value for 0980h; 0: no SYNC0, the drive is synchronous to process data (ETG.2000, OpMode)."""

    sync0_cycle_ns: int = 0
    sync0_shift_ns: int = 0
    sync1_ns: int = 0
    watchdog_divider: int | None = None
    watchdog_limit_ns: int | None = None
    controls: tuple[tuple[int, int], ...] = ()
    """Number and control byte of each sync manager of process data."""
    complete_access: bool | None = None
    safeop_op_ms: int | None = None
    mailbox_ms: int | None = None
    notes: tuple[Text, ...] = ()


def station_bring_up(profile: Profile | None, cycle_ns: int) -> StationBringUp:
    """Derive what a profile prescribes for process data with this cycle [ns]."""
    rules = profile.bring_up if profile is not None else None
    if rules is None:
        return StationBringUp(sync0_cycle_ns=cycle_ns)
    commands, notes = _commands(rules)
    mode = rules.clock_mode
    sync0_ns = cycle_ns if mode is None else mode.sync0.period_ns(cycle_ns)
    return StationBringUp(
        commands=commands,
        activate=rules.assign_activate,
        sync0_cycle_ns=sync0_ns,
        sync0_shift_ns=0 if mode is None else mode.sync0.shift_ns,
        sync1_ns=_sync1_ns(mode, sync0_ns),
        watchdog_divider=rules.watchdog.divider,
        watchdog_limit_ns=rules.watchdog.process_data_ns,
        controls=tuple(
            (each.number, each.control)
            for each in rules.sync_managers
            if each.kind in ("outputs", "inputs") and each.control is not None
        ),
        complete_access=rules.coe.complete_access,
        safeop_op_ms=rules.timeouts.safeop_op_ms,
        mailbox_ms=rules.timeouts.mailbox_response_ms,
        notes=notes,
    )


def _sync1_ns(mode: ClockMode | None, sync0_ns: int) -> int:
    """Register 9A4h: from SYNC0 to SYNC1, with whole SYNC0 cycles where SYNC1 is slower.

    ETG.1000.4 clause 6.8: SYNC1 follows the first SYNC0 by this time, and then every ``9A4h div
    9A0h + 1`` cycles of SYNC0.
    """
    if mode is None or mode.sync1 is None:
        return 0
    slower = mode.sync1.period_ns(sync0_ns) // sync0_ns if sync0_ns else 1
    return max((max(slower, 1) - 1) * sync0_ns + mode.sync1.shift_ns, 0)


def withheld(command: InitCommand) -> Text | None:
    """Return why this tool does not write a command of the file; None if it does.

    The mode may be set, as the axis is not enabled before Operational; a control word, a target or
    a forced output may not: the manufacturer's file must not move the axis. The PDO assignment is
    written as chosen by this tool.
    """
    if any(command.index in each for each in _MAPPING):
        return text("ethercat.withheld-process-data")
    if command.transition not in (*BEFORE_MAPPING, *BEFORE_OP):
        return text("ethercat.withheld-transition")
    rule = standard_rule(f"{command.index:04X}:{command.subindex:02X}")
    if rule is None or rule.motion != "energises" or command.index == _MODE_OF_OPERATION:
        return None
    return text("ethercat.withheld-could-move", reason=rule.reason)


def _commands(rules: BringUp) -> tuple[tuple[Command, ...], tuple[Text, ...]]:
    sent: list[Command] = []
    notes: list[Text] = []
    for each in rules.init_commands:
        reason = withheld(each)
        if reason:
            key = f"{each.index:04X}:{each.subindex:02X}"
            notes.append(
                text(
                    "ethercat.note-command-not-written",
                    transition=each.transition,
                    parameter=key,
                    reason=reason,
                )
            )
            continue
        sent.append(
            Command(
                each.transition,
                each.index,
                each.subindex,
                each.raw,
                each.complete_access,
                each.comment,
            )
        )
    return tuple(sent), tuple(notes)


def to_wire(rules: StationBringUp) -> Message:
    """Convert to a plain map."""
    return asdict(replace(rules, notes=())) | {"notes": [each.to_wire() for each in rules.notes]}


def from_wire(message: Message | None) -> StationBringUp | None:
    """Convert from the plain map; None for None."""
    if message is None:
        return None
    fields = dict(message)
    fields["commands"] = tuple(Command(**each) for each in message["commands"])
    fields["controls"] = tuple((number, value) for number, value in message["controls"])
    fields["notes"] = tuple(Text.from_wire(each) for each in message["notes"])
    return StationBringUp(**fields)


def send_commands(
    station: Station, rules: StationBringUp, transitions: tuple[str, ...]
) -> Steps[None]:
    """Write the commands of these transitions, in the order of the file within each transition.

    Raises:
        NotAllowed: the drive refuses one of them.
    """
    for transition in transitions:
        for command in rules.commands:
            if command.transition != transition:
                continue
            try:
                yield from coe.download(
                    station.box,
                    command.index,
                    command.subindex,
                    command.data,
                    complete=command.complete,
                )
            except Rejected as error:
                raise NotAllowed(
                    "ethercat.station-refuses-command-maker",
                    parameter=f"{command.index:04X}:{command.subindex:02X}",
                    value=command.data.hex(),
                    station=station.number,
                    transition=transition,
                    command_index=command.index,
                    subindex=command.subindex,
                    cause=error.text,
                ) from error


def set_watchdog_divider(station: Station, divider: int) -> Steps[None]:
    """Write 0400h.

    Raises:
        NotAllowed: a different value reads back.
    """
    wanted = struct.pack("<H", divider)
    yield Write(WATCHDOG_DIVIDER, wanted)
    if (yield from read_again(WATCHDOG_DIVIDER, 2)) != wanted:
        raise NotAllowed(
            "ethercat.station-not-take-watchdog", station=station.number, watchdog_divider=divider
        )


def set_controls(station: Station, rules: StationBringUp) -> Steps[None]:
    """Set the control bytes of the process data sync managers as in the file.

    The watchdog bit is left unchanged: this tool decides whether outputs trigger the watchdog.

    Raises:
        ProtocolError: the station stopped answering.
    """
    for number, control in rules.controls:
        base = SYNC_MANAGERS + 8 * number
        manager = yield from read_again(base, 8)
        if manager is None:
            raise ProtocolError("ethercat.station-stopped-answering", station=station.number)
        wanted = control & ~_WATCHDOG_BIT | manager[4] & _WATCHDOG_BIT
        if manager[4] == wanted or not manager[6] & 1:
            continue
        yield Write(base + 6, b"\0")
        yield Write(base + 4, bytes([wanted]))
        yield Write(base + 6, b"\x01")


def timeout_s(rules: StationBringUp | None, usual_s: float) -> float:
    """Return the time-out [s] of a step to Safe-Op or Op: the usual or the file's, if longer."""
    named_ms = None if rules is None else rules.safeop_op_ms
    return usual_s if named_ms is None else max(usual_s, named_ms / 1000)


def apply_mailbox(station: Station, rules: StationBringUp) -> None:
    """Apply complete access and time-outs of the file, and add its notes to the station."""
    if rules.complete_access is False:
        station.complete_access = False
    if rules.mailbox_ms and station.mailbox is not None:
        station.box.timeout_s = max(station.box.timeout_s, rules.mailbox_ms / 1000)
    station.notes += [note for note in rules.notes if note not in station.notes]
