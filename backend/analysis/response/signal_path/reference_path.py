"""Hold and delay of a closed loop's reference, tested on the measured loop itself.

A closed loop T is the measured response divided by hold and delay of the reference. Where the
open loop is large T is 1 whatever the plant is, so that a phase left there belongs to the reference
and not to the loop; an error of the plant appears in T multiplied by the sensitivity S = 1 - T.
Delay of the reference, gain and delay of the loop are thus separable by least squares, per hold.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from backend.analysis.response.signal_path.sampling import Hold, hold_response
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.analysis.thresholds import reference_path as threshold


@dataclass(frozen=True)
class ReferencePath:
    """One hold with the parameters that make the measured loop most like the predicted one.

    ``late_s`` is the reference's delay beyond the assumed one, ``late_std_s`` its deviation;
    ``misfit`` the root mean square of the residuals, in deviations.
    """

    hold: Hold
    late_s: float
    late_std_s: float
    misfit: float
    closed: ComplexArray
    """The closed loop with this hold and, where it is significant, this delay removed."""
    loop_late_s: tuple[float, float] = (0.0, threshold.LOOP_LATE_S)
    loop_size: tuple[float, float] = (0.0, threshold.LOOP_SIZE)
    """Delay and gain (logarithm) of the loop beyond the prediction, each with its deviation."""


def reference_paths(
    frequency_hz: FloatArray, closed: ComplexArray, deviation: FloatArray, predicted: ComplexArray,
    *, rate_hz: float, hold: Hold, holds: Sequence[Hold] = ("zero", "linear"),
) -> tuple[ReferencePath, ...]:  # fmt: skip
    """Return the possible holds, most likely first.

    ``closed`` was evaluated with ``hold``; ``predicted`` is the open loop expected on the lines.
    """
    f = frequency_hz
    if f.size < threshold.FEW:
        return (ReferencePath(hold, 0.0, np.inf, np.inf, closed),)
    expected = predicted / (1.0 + predicted)
    s = 1.0 / (1.0 + predicted)
    weight = 1.0 / np.hypot(deviation, threshold.OFF)
    found = []
    for each in holds:
        given = closed * hold_response(f, rate_hz, hold) / hold_response(f, rate_hz, each)
        found.append(_fitted(each, f, given, expected, s, weight, rate_hz))
    found.sort(key=lambda p: p.misfit)
    return tuple(p for p in found if p.misfit <= threshold.ALIKE * found[0].misfit)


def _fitted(
    hold: Hold,
    f: FloatArray,
    closed: ComplexArray,
    expected: ComplexArray,
    s: ComplexArray,
    weight: FloatArray,
    rate_hz: float,
) -> ReferencePath:
    """Delay of the reference and delay and gain of the loop, by robust linear least squares."""
    rows = np.log(closed / expected)
    turn = -2j * np.pi * f
    columns = np.column_stack([turn, s * turn, s])
    prior = np.diag(
        [rate_hz / threshold.STEADY_CYCLES, 1.0 / threshold.LOOP_LATE_S, 1.0 / threshold.LOOP_SIZE]
    )
    w = weight.copy()
    x, left, covariance = np.zeros(3), rows, np.eye(3)
    for _ in range(4):
        a = columns * w[:, None]
        matrix = np.concatenate([a.real, a.imag, prior])
        target = np.concatenate([(rows * w).real, (rows * w).imag, np.zeros(3)])
        x = np.linalg.lstsq(matrix, target, rcond=None)[0]
        left = rows - columns @ x
        covariance = np.linalg.inv(matrix.T @ matrix)
        w = weight / np.sqrt(1.0 + (np.abs(left) * weight / 3.0) ** 2)
    misfit = float(np.sqrt(np.mean((np.abs(left) * w) ** 2)))
    stds = np.sqrt(np.diag(covariance)) * max(misfit, 1.0)
    late = float(x[0]) if abs(x[0]) > threshold.SURE * stds[0] else 0.0
    return ReferencePath(
        hold,
        float(x[0]),
        float(stds[0]),
        misfit,
        np.asarray(closed * np.exp(-turn * late)),
        (float(x[1]), float(stds[1])),
        (float(x[2]), float(stds[2])),
    )
