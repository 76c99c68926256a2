"""Watches one axis: polls its state, notices loss, return and restart, and records faults."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from backend.axis import Axis
from backend.faults import active_faults, fault_keys, integer
from backend.journal import Journal, Level
from backend.people.identity import by_itself
from backend.readings import Reading
from backend.units import AxisUnits
from drivers import cia402
from drivers.cia402 import State
from drivers.errors import DriveError
from profiles.schema import Fault

log = logging.getLogger(__name__)

#: Polling period while somebody watches, and while nobody does.
WATCHED_S = 0.1
IDLE_S = 1.0

_VALUE_ROLES = {
    "position": "position_actual",
    "velocity": "velocity_actual",
    "torque": "torque_actual",
    "following_error": "following_error",
    "dc_voltage": "dc_voltage",
    "temperature": "temperature",
}

#: Meaning of status bits 12 and 13 in each mode (CiA 402-2 clauses 10 to 16).
_MODE_BITS: dict[int, tuple[str, str]] = {
    1: ("set-point acknowledged", "following error"),
    3: ("speed is zero", "maximum slippage"),
    6: ("homing attained", "homing error"),
    8: ("drive follows the command", "following error"),
    9: ("drive follows the command", ""),
    10: ("drive follows the command", ""),
}


@dataclass(frozen=True, slots=True)
class Snapshot:
    """State of an axis at one time (epoch seconds); values in the axis' units."""

    time: float
    fresh: bool
    problem: str = ""
    state: State = State.UNKNOWN
    status_word: int | None = None
    mode: int | None = None
    target_reached: bool = False
    internal_limit: bool = False
    mode_bits: dict[str, bool] = field(default_factory=dict)
    values: dict[str, float | None] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    faults: tuple[Fault, ...] = ()
    blocked_by: tuple[str, ...] = ()


class Monitor:
    """Polls one axis for as long as it is part of the bench."""

    def __init__(
        self,
        axis: Axis,
        journal: Journal,
        changed: Callable[[Snapshot], None],
        returned: Callable[[], None],
    ) -> None:
        self.axis = axis
        self.snapshot = Snapshot(time.time(), fresh=False, problem="not read yet")
        #: The live connections that look at it.
        self.watchers: set[str] = set()
        self._journal = journal
        self._changed = changed
        self._returned = returned
        self._task: asyncio.Task[None] | None = None
        self._wake = asyncio.Event()

    def start(self) -> None:
        """Begin to poll."""
        name = f"monitor-{self.axis.drive.id}"
        self._task = asyncio.create_task(self._run(), name=name, context=by_itself())

    async def close(self) -> None:
        """End polling."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait([self._task])

    def hurry(self) -> None:
        """Poll at once; somebody began to watch or changed something."""
        self._wake.set()

    async def _run(self) -> None:
        while True:
            try:
                await self.refresh()
            except Exception as error:
                # A watch that ended unseen would show the last state as the present one for ever.
                log.exception("the state of %s cannot be shown", self.axis.drive.name)
                problem = f"internal error: {type(error).__name__}: {error}"
                self.snapshot = replace(self.snapshot, fresh=False, problem=problem)
            self._wake.clear()
            period = WATCHED_S if self.watchers else IDLE_S
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._wake.wait(), period)

    async def refresh(self) -> Snapshot:
        """Read the state now. A failure becomes a snapshot that says so, with the old values.

        A drive that a procedure leaves alone is not asked; the last snapshot stands.
        """
        before = self.snapshot
        if await self.axis.repeat_stop():
            text = f"{self.axis.drive.name}: the stop that had not reached it was sent again"
            self._journal.add(text, level="warning", drive=self.axis.drive.id)
        if self.axis.drive.rest.held:
            return before
        try:
            snapshot = await self._read()
        except DriveError as error:
            snapshot = replace(before, time=time.time(), fresh=False, problem=error.message)
        self.snapshot = snapshot
        self._record(before, snapshot)
        self._changed(snapshot)
        return snapshot

    async def _read(self) -> Snapshot:
        axis, drive = self.axis, self.axis.drive
        units = await axis.units()
        keys = {role: key for role in _VALUE_ROLES.values() if (key := drive.key(role))}
        status_key = drive.require("status_word")
        wanted = [status_key, *keys.values()]
        wanted += [key for key in [drive.key("mode_display")] if key]
        wanted += fault_keys(drive)
        readings = await drive.read_many(dict.fromkeys(wanted))
        status = readings[status_key]
        if not isinstance(status.raw, int):
            raise DriveError(status.error or "the status word could not be read", drive=drive.name)
        word = status.raw
        mode_key = drive.key("mode_display")
        mode = integer(readings.get(mode_key or ""))
        state = drive.decode_state(word)
        names = _MODE_BITS.get(mode or 0, ("", ""))
        blocked: list[str] = []
        if state is not State.OPERATION_ENABLED:
            blocked = await axis.blocked_by()
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
            blocked_by=tuple(blocked),
        )

    def _record(self, before: Snapshot, now: Snapshot) -> None:
        drive = self.axis.drive
        if before.fresh and not now.fresh:
            self._journal.add(now.problem, level="error", drive=drive.id)
        if now.fresh and not before.fresh:
            self._journal.add(f"{drive.name} answers", drive=drive.id)
            if before.status_word is not None or drive.owed:
                self._returned()
        if not now.fresh:
            return
        old = {fault.code for fault in before.faults}
        for fault in now.faults:
            if fault.code not in old:
                level: Level = "error" if fault.kind == "fault" else "warning"
                self._journal.add(
                    f"{fault.kind} {fault.code} {fault.name}", level=level, drive=drive.id
                )


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
