"""One axis: its power state, its modes, and the two context managers that carry safety.

`Axis.restoring` puts parameters back and `Axis.enabled` leaves Operation enabled, on every
way out. Their cleanup is shielded from cancellation, has a deadline of its own, and reports
what it could not restore.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass

from backend.cyclic import CyclicSession
from backend.drive import Drive, Reading, address_of
from backend.faults import active_faults, fault_keys
from backend.units import AxisUnits, read_units
from drivers import cia402
from drivers.cia402 import Mode, State
from drivers.codec import encode
from drivers.errors import (
    DriveError,
    LinkLost,
    LinkTimeout,
    NotAllowed,
    OutOfRange,
    ProtocolError,
)
from drivers.link import OwnsPowerState
from profiles.schema import Fault, Raw

#: Longest time that one change of the power state may take (brake and bus included).
STATE_TIMEOUT_S = 3.0
#: Deadline of a cleanup.
CLEANUP_TIMEOUT_S = 5.0
_POLL_S = 0.01


@dataclass(frozen=True, slots=True)
class Envelope:
    """Limits of one motion, in the axis' units: travel from the start point in rev, rpm, %, s."""

    travel_rev: float
    speed_rpm: float
    torque_percent: float
    time_s: float


class RestoreFailed(DriveError):
    """A cleanup could not put something back; the message lists what."""

    kind = "restore-failed"


