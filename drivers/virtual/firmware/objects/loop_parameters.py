"""Conversion of settings in SI units to the parameters of the 50 µs loop.

Each function writes only its own part of ``p`` (`drivers.virtual.firmware.kernel.layout`).
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import numpy.typing as npt
from scipy.linalg import expm

from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.objects.settings import (
    GainSet,
    ImpedanceSettings,
    LoopSettings,
    MotorData,
    ProtectionSettings,
    SwingFilter,
)
from drivers.virtual.mechanics import MechanicsSpec

TURN: Final = 2 * math.pi

Parameters = npt.NDArray[np.float64]


def low_pass(cutoff_hz: float) -> float:
    """Return the coefficient of an exactly sampled first-order low-pass; 1 means no filter."""
    return 1.0 if math.isinf(cutoff_hz) else 1.0 - math.exp(-TURN * cutoff_hz * k.STEP_S)


def write_physics(p: Parameters, spec: MechanicsSpec, motor: MotorData) -> None:
    """Write encoder, friction, travel, switches, motor and supply of this axis."""
    p[k.P_COUNTS_PER_RAD] = spec.encoder.counts_per_rev / TURN
    p[k.P_NOISE] = spec.encoder.noise_counts
    encoder, phases = spec.encoder, spec.phases
    sense = -encoder.counted_share if encoder.inverted else encoder.counted_share
    p[k.P_ENCODER_SENSE] = sense
    p[k.P_COMMUTATION_SENSE] = 1.0 if phases.commutation == "hall" else sense
    p[k.P_PHASES_WRONG] = phases.wrong or p[k.P_COMMUTATION_SENSE] != 1.0
    p[k.P_FIELD_SENSE] = -1.0 if phases.order == "exchanged" else 1.0
    shifted = TURN / 3 if phases.order == "shifted" else 0.0
    p[k.P_FIELD_ANGLE] = shifted + math.radians(phases.angle_deg)
    p[k.P_POLE_PAIRS] = phases.pole_pairs
    p[k.P_COULOMB] = spec.friction.coulomb_nm
    p[k.P_LOAD_COULOMB] = spec.friction.load_coulomb_nm
    p[k.P_STICTION] = max(spec.friction.static_nm - spec.friction.coulomb_nm, 0.0)
    p[k.P_STRIBECK] = spec.friction.stribeck_rad_s
    p[k.P_STRIBECK_TANH] = spec.friction.stribeck_law == "tanh"
    ripple = spec.ripple
    p[k.P_RIPPLE_REVOLUTION], p[k.P_RIPPLE_PHASE] = ripple.revolution_nm, ripple.phase_rad
    p[k.P_RIPPLE_POLE_PAIR], p[k.P_RIPPLE_POLE_PAIRS] = ripple.pole_pair_nm, ripple.pole_pairs
    p[k.P_RIPPLE_COGGING] = ripple.cogging_nm
    p[k.P_RIPPLE_COGGING_SECOND] = ripple.cogging_second_nm
    p[k.P_RIPPLE_COGGING_PER_REV] = ripple.cogging_per_rev
    p[k.P_GRAVITY] = spec.friction.gravity_nm
    p[k.P_PLACE_NM] = spec.place.torque_nm
    p[k.P_PLACE_PER_RAD] = 1.0 / spec.place.period_rev
    p[k.P_PLACE_AT] = spec.place.at_rev * 2.0 * math.pi
    p[k.P_FAN] = spec.friction.fan_nms2
    p[k.P_STOP_MIN] = spec.travel.min_rev * TURN
    p[k.P_STOP_MAX] = spec.travel.max_rev * TURN
    negative, positive = spec.limit_switches_rev
    p[k.P_LIMIT_NEGATIVE], p[k.P_LIMIT_POSITIVE] = negative * TURN, positive * TURN
    p[k.P_HOME_FROM] = spec.switches.home_from_rev * TURN
    p[k.P_HOME_TO] = spec.switches.home_to_rev * TURN
    p[k.P_INDEX_RAD] = TURN
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


def write_gains(p: Parameters, first: GainSet, second: GainSet) -> None:
    """Write the two gain sets between which the loop switches."""
    p[k.P_KP_POSITION_1], p[k.P_KP_POSITION_2] = first.position_per_s, second.position_per_s
    p[k.P_KP_SPEED_1], p[k.P_KP_SPEED_2] = first.speed_nms, second.speed_nms
    p[k.P_KI_SPEED_1], p[k.P_KI_SPEED_2] = first.integral_nm, second.integral_nm


def write_loops(p: Parameters, loops: LoopSettings) -> None:
    """Write gain switching, limits, feed-forward, filters and notches; not the gains themselves."""
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
    _write_extras(p, loops)
    p[k.P_NOTCH_COUNT] = len(loops.notches)
    for i, notch in enumerate(loops.notches):
        start = k.P_NOTCHES + 4 * i
        p[start : start + 4] = notch.a1, notch.a2, notch.b1, notch.b2


def _write_extras(p: Parameters, loops: LoopSettings) -> None:
    """Write third gains, command notch and quadrant compensation of families that have them."""
    third, swing = loops.third, loops.swing
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


def write_protections(
    p: Parameters, limits: ProtectionSettings, rated_nm: float, resistor: bool
) -> None:
    """Write thresholds of the protections; ``resistor``: a braking resistor is fitted."""
    p[k.P_OCP_A], p[k.P_UVLO_V] = limits.over_current_a, limits.under_voltage_v
    p[k.P_OVP_V], p[k.P_BRAKE_ON_V] = limits.over_voltage_v, limits.brake_on_v
    fitted = limits.brake_enabled and resistor
    p[k.P_BRAKE_OFF_V], p[k.P_BRAKE_ENABLED] = limits.brake_off_v, fitted
    p[k.P_LOCK_ANGLE], p[k.P_LOCK_S] = limits.locked_angle_rad, limits.locked_s
    p[k.P_OVERLOAD_NM], p[k.P_OVERLOAD_S] = limits.overload_nm, limits.overload_s
    p[k.P_OTP_C], p[k.P_OVER_SPEED] = limits.over_temperature_c, limits.over_speed_rad_s
    p[k.P_SPEED_ERROR], p[k.P_SPEED_ERROR_S] = limits.speed_error_rad_s, limits.speed_error_s
    p[k.P_FOLLOWING_S], p[k.P_BRAKE_R] = limits.following_error_s, limits.braking_ohm
    p[k.P_I2T_LIMIT] = limits.i2t_s
    p[k.P_I2T_RATED_NM] = min(limits.i2t_rated_nm, 1e3 * rated_nm)
    p[k.P_LOCK_NM] = rated_nm if limits.locked_nm is None else limits.locked_nm


def write_impedance(p: Parameters, settings: ImpedanceSettings) -> None:
    """Write gains of the impedance controller."""
    p[k.P_Z_KP], p[k.P_Z_KI], p[k.P_Z_KD] = settings.kp, settings.ki, settings.kd
    p[k.P_Z_FILTER], p[k.P_Z_LIMIT] = low_pass(settings.filter_hz), settings.limit_nm


def _lag(time_constant_s: float) -> float:
    return 1.0 if time_constant_s <= 0 else 1.0 - math.exp(-k.STEP_S / time_constant_s)


def _swing_coefficients(swing: SwingFilter) -> list[float]:
    """Return the kernel's A11, A12, A21, A22, B1, B2: the notch's low-pass, sampled exactly."""
    w, two_zeta_w = TURN * swing.frequency_hz, 2 * swing.damping * TURN * swing.frequency_hz
    block = np.array([[0.0, 1.0, 0.0], [-w * w, -two_zeta_w, two_zeta_w], [0.0, 0.0, 0.0]])
    solved = expm(block * k.STEP_S)
    return [solved[i, j] for i, j in ((0, 0), (0, 1), (1, 0), (1, 1), (0, 2), (1, 2))]
