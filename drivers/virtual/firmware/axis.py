"""One simulated axis: arrays of the 50 µs loop behind names with units."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import numpy.typing as npt
from scipy.linalg import expm

from drivers.virtual.firmware import kernel as k
from drivers.virtual.firmware.settings import (
    GainSet,
    ImpedanceSettings,
    LoopSettings,
    MotorData,
    ProtectionSettings,
    SwingFilter,
)
from drivers.virtual.mechanics import MechanicsSpec
from drivers.virtual.mechanics.chain import FIRST_LOAD, discretise

TURN: Final = 2 * math.pi


def low_pass(cutoff_hz: float) -> float:
    """Coefficient of an exactly sampled first-order low pass; 1 passes everything."""
    return 1.0 if math.isinf(cutoff_hz) else 1.0 - math.exp(-TURN * cutoff_hz * k.STEP_S)


class VirtualAxis:
    """Mechanics, power stage and loops of one drive.

    Angles are motor radians in the encoder's own frame, which homing never moves. ``events`` is
    cleared by ``run``.
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
        self._loops: LoopSettings | None = None
        self._homing = False
        self._braked = self._brake_released = False
        self._set_physics(spec)
        self.set_current_loop(1000.0)
        self.apply_protections(ProtectionSettings())
        self.apply_windows(0.0, 0.0, 0.0, math.inf)
        self.set_limits(math.inf, math.inf, math.inf)
        self.set_alarm(None)
        self.p[k.P_LIMIT_DEC] = 1e3
        gains = GainSet(0.0, 0.0, 0.0)
        self.apply_loops(LoopSettings(first=gains, second=gains, homing=None))
        self.power_off()

    def _set_physics(self, spec: MechanicsSpec) -> None:
        p, motor, turn = self.p, self.motor, TURN
        p[k.P_COUNTS_PER_RAD] = spec.encoder.counts_per_rev / turn
        p[k.P_NOISE] = spec.encoder.noise_counts
        p[k.P_COULOMB] = spec.friction.coulomb_nm
        p[k.P_STICTION] = max(spec.friction.static_nm - spec.friction.coulomb_nm, 0.0)
        p[k.P_STRIBECK] = spec.friction.stribeck_rad_s
        p[k.P_GRAVITY] = spec.friction.gravity_nm
        p[k.P_PLACE_NM] = spec.place.torque_nm
        p[k.P_PLACE_PER_RAD] = 1.0 / spec.place.period_rev
        p[k.P_PLACE_AT] = spec.place.at_rev * 2.0 * math.pi
        p[k.P_FAN] = spec.friction.fan_nms2
        p[k.P_STOP_MIN] = spec.travel.min_rev * turn
        p[k.P_STOP_MAX] = spec.travel.max_rev * turn
        negative, positive = spec.limit_switches_rev
        p[k.P_LIMIT_NEGATIVE], p[k.P_LIMIT_POSITIVE] = negative * turn, positive * turn
        p[k.P_HOME_FROM] = spec.switches.home_from_rev * turn
        p[k.P_HOME_TO] = spec.switches.home_to_rev * turn
        p[k.P_INDEX_RAD] = turn
        p[k.P_KT], p[k.P_RESISTANCE] = motor.torque_constant, motor.resistance_ohm
        p[k.P_RATED_NM] = motor.rated_torque_nm
        p[k.P_POWER_LIMIT_V] = 1 / math.sqrt(6)
        p[k.P_SUPPLY_V], p[k.P_SUPPLY_R] = spec.supply.voltage_v, spec.supply.resistance_ohm
        p[k.P_SUPPLY_C], p[k.P_SUPPLY_SINKS] = spec.supply.capacitance_f, spec.supply.sinks
        p[k.P_BRAKE_R] = 25.0  # built-in braking resistor, 004:2235-2241
        rated_loss = 3 * motor.resistance_ohm * motor.rated_current_a**2
        p[k.P_THERMAL_K_PER_W] = 35.0 / rated_loss
        p[k.P_THERMAL_S] = 120.0
        p[k.P_AMBIENT] = spec.supply.ambient_c
        p[k.P_LOAD_RATIO_S] = 1.0
        p[k.P_EVENT_MASK] = k.EV_FAULT | k.EV_STOPPED
        self.s[k.S_VOLTAGE] = spec.supply.voltage_v
        self.s[k.S_TEMPERATURE] = spec.supply.ambient_c

    # --- running ---------------------------------------------------------------------------
    def run(self, steps: int) -> int:
        """Advance by up to ``steps`` of 50 µs; returns how many were done before an event."""
        self.s[k.S_EVENTS] = 0.0
        chain = self._chain
        done: int = k.run(
            steps, self.p, self.s, self._x, chain.a, chain.b, chain.gap_state,
            chain.half_gap_rad, self._scratch, self._random,
        )  # fmt: skip
        return done

    @property
    def events(self) -> int:
        """EV_* bits that ended the last run."""
        return int(self.s.item(k.S_EVENTS)) & int(self.p.item(k.P_EVENT_MASK))

    def listen(self, *events: int) -> None:
        """Events that end a run, besides fault, stop and alarm clock which always do."""
        mask = k.EV_FAULT | k.EV_STOPPED | k.EV_ALARM_CLOCK | k.EV_LIMIT
        for event in events:
            mask |= event
        self.p[k.P_EVENT_MASK] = mask

    def set_alarm(self, step: float | None) -> None:
        """End a run when the step counter reaches this value."""
        self.p[k.P_ALARM_STEP] = math.inf if step is None else step

    # --- settings --------------------------------------------------------------------------
    def set_current_loop(self, bandwidth_hz: float) -> None:
        """Bandwidth of the first-order current loop."""
        if bandwidth_hz != self._current_loop_hz:
            self._current_loop_hz = bandwidth_hz
            self._chain = discretise(self.spec, TURN * bandwidth_hz, k.STEP_S)

    def apply_loops(self, loops: LoopSettings) -> None:
        """Gains, filters, feed-forward and notches."""
        self._loops = loops
        self.set_current_loop(loops.current_loop_hz)
        p = self.p
        first, second = loops.first, loops.second
        if self._homing and loops.homing is not None:
            first = second = loops.homing
        p[k.P_KP_POSITION_1], p[k.P_KP_POSITION_2] = first.position_per_s, second.position_per_s
        p[k.P_KP_SPEED_1], p[k.P_KP_SPEED_2] = first.speed_nms, second.speed_nms
        p[k.P_KI_SPEED_1], p[k.P_KI_SPEED_2] = first.integral_nm, second.integral_nm
        switching = loops.switching
        p[k.P_SWITCH_KIND], p[k.P_SWITCH_LEVEL] = switching.kind, switching.level
        p[k.P_SWITCH_HYSTERESIS] = switching.hysteresis
        p[k.P_SWITCH_DELAY], p[k.P_SWITCH_TIME] = switching.delay_s, switching.ramp_s
        p[k.P_SPEED_OUT_LIMIT] = loops.speed_output_nm
        p[k.P_POSITION_OUT_LIMIT] = loops.position_output_rad_s
        p[k.P_TORQUE_SPEED_LIMIT] = loops.torque_mode_speed_rad_s
        p[k.P_FF_SPEED] = loops.speed_feed_forward
        p[k.P_FF_SPEED_COEFFICIENT] = _lag(loops.speed_feed_forward_s)
        p[k.P_FF_TORQUE] = loops.torque_feed_forward * loops.inertia_kgm2
        p[k.P_FF_TORQUE_COEFFICIENT] = _lag(loops.torque_feed_forward_s)
        p[k.P_POSITION_FILTER] = low_pass(loops.position_filter_hz)
        p[k.P_SPEED_FILTER] = low_pass(loops.speed_filter_hz)
        p[k.P_SPEED_SOURCE] = loops.use_observer
        p[k.P_OBSERVER_GAIN] = low_pass(loops.observer_hz)
        p[k.P_OBSERVER_INERTIA] = loops.inertia_kgm2
        p[k.P_OBSERVER_VISCOUS] = loops.viscous_nms
        p[k.P_OBSERVER_COULOMB] = loops.coulomb_nm
        p[k.P_STOP_SPEED], p[k.P_STOP_TORQUE] = loops.brake_speed_rad_s, loops.brake_torque_nm
        p[k.P_TORQUE_FILTER] = _lag(loops.torque_filter_s)
        second_s = loops.torque_filter_2_s
        p[k.P_TORQUE_FILTER_2] = _lag(loops.torque_filter_s if second_s is None else second_s)
        compensation = loops.compensation
        p[k.P_TORQUE_BIAS], p[k.P_FRICTION_VISCOUS] = compensation.bias_nm, compensation.viscous_nms
        p[k.P_FRICTION_POSITIVE] = compensation.positive_nm
        p[k.P_FRICTION_NEGATIVE] = compensation.negative_nm
        self._apply_extras(loops)
        p[k.P_NOTCH_COUNT] = len(loops.notches)
        for i, notch in enumerate(loops.notches):
            start = k.P_NOTCHES + 4 * i
            p[start : start + 4] = notch.a1, notch.a2, notch.b1, notch.b2

    def _apply_extras(self, loops: LoopSettings) -> None:
        """Third gains, command notch and quadrant compensation of the families that have them."""
        p, third, swing = self.p, loops.third, loops.swing
        p[k.P_THIRD_GAINS] = third is not None
        if third is not None:
            p[k.P_THIRD_DELAY] = third.delay_s
            p[k.P_KP_POSITION_3] = third.gains.position_per_s
            p[k.P_KP_SPEED_3] = third.gains.speed_nms
            p[k.P_KI_SPEED_3] = third.gains.integral_nm
        p[k.P_SHAPE_ON] = swing is not None
        if swing is not None:
            first = k.P_SHAPE_A11
            p[first : first + 6] = _swing_coefficients(swing)
        quadrant = loops.quadrant
        p[k.P_QUADRANT_POSITIVE] = quadrant.positive_nm
        p[k.P_QUADRANT_NEGATIVE] = quadrant.negative_nm
        p[k.P_QUADRANT_DELAY], p[k.P_QUADRANT_ANGLE] = quadrant.delay_s, quadrant.angle_rad
        p[k.P_QUADRANT_FILTER] = _lag(quadrant.filter_s)

    def use_homing_gains(self, homing: bool) -> None:
        """Switch to or from the gain set for homing."""
        if homing != self._homing and self._loops is not None:
            self._homing = homing
            self.apply_loops(self._loops)

    def apply_protections(self, limits: ProtectionSettings) -> None:
        """Thresholds of the protections."""
        p = self.p
        p[k.P_OCP_A], p[k.P_UVLO_V] = limits.over_current_a, limits.under_voltage_v
        p[k.P_OVP_V], p[k.P_BRAKE_ON_V] = limits.over_voltage_v, limits.brake_on_v
        fitted = limits.brake_enabled and self.spec.supply.braking_resistor
        p[k.P_BRAKE_OFF_V], p[k.P_BRAKE_ENABLED] = limits.brake_off_v, fitted
        p[k.P_LOCK_ANGLE], p[k.P_LOCK_S] = limits.locked_angle_rad, limits.locked_s
        p[k.P_OVERLOAD_NM], p[k.P_OVERLOAD_S] = limits.overload_nm, limits.overload_s
        p[k.P_OTP_C], p[k.P_OVER_SPEED] = limits.over_temperature_c, limits.over_speed_rad_s
        p[k.P_SPEED_ERROR], p[k.P_SPEED_ERROR_S] = limits.speed_error_rad_s, limits.speed_error_s
        p[k.P_FOLLOWING_S], p[k.P_BRAKE_R] = limits.following_error_s, limits.braking_ohm
        p[k.P_I2T_LIMIT] = limits.i2t_s
        rated = self.motor.rated_torque_nm
        p[k.P_I2T_RATED_NM] = min(limits.i2t_rated_nm, 1e3 * rated)
        p[k.P_LOCK_NM] = rated if limits.locked_nm is None else limits.locked_nm
        self._braked = limits.holding_brake or self.spec.motor.brake
        self.release_brake(self._brake_released)

    def apply_impedance(self, settings: ImpedanceSettings) -> None:
        """Gains of the impedance controller."""
        p = self.p
        p[k.P_Z_KP], p[k.P_Z_KI], p[k.P_Z_KD] = settings.kp, settings.ki, settings.kd
        p[k.P_Z_FILTER], p[k.P_Z_LIMIT] = low_pass(settings.filter_hz), settings.limit_nm

    def apply_windows(
        self, position_rad: float, speed_rad_s: float, zero_rad_s: float, following_rad: float
    ) -> None:
        """Windows of target reached, zero speed and following error."""
        self.p[k.P_POSITION_WINDOW], self.p[k.P_SPEED_WINDOW] = position_rad, speed_rad_s
        self.p[k.P_ZERO_SPEED], self.p[k.P_FOLLOWING_WINDOW] = zero_rad_s, following_rad

    def set_limits(self, positive_nm: float, negative_nm: float, speed_rad_s: float) -> None:
        """Torque limits (both as magnitudes) and the largest speed reference."""
        self.p[k.P_T_MAX], self.p[k.P_T_MIN] = positive_nm, -negative_nm
        self.p[k.P_MAX_SPEED] = speed_rad_s

    def set_signals(self, *, forced: int, forced_on: int, inverted: int) -> None:
        """Switches that are not wired (forced to a level) or wired the other way round."""
        self.p[k.P_SIGNAL_FORCED], self.p[k.P_SIGNAL_FORCED_ON] = forced, forced_on
        self.p[k.P_SIGNAL_INVERTED] = inverted

    def watch_signals(self, mask: int) -> None:
        """Raise EV_SIGNAL as soon as one of these switches changes; 0 watches none."""
        self.p[k.P_WATCH_MASK] = mask
        self.p[k.P_WATCH_VALUE] = int(self.s[k.S_SIGNALS]) & mask

    def watch_stall(self, torque_nm: float, time_s: float, speed_rad_s: float) -> None:
        """Raise EV_STALL after this long at this torque below this speed; 0 Nm switches off."""
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
        """Open the power stage: the axis coasts (or the holding brake grips).

        With ``dynamic_brake`` the windings are shorted: Kt²/(3R) Nm per rad/s.
        """
        self._begin(k.GEN_OFF, k.LOOP_OFF)
        motor = self.motor
        shorted = motor.torque_constant**2 / (3 * motor.resistance_ohm)
        self.p[k.P_DYNAMIC_BRAKE] = shorted if dynamic_brake else 0.0

    def await_standstill(self) -> None:
        """Raise EV_STOPPED as soon as the axis, which is not powered, has come to rest."""
        self.s[k.S_STOPPED] = 0.0
        self.p[k.P_STOPPING] = 1.0

    def release_brake(self, released: bool) -> None:
        """Whether the holding brake is kept open, with or without power."""
        self._brake_released = released
        grips = self._braked and not released
        self.p[k.P_BRAKE_TORQUE] = 2 * self.motor.rated_torque_nm if grips else 0.0

    def close_brake(self, closed: bool) -> None:
        """The holding brake, apart from the power stage (it grips without power in any case)."""
        self.p[k.P_BRAKE_CLOSED] = float(closed)

    def hold(self, at_rad: float | None = None) -> None:
        """Close the position loop at this angle, or where the axis is, from its speed."""
        moving = bool(self.p[k.P_LOOP] == k.LOOP_POSITION)
        self._begin(k.GEN_POSITION, k.LOOP_POSITION)
        if not moving:
            self.s[k.S_P_DEMAND] = self.s[k.S_THETA]
            self.s[k.S_V_DEMAND] = 0.0
        self.p[k.P_TARGET] = self.s[k.S_P_DEMAND] if at_rad is None else at_rad
        if at_rad is None:
            self.s[k.S_V_DEMAND] = 0.0

    def move(self, target_rad: float, speed: float, acceleration: float, braking: float) -> None:
        """Trapezoidal move from the present demand to an absolute angle; rad/s, rad/s²."""
        if self.p[k.P_LOOP] != k.LOOP_POSITION:
            self.s[k.S_P_DEMAND] = self.s[k.S_THETA]
            self.s[k.S_V_DEMAND] = self.s[k.S_OMEGA] if self.powered else 0.0
        self._begin(k.GEN_POSITION, k.LOOP_POSITION)
        self.p[k.P_TARGET] = target_rad
        self.p[k.P_V_MAX], self.p[k.P_ACC], self.p[k.P_DEC] = speed, acceleration, braking

    def run_velocity(self, speed: float, acceleration: float, braking: float) -> None:
        """Ramp to a speed and keep it."""
        if self.p[k.P_LOOP] not in (k.LOOP_SPEED, k.LOOP_POSITION):
            self.s[k.S_V_DEMAND] = self.s[k.S_OMEGA]
        self._begin(k.GEN_VELOCITY, k.LOOP_SPEED)
        self.p[k.P_V_TARGET], self.p[k.P_ACC], self.p[k.P_DEC] = speed, acceleration, braking

    def run_torque(self, torque_nm: float, slope_nm_s: float) -> None:
        """Ramp to a torque and keep it."""
        if self.p[k.P_LOOP] != k.LOOP_TORQUE:
            self.s[k.S_T_DEMAND] = self.s[k.S_TORQUE_COMMAND]
        self._begin(k.GEN_TORQUE, k.LOOP_TORQUE)
        self.p[k.P_T_TARGET], self.p[k.P_T_SLOPE] = torque_nm, slope_nm_s

    def run_cyclic(self, loop: int) -> None:
        """Follow interpolated set-points from the present demand (or actual) values."""
        s = self.s
        if self.p[k.P_LOOP] != k.LOOP_POSITION:
            s[k.S_P_DEMAND] = s[k.S_THETA]
        self._begin(k.GEN_CYCLIC, loop)
        s[k.S_IP_POSITION] = s[k.S_P_DEMAND]
        s[k.S_IP_SPEED] = s[k.S_OMEGA] if loop == k.LOOP_SPEED else 0.0
        s[k.S_IP_TORQUE] = s[k.S_TORQUE_COMMAND] if loop == k.LOOP_TORQUE else 0.0
        s[k.S_IP_LEFT] = 0.0

    def set_cyclic(self, angle_rad: float, speed: float, torque_nm: float, steps: int) -> None:
        """New cyclic set-points, reached linearly in ``steps`` of 50 µs (004:7618-7621)."""
        s, item = self.s, self.s.item
        s[k.S_IP_POSITION_INC] = (angle_rad - item(k.S_IP_POSITION)) / steps
        s[k.S_IP_SPEED_INC] = (speed - item(k.S_IP_SPEED)) / steps
        s[k.S_IP_TORQUE_INC] = (torque_nm - item(k.S_IP_TORQUE)) / steps
        s[k.S_IP_LEFT] = float(steps)

    def stop_ramp(self, braking: float) -> None:
        """Brake to rest at this deceleration; EV_STOPPED tells when."""
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
        """Take the torque back at this slope; EV_STOPPED tells when the axis stands."""
        self.run_torque(0.0, slope_nm_s)
        self.p[k.P_STOPPING] = 1.0

    def stop_by_torque(self, torque_nm: float) -> None:
        """Brake with a constant torque (0 coasts under power); EV_STOPPED tells when."""
        self._begin(k.GEN_TORQUE_STOP, k.LOOP_TORQUE)
        self.p[k.P_STOP_TORQUE] = torque_nm
        self.p[k.P_STOPPING] = 1.0

    def place(self, angle_rad: float) -> None:
        """Turn the shaft by hand to an angle, without power and at rest; the loads follow."""
        x, s = self._x, self.s
        x[:] = 0.0
        x[0] = angle_rad
        s[k.S_THETA] = s[k.S_THETA_FILTERED] = s[k.S_P_DEMAND] = angle_rad
        s[k.S_OMEGA_LOW] = s[k.S_OMEGA_OBSERVED] = s[k.S_OMEGA] = 0.0
        s[k.S_INDEX_COUNT] = math.floor(angle_rad / self.p[k.P_INDEX_RAD])

    def clear_faults(self) -> None:
        """Forget latched faults and their timers."""
        for name in (
            k.S_FAULTS, k.S_OVERLOAD_T, k.S_SPEED_ERROR_T, k.S_LOCK_T, k.S_FOLLOWING_T,
        ):  # fmt: skip
            self.s[name] = 0.0

    def live_faults(self) -> int:
        """Faults whose cause is present now, as F_* bits; timed ones need time to come back."""
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
    def torque_nm(self) -> float:
        """Motor torque."""
        return float(self.s[k.S_TORQUE])

    def trace(self) -> npt.NDArray[np.float64]:
        """The last 4096 torque commands, oldest first, one per 50 µs [Nm]."""
        ring = self.s[k.S_TRACE : k.S_TRACE + k.TRACE_STEPS]
        return np.roll(ring, -(int(self.s[k.S_STEP]) % k.TRACE_STEPS))

    @property
    def faults(self) -> int:
        """Latched F_* bits."""
        return int(self.s[k.S_FAULTS])

    def raise_fault(self, bit: int) -> None:
        """Latch a fault as if its protection had acted."""
        self.s[k.S_FAULTS] = float(self.faults | bit)


def _lag(time_constant_s: float) -> float:
    return 1.0 if time_constant_s <= 0 else 1.0 - math.exp(-k.STEP_S / time_constant_s)


def _swing_coefficients(swing: SwingFilter) -> list[float]:
    """The kernel's A11, A12, A21, A22, B1, B2: the notch's low pass, sampled exactly."""
    w, two_zeta_w = TURN * swing.frequency_hz, 2 * swing.damping * TURN * swing.frequency_hz
    block = np.array([[0.0, 1.0, 0.0], [-w * w, -two_zeta_w, two_zeta_w], [0.0, 0.0, 0.0]])
    solved = expm(block * k.STEP_S)
    return [solved[i, j] for i, j in ((0, 0), (0, 1), (1, 0), (1, 1), (0, 2), (1, 2))]
