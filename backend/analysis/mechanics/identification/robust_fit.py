"""Levenberg-Marquardt with bounds and a robust loss, for problems with few parameters.

Value and slopes come from one call, the slopes only of steps that are accepted, and steps from the
normal equations: with some hundred residuals and a dozen parameters that is several times faster
than a general solver.
Sources: Marquardt, J. SIAM 11 (1963) 431; Triggs et al., "Bundle adjustment: a modern
synthesis" (2000), section 4.3 (robust costs by reweighting).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from backend.analysis.signals.arrays import FloatArray
from backend.analysis.thresholds import robust_fit as threshold

#: Residuals [n], and a function for their slopes [n, m], which a rejected step does not need.
Evaluate = Callable[[FloatArray], tuple[FloatArray, Callable[[], FloatArray]]]


@dataclass(frozen=True)
class Minimum:
    """The minimum found. ``cost`` is Σ s²·(√(1+(r/s)²) - 1), for small r half the sum of squares.

    ``residuals`` [n] are unweighted, the rows of ``jacobian`` [n, m] are weighted as in the loss.
    """

    x: FloatArray
    cost: float
    residuals: FloatArray
    jacobian: FloatArray


def minimise(
    evaluate: Evaluate, start: FloatArray, low: FloatArray, high: FloatArray, *,
    scale: float, steps: int = 40, cost_tolerance: float = 1e-4, step_tolerance: float = 1e-5,
) -> Minimum:  # fmt: skip
    """Minimise the cost near ``start`` within ``low`` and ``high``.

    ``evaluate`` returns residuals [n] and a function for their slopes [n, m]; residuals much beyond
    ``scale`` count linearly. It ends when the cost falls by less than its tolerance (relative),
    when steps become small, or after ``steps`` evaluations.
    """
    x = np.clip(start, low, high)
    r, slopes_of = evaluate(x)
    slopes = slopes_of()
    gradient, hessian = _normal(r, slopes, scale)
    cost = _cost(r, scale)
    damping = 1e-3
    quiet = 0
    for _ in range(steps - 1):
        # A parameter at its bound whose step would cross it is kept fixed.
        free = ~(((x <= low) & (gradient > 0)) | ((x >= high) & (gradient < 0)))
        if not free.any():
            break
        step = _step(hessian, gradient, free, damping)
        tried = np.clip(x + step, low, high)
        new_r, new_slopes_of = evaluate(tried)
        new_cost = _cost(new_r, scale)
        moved = float(np.max(np.abs(tried - x)))
        if new_cost < cost:
            quiet = quiet + 1 if cost - new_cost < cost_tolerance * cost else 0
            x, r, slopes, cost = tried, new_r, new_slopes_of(), new_cost
            gradient, hessian = _normal(r, slopes, scale)
            damping = max(damping / 7.0, threshold.LEAST_DAMPING)
            if quiet == 2 or moved < step_tolerance:
                break
        else:
            damping *= 6.0
            if moved < step_tolerance or damping > threshold.MOST_DAMPING:
                break
    root = (1.0 + (r / scale) ** 2) ** -0.25
    return Minimum(x, cost, r, slopes * root[:, None])


def _normal(r: FloatArray, slopes: FloatArray, scale: float) -> tuple[FloatArray, FloatArray]:
    """Gradient [m] and approximate Hessian [m, m] of the cost."""
    weighted = slopes * (1.0 / np.sqrt(1.0 + (r / scale) ** 2))[:, None]
    return np.asarray(weighted.T @ r), np.asarray(weighted.T @ slopes)


def _cost(r: FloatArray, scale: float) -> float:
    cost = scale**2 * float(np.sum(np.sqrt(1.0 + (r / scale) ** 2) - 1.0))
    return cost if np.isfinite(cost) else np.inf


def _step(
    hessian: FloatArray, gradient: FloatArray, free: np.ndarray, damping: float
) -> FloatArray:
    """Step of the free parameters, zero for the others."""
    part = hessian[np.ix_(free, free)]
    diagonal = np.diag(part)
    part = part + np.diag(damping * np.maximum(diagonal, 1e-9 * float(np.max(diagonal)) + 1e-300))
    step = np.zeros(gradient.size)
    try:
        step[free] = np.linalg.solve(part, -gradient[free])
    except np.linalg.LinAlgError:
        step[free] = np.linalg.lstsq(part, -gradient[free], rcond=None)[0]
    return step
