"""The loops: position, speed, torque or impedance, then filter, notches and limits.

Loop structure: 004:2849-2896 (figure 33) and 004:3127-3174.
"""

from __future__ import annotations

from numba import njit

from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.kernel.basics import clamp
from drivers.virtual.firmware.kernel.compensate import friction_compensation, shape_command
from drivers.virtual.firmware.kernel.gains import select_gains, third_share


@njit(nogil=True)
def _speed_controller(p, s, reference, mix, third):  # type: ignore[no-untyped-def]
    """Compute PI control with torque feed-forward; return torque and the integral's increment."""
    kp = p[k.P_KP_SPEED_1] + mix * (p[k.P_KP_SPEED_2] - p[k.P_KP_SPEED_1])
    kp += third * (p[k.P_KP_SPEED_3] - kp)
    ki = p[k.P_KI_SPEED_1] + mix * (p[k.P_KI_SPEED_2] - p[k.P_KI_SPEED_1])
    ki += third * (p[k.P_KI_SPEED_3] - ki)
    error = reference - s[k.S_OMEGA]
    limit = p[k.P_SPEED_OUT_LIMIT]
    torque = clamp(kp * error + s[k.S_INTEGRAL], -limit, limit)
    wanted = p[k.P_FF_TORQUE] * s[k.S_A_DEMAND]
    s[k.S_FF_TORQUE] += p[k.P_FF_TORQUE_COEFFICIENT] * (wanted - s[k.S_FF_TORQUE])
    increment = ki * error * k.STEP_S
    if abs(torque) >= limit and increment * torque > 0.0:
        increment = 0.0
    return torque + s[k.S_FF_TORQUE], increment


@njit(nogil=True)
def _impedance(p, s):  # type: ignore[no-untyped-def]
    """Impedance controller of figure 53 (004:4548-4565)."""
    error = s[k.S_IP_POSITION] - s[k.S_THETA]
    s[k.S_Z_SPEED] += p[k.P_Z_FILTER] * (s[k.S_IP_SPEED] - s[k.S_OMEGA] - s[k.S_Z_SPEED])
    limit = p[k.P_Z_LIMIT]
    s[k.S_Z_INTEGRAL] = clamp(s[k.S_Z_INTEGRAL] + p[k.P_Z_KI] * error * k.STEP_S, -limit, limit)
    torque = p[k.P_Z_KP] * error + s[k.S_Z_INTEGRAL] + p[k.P_Z_KD] * s[k.S_Z_SPEED]
    return clamp(torque, -limit, limit) + s[k.S_T_DEMAND]


@njit(nogil=True)
def _let_go(p, s):  # type: ignore[no-untyped-def]
    """Reset commands and controllers while the power stage is off."""
    s[k.S_INTEGRAL] = 0.0
    s[k.S_FF_SPEED] = 0.0
    s[k.S_FF_TORQUE] = 0.0
    # Dynamic braking: the shorted windings brake in proportion to the speed of the shaft, whichever
    # way its encoder counts.
    s[k.S_TORQUE_COMMAND] = -p[k.P_DYNAMIC_BRAKE] * p[k.P_ENCODER_SENSE] * s[k.S_OMEGA]
    s[k.S_SATURATED] = 0.0
    s[k.S_TORQUE_FILTERED] = 0.0
    s[k.S_SPEED_REFERENCE] = s[k.S_OMEGA]
    s[k.S_SHAPE] = 0.0
    s[k.S_SHAPE_RATE] = 0.0
    s[k.S_QUADRANT] = 0.0
    s[k.S_QUADRANT_SIGN] = 0.0
    for i in range(8):
        s[k.S_NOTCHES + i] = 0.0


@njit(nogil=True)
def _position_controller(p, s, mix, third):  # type: ignore[no-untyped-def]
    """Return the speed reference of the position loop with its feed-forward."""
    shape_command(p, s)
    error = s[k.S_P_DEMAND] - s[k.S_SHAPE] - s[k.S_THETA_FILTERED]
    kp = p[k.P_KP_POSITION_1] + mix * (p[k.P_KP_POSITION_2] - p[k.P_KP_POSITION_1])
    kp += third * (p[k.P_KP_POSITION_3] - kp)
    wanted = p[k.P_FF_SPEED] * (s[k.S_V_DEMAND] - s[k.S_SHAPE_RATE])
    s[k.S_FF_SPEED] += p[k.P_FF_SPEED_COEFFICIENT] * (wanted - s[k.S_FF_SPEED])
    limit = p[k.P_POSITION_OUT_LIMIT]
    reference = clamp(kp * error, -limit, limit) + s[k.S_FF_SPEED]
    if int(p[k.P_GEN]) == k.GEN_CYCLIC:
        reference += s[k.S_IP_SPEED]
    return reference


