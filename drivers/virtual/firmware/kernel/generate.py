"""The command generator: demanded position, speed and torque of each step.

Linear interpolation over 60C2h: 004:7618-7621.
"""

from __future__ import annotations

import math

from numba import njit

from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.kernel.basics import clamp, raise_event


@njit(nogil=True)
def _approach(value, goal, rise, fall):  # type: ignore[no-untyped-def]
    """One step of a speed ramp: ``rise`` away from zero, ``fall`` towards it."""
    difference = goal - value
    limit = rise if value * difference >= 0.0 else fall
    if difference > limit:
        return value + limit
    if difference < -limit:
        return value - limit
    return goal


@njit(nogil=True)
def _held(p, s, towards):  # type: ignore[no-untyped-def]
    """Return whether an active limit switch blocks this direction (sign of ``towards``)."""
    held = False
    if p[k.P_LIMIT_STOPS] == k.LIMIT_HOLDS:
        signals = int(s[k.S_SIGNALS])
        held = (towards > 0.0 and signals & k.SIG_POSITIVE != 0) or (
            towards < 0.0 and signals & k.SIG_NEGATIVE != 0
        )
    if held and s[k.S_LIMIT_HELD] == 0.0:
        raise_event(s, k.EV_LIMIT)
    s[k.S_LIMIT_HELD] = 1.0 if held else 0.0
    return held


@njit(nogil=True)
def _generate_position(p, s):  # type: ignore[no-untyped-def]
    speed = s[k.S_V_DEMAND]
    if p[k.P_STOPPING] > 0.0:
        new = _approach(speed, 0.0, 0.0, p[k.P_STOP_DEC] * k.STEP_S)
    elif _held(p, s, p[k.P_TARGET] - s[k.S_P_DEMAND]):
        new = _approach(speed, 0.0, 0.0, p[k.P_LIMIT_DEC] * k.STEP_S)
        if new == 0.0:
            p[k.P_TARGET] = s[k.S_P_DEMAND]  # a target beyond the switch is abandoned
    else:
        distance = p[k.P_TARGET] - s[k.S_P_DEMAND]
        fall = p[k.P_DEC] * k.STEP_S
        half = 0.5 * fall
        allowed = math.sqrt(half * half + 2.0 * p[k.P_DEC] * abs(distance)) - half
        goal = math.copysign(min(p[k.P_V_MAX], allowed), distance)
        new = _approach(speed, goal, p[k.P_ACC] * k.STEP_S, fall * 1.0001)
        if (
            new * distance >= 0.0
            and abs(new) * k.STEP_S >= abs(distance)
            and abs(new) <= 2.0 * fall
        ):
            new = 0.0
            s[k.S_P_DEMAND] = p[k.P_TARGET]
            if s[k.S_ARRIVED] == 0.0:
                s[k.S_ARRIVED] = 1.0
                raise_event(s, k.EV_ARRIVED)
    s[k.S_P_DEMAND] += new * k.STEP_S
    s[k.S_A_DEMAND] = (new - speed) / k.STEP_S
    s[k.S_V_DEMAND] = new


@njit(nogil=True)
def _generate_velocity(p, s):  # type: ignore[no-untyped-def]
    speed = s[k.S_V_DEMAND]
    if p[k.P_STOPPING] > 0.0:
        new = _approach(speed, 0.0, 0.0, p[k.P_STOP_DEC] * k.STEP_S)
    elif _held(p, s, p[k.P_V_TARGET]):
        new = _approach(speed, 0.0, 0.0, p[k.P_LIMIT_DEC] * k.STEP_S)
    else:
        new = _approach(speed, p[k.P_V_TARGET], p[k.P_ACC] * k.STEP_S, p[k.P_DEC] * k.STEP_S)
        s[k.S_ARRIVED] = 1.0 if new == p[k.P_V_TARGET] else 0.0
    s[k.S_A_DEMAND] = (new - speed) / k.STEP_S
    s[k.S_V_DEMAND] = new
    s[k.S_P_DEMAND] = s[k.S_THETA]


