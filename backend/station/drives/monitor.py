"""Monitor of one axis: polls its state, detects loss, return and restart, and logs faults."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import logging
import math
import time
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from backend.axes.axis.axis import Axis
from backend.axes.drive.faults import active_faults, fault_keys, integer
from backend.axes.drive.readings import Reading
from backend.axes.scales.units import AxisUnits
from backend.axes.stopping.turning import Turning, TurnWatch, turning_message
from backend.foundation.people.identity import by_itself
from backend.foundation.work.journal import Journal, Level
from drivers import cia402
from drivers.cia402 import State
from drivers.errors import DriveError, internal_error
from drivers.texts.message import Text, profile_text, text
from profiles.schema import Fault

log = logging.getLogger(__name__)

#: Polling period while a page shows the axis, and while none does [s].
WATCHED_S = 0.1
IDLE_S = 1.0
#: Period of full polls during an exchange that delivers state and values [s].
ASKED_S = 1.0
#: Period for reading option codes and ramps of STOP, and scales, while the axis is enabled [s].
STOP_ASKED_S = 0.9
#: Greatest age of process data that count as the present state [s].
NEWEST_S = 0.05
#: Values that change so slowly that only full polls read them.
_SLOW_ROLES = ("dc_voltage", "temperature")

_VALUE_ROLES = {
    "position": "position_actual",
    "velocity": "velocity_actual",
    "torque": "torque_actual",
    "following_error": "following_error",
    "dc_voltage": "dc_voltage",
    "temperature": "temperature",
}

_SHOWN_ROLES = (*_VALUE_ROLES.values(), "mode_display")
#: Signals whose change causes a full poll.
_STATE_ROLES = ("status_word", "error_code")
#: Status bits that change with every motion: target reached, internal limit, mode-specific bits.
_MODE_SPECIFIC = 0x3C00
#: Running number of monitors. Multiplied by the golden ratio it gives evenly spread phases for any
#: number of monitors.
_COUNT = itertools.count()
_GOLDEN = 0.6180339887498949
#: A due time nearer than this share of the period is skipped, to leave the bus free for others.
_SOON = 0.5
_FAULTY = (State.FAULT, State.FAULT_REACTION, State.UNKNOWN)

#: Meaning of status bits 12 and 13 in each mode (CiA 402-2 clauses 10 to 16).
_MODE_BITS: dict[int, tuple[str, str]] = {
    1: ("setpoint acknowledged", "following error"),
    3: ("speed is zero", "maximum slippage"),
    6: ("homing attained", "homing error"),
    8: ("drive follows the command", "following error"),
    9: ("drive follows the command", ""),
    10: ("drive follows the command", ""),
}


@dataclass(frozen=True, slots=True)
class Snapshot:
    """State of an axis at one time [s since 1970]; values in the axis' units."""

    time: float
    fresh: bool
    problem: Text | None = None
    state: State = State.UNKNOWN
    status_word: int | None = None
    mode: int | None = None
    target_reached: bool = False
    internal_limit: bool = False
    mode_bits: dict[str, bool] = field(default_factory=dict)
    values: dict[str, float | None] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    faults: tuple[Fault, ...] = ()
    blocked_by: tuple[Text, ...] = ()
    turning: Turning | None = None
    """Set where the axis turns although nothing is permitted to move it."""


