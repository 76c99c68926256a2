"""The power state of one axis: CiA 402 control words, transitions, and STOP."""

from __future__ import annotations

import asyncio
import contextlib
import math
import time
from contextlib import AbstractContextManager
from functools import partial

from backend.axes.axis import loop
from backend.axes.axis.causes import hints
from backend.axes.axis.cyclic import CyclicSession
from backend.axes.axis.restoring import shielded
from backend.axes.axis.stop.braking import brake_then_quick_stop, quick_stop_coasts
from backend.axes.axis.stop.facts import StepCode, StopStep
from backend.axes.axis.stop.settings import settings_keys
from backend.axes.drive.drive import Drive
from backend.axes.drive.faults import read_active_faults
from backend.axes.drive.ports import address_of
from backend.axes.motion.authority import Ended
from backend.axes.motion.envelope import Envelope
from backend.axes.motion.grant import Grant
from backend.axes.motion.stopping import stops
from backend.foundation.people.identity import arrived_s
from drivers import cia402
from drivers.cia402 import Mode, State
from drivers.errors import DriveError, LinkLost, LinkTimeout, NotAllowed, ProtocolError
from drivers.link import OwnsPowerState
from drivers.objects.codec import encode
from drivers.objects.dialect import dialect_of
from drivers.texts.message import Text, joined, text
from drivers.texts.modes import mode_text
from drivers.texts.states import state_text
from profiles.schema import Fault

#: Longest time that one change of the power state may take, brake and bus included [s].
STATE_TIMEOUT_S = 3.0
_POLL_S = 0.01


