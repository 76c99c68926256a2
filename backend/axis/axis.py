"""One axis: its units, and the two context managers that carry safety.

`Axis.restoring` puts parameters back and `Axis.enabled` leaves Operation enabled, on every way
out. Their cleanup is shielded from cancellation, has a deadline, and reports what it left.
"""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager

from backend.axis import restoring
from backend.axis.cyclic import CyclicSession
from backend.axis.restoring import CLEANUP_TIMEOUT_S, shielded
from backend.axis.scaled import ScaledAxis
from backend.axis.stop.quick_stop import quick_stop_keys, raise_quick_stop
from backend.drive.drive import Drive
from backend.drive.optional import existing, torque_limits
from backend.motion.authority import UNATTENDED_S
from backend.motion.envelope import Envelope
from backend.motion.grant import Grant
from backend.people.identity import acting
from drivers import cia402
from drivers.cia402 import Mode, State
from drivers.errors import DriveError, LinkLost, LinkTimeout, NotAllowed, OutOfRange, ProtocolError
from drivers.texts.message import Text, text
from profiles.schema import Raw

__all__ = ["Axis", "Envelope"]


class Axis(ScaledAxis):
    """Power state and motion permission of one drive."""

    def __init__(self, drive: Drive) -> None:
        super().__init__(drive)
        #: A person enabled it by a transition, and nobody took that back here.
        self._left_enabled = False
        #: Time for a brake that opens by itself after enabling, once a motion met it closed [s].
        self.brake_wait_s = 0.0
        #: The page by which it was left enabled; None where it was no page.
        self.enabled_by: str | None = None
        self._standing: Grant | None = None
        #: Called with the reason when the axis must not stay enabled; power must be switched off.
        self.unattended: Callable[[Text], None] = lambda _why: None

    @property
    def left_enabled(self) -> bool:
        """A person enabled it by a transition, and nobody took that back."""
        return self._left_enabled and not self.stopped

    def forget(self) -> None:
        """The drive restarted or its gearing changed."""
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
            NotAllowed: the drive stays where it is, or STOP was pressed meanwhile.
        """
        await self.require_stop_delivered()
        # In a running exchange the loop keeps the setpoints where the axis is.
        aims = self.cyclic_power() is None
        with self.granted(f"to “{goal.value}”"):
            if mode is not None:
                if aims:
                    # One that is enabled already would follow a stale setpoint of the new mode.
                    await self.aim_here(mode)
                await self.set_mode(mode)
            if goal is State.OPERATION_ENABLED and aims:
                await self.aim_here()
            # Noted before the word goes out: whatever happens on the way, it may be enabled then.
            self._leave_enabled(goal is State.OPERATION_ENABLED)
            await self.go_to(goal)

    def _leave_enabled(self, enabled: bool) -> None:
        """A person leaves the axis enabled from here on, or does so no longer."""
        actor = acting.get()
        self._left_enabled = enabled
        self.enabled_by = actor.connection if enabled and actor is not None else None
        if enabled:
            # A page is watched, and its end takes the power off; a script has no sign of life.
            lasts_s = math.inf if self.enabled_by is not None else UNATTENDED_S
            drive = self.drive
            self._standing = drive.authority.standing(
                drive.id, "left enabled", lasts_s=lasts_s, ended=self.unattended
            )
        elif self._standing is not None:
            self.drive.authority.end(self._standing)
            self._standing = None

    async def let_go(self) -> None:
        """Take the power off an axis that a person enabled here and left enabled.

        For when nobody looks after it any more: the server ends, or the axis leaves the bench.

        Raises:
            DriveError: the drive does not take it.
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
            LinkTimeout: not at standstill in time even so; the message says what to do.
        """
        await self.control(cia402.ENABLE_OPERATION | cia402.HALT)
        if await self.standstill(timeout_s):
            return
        await self.quick_stop()
        await self._require_rest(timeout_s)

    async def _require_rest(self, timeout_s: float) -> None:
        """Raises LinkTimeout when the axis still moves after a quick stop."""
        if not await self.standstill(timeout_s):
            raise LinkTimeout(
                "axis.still-moves-after-quick", drive=self.drive.name, timeout_s=timeout_s
            )

    async def standstill(self, timeout_s: float) -> bool:
        """Whether the axis stopped (position unchanged over 30 ms) within the time.

        Two readings are compared at least: a busy computer or a slow bus may take longer for one.
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

    # --- what must be undone ----------------------------------------------------------

    def restoring(self, *keys: str) -> AbstractAsyncContextManager[dict[str, Raw]]:
        """Put these parameters back to what they are now, on every exit.

        Raises:
            RestoreFailed: on leaving, naming what could not be restored.
        """
        return restoring.restoring(self.drive, *keys)

    @asynccontextmanager
    async def enabled(self, mode: Mode, envelope: Envelope) -> AsyncIterator[None]:
        """Operation enabled in ``mode`` with the drive's torque limited by ``envelope``.

        STOP brakes at least as hard meanwhile as the profile's deceleration that was set before.

        On leaving, the axis is stopped, and back to the power state and mode it was
        in. The mode is set before enabling, at standstill, as some families demand.

        Raises:
            NotAllowed: the axis cannot be enabled, with the cause.
        """
        drive = self.drive
        if self.cyclic_power() is not None:
            raise NotAllowed("axis.profile-homing-modes-not", drive=drive.name)
        await self.require_planned_scales()
        with self.granted(cia402.MODE_NAMES[mode], envelope):
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
            # A stale setpoint must not start to move the axis: neither at the change of mode,
            # where it is enabled already, nor when it is enabled.
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
        """Operation enabled through the loop; braked and disabled on every way out.

        ``by_increments`` is for the small move that teaches a scale; every other motion needs
        scales that are certain.

        Raises:
            ScaleUnknown: they are not.
            NotAllowed: it cannot be enabled, the loop ended the motion, or the drive has a fault
                at its end. Where the drive has a fault, the message names it.
        """
        if not by_increments:
            await self.require_planned_scales()
        with self.granted(cia402.MODE_NAMES[mode]):
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
        """A fault after the last look at the motion must not pass for a motion that went well."""
        if await self.state() in (State.FAULT, State.FAULT_REACTION):
            error = NotAllowed("axis.fault-end-motion", drive=self.drive.name)
            await self._name_fault(error)
            raise error

    async def _name_fault(self, error: NotAllowed) -> None:
        """The loop sees only that the drive left Operation enabled; the drive has the reason."""
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
        """Brake and take the power off through the loop; nothing interrupts this.

        Raises:
            DriveError: the loop does not do it. A stop is pending then: what moves is not known.
        """
        try:
            await shielded(lambda: self._leave_cyclic(session), timeout_s, self.drive.name)
        except DriveError:
            self.stop_pending = True
            raise

    async def _leave_cyclic(self, session: CyclicSession) -> None:
        if not session.running:
            # Ended in order it has braked everything; broken off it has left that to the drive.
            self.stop_pending = self.stop_pending or bool(session.trouble)
            return
        await session.cyclic.halt(session.station(self.drive))
        await self.standstill(2.0)
        if await self.state() not in (State.FAULT, State.FAULT_REACTION):
            await self.go_to_cyclic(session, State.SWITCH_ON_DISABLED, None, timeout_s=5.0)

    async def restorable_mode(self) -> list[str]:
        """The mode's key, unless the drive shows one that cannot be written (none, at power-on)."""
        key = self.drive.key("mode")
        if key is None:
            return []
        try:
            self.drive.check(self.drive.parameter(key), await self.drive.raw(key))
        except OutOfRange:
            return []
        return [key]

    async def limit_torque(self, limits: list[str], percent: float) -> None:
        """Lower these limits of the drive to ``percent`` of rated torque; none is raised."""
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
                # Families that keep the limit of negative torque as a negative number.
                await self.drive.write(key, -raw)

    async def aim_here(self, mode: Mode | None = None) -> None:
        """Setpoint to "stay": of ``mode``, or of the mode that the drive shows."""
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
        """Neither STOP was pressed nor the permission of this work has ended."""
        return not self.stopped and self.drive.authority.may_move(self.drive.id)

    async def _leave(self, before: State, mode: Mode, previous: Mode) -> None:
        """To rest, and to the power state of before; without permission, to Switch on disabled."""
        if self._may_move():
            try:
                await self._leave_as_before(before, mode, previous)
            except NotAllowed:
                # STOP or the end of the permission refuses the words that are still to come.
                if self._may_move():
                    raise
            else:
                if self._may_move():
                    return
        state = await self.state()
        if state is State.OPERATION_ENABLED:
            # The write of STOP itself is still under way, or was lost.
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
            # Halt is released only onto a setpoint that is where the axis is, in this
            # mode and in the one that comes back.
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
