"""Torque that depends on where the axis stands: springs, arms and loads out of balance.

An arm on a gear needs T = A·sin(kθ + φ) to be held, an unbalanced rotor the same with one period
to a turn, and a spring or a counterweight on a lever is that sine where it is nearly straight. One
family therefore serves all of them, linear in A·cos φ and A·sin φ and searched over the period.

An axis that is accelerated at one end of its way and braked at the other has the sign of its
acceleration tied to its place, so that such a torque, left out, passes for inertia: a pull that
grows along the way makes J too small. Moves of different accelerations over one way tell the two
apart.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import minimize_scalar

from backend.analysis.arrays import BoolArray, FloatArray

_TURN = 2 * np.pi
#: The longest period looked for, in ways of the move: a sine is a straight line and a bow there.
_LONGEST = 8.0
#: The shortest period, in turns of the motor: shorter ones (cogging) average out by themselves.
_SHORTEST_REV = 0.45
#: Ratio of neighbouring periods of the search.
_STEP = 1.12
#: Rows that are enough for torques as slow as these.
_ROWS = 2000

Smooth = Callable[[FloatArray], FloatArray]


def angle_of(velocity_rad_s: FloatArray, sample_rate_hz: float) -> FloatArray:
    """Places of the motor [n] in rad, counted from the middle of its way."""
    steps = 0.5 * (velocity_rad_s[1:] + velocity_rad_s[:-1]) / sample_rate_hz
    angle = np.concatenate([[0.0], np.cumsum(steps)])
    return np.asarray(angle - 0.5 * (np.min(angle) + np.max(angle)))


def place_columns(angle_rad: FloatArray, period_rad: float, smooth: Smooth) -> FloatArray:
    """The two shapes of a torque of this period along the axis [n, 2], as ``smooth`` leaves them.

    The mean over the recording is taken out: it belongs to the constant torque.
    """
    phase = _TURN / period_rad * angle_rad
    both = np.column_stack([smooth(np.sin(phase)), smooth(np.cos(phase))])
    return np.asarray(both - np.mean(both, axis=0))


def find_period(
    others: FloatArray,
    torque_nm: FloatArray,
    angle_rad: FloatArray,
    keep: BoolArray,
    smooth: Smooth,
) -> float | None:
    """The period in rad that explains most of the torque [n] beside ``others`` [n, columns].

    None where the way is too short for any. Whether it is worth having, the caller judges.
    """
    rows = np.flatnonzero(keep)
    rows = rows[:: max(1, rows.size // _ROWS)]
    longest, shortest = _LONGEST * float(np.ptp(angle_rad[rows])), _SHORTEST_REV * _TURN
    if longest <= shortest * _STEP:
        return None
    scale = np.maximum(np.max(np.abs(others), axis=0), 1e-12)
    q = np.linalg.qr(others[rows] / scale)[0]
    rest = torque_nm[rows] - q @ (q.T @ torque_nm[rows])

    def left(logarithm: float) -> float:
        columns = place_columns(angle_rad, float(np.exp(logarithm)), smooth)[rows]
        columns = columns - q @ (q.T @ columns)
        x = np.linalg.lstsq(columns, rest, rcond=None)[0]
        return float(np.sum((rest - columns @ x) ** 2))

    count = int(np.log(longest / shortest) / np.log(_STEP)) + 2
    periods = np.linspace(np.log(shortest), np.log(longest), count)
    best = min(periods, key=left)
    near = (float(best - np.log(_STEP)), float(best + np.log(_STEP)))
    return float(np.exp(minimize_scalar(left, bounds=near, method="bounded").x))