class PowerState:
    """State machine of one drive, by single control words or the cyclic exchange of its bus."""

    def __init__(self, drive: Drive) -> None:
        self.drive = drive
        pause = drive.profile.quirk("enable_pause")
        self._enable_pause_s = ((pause.milliseconds if pause else None) or 0.0) / 1000.0
        #: Control word for quick stop of this family: the only one printed in its manual.
        self._stop_word = dialect_of(drive.profile).quick_stop
        #: The last control word written, to form rising edges.
        self.control_word = 0
        #: The running cyclic exchange of the axis' bus, which then writes the control word.
        self.session: CyclicSession | None = None
        #: STOP was pressed: no control word that enables may be sent until a new command is given.
        self.stopped = False
        #: Number of commands by people that have permitted motion so far.
        self.permits = 0
        #: When STOP was pressed last (`time.monotonic`).
        self.stop_pressed_s = -math.inf
        #: A stop did not reach the drive; `repeat_stop` sends it again once the drive answers.
        self.stop_pending = False
        self._repeating = asyncio.Lock()
        #: A quick stop was sent, and no enabling control word since. Halt contains the enabling
        #: bits and must not follow: the drive would leave the quick stop (CiA 402-2, transition
        #: 16).
        self.quick_stop_out = False
        #: Steps of STOP since it was pressed, and the time of the press (`time.monotonic`).
        self.stop_steps: list[StopStep] = []
        self._stop_began_s = time.monotonic()
        #: 605Ah as it was before STOP changed it; None where STOP did not.
        self.option_before: int | None = None

    def permit(self) -> None:
        """Allow enabling again, until the next STOP, as a person gave a new command.

        Never called by work in progress, so that nothing enables a stopped axis again.

        Raises:
            NotAllowed: STOP was pressed after the command had been given. The command was waiting
                then: for its turn, the rest of its request body or the start of an exchange.
        """
        given_s = arrived_s.get()
        if given_s is not None and given_s <= self.stop_pressed_s:
            raise NotAllowed("axis.stop-pressed-since", drive=self.drive.name)
        self.stopped = self.quick_stop_out = False
        self.permits += 1

    async def status_word(self) -> int:
        """Status word (6041h), read now."""
        return await self.drive.raw(self.drive.require("status_word"))

    async def state(self) -> State:
        """CiA 402 power state, read now."""
        return self.drive.decode_state(await self.status_word())

    async def control(self, word: int) -> None:
        """Write the control word (6040h).

        Raises:
            NotGranted: the word enables or moves the axis, and the calling work holds no grant.
            NotAllowed: STOP was pressed and the word would enable the axis again, or the cyclic
                exchange writes the control word.
        """
        if self.cyclic_power() is not None:
            raise NotAllowed("axis.cyclic-exchange-writes-control", drive=self.drive.name)
        if word == cia402.QUICK_STOP:
            word, self.quick_stop_out = self._stop_word, True
        key = self.drive.require("control_word")
        if not stops(self.drive.profile, self.drive.parameter(key), word):
            await self._control_with_grant(key, word)
            return
        await self.drive.relax(key, word)
        self.control_word = word

    async def _control_with_grant(self, key: str, word: int) -> None:
        """Write a word by which the drive may enter, or move in, Operation enabled."""
        if self.stopped:
            raise NotAllowed("axis.stop-pressed", drive=self.drive.name)
        self.drive.require_identity()
        grant = self.grant(key)
        self.drive.require_grant(grant, key)
        self.quick_stop_out = False
        await self.drive.command(key, word, grant)
        self.control_word = word

    def grant(self, key: str | None = None) -> Grant:
        """The grant that the calling work holds.

        Raises:
            NotGranted: it holds none.
        """
        return self.drive.authority.require_held(self.drive.id, self.drive.name, key)

    def granted(
        self,
        purpose: str | Text,
        envelope: Envelope | None = None,
        *,
        keys: frozenset[str] | None = None,
        ended: Ended | None = None,
    ) -> AbstractContextManager[Grant]:
        """A grant for this axis for the duration of the block; see `MotionAuthority.granted`.

        Raises:
            Busy: other work holds one.
        """
        drive = self.drive
        return drive.authority.granted(
            drive.id, drive.name, purpose, envelope=envelope, keys=keys, ended=ended
        )

    def cyclic_power(self) -> OwnsPowerState | None:
        """The cyclic loop, while it runs and owns this axis' control word."""
        session = self.session
        if session is None or not session.running:
            return None
        power = session.power()
        # A CANopen drive without cyclic modes keeps receiving its commands by SDO.
        owns = getattr(power, "owns", None)
        return power if owns is None or owns(session.station(self.drive)) else None

    async def go_to_cyclic(
        self, session: CyclicSession, goal: State, mode: Mode | None, timeout_s: float
    ) -> None:
        """Have the loop change the power state to ``goal``.

        Raises:
            NotAllowed: the drive does not reach it (the message contains the known cause), or STOP
                was pressed.
        """
        power = session.power()
        if power is None:
            if mode is not None:
                await self.set_mode(mode)
            await self.go_to(goal, timeout_s)
            return
        if goal is State.OPERATION_ENABLED:
            await self.require_stop_delivered()
            await self.read_stop_settings()
        if self.stopped and goal is State.OPERATION_ENABLED:
            raise NotAllowed("axis.stop-pressed", drive=self.drive.name)
        if goal is State.OPERATION_ENABLED and await self.state() is State.FAULT:
            raise await self._refused(State.FAULT, goal)
        try:
            if goal is State.OPERATION_ENABLED or mode is not None:
                await loop.drive_to(session, self.drive, goal, mode, self.grant())
            else:
                await loop.lower(session, self.drive, goal)
            await self._until_there(goal, timeout_s)
        except BaseException:
            # The loop would go on trying and enable the axis when nobody waits for it any more:
            # when the main power returns, or a fault disappears.
            if goal is State.OPERATION_ENABLED:
                try:
                    off = State.SWITCH_ON_DISABLED
                    cut = partial(loop.lower, session, self.drive, off)
                    await shielded(cut, timeout_s, self.drive.name)
                except DriveError:
                    self.stop_pending = True
            raise

    async def _until_there(self, goal: State, timeout_s: float) -> None:
        deadline = time.monotonic() + timeout_s
        while True:
            state = await self.state()
            if self.stopped and goal is State.OPERATION_ENABLED:
                raise NotAllowed("axis.stop-pressed", drive=self.drive.name)
            if state is goal:
                return
            if state is State.FAULT or time.monotonic() > deadline:
                raise await self._refused(state, goal)
            await asyncio.sleep(_POLL_S)

    async def go_to(self, goal: State, timeout_s: float = STATE_TIMEOUT_S) -> State:
        """Change the power state to ``goal``, one transition after the other.

        A fault is reset only on the way to Switch on disabled. Enabling never resets one, so that
        a drive which trips on being enabled is not enabled repeatedly.

        Raises:
            NotAllowed: the drive does not reach the state; the message contains the known cause.
        """
        if self.session is not None and self.cyclic_power() is not None:
            await self.go_to_cyclic(self.session, goal, None, timeout_s)
            return goal
        if goal is State.OPERATION_ENABLED:
            await self.read_stop_settings()
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
            # A quick stop may continue to Switch on disabled (605Ah = 0 to 4).
            if goal is State.QUICK_STOP_ACTIVE and state is State.SWITCH_ON_DISABLED:
                return state
            while state is before and time.monotonic() < deadline:
                await asyncio.sleep(_POLL_S)
                state = await self.state()
            if state is before:
                raise await self._refused(state, goal)
        return state

    async def _refused(self, state: State, goal: State) -> NotAllowed:
        causes = await self.blocked_by()
        if goal is State.OPERATION_ENABLED:
            causes += await hints(self.drive)
        why = joined(causes) if causes else text("axis.cause-none")
        error = NotAllowed(
            "axis.stays-not-go",
            drive=self.drive.name,
            remedy=(
                text("axis.try-remove-cause-named-try")
                if causes
                else text("axis.try-see-alarms-page")
            ),
            state=state_text(state),
            goal=state_text(goal),
            why=why,
        )
        error.names_faults = state in (State.FAULT, State.FAULT_REACTION)
        return error

    async def blocked_by(self) -> list[Text]:
        """Known causes that keep the axis from being enabled."""
        drive = self.drive
        causes: list[Text] = []
        word = await self.status_word()
        state = drive.decode_state(word)
        if state in (State.FAULT, State.FAULT_REACTION):
            faults = await self.active_faults()
            names = ", ".join(f"{fault.code} {fault.name}" for fault in faults)
            causes.append(
                text("axis.cause-fault", faults=names) if names else text("axis.cause-a-fault")
            )
        own = drive.profile.quirk("own_status_word") is not None
        enabled_states = (State.READY, State.SWITCHED_ON)
        if not own and state in enabled_states and not word & cia402.STATUS_VOLTAGE_ENABLED:
            causes.append(text("axis.cause-no-power"))
        if not own and not word & cia402.STATUS_REMOTE and state in enabled_states:
            causes.append(text("axis.cause-local"))
        waiting = [k for k, until in drive.pending.items() if until == "write_settings"]
        if waiting:
            causes.append(text("axis.cause-write-settings", count=len(waiting)))
        return causes

    async def active_faults(self) -> list[Fault]:
        """Faults and warnings that the drive reports, read now.

        Raises:
            DriveError: the drive does not answer, so its faults are not known.
        """
        return await read_active_faults(self.drive)

    async def reset_fault(self) -> State:
        """Reset a fault by a rising edge of the fault-reset bit, then go to Switch on disabled.

        Does nothing to an axis without a fault, as the control words would switch off the power of
        a moving axis.

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

    async def set_mode(self, mode: Mode) -> None:
        """Write 6060h and wait until 6061h shows it.

        Raises:
            NotAllowed: the family or the drive does not have this mode.
        """
        drive = self.drive
        if int(mode) not in drive.modes:
            raise NotAllowed(
                "axis.no-mode",
                drive=drive.name,
                profile_title=drive.profile.title,
                mode_names=mode_text(mode),
            )
        key = drive.require("mode")
        await drive.command(key, int(mode), self.grant(key))
        display = drive.key("mode_display")
        if display is None:
            return
        deadline = time.monotonic() + 1.0
        while await drive.raw(display) != int(mode):
            if time.monotonic() > deadline:
                raise NotAllowed("axis.not-change", drive=drive.name, mode_names=mode_text(mode))
            await asyncio.sleep(_POLL_S)

    def forbid(self) -> None:
        """Record that STOP was pressed: work in progress or requested before may not enable."""
        self.stopped = True
        self.stop_pressed_s = time.monotonic()

    async def stop(self) -> None:
        """STOP by a person: quick stop, and no work in progress may enable the axis again."""
        self.forbid()
        self.stop_steps, self._stop_began_s = [], time.monotonic()
        await self.quick_stop()

    def stop_step(
        self,
        code: StepCode,
        problem: Text | None = None,
        parameter: str | None = None,
        figures: dict[str, float] | None = None,
    ) -> None:
        """Record a step of STOP; with ``problem`` the step was tried and failed."""
        at_s = time.monotonic() - self._stop_began_s
        self.stop_steps.append(
            StopStep(code, at_s, problem is None, parameter, figures or {}, problem)
        )

    async def quick_stop(self) -> None:
        """Stop the axis now, as a rule by one write; harmless at standstill.

        Where a quick stop would coast (605Ah = 0, or torque mode of some families), the axis is
        first braked otherwise; see `brake_then_quick_stop`. Where the stop does not reach the
        drive, `stop_pending` is set.
        """
        try:
            if self.session is not None and self.cyclic_power() is not None:
                await self.session.cyclic.halt(self.session.station(self.drive))
                self.stop_step(StepCode.HALT)
            elif quick_stop_coasts(self.drive):
                await brake_then_quick_stop(self)
            else:
                await self.send_quick_stop()
                self.stop_step(StepCode.QUICK_STOP)
        except BaseException:
            # Whatever prevented it: also an exchange that just ended, a drive that was busy and
            # refused the word, and a caller that was cancelled.
            self.stop_pending = True
            raise
        self.stop_pending = False

    async def read_stop_settings(self) -> None:
        """Read how the drive brakes on STOP, so that STOP itself need not; raises no DriveError."""
        with contextlib.suppress(DriveError):
            await self.drive.read_many(settings_keys(self.drive))

    async def send_quick_stop(self) -> None:
        """Send one quick-stop word by the first port that delivers it.

        Raises:
            DriveError: no port delivers it; the error is that of the first port.
        """
        drive = self.drive
        key = drive.require("control_word")
        try:
            await self.control(cia402.QUICK_STOP)
        except (LinkLost, LinkTimeout, ProtocolError):
            parameter = drive.parameter(key)
            first = drive.port_for(parameter)
            data = encode(parameter.type, self._stop_word)
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
        """Send the pending stop; return whether one was pending and is delivered now."""
        # The monitor and the supervision of STOP both repeat it; once is enough.
        async with self._repeating:
            if not self.stop_pending:
                return False
            try:
                await self.quick_stop()
            except DriveError:
                return False
            return True

    async def require_stop_delivered(self) -> None:
        """Deliver a pending stop before any new command.

        Raises:
            DriveError: the stop still does not reach the drive.
        """
        if self.stop_pending:
            await self.quick_stop()
