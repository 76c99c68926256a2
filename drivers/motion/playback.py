"""One axis in the cyclic loop: control word, setpoints, expiry and envelope.

Pure: `AxisLoop.step` takes the inputs of a cycle and leaves the outputs of the next one in
``outputs``. It never sleeps, never raises for anything a drive does, and reports through
``report``.

Every forced end of a motion (expiry, envelope, halt, invalid data) brakes and then leaves
Operation enabled. Position and velocity setpoints are ramped down in `STOP_S`; a torque setpoint
becomes zero together with a quick stop, because zero torque does not stop a moving axis. An axis
that could not follow the ramp is stopped by the drive's quick stop too: without power it would
coast.

With a closed brake, a torque beyond a limit only becomes zero, and the power is removed `LET_GO_S`
later: a quick stop by a velocity loop would keep pushing (R6L, EP3E and M6-L take 50 ms to 1 s for
it). Where the limits say so, a shaft that has not slowed down `RUNS_ON_S` after the torque, as its
brake let go altogether, gets a quick stop after all.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from drivers import cia402
from drivers.cia402 import State
from drivers.errors import NotAllowed
from drivers.halt import ENVELOPE_CAUSES, HaltCause, Halted, LeftBy
from drivers.motion.guard import SpeedGuard
from drivers.motion.setpoint_plan import (
    ACTUAL_POSITION,
    ACTUAL_TORQUE,
    ACTUAL_VELOCITY,
    CONTROL,
    FOLLOWING,
    MODE,
    MODE_OF,
    MODE_SHOWN,
    OFFSETS,
    POSITION,
    STATUS,
    TORQUE,
    VELOCITY,
    Motion,
    Phase,
)
from drivers.texts.message import Text, prose, text
from drivers.texts.modes import mode_text
from drivers.texts.states import state_text
from profiles.schema import INTEGER_RANGE

STOP_S = 0.1
"""Ramp time from any speed to standstill [s]; below the 200 ms in which lost setpoints must end."""
LET_GO_S = 0.05
"""Delay until the power of an axis held by its closed brake, with zero torque, is removed [s]."""
RUNS_ON_S = 0.012
"""Delay after a torque became zero, until which a brake that still holds has slowed the shaft [s].

