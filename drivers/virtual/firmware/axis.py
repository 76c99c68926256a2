"""One simulated axis: arrays of the 50 µs loop behind names with units."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.kernel.loop import run
from drivers.virtual.firmware.objects import loop_parameters
from drivers.virtual.firmware.objects.settings import (
    GainSet,
    ImpedanceSettings,
    LoopSettings,
    MotorData,
    ProtectionSettings,
)
from drivers.virtual.firmware.rough.rough_torque import write_rough_torque
from drivers.virtual.mechanics import MechanicsSpec
from drivers.virtual.mechanics.chain import FIRST_LOAD, discretise

#: Damping ratio of a motor that oscillates on the hub of its closed brake.
_HUB_DAMPING = 0.3


class VirtualAxis:
    """Mechanics, power stage and loops of one drive.

    Angles are motor radians in the encoder's own frame, which homing never moves. ``run`` clears
    ``events``.
    """

    def __init__(self, spec: MechanicsSpec, seed: int = 1) -> None:
        self.spec = spec
        self.motor = MotorData.of(spec)
        self.p = np.zeros(k.P_SIZE)
        self.s = np.zeros(k.S_SIZE)
        self._random = np.array([seed * 0x9E3779B97F4A7C15 % 2**64 or 1], dtype=np.uint64)
        self._current_loop_hz = 0.0
        self._x = np.zeros(FIRST_LOAD + 2 * len(spec.load))
        self._scratch = np.zeros_like(self._x)
        #: Called when the shaft was turned by hand, so that coupled mechanics follow.
        self.placed: Callable[[], None] = lambda: None
        self._loops: LoopSettings | None = None
        self._homing = False
        self._braked = self._brake_released = False
        loop_parameters.write_physics(self.p, spec, self.motor)
        write_rough_torque(self.p, spec)
        self._jitter = np.random.default_rng(seed)
        self.p[k.P_EVENT_MASK] = k.EV_FAULT | k.EV_STOPPED
        self.s[k.S_VOLTAGE] = spec.supply.voltage_v
        self.s[k.S_TEMPERATURE] = spec.supply.ambient_c
        self.set_current_loop(1000.0)
        self.apply_protections(ProtectionSettings())
        self.apply_windows(0.0, 0.0, 0.0, math.inf)
        self.set_limits(math.inf, math.inf, math.inf)
        self.set_alarm(None)
        self.p[k.P_LIMIT_DEC] = 1e3
        gains = GainSet(0.0, 0.0, 0.0)
        self.apply_loops(LoopSettings(first=gains, second=gains, homing=None))
        self.power_off()

    # --- running ---------------------------------------------------------------------------
    def run(self, steps: int) -> int:
        """Advance by up to ``steps`` of 50 µs; return how many were done before an event."""
        self.s[k.S_EVENTS] = 0.0
        done: int = run(steps, *self._arrays)
        return done

    def share_state(self, x: npt.NDArray[np.float64]) -> npt.NDArray[np.uint64]:
        """Store angle, speed and torque of the motor in ``x`` [3], which the caller steps from now
        on.

        Returns the state of this axis' random numbers.
        """
        x[:] = self._x
        self._x = x
        self._collect()
        return self._random

    @property
    def current_loop_rad_s(self) -> float:
        """Bandwidth of the current loop [rad/s]."""
        return loop_parameters.TURN * self._current_loop_hz

    @property
    def events(self) -> int:
        """EV_* bits that ended the last run."""
        return int(self.s.item(k.S_EVENTS)) & int(self.p.item(k.P_EVENT_MASK))

    def listen(self, *events: int) -> None:
        """Set events that end a run, besides fault, stop and alarm clock, which always do."""
        mask = k.EV_FAULT | k.EV_STOPPED | k.EV_ALARM_CLOCK | k.EV_LIMIT
        for event in events:
            mask |= event
        self.p[k.P_EVENT_MASK] = mask

    def set_alarm(self, step: float | None) -> None:
        """End a run when the step counter reaches this value."""
        self.p[k.P_ALARM_STEP] = math.inf if step is None else step

    # --- settings --------------------------------------------------------------------------
    def set_current_loop(self, bandwidth_hz: float) -> None:
        """Set the bandwidth of the first-order current loop."""
        if bandwidth_hz != self._current_loop_hz:
            self._current_loop_hz = bandwidth_hz
            self._chain = discretise(self.spec, loop_parameters.TURN * bandwidth_hz, k.STEP_S)
            self._collect()

    def _collect(self) -> None:
        """Collect the arrays of `run`, which is called in every cycle."""
        chain = self._chain
        self._arrays = (
            self.p, self.s, self._x, chain.a, chain.b, chain.gap_state,
            chain.half_gap_rad, self._scratch, self._random,
        )  # fmt: skip

    def apply_loops(self, loops: LoopSettings) -> None:
        """Set gains, filters, feed-forward and notches."""
        self._loops = loops
        self.set_current_loop(loops.current_loop_hz)
        first, second = loops.first, loops.second
        if self._homing and loops.homing is not None:
            first = second = loops.homing
        loop_parameters.write_gains(self.p, first, second)
        loop_parameters.write_loops(self.p, loops)

    def use_homing_gains(self, homing: bool) -> None:
        """Switch to or from the gain set for homing."""
        if homing != self._homing and self._loops is not None:
            self._homing = homing
            self.apply_loops(self._loops)

    def apply_protections(self, limits: ProtectionSettings) -> None:
        """Set thresholds of the protections."""
        resistor = self.spec.supply.braking_resistor
        loop_parameters.write_protections(self.p, limits, self.motor.rated_torque_nm, resistor)
        self._braked = limits.holding_brake or self.spec.motor.brake
        self.release_brake(self._brake_released)

    def apply_impedance(self, settings: ImpedanceSettings) -> None:
        """Set gains of the impedance controller."""
        loop_parameters.write_impedance(self.p, settings)

    def apply_windows(
        self, position_rad: float, speed_rad_s: float, zero_rad_s: float, following_rad: float
    ) -> None:
        """Set windows of target reached, zero speed and following error."""
        self.p[k.P_POSITION_WINDOW], self.p[k.P_SPEED_WINDOW] = position_rad, speed_rad_s
        self.p[k.P_ZERO_SPEED], self.p[k.P_FOLLOWING_WINDOW] = zero_rad_s, following_rad

    def set_limits(self, positive_nm: float, negative_nm: float, speed_rad_s: float) -> None:
        """Set torque limits (both as magnitudes) and the largest speed reference."""
        self.p[k.P_T_MAX], self.p[k.P_T_MIN] = positive_nm, -negative_nm
        self.p[k.P_MAX_SPEED] = speed_rad_s

    def set_signals(self, *, forced: int, forced_on: int, inverted: int) -> None:
        """Set switches that are not wired (forced to a level) or wired inversely."""
        self.p[k.P_SIGNAL_FORCED], self.p[k.P_SIGNAL_FORCED_ON] = forced, forced_on
        self.p[k.P_SIGNAL_INVERTED] = inverted

    def watch_signals(self, mask: int) -> None:
        """Raise EV_SIGNAL as soon as one of these switches changes; 0 disables this."""
        self.p[k.P_WATCH_MASK] = mask
        self.p[k.P_WATCH_VALUE] = int(self.s[k.S_SIGNALS]) & mask

    def watch_stall(self, torque_nm: float, time_s: float, speed_rad_s: float) -> None:
        """Raise EV_STALL after this time at this torque below this speed; 0 Nm disables this."""
        self.s[k.S_STALL_T] = 0.0
        self.p[k.P_STALL_NM], self.p[k.P_STALL_S] = torque_nm, time_s
        self.p[k.P_STALL_SPEED] = speed_rad_s

    # --- commands --------------------------------------------------------------------------
    def _begin(self, generator: int, loop: int) -> None:
        p, s = self.p, self.s
        was, braking = int(p[k.P_LOOP]), p[k.P_GEN] == k.GEN_TORQUE_STOP
        p[k.P_GEN], p[k.P_LOOP], p[k.P_STOPPING] = generator, loop, 0.0
        s[k.S_STOPPED] = s[k.S_ARRIVED] = s[k.S_POSITION_T] = s[k.S_SPEED_T] = 0.0
        if loop in (k.LOOP_POSITION, k.LOOP_SPEED) and was == k.LOOP_TORQUE and not braking:
            s[k.S_INTEGRAL] = s[k.S_TORQUE_COMMAND]

    @property
    def powered(self) -> bool:
        """True while the power stage is on."""
        return bool(self.p[k.P_LOOP] != k.LOOP_OFF)

    def power_off(self, dynamic_brake: bool = False) -> None:
        """Switch the power stage off: the axis coasts (or the holding brake closes).

        With ``dynamic_brake`` the windings are shorted: Kt²/(3R) Nm per rad/s.
        """
        self._begin(k.GEN_OFF, k.LOOP_OFF)
        motor = self.motor
        shorted = motor.torque_constant**2 / (3 * motor.resistance_ohm)
        self.p[k.P_DYNAMIC_BRAKE] = shorted if dynamic_brake else 0.0

    def await_standstill(self) -> None:
        """Raise EV_STOPPED as soon as the axis, which is not powered, is at standstill."""
        self.s[k.S_STOPPED] = 0.0
        self.p[k.P_STOPPING] = 1.0

    def release_brake(self, released: bool) -> None:
        """Set whether the holding brake is kept open, with or without power."""
        self._brake_released = released
        grips = self._braked and not released
        motor = self.spec.motor
        holds_nm = motor.brake_nm or 2 * motor.rated_torque_nm
        self.p[k.P_BRAKE_TORQUE] = holds_nm if grips else 0.0
        stiffness = holds_nm / motor.brake_windup_rad if motor.brake_windup_rad else 0.0
        self.p[k.P_BRAKE_STIFFNESS] = stiffness
        self.p[k.P_BRAKE_DAMPING] = 2 * _HUB_DAMPING * math.sqrt(stiffness * motor.inertia_kgm2)

    def close_brake(self, closed: bool) -> None:
        """Close or release the brake with power on (without power it is closed in any case)."""
        self.p[k.P_BRAKE_CLOSED] = float(closed)

    def hold(self, at_rad: float | None = None) -> None:
        """Close the position loop at this angle, or at the present one, from the present speed."""
        moving = bool(self.p[k.P_LOOP] == k.LOOP_POSITION)
        self._begin(k.GEN_POSITION, k.LOOP_POSITION)
        if not moving:
            self.s[k.S_P_DEMAND] = self.s[k.S_THETA]
            self.s[k.S_V_DEMAND] = 0.0
        self.p[k.P_TARGET] = self.s[k.S_P_DEMAND] if at_rad is None else at_rad
        if at_rad is None:
            self.s[k.S_V_DEMAND] = 0.0

    def move(self, target_rad: float, speed: float, acceleration: float, braking: float) -> None:
        """Start a trapezoidal move from the present demand to an absolute angle; rad/s, rad/s²."""
        if self.p[k.P_LOOP] != k.LOOP_POSITION:
            self.s[k.S_P_DEMAND] = self.s[k.S_THETA]
            self.s[k.S_V_DEMAND] = self.s[k.S_OMEGA] if self.powered else 0.0
        self._begin(k.GEN_POSITION, k.LOOP_POSITION)
        self.p[k.P_TARGET] = target_rad
        self.p[k.P_V_MAX], self.p[k.P_ACC], self.p[k.P_DEC] = speed, acceleration, braking

    def run_velocity(self, speed: float, acceleration: float, braking: float) -> None:
        """Ramp to a speed and hold it."""
        if self.p[k.P_LOOP] not in (k.LOOP_SPEED, k.LOOP_POSITION):
            self.s[k.S_V_DEMAND] = self.s[k.S_OMEGA]
        self._begin(k.GEN_VELOCITY, k.LOOP_SPEED)
        self.p[k.P_V_TARGET], self.p[k.P_ACC], self.p[k.P_DEC] = speed, acceleration, braking

    def run_torque(self, torque_nm: float, slope_nm_s: float) -> None:
        """Ramp to a torque and hold it."""
        if self.p[k.P_LOOP] != k.LOOP_TORQUE:
            self.s[k.S_T_DEMAND] = self.s[k.S_TORQUE_COMMAND]
        self._begin(k.GEN_TORQUE, k.LOOP_TORQUE)
        self.p[k.P_T_TARGET], self.p[k.P_T_SLOPE] = torque_nm, slope_nm_s

    def run_cyclic(self, loop: int) -> None:
        """Follow interpolated setpoints from the present demand (or actual) values."""
        s = self.s
        if self.p[k.P_LOOP] != k.LOOP_POSITION:
            s[k.S_P_DEMAND] = s[k.S_THETA]
        self._begin(k.GEN_CYCLIC, loop)
        s[k.S_IP_POSITION] = s[k.S_P_DEMAND]
        s[k.S_IP_SPEED] = s[k.S_OMEGA] if loop == k.LOOP_SPEED else 0.0
        s[k.S_IP_TORQUE] = s[k.S_TORQUE_COMMAND] if loop == k.LOOP_TORQUE else 0.0
        s[k.S_IP_LEFT] = 0.0

    def set_cyclic(self, angle_rad: float, speed: float, torque_nm: float, steps: int) -> None:
        """Set new cyclic setpoints, reached linearly in ``steps`` of 50 µs (004:7618-7621)."""
        s, item = self.s, self.s.item
        s[k.S_IP_POSITION_INC] = (angle_rad - item(k.S_IP_POSITION)) / steps
        s[k.S_IP_SPEED_INC] = (speed - item(k.S_IP_SPEED)) / steps
        s[k.S_IP_TORQUE_INC] = (torque_nm - item(k.S_IP_TORQUE)) / steps
        s[k.S_IP_LEFT] = float(steps)
        p = self.p
        if p[k.P_ROUGH_ON] == 0.0:
            return
        if p[k.P_ROUGH_HOLDS_TORQUE] > 0.0:
            s[k.S_IP_TORQUE], s[k.S_IP_TORQUE_INC] = torque_nm, 0.0
        if p[k.P_ROUGH_HOLDS_SPEED] > 0.0:
            s[k.S_IP_SPEED], s[k.S_IP_SPEED_INC] = speed, 0.0
        if p[k.P_ROUGH_JITTER_STEPS] > 0.0:
            s[k.S_ROUGH_WAIT] = float(self._jitter.integers(0, int(p[k.P_ROUGH_JITTER_STEPS]) + 1))

    def stop_ramp(self, braking: float) -> None:
        """Brake to standstill at this deceleration; EV_STOPPED marks the end."""
        loop = self.p[k.P_LOOP]
        if loop == k.LOOP_POSITION:
            self._begin(k.GEN_POSITION, k.LOOP_POSITION)
            self.p[k.P_TARGET] = self.s[k.S_P_DEMAND]
        else:
            if loop != k.LOOP_SPEED:
                self.s[k.S_V_DEMAND] = self.s[k.S_OMEGA]
            self._begin(k.GEN_VELOCITY, k.LOOP_SPEED)
        self.p[k.P_STOPPING], self.p[k.P_STOP_DEC] = 1.0, braking

    def stop_by_torque_slope(self, slope_nm_s: float) -> None:
        """Reduce the torque at this slope; EV_STOPPED marks standstill."""
        self.run_torque(0.0, slope_nm_s)
        self.p[k.P_STOPPING] = 1.0

    def stop_by_torque(self, torque_nm: float) -> None:
        """Brake with a constant torque (0 coasts under power); EV_STOPPED marks standstill."""
        self._begin(k.GEN_TORQUE_STOP, k.LOOP_TORQUE)
        self.p[k.P_STOP_TORQUE] = torque_nm
        self.p[k.P_STOPPING] = 1.0

    def place(self, angle_rad: float) -> None:
        """Set the shaft to an angle by hand, without power and at standstill; the loads follow."""
        x, s = self._x, self.s
        x[:] = 0.0
        x[0] = angle_rad
        seen = angle_rad * self.p[k.P_ENCODER_SENSE]
        s[k.S_THETA] = s[k.S_THETA_FILTERED] = s[k.S_P_DEMAND] = seen
        s[k.S_OMEGA_LOW] = s[k.S_OMEGA_OBSERVED] = s[k.S_OMEGA] = 0.0
        s[k.S_INDEX_COUNT] = math.floor(angle_rad / self.p[k.P_INDEX_RAD])
        self.placed()

    def clear_faults(self) -> None:
        """Clear latched faults and their timers."""
        for name in (
            k.S_FAULTS,
            k.S_OVERLOAD_T,
            k.S_SPEED_ERROR_T,
            k.S_LOCK_T,
            k.S_FOLLOWING_T,
        ):
            self.s[name] = 0.0

    def live_faults(self) -> int:
        """Return faults whose cause is present now, as F_* bits; timed ones need time to recur."""
        p, s, present = self.p, self.s, 0
        for bit, condition in (
            (k.F_UNDER_VOLTAGE, s[k.S_VOLTAGE] < p[k.P_UVLO_V]),
            (k.F_OVER_VOLTAGE, s[k.S_VOLTAGE] > p[k.P_OVP_V]),
            (k.F_OVER_TEMPERATURE, s[k.S_TEMPERATURE] > p[k.P_OTP_C]),
            (k.F_OVER_SPEED, abs(s[k.S_OMEGA]) > p[k.P_OVER_SPEED]),
            (k.F_SENSOR, p[k.P_ENCODER_DEAD] > 0),
            (k.F_OVERLOAD, s[k.S_I2T] > 0.9 * p[k.P_I2T_LIMIT]),
        ):
            present |= bit if condition else 0
        return present

    @property
    def loops(self) -> LoopSettings | None:
        """The present loop settings, in SI units."""
        return self._loops

    # --- readings --------------------------------------------------------------------------
    @property
    def angle_rad(self) -> float:
        """Measured motor angle."""
        return float(self.s[k.S_THETA])

    @property
    def speed_rad_s(self) -> float:
        """Filtered motor speed, the speed loop's feedback."""
        return float(self.s[k.S_OMEGA])

    @property
    def load_angle_rad(self) -> float:
        """True angle of the last inertia, in rad of the motor shaft."""
        return float(self._x[0] - np.sum(self._x[FIRST_LOAD::2]))

    @property
    def torque_nm(self) -> float:
        """Motor torque."""
        return float(self.s[k.S_TORQUE])

    def trace(self) -> npt.NDArray[np.float64]:
        """Return the last 4096 torque commands, oldest first, one per 50 µs [Nm]."""
        ring = self.s[k.S_TRACE : k.S_TRACE + k.TRACE_STEPS]
        return np.roll(ring, -(int(self.s[k.S_STEP]) % k.TRACE_STEPS))

    @property
    def faults(self) -> int:
        """Latched F_* bits."""
        return int(self.s[k.S_FAULTS])

    def raise_fault(self, bit: int) -> None:
        """Latch a fault as if its protection had tripped."""
        self.s[k.S_FAULTS] = float(self.faults | bit)
