"""Uncertainty of a line from the uncertainty of the path and the mechanics that correct it.

The fit's parameters and those of the path (delay in cycles, log of the current loop's corner) have
one joint covariance: the motion may determine what the recorded torque leaves open of the path, and
what both leave open is added to the lines by their slopes (linear propagation, Pintelon &
Schoukens, *System Identification*, 2012, section 2.4).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from backend.analysis.mechanics.identification.fit_problem import Problem, View, robust_rows
from backend.analysis.mechanics.mechanical_model import RIGID_PARAMETERS, TURN
from backend.analysis.signals.arrays import ComplexArray, FloatArray

#: Indices of the delays and of the speed filter among a fit's parameters.
_DELAY, _POSITION_DELAY, _FILTER = 2, 3, 4


@dataclass(frozen=True)
class Shifted:
    """The views for another path, ``step`` away in one of the path's parameters."""

    views: tuple[View, ...]
    step: float


@dataclass(frozen=True)
class Uncertainty:
    """One standard deviation per view and line of the logarithm: real is magnitude, imaginary
    phase.

    ``corrected`` for lines with images removed, ``direct`` for those with them. ``path_step`` is
    the step from the given path to the one that torque and motion together determine.
    """

    corrected: tuple[ComplexArray, ...]
    direct: tuple[ComplexArray, ...]
    path_step: FloatArray
    path_std: FloatArray
    covariance: FloatArray
    """Covariance [n, n] of the fit's parameters."""


def uncertainty(
    problem: Problem,
    x: FloatArray,
    shifted: Sequence[Shifted],
    path_covariance: FloatArray,
    moved: FloatArray,
) -> Uncertainty:
    """Return the joint uncertainty at a solution ``x``; ``path_covariance`` [n, n] is that of the
    ``shifted`` path parameters from the torque alone.

    ``moved`` [n] is the distance of the path from the one that the torque alone gives.
    """
    residuals, jacobian = problem.misfit(x)
    root = robust_rows(residuals)
    values, gradients = problem.logs(x)
    by_shift = [_moved(problem, x, values, shift) for shift in shifted]
    rows = np.zeros((residuals.size, len(by_shift)))
    for number, by_view in enumerate(by_shift):
        parts = [p for v, q in zip(problem.views, by_view, strict=True) for p in _parts(v, q)]
        flat = np.concatenate(parts)
        rows[: flat.size, number] = flat
    whole = np.hstack([jacobian, rows]) * root[:, None]
    residuals = residuals * root
    freedom = max(int(np.count_nonzero(residuals)) - x.size, 1)
    variance = float(residuals @ residuals) / freedom
    information = whole.T @ whole / variance
    by_torque = np.linalg.pinv(path_covariance)
    information[x.size :, x.size :] += by_torque
    covariance = np.linalg.pinv(information, hermitian=True)
    slope = whole.T @ residuals / variance
    slope[x.size :] += by_torque @ moved
    step = -covariance @ slope
    own = _plant_slopes(problem, x)
    corrected, direct = [], []
    for place, view in enumerate(problem.views):
        by_path = np.array([-q[place] for q in by_shift])
        corrected.append(_spread(np.vstack([own - gradients[place], by_path]), covariance))
        raw = [np.log(s.views[place].g / view.g) / s.step for s in shifted]
        plain = np.vstack([_late_slopes(problem, view, x), *raw])
        direct.append(_spread(plain, covariance))
    return Uncertainty(
        tuple(corrected),
        tuple(direct),
        step[x.size :],
        np.sqrt(np.maximum(np.diag(covariance)[x.size :], 0.0)),
        # All lines together may be explained better than the accuracy of single ones suggests.
        covariance[: x.size, : x.size] / min(variance, 1.0),
    )


def _moved(
    problem: Problem, x: FloatArray, values: Sequence[ComplexArray], shift: Shifted
) -> list[ComplexArray]:
    """Slope of log(seen/measured) by a path parameter, per view."""
    other, _ = problem.with_views(shift.views).logs(x)
    return [(o - v) / shift.step for o, v in zip(other, values, strict=True)]


def _parts(view: View, values: ComplexArray) -> tuple[FloatArray, FloatArray]:
    weighted = values * view.weight
    return weighted.real, weighted.imag


def _plant_slopes(problem: Problem, x: FloatArray) -> ComplexArray:
    """Slopes of the logarithm of the mechanics alone [parameters, lines]."""
    plant, slopes = problem.form.response(x, problem.views[0].f)
    by_parameter = slopes()
    by_parameter[_DELAY:RIGID_PARAMETERS] = 0.0
    return np.asarray(by_parameter / plant)


def _late_slopes(problem: Problem, view: View, x: FloatArray) -> ComplexArray:
    """Slopes of what a direct estimate removes: delay and speed filter [parameters, lines]."""
    slopes = np.zeros((x.size, view.f.size), dtype=np.complex128)
    turn = 1j * TURN * view.f * problem.period_s
    slopes[_POSITION_DELAY if view.integrated else _DELAY] = turn
    if problem.free_filter and not view.integrated:
        part = 1j * view.f / np.exp(x[_FILTER])
        slopes[_FILTER] = -part / (1.0 + part)
    return slopes


def _spread(slopes: ComplexArray, covariance: FloatArray) -> ComplexArray:
    size, turn = (
        np.sqrt(np.maximum(np.einsum("pl,pq,ql->l", s, covariance, s), 0.0))
        for s in (slopes.real, slopes.imag)
    )
    return np.asarray(size + 1j * turn)