class Monitor:
    """Polls one axis as long as it is connected."""

    def __init__(
        self,
        axis: Axis,
        journal: Journal,
        changed: Callable[[Snapshot], None],
        returned: Callable[[], None],
        may_turn: Callable[[], bool] = lambda: True,
    ) -> None:
        self.axis = axis
        self.snapshot = Snapshot(time.time(), fresh=False, problem=text("station.not-read-yet"))
        #: Live connections that show this axis.
        self.watchers: set[str] = set()
        self._journal = journal
        self._changed = changed
        self._returned = returned
        self._turns = TurnWatch(may_turn)
        self._stop_asked_s = -math.inf
        self._task: asyncio.Task[None] | None = None
        self._wake = asyncio.Event()
        self._last: dict[str, Reading] = {}
        self._last_causes: list[Text] = []
        self._waiting: list[str] = []
        self._asked_s = -math.inf
        #: Number of the last poll, and of the poll that the snapshot comes from.
        self._polls = self._shown = 0
        # If all axes polled at the same instant, other requests would wait for all of them.
        self._phase = next(_COUNT) * _GOLDEN % 1

    def start(self) -> None:
        """Begin polling."""
        name = f"monitor-{self.axis.drive.id}"
        self._task = asyncio.create_task(self._run(), name=name, context=by_itself())

    async def close(self) -> None:
        """End polling."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait([self._task])

    def hurry(self) -> None:
        """Poll at once, as a page opened the axis or something changed."""
        self._wake.set()

    async def _run(self) -> None:
        while True:
            try:
                await self._poll(self._read_what_changes)
            except Exception as error:
                # A monitor that ended unnoticed would show its last state as the present one.
                log.exception("the state of %s cannot be shown", self.axis.drive.name)
                problem = internal_error(error)
                self.snapshot = replace(self.snapshot, fresh=False, problem=problem, turning=None)
                # Pages show what they were sent last. What listens may be the defect itself.
                with contextlib.suppress(Exception):
                    self._changed(self.snapshot)
            self._wake.clear()
            period = WATCHED_S if self.watchers else IDLE_S
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(self._until_due(period)):
                    await self._wake.wait()

    def _until_due(self, period_s: float) -> float:
        """Time to this monitor's own phase of the period [s]."""
        left = (self._phase - time.monotonic() / period_s) % 1
        return (left if left > _SOON else left + 1) * period_s

    async def refresh(self) -> Snapshot:
        """Read the state now. On failure the snapshot has the problem and the earlier values.

        While a procedure has exclusive access to the drive, the last snapshot is returned.
        """
        return await self._poll(self._read)

    async def _poll(self, read: Callable[[], Awaitable[Snapshot]]) -> Snapshot:
        self._polls += 1
        number = self._polls
        if await self.axis.repeat_stop():
            drive = self.axis.drive
            again = text("station.stop-sent-again", drive=drive.name)
            self._journal.add(again, level="warning", drive=drive.id)
        if self.axis.drive.exclusive.held:
            return self.snapshot
        try:
            snapshot = await read()
        except DriveError as error:
            self._asked_s = -math.inf
            snapshot = replace(
                self.snapshot, time=time.time(), fresh=False, problem=error.text, turning=None
            )
        # A request may poll at the same time as the monitor: each change is reported once, and
        # the result of an earlier poll is discarded.
        if number < self._shown:
            return self.snapshot
        before, self.snapshot, self._shown = self.snapshot, snapshot, number
        self._record(before, snapshot)
        self._changed(snapshot)
        return snapshot

    async def _read(self) -> Snapshot:
        """Full poll: read all shown values from the drive."""
        drive = self.axis.drive
        began_s = time.monotonic()
        wanted = [drive.require("status_word")]
        wanted += [key for role in _SHOWN_ROLES if (key := drive.key(role))]
        wanted += fault_keys(drive)
        if drive.modes_key is not None and drive.modes_key not in drive.readings:
            wanted.append(drive.modes_key)
        self._last = await drive.read_many(dict.fromkeys(wanted))
        self._last_causes, self._waiting = [], list(drive.pending)
        if self._state() in (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE):
            await self._read_settings(began_s)
        if self._state() is not State.OPERATION_ENABLED:
            self._last_causes = await self.axis.blocked_by()
        self._asked_s = began_s
        return await self._snapshot()

    async def _read_what_changes(self) -> Snapshot:
        """Snapshot from the newest process data, as long as state and faults are unchanged.

        A full poll is still made every `ASKED_S`, as process data may continue although the
        mailbox, and with it the firmware, has failed. Any change of state or fault causes a full
        poll.
        """
        axis, drive = self.axis, self.axis.drive
        session = axis.session
        if session is None or time.monotonic() - self._asked_s >= ASKED_S:
            return await self._read()
        shown = {key: role for role in _SHOWN_ROLES if (key := drive.key(role))}
        telling = [key for role in _STATE_ROLES if (key := drive.key(role))]
        newest = drive.take(session.newest(drive, [*telling, *shown], NEWEST_S))
        if self._state_differs(newest, telling) or self._waiting != list(drive.pending):
            return await self._read()
        self._last = self._last | newest
        asked = [k for k, role in shown.items() if k not in newest and role not in _SLOW_ROLES]
        if asked:
            self._last = self._last | await drive.read_many(asked)
        return await self._snapshot()

    async def _read_settings(self, now_s: float) -> None:
        """Read settings that other programs may change while the axis has power.

        These are the stop settings, as STOP has no time to read them, and the scales, which the
        axis compares.
        """
        if now_s - self._stop_asked_s >= STOP_ASKED_S:
            self._stop_asked_s = now_s
            await self.axis.read_stop_settings()
            await self.axis.look_at_scales()

    def _state_differs(self, newest: Mapping[str, Reading], telling: Sequence[str]) -> bool:
        """Whether state, warning or error code have changed or are not known."""
        drive = self.axis.drive
        reported, known = (
            [integer(readings.get(key)) for key in telling] for readings in (newest, self._last)
        )
        word, before = reported[0], known[0]
        if word is None or before is None or drive.decode_state(word) in _FAULTY:
            return True
        return bool((word ^ before) & ~_MODE_SPECIFIC) or reported[1:] != known[1:]

    def _state(self) -> State:
        drive = self.axis.drive
        status = self._last[drive.require("status_word")]
        if not isinstance(status.raw, int):
            raise DriveError(status.problem or "station.no-status-word", drive=drive.name)
        return drive.decode_state(status.raw)

    async def _snapshot(self) -> Snapshot:
        axis, drive = self.axis, self.axis.drive
        units, readings, state = await axis.units(), self._last, self._state()
        keys = {role: key for role in _VALUE_ROLES.values() if (key := drive.key(role))}
        word = integer(readings[drive.require("status_word")]) or 0
        mode = integer(readings.get(drive.key("mode_display") or ""))
        names = _MODE_BITS.get(mode or 0, ("", ""))
        position, velocity = (
            integer(readings.get(drive.key(role) or ""))
            for role in ("position_actual", "velocity_actual")
        )
        turning = self._turns.take(units, state, position, velocity)
        return Snapshot(
            time=time.time(),
            fresh=True,
            state=state,
            status_word=word,
            mode=mode,
            target_reached=bool(word & cia402.STATUS_TARGET_REACHED),
            internal_limit=bool(word & cia402.STATUS_INTERNAL_LIMIT),
            mode_bits={
                n: bool(word >> bit & 1) for n, bit in zip(names, (12, 13), strict=True) if n
            },
            values={
                name: _scaled(units, name, readings.get(keys.get(role, "")))
                for name, role in _VALUE_ROLES.items()
            },
            units=units.names,
            faults=tuple(active_faults(drive, readings)),
            blocked_by=tuple(self._last_causes),
            turning=turning,
        )

    def _record(self, before: Snapshot, now: Snapshot) -> None:
        drive = self.axis.drive
        if before.fresh and not now.fresh:
            lost = now.problem or text("station.not-read-yet")
            self._journal.add(lost, level="error", drive=drive.id)
        if now.fresh and not before.fresh:
            self._journal.add(text("station.answers", drive=drive.name), drive=drive.id)
            if before.status_word is not None or drive.pending_restores:
                self._returned()
        if not now.fresh:
            return
        if now.turning is not None and before.turning is None:
            self._journal.add(
                turning_message(drive.name, now.turning), level="error", drive=drive.id
            )
        old = {fault.code for fault in before.faults}
        for fault in now.faults:
            if fault.code not in old:
                level: Level = "error" if fault.kind == "fault" else "warning"
                line = text(
                    "station.fault",
                    kind=fault.kind,
                    fault_code=fault.code,
                    fault_name=profile_text(drive.profile.drive, fault.name),
                )
                self._journal.add(line, level=level, drive=drive.id)


def _scaled(units: AxisUnits, name: str, reading: Reading | None) -> float | None:
    if reading is None or not isinstance(reading.raw, (int, float)):
        return None
    match name:
        case "position" | "following_error":
            return units.position(reading.raw)
        case "velocity":
            return units.velocity(reading.raw)
        case "torque":
            return units.torque(reading.raw)
        case _:
            return float(reading.value) if isinstance(reading.value, (int, float)) else None
