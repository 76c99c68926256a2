"""One axis: motion permission, and the two context managers that its safety rests on.

`Axis.restoring` restores parameters and `Axis.enabled` leaves Operation enabled, on every exit.
Their cleanup is shielded from cancellation, has a deadline, and reports what it could not restore.
"""

from __future__ import annotations

import asyncio
import itertools
import math
import time
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager

from backend.axes.axis import restoring
from backend.axes.axis.cyclic import CyclicSession
from backend.axes.axis.restoring import CLEANUP_TIMEOUT_S, shielded
from backend.axes.axis.scaled import ScaledAxis
from backend.axes.axis.stop.quick_stop import quick_stop_keys, raise_quick_stop
from backend.axes.drive.drive import Drive
from backend.axes.drive.optional import existing, torque_limits
from backend.axes.motion.authority import UNATTENDED_S
from backend.axes.motion.envelope import Envelope
from backend.axes.motion.grant import Grant
from backend.foundation.people.identity import acting
from drivers import cia402
from drivers.cia402 import Mode, State
from drivers.errors import DriveError, LinkLost, LinkTimeout, NotAllowed, OutOfRange, ProtocolError
from drivers.texts.message import Text, text
from drivers.texts.modes import mode_text
from drivers.texts.states import state_text
from profiles.schema import Raw

__all__ = ["Axis", "Envelope"]

#: An axis that is halted through the loop stands within this time, s.
_HALT_S = 2.0
#: Further time for one that its drive brakes on a longer ramp, s.
_RAMP_S = 1.5
#: Time in which one stands that lost its power while it moved, s.
_COAST_S = 0.5
#: Looks at a moving axis and the time between them [s]; it slows down where its speed at their end
#: is below this part of that at their beginning.
_LOOKS, _LOOK_S, _SLOWER = 5, 0.15, 0.97


