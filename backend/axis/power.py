"""The power state of one axis: CiA 402 words, the way between states, and STOP."""

from __future__ import annotations

import asyncio
import contextlib
import math
import time
from contextlib import AbstractContextManager
from functools import partial

from backend.axis import loop
from backend.axis.causes import hints
from backend.axis.cyclic import CyclicSession
from backend.axis.restoring import shielded
from backend.axis.stop.braking import brake_then_quick_stop, quick_stop_coasts
from backend.axis.stop.facts import StepCode, StopStep
from backend.axis.stop.settings import settings_keys
from backend.drive.drive import Drive
from backend.drive.faults import read_active_faults
from backend.drive.ports import address_of
from backend.motion.authority import Ended
from backend.motion.envelope import Envelope
from backend.motion.grant import Grant
from backend.motion.stopping import stops
from backend.people.identity import arrived_s
from drivers import cia402
from drivers.cia402 import Mode, State
from drivers.codec import encode
from drivers.dialect import dialect_of
from drivers.errors import DriveError, LinkLost, LinkTimeout, NotAllowed, ProtocolError
from drivers.link import OwnsPowerState
from drivers.texts.message import Text, joined, text
from drivers.texts.states import state_text
from profiles.schema import Fault

#: Longest time that one change of the power state may take (brake and bus included).
STATE_TIMEOUT_S = 3.0
_POLL_S = 0.01


class PowerState:
    """State machine of one drive, by profile words or through the cyclic exchange of its bus."""

    def __init__(self, drive: Drive) -> None:
        self.drive = drive
        pause = drive.profile.quirk("enable_pause")
        self._enable_pause_s = ((pause.milliseconds if pause else None) or 0.0) / 1000.0
        #: What stops this family: only this word is printed in its manual.
        self._stop_word = dialect_of(drive.profile).quick_stop
        #: The last control word written, for edges.
        self.control_word = 0
        #: The running cyclic exchange of the axis' bus, which then writes the control word.
        self.session: CyclicSession | None = None
        #: STOP was pressed: no word that enables may be sent until a new command is given.
        self.stopped = False
        #: How many commands of people have permitted motion so far.
        self.permits = 0
        #: When STOP was pressed last (`time.monotonic`).
        self.stop_pressed_s = -math.inf
        #: A stop did not reach the drive; `repeat_stop` sends it again once the drive answers.
        self.stop_pending = False
        self._repeating = asyncio.Lock()
        #: A quick stop went out, and no word since that enables. Halt has the bits that enable, so
        #: it must not follow: the drive would leave the quick stop (CiA 402-2, transition 16).
        self.quick_stop_out = False
        #: What STOP has done since it was pressed, and when that was (monotonic).
        self.stop_steps: list[StopStep] = []
        self._stop_began_s = time.monotonic()
        #: 605Ah as it was before STOP had to change it; None where it has not.
        self.option_before: int | None = None

    def permit(self) -> None:
        """A person gave a new command: enabling is allowed again, until the next STOP.

        Never called by work in progress, so that nothing enables again what was stopped.

        Raises:
            NotAllowed: STOP was pressed after the command had been given; it waited meanwhile, for
                its turn, the rest of its body or the start of an exchange.
        """
        given_s = arrived_s.get()
        if given_s is not None and given_s <= self.stop_pressed_s:
            raise NotAllowed("axis.stop-pressed-since", drive=self.drive.name)
        self.stopped = self.quick_stop_out = False
        self.permits += 1

    async def status_word(self) -> int:
        """6041h, read now."""
        return await self.drive.raw(self.drive.require("status_word"))

    async def state(self) -> State:
        """CiA 402 power state, read now."""
        return self.drive.decode_state(await self.status_word())

    async def control(self, word: int) -> None:
        """Write 6040h.

        Raises:
            NotGranted: the word enables or moves the axis, and the calling work holds no grant.
            NotAllowed: STOP was pressed and the word would enable the axis again.
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
        """A word by which the drive may go to, or move in, Operation enabled."""
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
            NotGranted: none.
        """
        return self.drive.authority.require_held(self.drive.id, self.drive.name, key)

    def granted(
        self,
        purpose: str,
        envelope: Envelope | None = None,
        *,
        keys: frozenset[str] | None = None,
        ended: Ended | None = None,
    ) -> AbstractContextManager[Grant]:
        """A grant for this axis for the length of the block; see `MotionAuthority.granted`.

        Raises:
            Busy: other work has one.
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
            # The loop would go on trying, and enable when nobody waits for it any more: when the
            # main power comes, or a fault goes.
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
        """Walk the state machine to ``goal``, one transition after the other.

        A fault is reset only on the way to Switch on disabled: enabling never resets one, so
        that a drive which trips on being enabled is not enabled again and again.

        Raises:
            NotAllowed: the drive stays where it is; the message gives the cause that is known.
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
            # A quick stop may fall through to Switch on disabled (605Ah 0 to 4).
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
        """What the drive reports now, read now.

        Raises:
            DriveError: it does not answer, so it is not known.
        """
        return await read_active_faults(self.drive)

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
                mode_names=cia402.MODE_NAMES[mode],
            )
        key = drive.require("mode")
        await drive.command(key, int(mode), self.grant(key))
        display = drive.key("mode_display")
        if display is None:
            return
        deadline = time.monotonic() + 1.0
        while await drive.raw(display) != int(mode):
            if time.monotonic() > deadline:
                raise NotAllowed(
                    "axis.not-change", drive=drive.name, mode_names=cia402.MODE_NAMES[mode]
                )
            await asyncio.sleep(_POLL_S)

    def forbid(self) -> None:
        """STOP was pressed: nothing in progress, or asked for before, may enable the axis again."""
        self.stopped = True
        self.stop_pressed_s = time.monotonic()

    async def stop(self) -> None:
        """STOP by a person: quick stop, and nothing in progress may enable the axis again."""
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
        """Note a step of STOP; with a problem it was tried in vain."""
        at_s = time.monotonic() - self._stop_began_s
        self.stop_steps.append(
            StopStep(code, at_s, problem is None, parameter, figures or {}, problem)
        )

    async def quick_stop(self) -> None:
        """Stop now, by one write; harmless when nothing moves.

        Where 605Ah is known to coast, the axis is braked by halt, and by a quick stop that brakes.
        Where it does not reach the drive, `stop_pending` is set.
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
            # Whatever kept it: also an exchange that just ended, a drive that refused the word
            # while it was busy, and a caller that did not wait.
            self.stop_pending = True
            raise
        self.stop_pending = False

    async def read_stop_settings(self) -> None:
        """Read how the drive brakes on STOP, so that STOP itself need not ask; never raises."""
        with contextlib.suppress(DriveError):
            await self.drive.read_many(settings_keys(self.drive))

    async def send_quick_stop(self) -> None:
        """One quick-stop word, by the first port that takes it.

        Raises:
            DriveError: that of the first port, when none takes it.
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
        """Send the pending stop; returns whether one was pending and is delivered now."""
        # Monitor and the watch over STOP both repeat it; once is enough.
        async with self._repeating:
            if not self.stop_pending:
                return False
            try:
                await self.quick_stop()
            except DriveError:
                return False
            return True

    async def require_stop_delivered(self) -> None:
        """A stop that did not reach the drive comes before any new command.

        Raises:
            DriveError: it still does not reach it.
        """
        if self.stop_pending:
            await self.quick_stop()
