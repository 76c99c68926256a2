"""Position-dependent torque: springs, arms, unbalanced loads, cogging.

An arm on a gear needs T = A·sin(kθ + φ) to be held, an unbalanced rotor the same with one period
per turn, and a spring or a counterweight on a lever is that sine where it is nearly straight. One
family therefore covers all of them, linear in A·cos φ and A·sin φ and searched over the period.
The cogging of a motor, and other effects of its magnets and slots, repeat a whole number of times
per turn.

On an axis that accelerates at one end of its travel and brakes at the other, the sign of the
acceleration is correlated with the position, so that such a torque, if omitted, appears as inertia:
a pull that grows along the travel makes J too small. Moves at different accelerations over the same
travel separate the two.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy

from backend.analysis.signals.arrays import BoolArray, FloatArray
from backend.analysis.thresholds import position_torque as threshold

_TURN = 2 * np.pi
_ORDERS = range(2, 31)
#: Periods shorter than this, in rad, belong to the motor itself.
COGGING_RAD = 0.45 * _TURN

Smooth = Callable[[FloatArray], FloatArray]


def angle_of(velocity_rad_s: FloatArray, sample_rate_hz: float) -> FloatArray:
    """Return the motor angle [n] in rad, integrated from its speed."""
    steps = 0.5 * (velocity_rad_s[1:] + velocity_rad_s[:-1]) / sample_rate_hz
    return np.concatenate([[0.0], np.cumsum(steps)])


def place_columns(angle_rad: FloatArray, period_rad: float, smooth: Smooth) -> FloatArray:
    """Return sine and cosine of a torque of this period [n, 2], after ``smooth``.

    The mean over the recording is removed: it belongs to the constant torque. Where a period takes
    less than four samples the shape is set to zero, as aliasing would indicate a slower one.
    """
    phase = _TURN / period_rad * angle_rad
    seen = np.abs(np.gradient(phase)) < 0.25 * _TURN
    both = np.column_stack([smooth(seen * np.sin(phase)), smooth(seen * np.cos(phase))])
    return np.asarray(both - np.mean(both, axis=0))


def find_period(
    others: FloatArray,
    torque_nm: FloatArray,
    angle_rad: FloatArray,
    keep: BoolArray,
    smooth: Smooth,
) -> float:
    """Return the period in rad that explains most of the torque [n] besides ``others`` [n,
    columns].

    The caller must check whether it is significant.
    """
    rows = np.flatnonzero(keep)
    rows = rows[:: max(1, rows.size // threshold.ROWS)]
    longest, shortest = (
        threshold.LONGEST * float(np.ptp(angle_rad[rows])),
        threshold.SHORTEST_REV * _TURN,
    )
    scale = np.maximum(np.max(np.abs(others), axis=0), 1e-12)
    q = np.linalg.qr(others[rows] / scale)[0]
    rest = torque_nm[rows] - q @ (q.T @ torque_nm[rows])

    def left(logarithm: float) -> float:
        columns = place_columns(angle_rad, float(np.exp(logarithm)), smooth)[rows]
        columns = columns - q @ (q.T @ columns)
        x = np.linalg.lstsq(columns, rest, rcond=None)[0]
        return float(np.sum((rest - columns @ x) ** 2))

    repeated = min((float(np.log(_TURN / order)) for order in _ORDERS), key=left)
    if longest <= shortest * threshold.STEP:
        return float(np.exp(repeated))
    count = int(np.log(longest / shortest) / np.log(threshold.STEP)) + 2
    best = min(np.linspace(np.log(shortest), np.log(longest), count), key=left)
    near = (float(best - np.log(threshold.STEP)), float(best + np.log(threshold.STEP)))
    slow = float(scipy.optimize.minimize_scalar(left, bounds=near, method="bounded").x)
    return float(np.exp(min(slow, repeated, key=left)))
