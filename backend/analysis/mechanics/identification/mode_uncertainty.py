"""Uncertainty of the modes of a fit: frequency, damping and residue.

The covariance of the fit's parameters is propagated to the modes by their slopes (Pintelon &
Schoukens, *System Identification*, 2012, section 2.4). In addition, all lines may have a common
error, which no covariance of single lines shows: the friction that was removed from them acts like
damping, with the same share on every line.

The damping that friction adds to a mode does not depend on the mode's own damping; and lines next
to a mode that is narrower than their spacing show its damping by their phase, proportionally.
Therefore the range of a damping ratio is stated as a sum and not as a factor, and it begins at zero
where the uncertainty exceeds half of the value.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from backend.analysis.mechanics.identification.fit_problem import Problem, robust_rows
from backend.analysis.mechanics.mechanical_model import Mode
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.analysis.thresholds import mode_uncertainty as threshold

_SYSTEMATIC = np.array(threshold.SYSTEMATIC)
_UNSEEN_FRICTION = np.array(threshold.UNSEEN_FRICTION)


@dataclass(frozen=True)
class ModeUncertainty:
    """One relative standard deviation each of frequency, damping and residue of a mode."""

    frequency: float
    damping: float
    residue: float

    def with_band(
        self,
        mode: Mode,
        frequency_hz: FloatArray,
        distortion: FloatArray,
        by_place: FloatArray | None,
    ) -> ModeUncertainty:
        """Return a larger uncertainty, by ``distortion`` and ``by_place`` [lines] of the band.

        The phase of a line next to a mode turns by 1/damping of a relative change of its frequency.
        A change of inertia shifts a frequency by half of its relative effect on the lines above it
        (square root).
        """
        phase = float(np.interp(mode.frequency_hz, frequency_hz, distortion))
        above = frequency_hz > mode.frequency_hz
        place = 0.0
        if by_place is not None and np.any(above):
            place = float(np.median(by_place[above]))
        frequency = (self.frequency, mode.damping * phase, 0.5 * place)
        damping = (self.damping, phase, place)
        return replace(
            self,
            frequency=float(np.linalg.norm(frequency)),
            damping=float(np.linalg.norm(damping)),
        )

    def damping_interval(self, damping: float, deviations: float) -> tuple[float, float]:
        """Return the range of a damping ratio within this number of standard deviations."""
        apart = deviations * min(self.damping, threshold.WIDEST)
        return damping * max(1.0 - apart, 0.0), damping * (1.0 + apart)


def mode_uncertainties(
    problem: Problem,
    x: FloatArray,
    covariance: FloatArray,
    together: Sequence[ComplexArray],
    *,
    friction_seen: bool,
) -> tuple[ModeUncertainty, ...]:
    """Return the uncertainties of the modes of the model at ``x``, in its order.

    ``covariance`` is that of ``x``; ``together`` contains, per view, one deviation [lines] of the
    logarithm that is common to all lines; ``friction_seen`` whether friction was removed.
    """
    here = _modes(problem, x)
    if here.size == 0:
        return ()
    slopes = np.zeros((x.size, *here.shape))
    for n in range(x.size):
        moved = x.copy()
        moved[n] += threshold.STEP
        there = _modes(problem, moved)
        if there.shape == here.shape:
            slopes[n] = (there - here) / threshold.STEP
    spread = np.einsum("pml,pq,qml->ml", slopes, covariance, slopes)
    shift = np.einsum("pml,p->ml", slopes, _step_of(problem, x, together))
    least = _SYSTEMATIC**2 + (0.0 if friction_seen else 1.0) * _UNSEEN_FRICTION**2
    total = np.sqrt(np.maximum(spread, 0.0) + shift**2 + least)
    return tuple(ModeUncertainty(*(float(v) for v in row)) for row in total)


def _modes(problem: Problem, x: FloatArray) -> FloatArray:
    """Logarithms [modes, 3] of frequency, damping and residue."""
    modes = problem.form.model(x).modes
    rows = [[m.frequency_hz, m.damping, m.residue] for m in modes]
    return np.asarray(np.log(np.maximum(np.array(rows).reshape(-1, 3), 1e-12)))


def _step_of(problem: Problem, x: FloatArray, together: Sequence[ComplexArray]) -> FloatArray:
    """Change of the best parameters for a common change of all measured lines."""
    residuals, jacobian = problem.misfit(x)
    rows = np.zeros(residuals.size)
    parts = []
    for view, common in zip(problem.views, together, strict=True):
        weighted = common * view.weight
        parts += [weighted.real, weighted.imag]
    flat = np.concatenate(parts)
    rows[: flat.size] = flat
    root = robust_rows(residuals)
    jacobian = jacobian * root[:, None]
    return np.asarray(np.linalg.lstsq(jacobian, rows * root, rcond=1e-9)[0])
