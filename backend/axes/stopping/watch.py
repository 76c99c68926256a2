"""Supervises one axis from STOP to standstill, and escalates where the quick stop is insufficient.

The first quick-stop word has been sent before this begins. The further steps, each recorded as a
`StopStep`: where the axis turns without being enabled, the drive's own motion triggers are cleared
(`stop_clears` of its profile); where an enabled axis is neither at standstill nor decelerating when
its ramp should be over, its power is removed, after applying the brake where the bus controls it;
finally the process data are ended, so that the drive's watchdog trips. An axis that decelerates on
a long ramp keeps its power, because coasting is worse.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Awaitable, Callable

from backend.axes.axis import loop
from backend.axes.axis.axis import Axis
from backend.axes.axis.restoring import shielded
from backend.axes.axis.stop.facts import AxisStop, StepCode, Verdict
from backend.axes.axis.stop.settings import (
    OPTION,
    deceleration_rpm_s,
    known_settings,
)
from backend.axes.stopping.speed import DWELL_S, LOOK_S, Sample, SpeedWatch, units_of
from drivers import cia402
from drivers.cia402 import State
from drivers.errors import DriveError, LinkLost, LinkTimeout
from drivers.texts.message import Text, text
from profiles.stopping import StopClear

#: Ramp time: multiplied by the factor, plus the lag [s], limited to the shortest and longest [s].
_MORE, _LAG_S, SHORTEST_S, LONGEST_S = 1.3, 0.25, 0.4, 3.0
#: Time after STOP until which an axis that still decelerates is waited for, s.
_PATIENCE_S = 8.0
#: An axis without power is also waited for if its predicted time to standstill is below this, s.
_SOON_S = 1.0
#: Time allowed for a further step to take effect, s.
_STEP_S = 0.5
#: Time allowed for the drive's own ramp after its own motion was ended, s.
_OWN_RAMP_S = 1.0
_LOOK_EVERY_S = 0.02
#: Between two looks at an axis that seems to be at rest. At a reversal with 130 rad/s² 606Ch shows
#: more than 6 rpm in one of them.
_AGAIN_S = 0.01
#: The look before STOP and the last one span this time at least.
_SPAN_S = 0.03
#: After a new command, the looks that standstill needs are still taken within this time, s.
_NEW_COMMAND_S = DWELL_S + 0.1
#: Time of turning without power after which it is no longer the end of a quick stop, s.
_UNPOWERED_S = 0.1
#: Ratio of the speed to that at the start of that time: below the first the axis decelerates,
#: above the second it falls.
_RUNS_OUT, _FALLS = 0.95, 1.05
#: A drive that does not answer for this time counts as unreachable, s.
_SILENT_S = 1.5
#: A position read within this time before STOP shows whether the axis was at standstill, s. One
#: more recent than `_SPAN_S` is too recent: the second look waits for it.
_BEFORE_S = 5.0
_POWERED = (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE, State.FAULT_REACTION, State.UNKNOWN)


class StopWatch:
    """Supervision of one STOP of one axis."""

    def __init__(
        self, axis: Axis, end_process_data: Callable[[], Awaitable[bool]] | None = None
    ) -> None:
        self._axis = axis
        self._end_process_data = end_process_data
        self._began_s = time.monotonic()
        self._watch = SpeedWatch(axis, None)
        self._permits = axis.permits
        self._cleared = self._disabled = self._ended = False
        self._unpowered_since: float | None = None
        self._unpowered_speed = 0.0
        self._until_s = 0.0

    async def run(self, problem: Text | None = None) -> AxisStop:
        """Run until there is a verdict. ``problem``: why the first quick-stop word was not sent."""
        axis, self._began_s = self._axis, time.monotonic()
        before = None if problem else self._resting_at()
        try:
            units = await units_of(axis)
            self._watch = SpeedWatch(axis, units)
            if before is not None:
                self._watch.take(before)
            first = await self._watch.look()
            if before is not None and await self._rests(before, first):
                return self._verdict(Verdict.STOPPED)
        except DriveError as error:
            return await self._silent(problem or error.text)
        self._until_s = self._began_s + SHORTEST_S
        await self._read_ramp()
        return await self._follow(problem)

    async def _read_ramp(self) -> None:
        """Read the ramp settings not read before the motion; the stop word has been sent."""
        axis = self._axis
        if known_settings(axis.drive).ramp_raw() is None:
            try:
                async with asyncio.timeout(LOOK_S):
                    await axis.read_stop_settings()
            except TimeoutError:
                return

    def _resting_at(self) -> Sample | None:
        """Return the reading from shortly before STOP, if the axis had no power then."""
        drive = self._axis.drive
        position, status = (
            drive.readings.get(drive.key(role) or "") for role in ("position_actual", "status_word")
        )
        if position is None or status is None or position.time is None:
            return None
        if not isinstance(position.raw, int) or not isinstance(status.raw, int):
            return None
        ago_s, state = time.time() - position.time, drive.decode_state(status.raw)
        if state in _POWERED or not 0.0 <= ago_s <= _BEFORE_S:
            return None
        return Sample(time.monotonic() - ago_s, state, position.raw, None)

    async def _rests(self, before: Sample, first: Sample) -> bool:
        """Whether the axis was without power and at standstill before STOP, and still is.

        A second look confirms it: an axis at a reversal has zero speed for a moment, and one that
        its drive swings to and fro passes its old position again and again.
        """
        if not self._unmoved(before, first):
            return False
        old_enough = before.at_s + _SPAN_S - time.monotonic()
        await asyncio.sleep(max(_AGAIN_S, old_enough))
        return self._unmoved(before, await self._watch.look())

    def _unmoved(self, before: Sample, now: Sample) -> bool:
        return now.state not in _POWERED and self._watch.at_position_of(before, now)

    async def _silent(self, problem: Text) -> AxisStop:
        """Retry after a failed first sample; unreachable after `_SILENT_S` without answer."""
        while time.monotonic() - self._began_s < _SILENT_S:
            await asyncio.sleep(_LOOK_EVERY_S)
            try:
                await self._axis.repeat_stop()
                await self._watch.look()
            except DriveError:
                continue
            self._until_s = time.monotonic() + LONGEST_S
            return await self._follow(None)
        return self._verdict(Verdict.UNREACHABLE, problem)

    async def _follow(self, problem: Text | None) -> AxisStop:
        watch, axis, ramp_known = self._watch, self._axis, False
        while True:
            if axis.permits != self._permits:
                return await self._superseded()
            await asyncio.sleep(_LOOK_EVERY_S)
            try:
                if axis.stop_pending and await axis.repeat_stop():
                    problem = None
                sample = await watch.look()
            except DriveError as error:
                if time.monotonic() - (watch.answered_s or self._began_s) > _SILENT_S:
                    return self._verdict(Verdict.UNREACHABLE, problem or error.text)
                continue
            if watch.stands():
                if axis.stop_pending:
                    return self._verdict(Verdict.UNREACHABLE, problem)
                await self._settle(sample)
                return self._verdict(Verdict.STOPPED)
            if not ramp_known and (allowed := self._allowed_s()) is not None:
                ramp_known = True
                self._until_s = max(self._until_s, self._began_s + allowed)
            await self._without_power(sample)
            over = time.monotonic() >= self._until_s and watch.turns
            if over and not await self._next(sample):
                return self._moving(sample, problem)

    def _allowed_s(self) -> float | None:
        """Return the time [s] of the active ramp from the measured speed; None if unknown."""
        watch = self._watch
        speed = watch.speed()
        if speed is None or not watch.certain or watch.units is None:
            return None
        ramp = deceleration_rpm_s(watch.units, known_settings(self._axis.drive).ramp_raw())
        if ramp is None:
            return 2 * SHORTEST_S
        return min(max(speed / ramp * _MORE + _LAG_S, SHORTEST_S), LONGEST_S)

    async def _without_power(self, sample: Sample) -> None:
        """Clear the drive's own motion triggers for an axis that turns without power."""
        now, speed = time.monotonic(), self._watch.speed() or 0.0
        if sample.state in (*_POWERED, State.FAULT) or not self._watch.turns:
            self._unpowered_since = None
            return
        if self._unpowered_since is None or speed < self._unpowered_speed * _RUNS_OUT:
            # The rest of a ramp, or an oscillating load: motion driven by the drive keeps its
            # speed.
            self._unpowered_since, self._unpowered_speed = now, speed
        if self._cleared or now - self._unpowered_since < _UNPOWERED_S:
            return
        self._cleared = True
        # A holding brake must not be used for stopping: apply it to a falling axis, not a coasting
        # one.
        await self._clear(brake=speed > self._unpowered_speed * _FALLS)
        self._until_s = max(self._until_s, time.monotonic() + _OWN_RAMP_S)

    async def _next(self, sample: Sample) -> bool:
        """Wait on or take the next step after the time has expired. False where no step is left."""
        now, slows = time.monotonic(), self._watch.slows()
        soon = self._watch.time_to_standstill_s() < _SOON_S
        if slows and (sample.state in _POWERED or soon) and now - self._began_s < _PATIENCE_S:
            self._until_s = now + _STEP_S / 2
            return True
        if slows and (self._cleared or sample.state is State.FAULT):
            return False  # it coasts, or ends by its own ramp: no step brakes it harder
        if not self._disabled and sample.state in _POWERED:
            self._disabled = True
            await self._clear(triggers=False)
            await self._disable_voltage()
        elif not self._cleared and sample.state is not State.FAULT:
            self._cleared = True
            await self._clear(brake=False)
        elif not self._ended:
            self._ended = True
            if not await self._trip_watchdog():
                return False
        else:
            return False
        self._until_s = time.monotonic() + _STEP_S
        return True

    async def _disable_voltage(self) -> None:
        problem: Text | None = None
        axis = self._axis
        try:
            await shielded(self._power_off, LOOK_S, axis.drive.name)
        except DriveError as error:
            problem = error.text
        axis.stop_step(StepCode.VOLTAGE_DISABLED, problem)

    async def _power_off(self) -> None:
        axis = self._axis
        session = axis.session
        if axis.cyclic_power() is not None and session is not None:
            await loop.lower(session, axis.drive, State.SWITCH_ON_DISABLED)
        else:
            await axis.control(cia402.DISABLE_VOLTAGE)

    async def _trip_watchdog(self) -> bool:
        """End the process data; False where there are none to end."""
        if self._end_process_data is None:
            return False
        problem: Text | None = None
        try:
            if not await self._end_process_data():
                return False
        except DriveError as error:
            problem = error.text
        self._axis.stop_step(StepCode.PROCESS_DATA_ENDED, problem)
        return True

    async def _clear(self, *, brake: bool = True, triggers: bool = True) -> None:
        """Write the neutral values of the drive's own motion triggers, and apply the brake."""
        for entry in self._axis.drive.profile.stop_clears:
            wanted = brake if entry.kind == "brake" else triggers
            if wanted and not await self._clear_one(entry):
                return

    async def _clear_one(self, entry: StopClear) -> bool:
        """Write one neutral value; False where the drive does not answer."""
        axis, drive, answers = self._axis, self._axis.drive, True
        problem: Text | None = None
        if drive.unreachable_why(drive.parameter(entry.key)):
            return True
        figures: dict[str, float] = {}
        try:
            async with asyncio.timeout(LOOK_S):
                before = await drive.raw(entry.key)
                wanted = entry.neutral(before)
                if wanted is None:
                    return True
                figures = {"before": float(before), "after": float(wanted)}
                await drive.stop_by(entry.key, wanted)
        except (LinkLost, LinkTimeout, TimeoutError):
            answers, problem = False, text("stopping.no-answer")
        except DriveError as error:
            problem = error.text
        code = StepCode.BRAKE_APPLIED if entry.kind == "brake" else StepCode.TRIGGER_CLEARED
        axis.stop_step(code, problem, entry.key, figures)
        return answers

    async def _settle(self, sample: Sample) -> None:
        """At standstill: restore 605Ah, and quick-stop an axis that was only halted."""
        axis, before = self._axis, self._axis.option_before
        halted = any(step.code is StepCode.HALT for step in axis.stop_steps)
        try:
            if halted and sample.state is State.OPERATION_ENABLED and axis.cyclic_power() is None:
                await axis.control(cia402.QUICK_STOP)
        except DriveError as error:
            axis.stop_step(StepCode.QUICK_STOP, error.text)
        if before is None:
            return
        try:
            await axis.drive.stop_by(OPTION, before)
            axis.option_before = None
            axis.stop_step(StepCode.OPTION_RESTORED, None, OPTION, {"raw": float(before)})
        except DriveError as error:
            axis.stop_step(StepCode.OPTION_RESTORED, error.text, OPTION)

    def _moving(self, sample: Sample, problem: Text | None) -> AxisStop:
        coasts = sample.state not in _POWERED and self._watch.slows()
        return self._verdict(Verdict.COASTING if coasts else Verdict.STILL_MOVING, problem)

    async def _superseded(self) -> AxisStop:
        """The verdict where a new command was given: it may not have moved the axis yet."""
        until = time.monotonic() + _NEW_COMMAND_S
        with contextlib.suppress(DriveError):
            while not self._watch.stands() and time.monotonic() < until:
                await asyncio.sleep(_LOOK_EVERY_S)
                await self._watch.look()
        found = Verdict.STOPPED if self._watch.stands() else Verdict.STILL_MOVING
        return self._verdict(found, superseded=True)

    def _verdict(
        self, verdict: Verdict, problem: Text | None = None, *, superseded: bool = False
    ) -> AxisStop:
        watch, axis = self._watch, self._axis
        units = watch.units
        names = {} if units is None else units.names
        reported = watch.newest is not None
        travelled = (
            float(watch.travelled_inc) if units is None else units.position(watch.travelled_inc)
        )
        return AxisStop(
            drive=axis.drive.id,
            verdict=verdict,
            took_s=time.monotonic() - self._began_s,
            speed=watch.speed() if reported else None,
            speed_unit=names.get("velocity", "inc/s"),
            travelled=travelled if reported else None,
            travel_unit=names.get("position", "inc"),
            steps=tuple(axis.stop_steps),
            problem=problem,
            superseded=superseded,
        )