class Axis(ScaledAxis):
    """Power state and motion permission of one drive."""

    def __init__(self, drive: Drive) -> None:
        super().__init__(drive)
        #: A person enabled the axis by a transition and has not disabled it here since.
        self._left_enabled = False
        #: Time to wait after enabling for a brake that the drive releases itself [s]; 0 until a
        #: motion has found the brake still applied.
        self.brake_wait_s = 0.0
        #: Connection of the page that left the axis enabled; None where it was not a page.
        self.enabled_by: str | None = None
        self._standing: Grant | None = None
        #: Called with the reason when the axis must not stay enabled; power must be switched off.
        self.unattended: Callable[[Text], None] = lambda _why: None

    @property
    def left_enabled(self) -> bool:
        """Whether a person left the axis enabled by a transition and STOP was not pressed since."""
        return self._left_enabled and not self.stopped

    def forget(self) -> None:
        """Discard scales and control word, as the drive restarted or its gearing changed."""
        self.forget_scales()
        self.control_word = 0

    async def position_raw(self) -> int:
        """Actual position in increments."""
        return await self.drive.raw(self.drive.require("position_actual"))

    async def velocity_raw(self) -> int:
        """Actual velocity in the drive's unit."""
        return await self.drive.raw(self.drive.require("velocity_actual"))

    async def transition(self, goal: State, mode: Mode | None) -> None:
        """Change power state and, where given, the mode, without moving.

        Raises:
            NotAllowed: the drive does not change its state, or STOP was pressed meanwhile.
        """
        await self.require_stop_delivered()
        # In a running exchange the loop keeps the setpoints at the actual position.
        aims = self.cyclic_power() is None
        with self.granted(text("motion.purpose-state", state=state_text(goal))):
            if mode is not None:
                if aims:
                    # An axis that is enabled already would follow a stale setpoint of the new mode.
                    await self.aim_here(mode)
                await self.set_mode(mode)
            if goal is State.OPERATION_ENABLED and aims:
                await self.aim_here()
            # Recorded before the control word is sent: from then on the axis may be enabled,
            # even where an error follows.
            self._leave_enabled(goal is State.OPERATION_ENABLED)
            await self.go_to(goal)

    def _leave_enabled(self, enabled: bool) -> None:
        """Record whether a person leaves the axis enabled, and begin or end the standing grant."""
        actor = acting.get()
        self._left_enabled = enabled
        self.enabled_by = actor.connection if enabled and actor is not None else None
        if enabled:
            # A page's connection is supervised, and its end switches the power off; a script gives
            # no sign of life, so its grant has a time limit.
            lasts_s = math.inf if self.enabled_by is not None else UNATTENDED_S
            drive = self.drive
            self._standing = drive.authority.standing(
                drive.id,
                text("motion.purpose-left-enabled"),
                lasts_s=lasts_s,
                ended=self.unattended,
            )
        elif self._standing is not None:
            self.drive.authority.end(self._standing)
            self._standing = None

    async def let_go(self) -> None:
        """Switch off the power of an axis that a person enabled here and left enabled.

        Used where nobody attends the axis any more: the server ends, or the axis is removed.

        Raises:
            DriveError: the power could not be switched off.
        """
        if not self._left_enabled:
            return
        self._leave_enabled(False)
        if await self.state() is State.OPERATION_ENABLED:
            await shielded(self._power_off, CLEANUP_TIMEOUT_S, self.drive.name)

    async def _power_off(self) -> None:
        if not await self.standstill(0.5):
            await self.quick_stop()
            await self._require_rest(CLEANUP_TIMEOUT_S / 2)
        await self.go_to(State.SWITCH_ON_DISABLED)

    async def halt_and_wait(self, timeout_s: float) -> None:
        """Halt (bit 8) and wait for standstill; quick stop if the axis does not slow down.

        Raises:
            LinkTimeout: no standstill in time, even by quick stop; the message contains a remedy.
        """
        await self.control(cia402.ENABLE_OPERATION | cia402.HALT)
        if await self.standstill(timeout_s):
            return
        await self.quick_stop()
        await self._require_rest(timeout_s)

    async def _require_rest(self, timeout_s: float, stopped_s: float | None = None) -> None:
        """Raise LinkTimeout where the axis still moves after a quick stop.

        ``stopped_s``: when it was stopped (`time.monotonic`), if that was before this call.
        """
        if not await self.standstill(timeout_s):
            passed_s = timeout_s if stopped_s is None else round(time.monotonic() - stopped_s, 1)
            raise LinkTimeout(
                "axis.still-moves-after-quick", drive=self.drive.name, timeout_s=passed_s
            )

    async def standstill(self, timeout_s: float) -> bool:
        """Whether the axis stopped (position unchanged over 30 ms) within the time.

        At least two readings are compared, even where one of them takes longer than the timeout on
        a busy computer or a slow bus.
        """
        tolerance = (await self.units()).rest_tolerance()
        deadline = time.monotonic() + timeout_s
        last = await self.position_raw()
        while True:
            await asyncio.sleep(0.03)
            now = await self.position_raw()
            if abs(now - last) <= tolerance:
                return True
            if time.monotonic() >= deadline:
                return False
            last = now

    # --- what must be restored --------------------------------------------------------

    def restoring(self, *keys: str) -> AbstractAsyncContextManager[dict[str, Raw]]:
        """Restore these parameters to their present values on every exit.

        Raises:
            RestoreFailed: on exit; the message names what could not be restored.
        """
        return restoring.restoring(self.drive, *keys)

    @asynccontextmanager
    async def enabled(self, mode: Mode, envelope: Envelope) -> AsyncIterator[None]:
        """Operation enabled in ``mode`` with the drive's torque limited by ``envelope``.

        Meanwhile STOP brakes at least as hard as the profile deceleration (6084h) that was set
        before. On exit the axis is stopped and returned to its earlier power state and mode. The
        mode is set before enabling, at standstill, as some families require.

        Raises:
            NotAllowed: the axis cannot be enabled; the message contains the cause.
        """
        drive = self.drive
        if self.cyclic_power() is not None:
            raise NotAllowed("axis.profile-homing-modes-not", drive=drive.name)
        await self.require_planned_scales()
        with self.granted(mode_text(mode), envelope):
            async with self._enabled(mode, envelope):
                yield

    @asynccontextmanager
    async def _enabled(self, mode: Mode, envelope: Envelope) -> AsyncIterator[None]:
        drive = self.drive
        await self.require_stop_delivered()
        before = await self.state()
        if before is State.OPERATION_ENABLED and not await self.standstill(0.5):
            raise NotAllowed("axis.moving-already", drive=drive.name)
        limits = await torque_limits(drive)
        mode_keys = await self.restorable_mode()
        stop_keys = await existing(drive, quick_stop_keys(drive))
        async with self.restoring(*limits, *stop_keys, *mode_keys) as earlier:
            shown = next((earlier[key] for key in mode_keys if key in earlier), None)
            previous = Mode(int(shown)) if shown in set(Mode) else mode
            await self.limit_torque(limits, envelope.torque_percent)
            await raise_quick_stop(drive, earlier)
            # A stale setpoint must not move the axis: neither at the change of mode, where the axis
            # is enabled already, nor when it is enabled.
            await self.aim_here(mode)
            await self.set_mode(mode)
            await self.aim_here(mode)
            try:
                await self.go_to(State.OPERATION_ENABLED)
                yield
            finally:
                await self._leaving(before, mode, previous)

    async def _leaving(self, before: State, mode: Mode, previous: Mode) -> None:
        try:
            await shielded(
                lambda: self._leave(before, mode, previous), CLEANUP_TIMEOUT_S, self.drive.name
            )
        except (LinkLost, LinkTimeout, ProtocolError):
            self.stop_pending = True
            raise

    @asynccontextmanager
    async def enabled_cyclic(
        self, session: CyclicSession, mode: Mode, timeout_s: float, *, by_increments: bool = False
    ) -> AsyncIterator[None]:
        """Operation enabled through the cyclic loop; the axis is braked and disabled on every exit.

        ``by_increments`` is for the small move by which a scale is determined; every other motion
        needs scales that are certain.

        Raises:
            ScaleUnknown: a scale is not certain.
            NotAllowed: the axis cannot be enabled, the loop ended the motion, or the drive has a
                fault at its end. Where the drive has a fault, the message names it.
        """
        if not by_increments:
            await self.require_planned_scales()
        with self.granted(mode_text(mode)):
            try:
                await self.go_to_cyclic(session, State.OPERATION_ENABLED, mode, timeout_s)
                if self.brake_wait_s:
                    await asyncio.sleep(self.brake_wait_s)
                yield
            except NotAllowed as error:
                await self._name_fault(error)
                raise
            finally:
                await self.leave_cyclic(session, timeout_s)
            await self._require_sound()

    async def _require_sound(self) -> None:
        """Raise NotAllowed where the drive has a fault now.

        A fault after the last check of the motion must not be taken for a motion without error.
        """
        if await self.state() in (State.FAULT, State.FAULT_REACTION):
            error = NotAllowed("axis.fault-end-motion", drive=self.drive.name)
            await self._name_fault(error)
            raise error

    async def _name_fault(self, error: NotAllowed) -> None:
        """Add the drive's active faults to an error of the loop.

        The loop only knows that the drive left Operation enabled; the drive reports the reason.
        """
        try:
            if await self.state() not in (State.FAULT, State.FAULT_REACTION):
                return
            faults = [f"{fault.code} {fault.name}" for fault in await self.active_faults()]
        except DriveError:
            return
        if faults and not error.names_faults:
            error.text = text("axis.with-faults", cause=error.text, faults=", ".join(faults))
            error.names_faults = True

    async def leave_cyclic(self, session: CyclicSession, timeout_s: float) -> None:
        """Brake and switch the power off through the loop, shielded from cancellation.

        Raises:
            LinkTimeout: the axis did not come to rest. One that still slows down in a quick stop
                keeps its power.
            DriveError: the loop did not do so. A stop is pending then, as the axis may still move.
        """
        try:
            await shielded(lambda: self._leave_cyclic(session), timeout_s, self.drive.name)
        except DriveError:
            self.stop_pending = True
            raise

    async def _leave_cyclic(self, session: CyclicSession) -> None:
        if not session.running:
            # An exchange that was stopped has braked all axes; one that broke off has left braking
            # to the drive.
            self.stop_pending = self.stop_pending or bool(session.trouble)
            return
        stopped_s = time.monotonic()
        await session.cyclic.halt(session.station(self.drive))
        rests = await self.standstill(_HALT_S)
        state = await self.state()
        if state in (State.FAULT, State.FAULT_REACTION):
            return
        if not rests and state is State.QUICK_STOP_ACTIVE and await self._slows_down():
            # Its drive brakes on a long ramp: without power the axis would coast.
            await self._require_rest(_RAMP_S, stopped_s)
        # One that neither stands nor slows down loses its power, as after STOP: the loop waits
        # once more for its standstill.
        await self.go_to_cyclic(session, State.SWITCH_ON_DISABLED, None, timeout_s=5.0)
        if not rests and state in (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE):
            await self._require_rest(_COAST_S, stopped_s)

    async def _slows_down(self) -> bool:
        """Whether the axis moves in one direction and becomes slower."""
        seen = [(time.monotonic(), await self.position_raw())]
        while len(seen) < _LOOKS:
            await asyncio.sleep(_LOOK_S)
            seen.append((time.monotonic(), await self.position_raw()))
        speeds = [(q - p) / (t - s) for (s, p), (t, q) in itertools.pairwise(seen)]
        one_way = all(v > 0 for v in speeds) or all(v < 0 for v in speeds)
        return one_way and abs(speeds[-1]) < _SLOWER * abs(speeds[0])

    async def restorable_mode(self) -> list[str]:
        """Key of 6060h; none where the drive shows a mode that cannot be written (power-on)."""
        key = self.drive.key("mode")
        if key is None:
            return []
        try:
            self.drive.check(self.drive.parameter(key), await self.drive.raw(key))
        except OutOfRange:
            return []
        return [key]

    async def limit_torque(self, limits: list[str], percent: float) -> None:
        """Lower these torque limits to ``percent`` of rated torque; lower limits stay unchanged."""
        units = await self.units()
        for key in limits:
            parameter = self.drive.parameter(key)
            raw = units.torque_raw(percent)
            low, high = parameter.raw_limits
            raw = int(min(raw, raw if high is None else high))
            raw = int(max(raw, raw if low is None else low))
            current = (await self.drive.read(key)).raw
            if not isinstance(current, int):
                continue
            if current > raw:
                await self.drive.write(key, raw)
            elif current < -raw:
                # Some families hold the limit of negative torque as a negative number.
                await self.drive.write(key, -raw)

    async def aim_here(self, mode: Mode | None = None) -> None:
        """Write the setpoint with which the axis stays where it is.

        It is the setpoint of ``mode``, or of the mode that the drive shows.
        """
        drive = self.drive
        if mode is None:
            display = drive.key("mode_display")
            shown = await drive.raw(display) if display else 0
            mode = Mode(shown) if shown in set(Mode) else Mode.NONE
        role, value = {
            Mode.PP: ("position_target", await self.position_raw()),
            Mode.CSP: ("position_target", await self.position_raw()),
            Mode.PV: ("velocity_target", 0),
            Mode.CSV: ("velocity_target", 0),
            Mode.PT: ("torque_target", 0),
            Mode.CST: ("torque_target", 0),
        }.get(mode, ("", 0))
        if role and (key := drive.key(role)) is not None:
            await drive.command(key, value, self.grant(key))

    def _may_move(self) -> bool:
        """Whether STOP was not pressed and the grant of this work has not ended."""
        return not self.stopped and self.drive.authority.may_move(self.drive.id)

    async def _leave(self, before: State, mode: Mode, previous: Mode) -> None:
        """Stop and return to the power state ``before``; without a grant, to Switch on disabled."""
        if self._may_move():
            try:
                await self._leave_as_before(before, mode, previous)
            except NotAllowed:
                # After STOP or the end of the grant, further control words are refused.
                if self._may_move():
                    raise
            else:
                if self._may_move():
                    return
        state = await self.state()
        if state is State.OPERATION_ENABLED:
            # The quick stop that STOP sent is still under way, or was lost.
            await self.quick_stop()
        if state in (State.FAULT, State.FAULT_REACTION):
            return
        # Without power an axis that still moves would coast.
        await self._require_rest(CLEANUP_TIMEOUT_S / 2)
        await self.go_to(State.SWITCH_ON_DISABLED)

    async def _leave_as_before(self, before: State, mode: Mode, previous: Mode) -> None:
        state = await self.state()
        if state is State.OPERATION_ENABLED:
            await self.halt_and_wait(CLEANUP_TIMEOUT_S / 2)
            state = await self.state()
        if before is State.OPERATION_ENABLED and state is State.OPERATION_ENABLED:
            # Halt is released only after the setpoint is at the actual position, in this mode
            # and in the mode that is restored.
            for aimed in dict.fromkeys((mode, previous)):
                await self.aim_here(aimed)
            if mode is Mode.PP:
                stay = cia402.ENABLE_OPERATION | cia402.HALT | cia402.CHANGE_IMMEDIATELY
                await self.control(stay | cia402.NEW_SET_POINT)
                await self.control(stay)
            await self.control(cia402.ENABLE_OPERATION)
            return
        if state in (State.FAULT, State.FAULT_REACTION):
            return
        await self.go_to(
            before if before in (State.READY, State.SWITCHED_ON) else State.SWITCH_ON_DISABLED
        )