With the torque gone after 3 ms, a brake with a fifth of it takes half of the speed in this time.
Not less than `_RUNS_ON_CYCLES`, for the delay of bus and drive.
"""
_RUNS_ON_CYCLES = 5
_SLOWED = 0.5
"""Share of the speed at the limit below which the shaft counts as slowed down."""

_RESTLESS = 2
"""Encoder noise of an axis at standstill, in increments per cycle."""
_LOWEST, _HIGHEST = INTEGER_RANGE["INT32"]
"""Range of a position setpoint [increments] (CiA 402-2, 607Ah)."""
_WITHOUT_POSITION = (
    cia402.Mode.VL,
    cia402.Mode.PV,
    cia402.Mode.PT,
    cia402.Mode.CSV,
    cia402.Mode.CST,
)
"""Modes in which a drive does not follow 607Ah."""
_ALIVE_STATES = (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE)
_STANDARD = cia402.Dialect()
_DISABLED = Halted(HaltCause.COMMANDED, note=text("cyclic.axis-being-disabled"))
_PAUSED = Halted(HaltCause.COMMANDED, note=text("cyclic.motion-ended"))
_RESTLESS_STILL = Halted(HaltCause.COMMANDED, note=text("cyclic.not-come-rest-ramp"))
_STALE_CYCLES = 3
"""Samples that may be older than a state a mailbox reported before the axis was enabled again."""
_SETTLES = 2
"""An axis that lags behind its ramp may take this many ramp times longer to come to a hold."""
_RESET_S = 3.0
"""How long a fault that stays is reset [s]: as long as a person waits for the result."""
_REST_S, _GIVE_UP = 0.05, 30
"""Dwell without motion that counts as standstill [s]; time-out as a multiple of this dwell."""


class AxisLoop:
    """Cyclic loop of one axis, see the module docstring.

    ``inputs`` and ``outputs`` map the index of a CiA 402 object to its place in the values.
    """

    def __init__(
        self,
        station: int,
        *,
        inputs: dict[int, int],
        outputs: dict[int, int],
        output_count: int,
        cycle_s: float,
        report: Callable[[int, Text], None],
        dialect: cia402.Dialect = _STANDARD,
    ) -> None:
        self.station = station
        self.outputs: list[int] = [0] * output_count
        self.phase = Phase.IDLE
        self.state = State.UNKNOWN
        self.goal: State | None = None
        self.halted: Halted | None = None
        """Why the last motion was ended by force, or why the drive is no longer enabled."""
        self._in = inputs
        self._out = outputs
        # Looked up once, as they are used in every cycle.
        self._mode_at, self._status_at = inputs.get(MODE_SHOWN), inputs.get(STATUS)
        self._position_at = inputs.get(ACTUAL_POSITION)
        self._velocity_at = inputs.get(ACTUAL_VELOCITY)
        self._torque_at = inputs.get(ACTUAL_TORQUE)
        self._word: int | None = None
        self._reported = State.UNKNOWN
        """The state in the status word ``_word``."""
        self._report = report
        self._dialect = dialect
        self._pause_cycles = round(dialect.pause_s / cycle_s)
        self._pause_left = 0
        self._rest_cycles = max(round(_REST_S / cycle_s), 1)
        self._rested = self._stopping = 0
        self._brakes_itself = False
        self._completes_stop = False
        """Another goal was given during a quick stop."""
        self._stop_cycles = max(round(STOP_S / cycle_s), 1)
        self._mode: int | None = None
        self._motion: Motion | None = None
        self._place = 0
        self._life = 0
        self._reset = False
        self._reset_left = 0
        self._reset_cycles = max(round(_RESET_S / cycle_s), 1)
        self._setpoint = 0.0
        self._speed = 0.0
        self._brake_step = 0.0
        self._brake_left = 0
        self._brake_target = POSITION
        self._after_brake = State.READY
        self._after_quick_stop = State.READY
        self._let_go_at: int | None = None
        self._runs_on_at: int | None = None
        self._was_enabled = False
        self._stale = 0
        self._last_position: int | None = None
        self._moved = 0
        """Increments moved since the previous cycle."""
        self._moved_at_stop = 0
        self._cycle_s = cycle_s
        self._cycles = 0
        self._sampled_s = 0.0
        self._speed_guard = SpeedGuard(None, None)

    @property
    def position(self) -> int | None:
        """Actual position [increments] of the last valid cycle; None before the first."""
        return self._last_position

    # Commands ------------------------------------------------------------------------------

    def drive_to(self, goal: State, mode: int | None) -> None:
        """Request a power state; leaving Operation enabled brakes first.

        During a quick stop it is approached only once the axis rests.

        Raises:
            NotAllowed: the control word is not mapped, the axis is in a fault or braking, or the
                mode would change during a motion.
        """
        if CONTROL not in self._out:
            raise NotAllowed("cyclic.station-control-word-not", station=self.station)
        if goal is State.OPERATION_ENABLED:
            if self.goal is not State.OPERATION_ENABLED:
                # Samples from before the last disabling must not keep the axis disabled.
                self._was_enabled, self._stale = False, _STALE_CYCLES
            if self.state in (State.FAULT, State.FAULT_REACTION):
                raise NotAllowed("cyclic.station-fault-cannot-enabled", station=self.station)
            if self.phase is Phase.BRAKING:
                raise NotAllowed("cyclic.station-braking", station=self.station, why=self._why)
            self.halted = None
        if mode is not None and self.phase is not Phase.IDLE:
            raise NotAllowed("cyclic.station-moves-mode-cannot", station=self.station)
        if mode is not None and MODE in self._out:
            self.outputs[self._out[MODE]] = self._dialect.mode(mode)
        if (
            goal is not State.OPERATION_ENABLED
            and goal is not State.QUICK_STOP_ACTIVE
            and self.phase is not Phase.IDLE
        ):
            if self.phase is Phase.BRAKING:
                self._after_brake = goal
            self.stop(_DISABLED, goal)
            return
        if self.goal is State.QUICK_STOP_ACTIVE and goal is not State.QUICK_STOP_ACTIVE:
            self._completes_stop = True
            self._rested = self._stopping = 0
        self.goal = goal

    def reset_fault(self) -> None:
        """Reset a fault once; the axis stays disabled.

        Does nothing to an axis that is enabled or in a quick stop: without power it would coast.
        """
        if self.state in _ALIVE_STATES:
            return
        self._reset, self._reset_left = True, self._reset_cycles
        self.goal = State.SWITCH_ON_DISABLED
        self.halted = None

    def play(self, motion: Motion) -> None:
        """Start a motion with its first value in the next cycle.

        Raises:
            NotAllowed: not enabled, a required object is not mapped, or the first value is a jump.
        """
        self.check(motion)
        # An end before the first value brakes from here; the place or speed of an earlier motion
        # must not become a setpoint of this one.
        self._setpoint = self.setpoint_now(motion.target) or 0
        self._clear_offsets()
        self._motion = motion
        self._place = 0
        self._life = motion.renew_cycles
        self.phase = Phase.PLAYING
        self.halted = None
        self._speed_guard = SpeedGuard(motion.limits.feedback, motion.limits.speed_max)

    def renew(self) -> None:
        """Extend the validity of the setpoints."""
        if self._motion is not None:
            self._life = self._motion.renew_cycles

    def stop(self, why: Halted, goal: State = State.READY) -> None:
        """Brake now, then go to the power state ``goal``."""
        if self.phase is Phase.BRAKING:
            if self._after_brake is State.OPERATION_ENABLED:
                # It was braking in order to hold; now its motion is ended.
                self.halted, self._after_brake = why, goal
                self._report(self.station, why.text)
            return
        if self.phase is Phase.IDLE:
            self.goal = goal if self.goal is State.OPERATION_ENABLED else self.goal
            return
        self.halted = why
        self._report(self.station, why.text)
        motion, self._motion = self._motion, None
        self._clear_offsets()
        if motion is not None and motion.target == TORQUE:
            self._set(TORQUE, 0)
            self.phase, self._brake_left = Phase.IDLE, 0
            self._brake_target = TORQUE
            if motion.limits.torque_off_only and why.cause in ENVELOPE_CAUSES:
                self._let_go_at = self._cycles + max(1, round(LET_GO_S / self._cycle_s))
                if motion.limits.stopped_if_it_runs_on:
                    cycles = max(_RUNS_ON_CYCLES, round(RUNS_ON_S / self._cycle_s))
                    self._runs_on_at, self._moved_at_stop = self._cycles + cycles, self._moved
                return
            self.goal = State.QUICK_STOP_ACTIVE
            self._after_quick_stop = goal
            return
        self._begin_to_brake(motion, goal)

    def pause(self) -> None:
        """Brake now and hold, enabled; the motion ends, and another may start at once.

        For position and velocity setpoints; a torque motion ends as by `stop`.
        """
        if self.phase not in (Phase.PLAYING, Phase.HOLDING):
            return
        motion = self._motion
        if motion is None or motion.target == TORQUE:
            self.stop(_PAUSED)
            return
        self._motion = None
        self._clear_offsets()
        self._begin_to_brake(motion, State.OPERATION_ENABLED)

    def _begin_to_brake(self, motion: Motion | None, goal: State) -> None:
        self._brake_target = motion.target if motion is not None else POSITION
        self.phase = Phase.BRAKING
        self._moved_at_stop = self._moved
        self._brake_left = self._stop_cycles
        start = self._speed if self._brake_target == POSITION else self._setpoint
        self._brake_step = start / self._stop_cycles
        self._after_brake = goal

    # One cycle -----------------------------------------------------------------------------

    def step(self, values: Sequence[int], late_s: float = 0.0) -> None:
        """Compute the outputs of the next cycle from the inputs of this one, which must be valid.

        ``late_s`` [s]: delay of the input sampling relative to the grid of cycles.
        """
        self._cycles += 1
        self._sampled_s = self._cycles * self._cycle_s + late_s
        if self._mode_at is not None:
            self._mode = values[self._mode_at]
        place_of_status = self._status_at
        if place_of_status is not None:
            self.state = self._state_of(values[place_of_status])
        if self._position_at is not None:
            position = values[self._position_at]
            self._moved = 0 if self._last_position is None else abs(position - self._last_position)
            self._last_position = position
        enabled = self.state is State.OPERATION_ENABLED
        if self._was_enabled and not enabled:
            self._fell_out(0 if place_of_status is None else values[place_of_status])
        self._was_enabled = enabled and not self._stale
        if self._stale > 0:
            self._stale -= 1
        if self.phase in (Phase.PLAYING, Phase.HOLDING):
            self._guard(values)
        self._setpoints(values, enabled=enabled)
        if CONTROL in self._out:
            self._control()

    def _state_of(self, word: int) -> State:
        if word != self._word:
            self._word = word
            echoes = self._dialect.echoes_control
            self._reported = cia402.decode_state(word, echoes_control=echoes)
        return self._reported

    def blind(self) -> None:
        """Advance one cycle without valid inputs: setpoints continue, inputs are not evaluated.

        Once the axis has braked, a quick stop is commanded whether or not the drive receives it: it
        is unknown whether the axis is at standstill, and disabled by another control word it would
        coast.
        """
        self._cycles += 1
        if self.phase is not Phase.IDLE:
            if self.phase is not Phase.BRAKING:
                self._age(1)
            self._advance()
        elif self.goal not in (None, State.OPERATION_ENABLED) and CONTROL in self._out:
            word = self.outputs[self._out[CONTROL]]
            if word & cia402.ENABLE_OPERATION == cia402.ENABLE_OPERATION:
                self.outputs[self._out[CONTROL]] = self._dialect.quick_stop

    def skip(self, cycles: int) -> None:
        """Account for cycles that the computer missed: time passed without an exchange.

        Setpoints age by all of them; an axis whose setpoints expired brakes in the next cycle.
        """
        self._cycles += cycles
        self._life -= cycles
        self._speed_guard.gap()

    def _fell_out(self, word: int) -> None:
        if self.goal is State.OPERATION_ENABLED:
            self.goal = State.SWITCH_ON_DISABLED
            self._brakes_itself = self.state is State.QUICK_STOP_ACTIVE
            self._rested = self._stopping = 0
            self.halted = Halted(
                HaltCause.LEFT_ENABLED, note=state_text(self.state), left_by=self._left_by(word)
            )
            self._report(self.station, self.halted.text)
        self.phase = Phase.IDLE
        self._motion = None
        self._clear_offsets()

    def _left_by(self, word: int) -> LeftBy:
        if self.state in (State.FAULT, State.FAULT_REACTION):
            return LeftBy.FAULT
        if self.state is State.QUICK_STOP_ACTIVE:
            return LeftBy.QUICK_STOP
        if not self._dialect.echoes_control and not word & cia402.STATUS_VOLTAGE_ENABLED:
            return LeftBy.VOLTAGE
        return LeftBy.OTHERS

    def _guard(self, values: Sequence[int]) -> None:
        """Check envelope and expiry; a violation starts braking in the same cycle."""
        assert self._motion is not None
        if self._age(1):
            return
        limits = self._motion.limits
        position = None if self._position_at is None else values[self._position_at]
        if position is not None:
            if limits.position_min is not None and position < limits.position_min:
                self.stop(Halted.beyond("position", position, limits.position_min))
                return
            if limits.position_max is not None and position > limits.position_max:
                self.stop(Halted.beyond("position", position, limits.position_max))
                return
        velocity = None if self._velocity_at is None else values[self._velocity_at]
        place = None if position is None else round(position)
        halt = self._speed_guard.look(place, velocity, self._sampled_s)
        if halt is not None:
            self.stop(halt)
            return
        torque = None if self._torque_at is None else values[self._torque_at]
        most = limits.torque_max
        if most is not None and torque is not None and abs(torque) > most:
            self._no_faster_than_it_turns(values)
            self.stop(Halted.beyond("torque", torque, most))
            return
        if limits.following_error_max is not None:
            error = self._following_error(values)
            if abs(error) > limits.following_error_max:
                self.stop(Halted.beyond("following error", error, limits.following_error_max))

    def _age(self, cycles: int) -> bool:
        """Age the setpoints; return whether they expired without renewal, which brakes the axis."""
        self._life -= cycles
        expired = self._life < 0
        if expired:
            self.stop(Halted(HaltCause.EXPIRED))
        return expired

    def _no_faster_than_it_turns(self, values: Sequence[int]) -> None:
        """Brake an axis that does not follow (a blocked axis) from its actual speed, not the
        setpoint's.

        Otherwise its loop would keep pushing, with increasing torque, for as long as it brakes.
        """
        assert self._motion is not None
        actual = self._value(values, ACTUAL_VELOCITY)
        if actual is not None and self._motion.target == VELOCITY:
            low, high = sorted((0.0, float(self._setpoint)))
            self._setpoint = min(max(actual, low), high)

    def _following_error(self, values: Sequence[int]) -> float:
        reported = self._value(values, FOLLOWING)
        if reported is not None:
            return reported
        actual = self._value(values, ACTUAL_POSITION)
        moving = self._motion is not None and self._motion.target == POSITION
        return self._setpoint - actual if moving and actual is not None else 0.0

    def _setpoints(self, values: Sequence[int], *, enabled: bool) -> None:
        if self.phase is Phase.IDLE:
            if not enabled or self._mode in _WITHOUT_POSITION:
                # Neither enabling nor a change of mode may cause motion: the setpoint is kept at
                # the actual position as long as the drive does not follow it.
                actual = self._value(values, ACTUAL_POSITION)
                if actual is not None:
                    self._set(POSITION, round(actual))
            if not enabled:
                self._set(VELOCITY, 0)
                self._set(TORQUE, 0)
                self._clear_offsets()
            self._speed = 0.0
            return
        self._advance()

    def _advance(self) -> None:
        if self.phase is Phase.BRAKING:
            self._brake()
            return
        motion = self._motion
        if motion is None:
            return
        if self._place < len(motion.values):
            value = motion.values[self._place]
            self._speed = value - self._setpoint if self._place or motion.target == POSITION else 0
            self._setpoint = value
            self._set(motion.target, value)
            if motion.offset is not None and motion.offset_values is not None:
                self._set(motion.offset, motion.offset_values[self._place])
            self._place += 1
            if self._place == len(motion.values):
                self.phase = Phase.HOLDING
        else:
            self._speed = 0.0

    def _brake(self) -> None:
        self._brake_left -= 1
        if self._brake_target == POSITION:
            self._speed -= self._brake_step
            if self._brake_left > 0:
                # Beyond the limits of its type a setpoint could not be sent, nor could the
                # control word that follows.
                self._setpoint = min(max(self._setpoint + self._speed, _LOWEST), _HIGHEST)
            self._set(POSITION, round(self._setpoint))
        else:
            self._setpoint = self._setpoint - self._brake_step if self._brake_left > 0 else 0.0
            self._set(self._brake_target, round(self._setpoint))
        if self._brake_left <= 0 and not self._lags_behind():
            self.phase = Phase.IDLE
            self._speed = 0.0
            self.goal = self._after_brake
            if self._moved > max(0.1 * self._moved_at_stop, _RESTLESS):
                # An axis that did not follow its ramp cannot be held either.
                held = self._after_brake is State.OPERATION_ENABLED
                self.goal = State.QUICK_STOP_ACTIVE
                self._after_quick_stop = State.READY if held else self._after_brake
                if held:
                    self.halted = _RESTLESS_STILL
                    self._report(self.station, _RESTLESS_STILL.text)

    def _lags_behind(self) -> bool:
        """Return whether an axis to be held still lags behind its ramp, within the time allowed."""
        held = self._after_brake is State.OPERATION_ENABLED
        patient = self._brake_left > -_SETTLES * self._stop_cycles
        return held and patient and self._moved > max(0.1 * self._moved_at_stop, _RESTLESS)

    def _control(self) -> None:
        place = self._out[CONTROL]
        if self._runs_on_at is not None and self._cycles >= self._runs_on_at:
            self._runs_on_at = None
            runs_on = self._moved > max(_SLOWED * self._moved_at_stop, _RESTLESS)
            if runs_on and self.goal is State.OPERATION_ENABLED and self.phase is Phase.IDLE:
                self._let_go_at = None
                self.goal = State.QUICK_STOP_ACTIVE
                self._after_quick_stop = State.SWITCH_ON_DISABLED
        if self._let_go_at is not None and self._cycles >= self._let_go_at:
            self._let_go_at = None
            if self.goal is State.OPERATION_ENABLED and self.phase is Phase.IDLE:
                self.goal = State.SWITCH_ON_DISABLED
        if self.goal is None:
            return
        if self.state in (State.FAULT, State.FAULT_REACTION):
            self._reset_left -= self.state is State.FAULT
            if not self._reset or self._reset_left < 0:
                self._reset = False
                self.outputs[place] = cia402.DISABLE_VOLTAGE
                return
        if self._brakes_itself:
            # A limit switch or the drive itself began a quick stop, which needs power for braking.
            if self.state is State.QUICK_STOP_ACTIVE and self._may_brake():
                self.outputs[place] = self._dialect.quick_stop
                return
            self._brakes_itself = False
        if self._completes_stop:
            stopping = self.state in _ALIVE_STATES or self._dialect.echoes_control
            if stopping and self._may_brake():
                self.outputs[place] = self._dialect.quick_stop
                return
            self._completes_stop = False
        if self.goal is State.QUICK_STOP_ACTIVE and self.state not in _ALIVE_STATES:
            if self._stops_unseen():
                return
            self.goal = self._after_quick_stop
        word = cia402.next_control_word(self.state, self.goal, self.outputs[place])
        if word == cia402.QUICK_STOP:
            word = self._dialect.quick_stop
        self._pause_left = max(self._pause_left - 1, 0)
        if word is not None:
            if word != self.outputs[place] and not cia402.stops(word):
                if self._pause_left:
                    return
                self._pause_left = self._pause_cycles
            self.outputs[place] = word
        elif self.state is self.goal:
            self._reset = False
            self.outputs[place] &= ~cia402.FAULT_RESET

    def _stops_unseen(self) -> bool:
        """Return whether a drive whose status word shows no quick stop may still be braking.

        Any other control word would remove its power while it brakes.
        """
        return self._dialect.echoes_control and self._may_brake()

    def _may_brake(self) -> bool:
        """Return whether the axis may still move: no standstill dwell yet, and no time-out."""
        self._stopping += 1
        self._rested = self._rested + 1 if self._moved <= _RESTLESS else 0
        if self._rested < self._rest_cycles and self._stopping < _GIVE_UP * self._rest_cycles:
            return True
        self._stopping = self._rested = 0
        return False

    # Parts ---------------------------------------------------------------------------------

    @property
    def _why(self) -> Text:
        """Why the last motion was ended by force, for messages; empty if it was not."""
        return prose("") if self.halted is None else self.halted.text

    def setpoint_now(self, target: int) -> int | None:
        """Return the output value of a target, or None if it is not mapped."""
        return self.outputs[self._out[target]] if target in self._out else None

    def check(self, motion: Motion) -> None:
        """Raise `NotAllowed` if this motion cannot start in the next cycle."""
        where = text("link.station", station=self.station)
        motion.require_mapped(self._out, where)
        if self.state is not State.OPERATION_ENABLED or self.goal is not State.OPERATION_ENABLED:
            if self.halted is not None:
                raise NotAllowed(
                    "cyclic.motion-needs-enabled-again",
                    where=where,
                    state=state_text(self.state),
                    cause=self.halted.text,
                )
            raise NotAllowed(
                "cyclic.motion-needs-operation-enabled", where=where, state=state_text(self.state)
            )
        wanted = cia402.Mode(self._dialect.mode(MODE_OF[motion.target]))
        if self._mode is not None and self._mode != wanted:
            raise NotAllowed(
                "cyclic.mode-setpoint-needs-mode",
                where=where,
                mode=self._mode,
                wanted=int(wanted),
                mode_names=mode_text(wanted),
            )
        motion.limits.require_watched(self._in, where, motion.target)
        if self.phase is Phase.BRAKING or self._completes_stop:
            raise NotAllowed("cyclic.braking", where=where, why=self._why)
        if not len(motion.values):
            raise NotAllowed("cyclic.trajectory-without-values", where=where)
        if motion.target == POSITION:
            now = self.setpoint_now(POSITION)
            assert now is not None
            self._setpoint = now
            motion.require_near(now, self._speed, where)

    def _value(self, values: Sequence[int], index: int) -> float | None:
        place = self._in.get(index)
        return None if place is None else values[place]

    def _set(self, index: int, value: int) -> None:
        place = self._out.get(index)
        if place is not None:
            self.outputs[place] = value

    def _clear_offsets(self) -> None:
        for index in OFFSETS:
            self._set(index, 0)
