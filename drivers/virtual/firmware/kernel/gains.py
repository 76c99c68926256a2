"""Selection of the gains in each step (004:3061-3096)."""

from __future__ import annotations

from numba import njit

from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.kernel.basics import clamp


@njit(nogil=True)
def _switch_measure(s, kind):  # type: ignore[no-untyped-def]
    """Return the quantity that a switching condition compares with its level, SI units."""
    error = abs(s[k.S_P_DEMAND] - s[k.S_THETA])
    if kind == k.SWITCH_TORQUE:
        return abs(s[k.S_TORQUE_COMMAND])
    if kind == k.SWITCH_SPEED_DEMAND:
        return abs(s[k.S_V_DEMAND])
    if kind == k.SWITCH_SPEED:
        return abs(s[k.S_OMEGA])
    if kind == k.SWITCH_ACCELERATION:
        return abs(s[k.S_A_DEMAND])
    if kind == k.SWITCH_ERROR:
        return error
    if kind == k.SWITCH_COMMANDED_OR_FAST and s[k.S_V_DEMAND] == 0.0:
        return abs(s[k.S_OMEGA])
    return 0.0


@njit(nogil=True)
def select_gains(p, s, loop):  # type: ignore[no-untyped-def]
    """Return the share of the second gains, 0 to 1.

    The second gains are selected at once above level + hysteresis, the first again when the
    quantity has been below level − hysteresis for the delay.
    """
    kind = int(p[k.P_SWITCH_KIND])
    goal = s[k.S_SECOND_GAINS]
    if kind == k.SWITCH_OFF:
        goal = 0.0
    elif kind == k.SWITCH_SMALL_ERROR:
        error = abs(s[k.S_P_DEMAND] - s[k.S_THETA_FILTERED])
        goal = 1.0 if loop == k.LOOP_POSITION and error < p[k.P_SWITCH_LEVEL] else 0.0
    else:
        if kind == k.SWITCH_INPUT:
            on = p[k.P_SWITCH_INPUT] > 0.0
            off = not on
        elif kind in (k.SWITCH_COMMANDED, k.SWITCH_UNFINISHED) or (
            kind == k.SWITCH_COMMANDED_OR_FAST and s[k.S_V_DEMAND] != 0.0
        ):
            on = s[k.S_V_DEMAND] != 0.0
            if kind == k.SWITCH_UNFINISHED:
                on = on or abs(s[k.S_P_DEMAND] - s[k.S_THETA]) > p[k.P_POSITION_WINDOW]
            off = not on
        else:
            measure = _switch_measure(s, kind)
            on = measure > p[k.P_SWITCH_LEVEL] + p[k.P_SWITCH_HYSTERESIS]
            off = measure < max(p[k.P_SWITCH_LEVEL] - p[k.P_SWITCH_HYSTERESIS], 1e-9)
        s[k.S_SWITCH_T] = s[k.S_SWITCH_T] + k.STEP_S if off else 0.0
        if on:
            goal = 1.0
        elif off and s[k.S_SWITCH_T] >= p[k.P_SWITCH_DELAY]:
            goal = 0.0
    s[k.S_SECOND_GAINS] = goal
    rate = k.STEP_S / max(p[k.P_SWITCH_TIME], k.STEP_S)
    s[k.S_GAIN_MIX] = clamp(goal, s[k.S_GAIN_MIX] - rate, s[k.S_GAIN_MIX] + rate)
    return s[k.S_GAIN_MIX]


@njit(nogil=True)
def third_share(p, s, loop):  # type: ignore[no-untyped-def]
    """Return the share of the third gains, 0 to 1: they hold an axis whose command has stopped."""
    resting = loop == k.LOOP_POSITION and s[k.S_V_DEMAND] == 0.0
    s[k.S_REST_T] = s[k.S_REST_T] + k.STEP_S if resting else 0.0
    on = p[k.P_THIRD_GAINS] > 0.0 and resting and s[k.S_REST_T] >= p[k.P_THIRD_DELAY]
    rate = k.STEP_S / max(p[k.P_SWITCH_TIME], k.STEP_S)
    share = clamp(1.0 if on else 0.0, s[k.S_THIRD_MIX] - rate, s[k.S_THIRD_MIX] + rate)
    s[k.S_THIRD_MIX] = share
    return share