@njit(nogil=True)
def _moving_torque(p, s, loop):  # type: ignore[no-untyped-def]
    """Return the torque of the position and speed loops, and the integral's increment."""
    mix = select_gains(p, s, loop)
    third = third_share(p, s, loop)
    reference = s[k.S_V_DEMAND]
    if loop == k.LOOP_POSITION:
        reference = _position_controller(p, s, mix, third)
    else:
        s[k.S_SHAPE] = 0.0
        s[k.S_SHAPE_RATE] = 0.0
    limited = clamp(reference, -p[k.P_MAX_SPEED], p[k.P_MAX_SPEED])
    s[k.S_SPEED_LIMITED] = 0.0 if limited == reference else 1.0
    s[k.S_SPEED_REFERENCE] = limited
    torque, increment = _speed_controller(p, s, limited, mix, third)
    torque += friction_compensation(p, s)
    if int(p[k.P_GEN]) == k.GEN_CYCLIC:
        torque += s[k.S_IP_TORQUE]
    return torque, increment


@njit(nogil=True)
def _commanded_torque(p, s, loop):  # type: ignore[no-untyped-def]
    """Return the torque of torque and impedance modes, reduced beyond the speed limit."""
    s[k.S_INTEGRAL] = 0.0
    s[k.S_SPEED_REFERENCE] = s[k.S_OMEGA]
    torque = s[k.S_T_DEMAND] if loop == k.LOOP_TORQUE else _impedance(p, s)
    limit = p[k.P_TORQUE_SPEED_LIMIT]
    upper = p[k.P_KP_SPEED_1] * (limit - s[k.S_OMEGA])
    lower = p[k.P_KP_SPEED_1] * (-limit - s[k.S_OMEGA])
    if torque > upper or torque < lower:
        s[k.S_SPEED_LIMITED] = 1.0
        torque = clamp(torque, lower, upper)
    return torque


@njit(nogil=True)
def _filtered(p, s, torque):  # type: ignore[no-untyped-def]
    """Return the torque after torque filter and notches."""
    share = s[k.S_GAIN_MIX]
    lag = p[k.P_TORQUE_FILTER] + share * (p[k.P_TORQUE_FILTER_2] - p[k.P_TORQUE_FILTER])
    s[k.S_TORQUE_FILTERED] += lag * (torque - s[k.S_TORQUE_FILTERED])
    torque = s[k.S_TORQUE_FILTERED]
    for i in range(int(p[k.P_NOTCH_COUNT])):
        c, z = k.P_NOTCHES + 4 * i, k.S_NOTCHES + 2 * i
        out = torque + s[z]
        s[z] = p[c] * torque - p[c + 2] * out + s[z + 1]
        s[z + 1] = p[c + 1] * torque - p[c + 3] * out
        torque = out
    return torque


@njit(nogil=True)
def control(p, s):  # type: ignore[no-untyped-def]
    """Compute the torque command of this step, limited by its limits and the bus voltage."""
    loop = int(p[k.P_LOOP])
    if loop == k.LOOP_OFF:
        _let_go(p, s)
        return
    increment = 0.0
    s[k.S_SPEED_LIMITED] = 0.0
    if loop in (k.LOOP_POSITION, k.LOOP_SPEED):
        torque, increment = _moving_torque(p, s, loop)
    else:
        torque = _commanded_torque(p, s, loop)
    torque = _filtered(p, s, torque)
    # The remaining bus voltage limits the current at speed.
    emf = p[k.P_KT] * s[k.S_OMEGA] / 3.0
    room = s[k.S_VOLTAGE] * p[k.P_POWER_LIMIT_V]
    high = min(p[k.P_T_MAX], max(0.0, (room - emf) / p[k.P_RESISTANCE]) * p[k.P_KT])
    low = max(p[k.P_T_MIN], -max(0.0, (room + emf) / p[k.P_RESISTANCE]) * p[k.P_KT])
    command = clamp(torque, low, high)
    s[k.S_SATURATED] = 0.0 if command == torque else 1.0
    if command == torque or increment * (torque - command) < 0.0:
        s[k.S_INTEGRAL] += increment
    s[k.S_TORQUE_COMMAND] = command