@njit(nogil=True)
def _generate_cyclic(p, s):  # type: ignore[no-untyped-def]
    speed = s[k.S_V_DEMAND]
    loop = int(p[k.P_LOOP])
    held = False
    if p[k.P_LIMIT_STOPS] == k.LIMIT_HOLDS:
        towards = s[k.S_IP_POSITION_INC] if loop == k.LOOP_POSITION else s[k.S_IP_SPEED]
        if loop in (k.LOOP_TORQUE, k.LOOP_IMPEDANCE):
            towards = s[k.S_IP_TORQUE] if s[k.S_OMEGA] * s[k.S_IP_TORQUE] >= 0.0 else 0.0
        held = _held(p, s, towards)
    if held and loop == k.LOOP_POSITION:
        s[k.S_IP_LEFT] = 0.0
        s[k.S_V_DEMAND] = 0.0
    elif s[k.S_IP_LEFT] > 0.0:
        s[k.S_IP_LEFT] -= 1.0
        s[k.S_IP_POSITION] += s[k.S_IP_POSITION_INC]
        s[k.S_IP_SPEED] += s[k.S_IP_SPEED_INC]
        s[k.S_IP_TORQUE] += s[k.S_IP_TORQUE_INC]
        if loop == k.LOOP_POSITION:
            s[k.S_V_DEMAND] = s[k.S_IP_POSITION_INC] / k.STEP_S
    elif loop == k.LOOP_POSITION:
        s[k.S_V_DEMAND] = 0.0
    if loop == k.LOOP_POSITION:
        s[k.S_P_DEMAND] = s[k.S_IP_POSITION]
        s[k.S_T_DEMAND] = 0.0
    elif loop == k.LOOP_SPEED:
        s[k.S_V_DEMAND] = 0.0 if held else s[k.S_IP_SPEED]
        s[k.S_P_DEMAND] = s[k.S_THETA]
        s[k.S_T_DEMAND] = 0.0
    else:
        s[k.S_V_DEMAND] = s[k.S_OMEGA]
        s[k.S_P_DEMAND] = s[k.S_IP_POSITION] if loop == k.LOOP_IMPEDANCE else s[k.S_THETA]
        s[k.S_T_DEMAND] = 0.0 if held else s[k.S_IP_TORQUE]
    s[k.S_A_DEMAND] = (s[k.S_V_DEMAND] - speed) / k.STEP_S
    s[k.S_ARRIVED] = 1.0


@njit(nogil=True)
def generate(p, s):  # type: ignore[no-untyped-def]
    """Advance the demand by one step, and raise EV_STOPPED at the end of a stop."""
    kind = int(p[k.P_GEN])
    if kind == k.GEN_POSITION:
        _generate_position(p, s)
    elif kind == k.GEN_VELOCITY:
        _generate_velocity(p, s)
    elif kind == k.GEN_CYCLIC:
        _generate_cyclic(p, s)
    elif kind in (k.GEN_TORQUE, k.GEN_TORQUE_STOP):
        if kind == k.GEN_TORQUE:
            goal = 0.0 if p[k.P_STOPPING] > 0.0 else p[k.P_T_TARGET]
            if _held(p, s, goal):
                goal = 0.0
            slope = p[k.P_T_SLOPE] * k.STEP_S
            s[k.S_T_DEMAND] += clamp(goal - s[k.S_T_DEMAND], -slope, slope)
            s[k.S_ARRIVED] = 1.0 if s[k.S_T_DEMAND] == goal else 0.0
        else:
            # The speed controller with zero reference, limited to the braking torque: it does not
            # overshoot as a constant torque would.
            limit = p[k.P_STOP_TORQUE]
            s[k.S_T_DEMAND] = clamp(-p[k.P_KP_SPEED_1] * s[k.S_OMEGA], -limit, limit)
        s[k.S_V_DEMAND] = s[k.S_OMEGA]
        s[k.S_A_DEMAND] = 0.0
        s[k.S_P_DEMAND] = s[k.S_THETA]
    else:
        s[k.S_P_DEMAND] = s[k.S_THETA]
        s[k.S_V_DEMAND] = 0.0
        s[k.S_A_DEMAND] = 0.0
        s[k.S_T_DEMAND] = 0.0
    if p[k.P_STOPPING] > 0.0 and s[k.S_STOPPED] == 0.0:
        ramped = kind in (k.GEN_TORQUE, k.GEN_TORQUE_STOP) or s[k.S_V_DEMAND] == 0.0
        if ramped and abs(s[k.S_OMEGA]) <= p[k.P_STOP_SPEED]:
            s[k.S_STOPPED] = 1.0
            raise_event(s, k.EV_STOPPED)
