"""Corrections of command and torque for the load."""

from __future__ import annotations

from numba import njit

from drivers.virtual.firmware.kernel import layout as k


@njit(nogil=True)
def shape_command(p, s):  # type: ignore[no-untyped-def]
    """Compute the part of demanded position and speed removed by (s² + ω²)/(s² + 2ζωs + ω²).

    The part subtracted is 2ζω/(s² + 2ζωs + ω²) of the demanded speed, so that a constant position
    passes unchanged and an oscillation of the load at ω is not excited.
    """
    if p[k.P_SHAPE_ON] == 0.0:
        s[k.S_SHAPE] = 0.0
        s[k.S_SHAPE_RATE] = 0.0
        return
    taken, rate, speed = s[k.S_SHAPE], s[k.S_SHAPE_RATE], s[k.S_V_DEMAND]
    s[k.S_SHAPE] = p[k.P_SHAPE_A11] * taken + p[k.P_SHAPE_A12] * rate + p[k.P_SHAPE_B1] * speed
    s[k.S_SHAPE_RATE] = p[k.P_SHAPE_A21] * taken + p[k.P_SHAPE_A22] * rate + p[k.P_SHAPE_B2] * speed


@njit(nogil=True)
def _quadrant_compensation(p, s):  # type: ignore[no-untyped-def]
    """Return the torque after a reversal of the demand: delayed, filtered, over a travel."""
    sign = 1.0 if s[k.S_V_DEMAND] > 0.0 else -1.0 if s[k.S_V_DEMAND] < 0.0 else 0.0
    if sign != 0.0 and sign != s[k.S_QUADRANT_SIGN]:
        turned = s[k.S_QUADRANT_SIGN] != 0.0
        s[k.S_QUADRANT_SIGN] = sign
        s[k.S_QUADRANT_T] = 0.0 if turned else -1.0  # starting from standstill is not a reversal
        s[k.S_QUADRANT_FROM] = s[k.S_P_DEMAND]
    if s[k.S_QUADRANT_T] >= 0.0:
        s[k.S_QUADRANT_T] += k.STEP_S
    near = abs(s[k.S_P_DEMAND] - s[k.S_QUADRANT_FROM]) < p[k.P_QUADRANT_ANGLE]
    goal = 0.0
    if near and s[k.S_QUADRANT_T] > p[k.P_QUADRANT_DELAY]:
        positive = s[k.S_QUADRANT_SIGN] > 0.0
        goal = p[k.P_QUADRANT_POSITIVE] if positive else -p[k.P_QUADRANT_NEGATIVE]
    s[k.S_QUADRANT] += p[k.P_QUADRANT_FILTER] * (goal - s[k.S_QUADRANT])
    return s[k.S_QUADRANT]


@njit(nogil=True)
def friction_compensation(p, s):  # type: ignore[no-untyped-def]
    """Return the torque added for friction by the direction of the demand, and the bias."""
    torque = p[k.P_TORQUE_BIAS] + p[k.P_FRICTION_VISCOUS] * s[k.S_V_DEMAND]
    torque += _quadrant_compensation(p, s)
    if s[k.S_V_DEMAND] > 0.0:
        torque += p[k.P_FRICTION_POSITIVE]
    elif s[k.S_V_DEMAND] < 0.0:
        torque -= p[k.P_FRICTION_NEGATIVE]
    return torque
