"""Protections (004:4703-4917) and the windows that the status word reports."""

from __future__ import annotations

from numba import njit

from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.kernel.basics import raise_event


@njit(nogil=True)
def protect(p, s):  # type: ignore[no-untyped-def]
    """Latch the faults whose thresholds were exceeded in this step."""
    faults = 0
    powered = int(p[k.P_LOOP]) != k.LOOP_OFF
    if powered and abs(s[k.S_CURRENT]) * 1.4142135623730951 > p[k.P_OCP_A]:
        faults |= k.F_OVER_CURRENT
    if s[k.S_VOLTAGE] < p[k.P_UVLO_V]:
        faults |= k.F_UNDER_VOLTAGE
    if s[k.S_VOLTAGE] > p[k.P_OVP_V]:
        faults |= k.F_OVER_VOLTAGE
    if s[k.S_TEMPERATURE] > p[k.P_OTP_C]:
        faults |= k.F_OVER_TEMPERATURE
    if abs(s[k.S_OMEGA]) > p[k.P_OVER_SPEED]:
        faults |= k.F_OVER_SPEED
    torque = abs(s[k.S_TORQUE])
    s[k.S_OVERLOAD_T] = s[k.S_OVERLOAD_T] + k.STEP_S if torque > p[k.P_OVERLOAD_NM] else 0.0
    if s[k.S_OVERLOAD_T] > p[k.P_OVERLOAD_S]:
        faults |= k.F_OVERLOAD
    share = torque / p[k.P_I2T_RATED_NM]
    s[k.S_I2T] = max(0.0, s[k.S_I2T] + (share * share - 1.0) * k.STEP_S)
    if s[k.S_I2T] > p[k.P_I2T_LIMIT]:
        faults |= k.F_OVERLOAD
    loop = int(p[k.P_LOOP])
    closed = loop in (k.LOOP_POSITION, k.LOOP_SPEED)
    away = closed and abs(s[k.S_SPEED_REFERENCE] - s[k.S_OMEGA]) > p[k.P_SPEED_ERROR]
    s[k.S_SPEED_ERROR_T] = s[k.S_SPEED_ERROR_T] + k.STEP_S if away else 0.0
    if s[k.S_SPEED_ERROR_T] > p[k.P_SPEED_ERROR_S]:
        faults |= k.F_SPEED_ERROR
    if loop == k.LOOP_POSITION and s[k.S_FOLLOWING_T] > p[k.P_FOLLOWING_S]:
        faults |= k.F_FOLLOWING
    pushing = closed and powered and torque > p[k.P_LOCK_NM]
    if pushing and loop == k.LOOP_POSITION:
        goal = p[k.P_TARGET] if int(p[k.P_GEN]) == k.GEN_POSITION else s[k.S_P_DEMAND]
        pushing = abs(goal - s[k.S_THETA]) > p[k.P_LOCK_ANGLE]
    if pushing and abs(s[k.S_THETA] - s[k.S_LOCK_ANCHOR]) < p[k.P_LOCK_ANGLE]:
        s[k.S_LOCK_T] += k.STEP_S
    else:
        s[k.S_LOCK_T] = 0.0
        s[k.S_LOCK_ANCHOR] = s[k.S_THETA]
    if s[k.S_LOCK_T] > p[k.P_LOCK_S]:
        faults |= k.F_LOCKED
    signals = int(s[k.S_SIGNALS])
    into = 0.0
    if signals & k.SIG_NEGATIVE and s[k.S_OMEGA] < -p[k.P_STOP_SPEED]:
        into = 1.0
    if signals & k.SIG_POSITIVE and s[k.S_OMEGA] > p[k.P_STOP_SPEED]:
        into = 1.0
    s[k.S_LIMIT_ACTIVE] = into
    if into > 0.0 and powered and p[k.P_LIMIT_STOPS] == k.LIMIT_FAULT:
        faults |= k.F_POSITION_LIMIT
    before = int(s[k.S_FAULTS])
    if faults & ~before:
        s[k.S_FAULTS] = float(before | faults)
        raise_event(s, k.EV_FAULT)


@njit(nogil=True)
def monitor(p, s):  # type: ignore[no-untyped-def]
    """Update timers of target reached, zero speed, following error, stall and alarm clock."""
    error = abs(s[k.S_P_DEMAND] - s[k.S_THETA])
    arrived = s[k.S_ARRIVED] > 0.0
    near = arrived and error <= p[k.P_POSITION_WINDOW]
    s[k.S_POSITION_T] = s[k.S_POSITION_T] + k.STEP_S if near else 0.0
    near = arrived and abs(s[k.S_V_DEMAND] - s[k.S_OMEGA]) <= p[k.P_SPEED_WINDOW]
    s[k.S_SPEED_T] = s[k.S_SPEED_T] + k.STEP_S if near else 0.0
    slow = abs(s[k.S_OMEGA]) <= p[k.P_ZERO_SPEED]
    s[k.S_ZERO_T] = s[k.S_ZERO_T] + k.STEP_S if slow else 0.0
    s[k.S_FOLLOWING_T] = s[k.S_FOLLOWING_T] + k.STEP_S if error > p[k.P_FOLLOWING_WINDOW] else 0.0
    if p[k.P_STALL_NM] > 0.0:
        stalled = abs(s[k.S_TORQUE]) >= p[k.P_STALL_NM] and abs(s[k.S_OMEGA]) < p[k.P_STALL_SPEED]
        s[k.S_STALL_T] = s[k.S_STALL_T] + k.STEP_S if stalled else 0.0
        if s[k.S_STALL_T] > p[k.P_STALL_S]:
            raise_event(s, k.EV_STALL)
    if s[k.S_STEP] >= p[k.P_ALARM_STEP]:
        raise_event(s, k.EV_ALARM_CLOCK)