class Axis:
    """Power state and motion permission of one drive."""

    def __init__(self, drive: Drive) -> None:
        self.drive = drive
        self._units: AxisUnits | None = None
        pause = drive.profile.quirk("enable_pause")
        self._enable_pause_s = ((pause.milliseconds if pause else None) or 0.0) / 1000.0
        #: The last control word written, for edges.
        self.control_word = 0
        #: The running cyclic exchange of the axis' bus, which then writes the control word.
        self.session: CyclicSession | None = None
        #: STOP was pressed: no word that enables may be sent until a new command is given.
        self.stopped = False
        #: A stop did not reach the drive; `repeat_stop` sends it again once the drive answers.
        self.owes_stop = False
        self._unit_raws: dict[str, Raw | None] = {}
        drive.listen(self._units_may_have_changed)

    def permit(self) -> None:
        """A person gave a new command: enabling is allowed again, until the next STOP.

        Never called by work in progress, so that nothing enables again what was stopped.
        """
        self.stopped = False

    # --- words ------------------------------------------------------------------------

    async def units(self) -> AxisUnits:
        """Units with the present gearing, read once until `forget`."""
        if self._units is None:
            units = await read_units(self.drive)
            known = self.drive.readings
            self._unit_raws = {
                key: known[key].raw for key in self.drive.profile.unit_keys if key in known
            }
            self._units = units
        return self._units

    def _units_may_have_changed(self, readings: list[Reading]) -> None:
        """Whoever wrote the gearing (a page, a set, the panel): units are read anew."""
        for reading in readings:
            known = self._unit_raws.get(reading.key)
            if known is not None and reading.raw is not None and reading.raw != known:
                self._units = None

    def forget(self) -> None:
        """The drive restarted or its gearing changed."""
        self._units = None
        self.control_word = 0

    async def status_word(self) -> int:
        """6041h, read now."""
        return await self.drive.raw(self.drive.require("status_word"))

    async def state(self) -> State:
        """CiA 402 power state, read now."""
        return self.drive.decode_state(await self.status_word())

    async def control(self, word: int) -> None:
        """Write 6040h.

        Raises:
            NotAllowed: STOP was pressed and the word would enable the axis again.
        """
        if self.cyclic_power() is not None:
            raise NotAllowed(
                f"{self.drive.name}: the cyclic exchange writes the control word",
                drive=self.drive.name,
                remedy="end the cyclic exchange, or use a cyclic mode",
            )
        enables = word & cia402.ENABLE_OPERATION == cia402.ENABLE_OPERATION
        if self.stopped and enables:
            raise NotAllowed(
                f"{self.drive.name}: STOP was pressed",
                drive=self.drive.name,
                remedy="start a new motion when it is safe",
            )
        if enables:
            self.drive.require_identity()
        await self.drive.command(self.drive.require("control_word"), word)
        self.control_word = word

    async def position_raw(self) -> int:
        """Actual position in increments."""
        return await self.drive.raw(self.drive.require("position_actual"))

    async def velocity_raw(self) -> int:
        """Actual velocity in the drive's unit."""
        return await self.drive.raw(self.drive.require("velocity_actual"))

    # --- power state ------------------------------------------------------------------

    def cyclic_power(self) -> OwnsPowerState | None:
        """The cyclic loop, while it runs and owns this axis' control word."""
        session = self.session
        if session is None or not session.running:
            return None
        power = session.power()
        # A CANopen drive without cyclic modes keeps taking its commands by SDO.
        owns = getattr(power, "owns", None)
        return power if owns is None or owns(session.station(self.drive)) else None

    async def go_to_cyclic(
        self, session: CyclicSession, goal: State, mode: Mode | None, timeout_s: float
    ) -> None:
        """Let the loop walk the state machine.

        Raises:
            NotAllowed: the drive stays where it is, with the cause that is known; or STOP.
        """
        power = session.power()
        if power is None:
            if mode is not None:
                await self.set_mode(mode)
            await self.go_to(goal, timeout_s)
            return
        if self.stopped and goal is State.OPERATION_ENABLED:
            raise NotAllowed(f"{self.drive.name}: STOP was pressed", drive=self.drive.name)
        station = session.station(self.drive)
        if goal is State.OPERATION_ENABLED and await self.state() is State.FAULT:
            raise await self._refused(State.FAULT, goal)
        await power.drive_to(station, goal, None if mode is None else int(mode))
        deadline = time.monotonic() + timeout_s
        while (state := await self.state()) is not goal:
            if state is State.FAULT or time.monotonic() > deadline:
                raise await self._refused(state, goal)
            await asyncio.sleep(_POLL_S)

    async def go_to(self, goal: State, timeout_s: float = STATE_TIMEOUT_S) -> State:
        """Walk the state machine to ``goal``, one transition after the other.

        A fault is reset only on the way to Switch on disabled: enabling never resets one, so
        that a drive which trips on being enabled is not enabled again and again.

        Raises:
            NotAllowed: the drive stays where it is; the message gives the cause that is known.
        """
        if self.session is not None and self.cyclic_power() is not None:
            await self.go_to_cyclic(self.session, goal, None, timeout_s)
            return goal
        deadline = time.monotonic() + timeout_s
        state = await self.state()
        while (word := cia402.next_control_word(state, goal, self.control_word)) is not None or (
            state is not goal
        ):
            faulty = state in (State.FAULT, State.FAULT_REACTION)
            if (faulty and goal is not State.SWITCH_ON_DISABLED) or time.monotonic() > deadline:
                raise await self._refused(state, goal)
            if word is not None:
                await self.control(word)
                if self._enable_pause_s:
                    await asyncio.sleep(self._enable_pause_s)
            before = state
            state = await self.state()
            # A quick stop may fall through to Switch on disabled (605Ah 0 to 4).
            if goal is State.QUICK_STOP_ACTIVE and state is State.SWITCH_ON_DISABLED:
                return state
            while state is before and time.monotonic() < deadline:
                await asyncio.sleep(_POLL_S)
                state = await self.state()
            if state is before:
                raise await self._refused(state, goal)
        return state

    async def transition(self, goal: State, mode: Mode | None) -> None:
        """Change power state and, where given, the mode, without moving.

        Raises:
            NotAllowed: the drive stays where it is, or STOP was pressed meanwhile.
        """
        await self._require_stop_delivered()
        # In a running exchange the loop keeps the set-points where the axis stands.
        aims = self.cyclic_power() is None
        if mode is not None:
            if aims:
                # An axis that is enabled already would follow a stale set-point of the new mode.
                await self.aim_here(mode)
            await self.set_mode(mode)
        if goal is State.OPERATION_ENABLED and aims:
            await self.aim_here()
        await self.go_to(goal)

    async def _refused(self, state: State, goal: State) -> NotAllowed:
        causes = await self.blocked_by()
        why = "; ".join(causes) or "the drive gives no reason"
        return NotAllowed(
            f"{self.drive.name} stays in “{state.value}” and does not go to “{goal.value}”: {why}",
            drive=self.drive.name,
            remedy="remove the cause named and try again" if causes else "see the Alarms page",
        )

    async def blocked_by(self) -> list[str]:
        """Known causes that keep the axis from being enabled, in words."""
        drive = self.drive
        causes: list[str] = []
        word = await self.status_word()
        state = drive.decode_state(word)
        if state in (State.FAULT, State.FAULT_REACTION):
            faults = await self.active_faults()
            names = ", ".join(f"{fault.code} {fault.name}" for fault in faults) or "unknown"
            causes.append(f"fault present: {names}")
        own = drive.profile.quirk("own_status_word") is not None
        enabled_states = (State.READY, State.SWITCHED_ON)
        if not own and state in enabled_states and not word & cia402.STATUS_VOLTAGE_ENABLED:
            causes.append("no main power: the DC bus is not charged, or STO is open")
        if not own and not word & cia402.STATUS_REMOTE and state in enabled_states:
            causes.append("the drive is not under bus control (remote bit is 0)")
        waiting = [k for k, why in drive.pending.items() if why == "write_settings"]
        if waiting:
            causes.append(f"write-settings pending for {len(waiting)} parameters")
        return causes

    async def active_faults(self) -> list[Fault]:
        """What the drive reports now, read now."""
        return active_faults(self.drive, await self.drive.read_many(fault_keys(self.drive)))

    async def reset_fault(self) -> State:
        """Rising edge of the fault-reset bit, then Switch on disabled.

        Does nothing to an axis that has no fault: the words would cut the power of one that moves.

        Raises:
            NotAllowed: the fault is still present.
        """
        power = self.cyclic_power()
        if power is not None and self.session is not None:
            await power.reset_fault(self.session.station(self.drive))
            deadline = time.monotonic() + STATE_TIMEOUT_S
            while (state := await self.state()) is State.FAULT:
                if time.monotonic() > deadline:
                    raise await self._refused(state, State.SWITCH_ON_DISABLED)
                await asyncio.sleep(_POLL_S)
            return state
        if (state := await self.state()) not in (State.FAULT, State.FAULT_REACTION):
            return state
        await self.control(cia402.DISABLE_VOLTAGE)
        return await self.go_to(State.SWITCH_ON_DISABLED)

    # --- motion -----------------------------------------------------------------------

    async def set_mode(self, mode: Mode) -> None:
        """Write 6060h and wait until 6061h shows it.

        Raises:
            NotAllowed: the family or the drive does not have this mode.
        """
        drive = self.drive
        if int(mode) not in drive.profile.supported_modes:
            raise NotAllowed(
                f"{drive.name}: {drive.profile.title} has no {cia402.MODE_NAMES[mode]} mode",
                drive=drive.name,
                remedy="choose one of its modes",
            )
        await drive.command(drive.require("mode"), int(mode))
        display = drive.key("mode_display")
        if display is None:
            return
        deadline = time.monotonic() + 1.0
        while await drive.raw(display) != int(mode):
            if time.monotonic() > deadline:
                raise NotAllowed(
                    f"{drive.name} does not change to {cia402.MODE_NAMES[mode]}",
                    drive=drive.name,
                    remedy="stop the axis and try again",
                )
            await asyncio.sleep(_POLL_S)

    async def stop(self) -> None:
        """STOP by a person: quick stop, and nothing in progress may enable the axis again."""
        self.stopped = True
        await self.quick_stop()

    async def quick_stop(self) -> None:
        """Stop now, by one write; harmless when nothing moves.

        Where it does not reach the drive, `owes_stop` is set.
        """
        try:
            if self.session is not None and self.cyclic_power() is not None:
                await self.session.cyclic.halt(self.session.station(self.drive))
            else:
                await self._quick_stop_by_any_port()
        except (LinkLost, LinkTimeout, ProtocolError):
            self.owes_stop = True
            raise
        self.owes_stop = False

    async def _quick_stop_by_any_port(self) -> None:
        """The first port's error is raised when no port takes the word."""
        drive = self.drive
        key = drive.require("control_word")
        try:
            await self.control(cia402.QUICK_STOP)
        except (LinkLost, LinkTimeout, ProtocolError):
            parameter = drive.parameter(key)
            first = drive.port_for(parameter)
            data = encode(parameter.type, cia402.QUICK_STOP)
            for port in drive.ports:
                if port is first or not port.carries(parameter):
                    continue
                try:
                    await port.link.write(port.station, address_of(parameter), data)
                except DriveError:
                    continue
                return
            raise

    async def repeat_stop(self) -> bool:
        """Send the stop that is owed; returns whether one was owed and is delivered now."""
        if not self.owes_stop:
            return False
        try:
            await self.quick_stop()
        except DriveError:
            return False
        return True

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
                f"{self.drive.name} still moves {timeout_s:g} s after quick stop",
                drive=self.drive.name,
                remedy="use the machine's emergency stop",
            )

    async def standstill(self, timeout_s: float) -> bool:
        """Whether the axis came to rest (position unchanged over 30 ms) within the time."""
        units = await self.units()
        tolerance = max(2, units.position_raw(0.0005))
        deadline = time.monotonic() + timeout_s
        last = await self.position_raw()
        while time.monotonic() < deadline:
            await asyncio.sleep(0.03)
            now = await self.position_raw()
            if abs(now - last) <= tolerance:
                return True
            last = now
        return False

    # --- what must be undone ----------------------------------------------------------

    @asynccontextmanager
    async def restoring(self, *keys: str) -> AsyncIterator[dict[str, Raw]]:
        """Put these parameters back to what they are now, on every exit.

        Raises:
            RestoreFailed: on leaving, naming what could not be put back.
        """
        before: dict[str, Raw] = {}
        for key in keys:
            reading = await self.drive.read(key)
            if reading.raw is not None:
                before[key] = reading.raw
        try:
            yield before
        except BaseException as error:
            await self._put_back(before, error)
            raise
        else:
            await self._put_back(before, None)

    async def _put_back(self, before: dict[str, Raw], earlier: BaseException | None) -> None:
        """Restore; what failed before is told as well, it may be an inner restore."""
        name = self.drive.name
        try:
            await shielded(lambda: self._restore(before), CLEANUP_TIMEOUT_S, name)
        except DriveError as error:
            if not isinstance(error, RestoreFailed):
                values = ", ".join(f"{key} (was {raw})" for key, raw in before.items())
                error = RestoreFailed(
                    f"{name}: perhaps not restored: {values}: {error.message}",
                    drive=name,
                    remedy="compare these values before the next motion",
                )
            if isinstance(earlier, DriveError):
                error.message = f"{earlier.message}; {error.message}"
                error.args = (error.message,)
            raise error from earlier

    async def _restore(self, before: dict[str, Raw]) -> None:
        failed: list[str] = []
        same = False
        for key, raw in before.items():
            try:
                if (await self.drive.read(key)).raw != raw:
                    if not same:
                        # The link may have been lost in between, and another drive be there now.
                        await self.drive.confirm_identity()
                        same = True
                    await self.drive.write(key, raw)
            except DriveError as error:
                failed.append(f"{key} (was {raw}): {error.message}")
        if failed:
            raise RestoreFailed(
                f"{self.drive.name}: not restored: {'; '.join(failed)}",
                drive=self.drive.name,
                remedy="write these values by hand before the next motion",
            )

    @asynccontextmanager
    async def enabled(self, mode: Mode, envelope: Envelope) -> AsyncIterator[None]:
        """Operation enabled in ``mode`` with the drive's torque limited by ``envelope``.

        On leaving, the axis is brought to rest, and back to the power state and mode it was
        in. The mode is set before enabling, at standstill, as some families demand.

        Raises:
            NotAllowed: the axis cannot be enabled, with the cause.
        """
        drive = self.drive
        if self.cyclic_power() is not None:
            raise NotAllowed(
                f"{drive.name}: profile and homing modes are not possible while the cyclic "
                "exchange runs",
                drive=drive.name,
                remedy="end the cyclic exchange, or use CSP, CSV or CST",
            )
        await self._require_stop_delivered()
        before = await self.state()
        if before is State.OPERATION_ENABLED and not await self.standstill(0.5):
            raise NotAllowed(
                f"{drive.name} is moving already",
                drive=drive.name,
                remedy="stop it first",
            )
        limits = [
            key
            for role in ("torque_limit_positive", "torque_limit_negative", "max_torque")
            if (key := drive.key(role)) is not None
        ]
        mode_keys = await self._restorable_mode()
        async with self.restoring(*limits, *mode_keys) as earlier:
            shown = next((earlier[key] for key in mode_keys if key in earlier), None)
            previous = Mode(int(shown)) if shown in set(Mode) else mode
            await self._limit_torque(limits, envelope.torque_percent)
            # A stale set-point must not start to move the axis: neither at the change of mode,
            # where it is enabled already, nor when it is enabled.
            await self.aim_here(mode)
            await self.set_mode(mode)
            await self.aim_here(mode)
            try:
                await self.go_to(State.OPERATION_ENABLED)
                yield
            finally:
                await self._leaving(before, mode, previous)

    async def _require_stop_delivered(self) -> None:
        """A stop that did not reach the drive comes before any new command.

        Raises:
            DriveError: it still does not reach it.
        """
        if self.owes_stop:
            await self.quick_stop()

    async def _leaving(self, before: State, mode: Mode, previous: Mode) -> None:
        try:
            await shielded(
                lambda: self._leave(before, mode, previous), CLEANUP_TIMEOUT_S, self.drive.name
            )
        except (LinkLost, LinkTimeout, ProtocolError):
            self.owes_stop = True
            raise

    async def _restorable_mode(self) -> list[str]:
        """The mode's key, unless the drive shows one that cannot be written (none, at power-on)."""
        key = self.drive.key("mode")
        if key is None:
            return []
        try:
            self.drive.check(self.drive.parameter(key), await self.drive.raw(key))
        except OutOfRange:
            return []
        return [key]

    async def _limit_torque(self, limits: list[str], percent: float) -> None:
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
        """Set-point to "stay": of ``mode``, or of the mode that the drive shows."""
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
            await drive.command(key, value)

    async def _leave(self, before: State, mode: Mode, previous: Mode) -> None:
        """To rest, and to the power state of before; after STOP, to Switch on disabled."""
        if not self.stopped:
            try:
                await self._leave_as_before(before, mode, previous)
            except NotAllowed:
                # STOP in the middle of it refuses the words that are still to come.
                if not self.stopped:
                    raise
            if not self.stopped:
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
            # Halt is released only onto a set-point that is where the axis stands, in this
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


async def shielded(cleanup: Callable[[], Awaitable[None]], timeout_s: float, drive: str) -> None:
    """Run a cleanup to its end even when the surrounding task is cancelled again.

    Raises:
        LinkTimeout: the cleanup itself took longer than ``timeout_s``.
    """

    async def bounded() -> None:
        try:
            async with asyncio.timeout(timeout_s):
                await cleanup()
        except TimeoutError as error:
            raise LinkTimeout(
                f"{drive}: restoring took longer than {timeout_s:g} s and was given up",
                drive=drive,
                remedy="check the axis: mode, torque limit and power state may not be restored",
            ) from error

    task = asyncio.create_task(bounded())
    cancelled: asyncio.CancelledError | None = None
    while not task.done():
        try:
            await asyncio.shield(task)
        except asyncio.CancelledError as error:
            cancelled = error
        except DriveError:
            break
    if cancelled is not None and task.exception() is None:
        raise cancelled
    task.result()
