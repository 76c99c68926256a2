"""How exactly a fit shows its modes: frequency, damping and part in the response.

The covariance of the fit's parameters carried over to the modes by their slopes (Pintelon &
Schoukens, *System Identification*, 2012, section 2.4), and next to it what all lines may be off by
together, which no covariance of single lines shows: the friction that was removed from them acts
like damping, by the same share everywhere.

What friction adds to the damping of a mode is the same however much that mode is damped by itself;
and lines next to a mode that is narrower than their distance show its damping by their phase, in
proportion. So the range of a damping is stated by what is added to it and not as a factor, and
where it is not known to half of itself it begins at zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from backend.analysis.mechanics.fit_problem import Problem, robust_rows
from backend.analysis.mechanics.mechanical_model import Mode
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.analysis.thresholds import mode_uncertainty as threshold

_SYSTEMATIC = np.array(threshold.SYSTEMATIC)
_UNSEEN_FRICTION = np.array(threshold.UNSEEN_FRICTION)


@dataclass(frozen=True)
class ModeUncertainty:
    """One standard deviation each, relative: frequency, damping and residue of a mode."""

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
        """Wider by what the model leaves open: ``distortion`` and ``by_place`` [lines] of the band.

        A line's phase next to a mode turns by 1/damping of a relative change of its frequency. An
        inertia moves a frequency by half of what it moves the lines above it, as its root.
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
        """Within so many deviations of a damping ratio."""
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
    """For each mode of the model at ``x``, in its order.

    ``covariance`` is that of ``x``; ``together`` are, per view, one deviation [lines] of the
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
    """How far the best parameters move when all measured lines do."""
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
