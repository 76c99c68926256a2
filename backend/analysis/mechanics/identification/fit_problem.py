"""Least-squares fit of mechanics and delays to several views of one motion.

Fitted is the logarithm of the response of a model as sampling shows it (`sampled_model`), over the
measured one; the parametrisation of the mechanics is a `Form`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
import numpy.typing as npt

from backend.analysis.mechanics.chain_model import (
    LOAD_PARAMETERS,
    chain_response_and_slopes,
    loads_of,
    model_of_chain,
)
from backend.analysis.mechanics.identification.robust_fit import minimise
from backend.analysis.mechanics.mechanical_model import (
    MODE_PARAMETERS,
    RIGID_PARAMETERS,
    TURN,
    MechanicalModel,
    model_of,
    response_and_slopes,
)
from backend.analysis.response.frf import Frf
from backend.analysis.response.signal_path.sampled_model import LoopModel, Sampler
from backend.analysis.response.signal_path.sampling import SignalPath, lag_response
from backend.analysis.signals.arrays import BoolArray, ComplexArray, FloatArray
from backend.analysis.thresholds import fit_problem as threshold

USUAL_CORNER = float(np.log(2000.0))
USUAL_DAMPING = threshold.USUAL_DAMPING
_NEAR_ANCHOR = np.array(threshold.NEAR_ANCHOR)
HIGHEST_TRIED = threshold.HIGHEST_TRIED


@dataclass(frozen=True)
class View:
    """One estimate of the same mechanics: lines, values, weights, and its signal path."""

    f: FloatArray
    g: ComplexArray
    weight: FloatArray
    sampler: Sampler
    integrated: bool
    second: bool
    """Whether another view comes before it."""

    @staticmethod
    def of(
        frf: Frf, use: BoolArray, path: SignalPath, loop: LoopModel, floor: float, *,
        integrated: bool, second: bool,
    ) -> View:  # fmt: skip
        """Return a view with weights from the accuracy of the lines, limited by ``floor``.

        Lines that are not in ``use`` have weight zero.
        """
        f = frf.frequency_hz
        relative = np.nan_to_num(frf.std_db, nan=0.0) * np.log(10) / 20
        # The logarithm of a line that is mostly noise is biased.
        weight = np.where(use & (relative < threshold.NOISE), 1.0 / np.hypot(relative, floor), 0.0)
        sampler = Sampler.of(f, path, loop, integrated=integrated)
        return View(f, frf.response, weight, sampler, integrated, second)

    def thinned(self, lines: npt.NDArray[np.int64]) -> View:
        """Return the view with some of the lines."""
        return replace(
            self,
            f=self.f[lines],
            g=self.g[lines],
            weight=self.weight[lines],
            sampler=self.sampler.thinned(lines),
        )


@dataclass(frozen=True)
class KnownInertia:
    """Inertia of the whole axis from moves, and its relative standard deviation."""

    kgm2: float
    deviation: float = 0.0


@dataclass(frozen=True)
class Form:
    """A parametrisation of the mechanics: response, model, bounds and prior."""

    response: Callable[[FloatArray, FloatArray], tuple[ComplexArray, Callable[[], ComplexArray]]]
    model: Callable[[FloatArray], MechanicalModel]
    bounds: Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
    prior: Callable[[FloatArray], tuple[FloatArray, FloatArray]]
    """Prior: rows that are normally near zero, and their slopes [rows, parameters]."""
    inertia: Callable[[FloatArray], tuple[float, FloatArray]]
    """Logarithm of the whole inertia (kg·m²), and its slopes [parameters]."""


@dataclass(frozen=True)
class Found:
    """One solution of a `Problem`."""

    x: FloatArray
    jacobian: FloatArray
    residuals: FloatArray
    score: float
    error: float
    noise: float
    model: MechanicalModel


@dataclass(frozen=True)
class Problem:
    """One nonlinear least-squares problem over all views."""

    views: tuple[View, ...]
    period_s: float
    form: Form
    free_filter: bool
    """Whether the drive's speed filter is unknown."""
    anchor: FloatArray | None = None
    """Delays and filter that a search stays near to while the mechanics are incomplete."""
    inertia: KnownInertia | None = None
    """Inertia from moves; the only information on it where friction hides the low lines."""

    @cached_property
    def _sampler(self) -> Sampler:
        # All views have the same lines, and so the same images.
        return self.views[0].sampler

    def logs(self, x: FloatArray) -> tuple[list[ComplexArray], list[ComplexArray]]:
        """Return per view log(seen/measured) [lines] and its slopes [parameters, lines]."""
        values, gradients = self._logs(x)
        return values, gradients()

    def _logs(self, x: FloatArray) -> tuple[list[ComplexArray], Callable[[], list[ComplexArray]]]:
        """`logs`, with a function for the slopes: a step that is rejected needs none."""
        f = self._sampler.frequency_hz
        alone, plant_slopes = self.form.response(x, f)
        late = self._sampler.late(float(x[2]) * self.period_s)
        plant = alone * late
        furthers = [self.further(x, view, self._sampler) for view in self.views]
        seen = [
            view.sampler.seen(plant, further)
            for view, further in zip(self.views, furthers, strict=True)
        ]

        def gradients() -> list[ComplexArray]:
            slopes = plant_slopes()
            turn = -2j * np.pi * f * self.period_s
            found = []
            for view, further, (value, by_both) in zip(self.views, furthers, seen, strict=True):
                by_plant, by_further = by_both()
                gradient = np.einsum("pil,il->pl", slopes, by_plant * late)
                gradient[2] = np.einsum("il,il->l", turn * plant, by_plant)
                if further is not None and view.integrated:
                    by_delay = np.einsum("il,il->l", turn * further, by_further)
                    gradient[2] -= by_delay
                    gradient[3] += by_delay
                elif further is not None:
                    # The lag's slope by the logarithm of its corner is its own complement.
                    gradient[4] = np.einsum("il,il->l", further * (1.0 - further), by_further)
                found.append(gradient / value)
            return found

        values = [np.log(value / view.g) for view, (value, _) in zip(self.views, seen, strict=True)]
        return values, gradients

    def further(self, x: FloatArray, view: View, sampler: Sampler) -> ComplexArray | None:
        """Return the factor in the path of this view's signal alone, for the parameters."""
        if view.integrated:
            return sampler.late(float(x[3] - x[2]) * self.period_s)
        if not self.free_filter:
            return None
        return lag_response(sampler.frequency_hz, float(np.exp(x[4])))

    def misfit(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the weighted logarithmic error, the same for peaks and valleys, and its slopes
        [n, parameters].
        """
        rows, slopes = self._misfit(x)
        return rows, slopes()

    def _misfit(self, x: FloatArray) -> tuple[FloatArray, Callable[[], FloatArray]]:
        """`misfit`, with a function for the slopes."""
        values, gradients = self._logs(x)
        return self._rows(x, values), lambda: self._slopes(x, gradients())

    def _rows(self, x: FloatArray, values: list[ComplexArray]) -> FloatArray:
        rows = [v * view.weight for v, view in zip(values, self.views, strict=True)]
        path = [
            *(x[2:4] * self.period_s / threshold.USUAL_DELAY_S),
            (x[4] - USUAL_CORNER) / threshold.CORNER_SPREAD,
        ]
        usual = [np.array(path), self.form.prior(x)[0], self._known(x)[0]]
        return np.concatenate([p for e in rows for p in (e.real, e.imag)] + usual)

    def _slopes(self, x: FloatArray, gradients: list[ComplexArray]) -> FloatArray:
        path = np.zeros((3, x.size))
        path[0, 2] = path[1, 3] = self.period_s / threshold.USUAL_DELAY_S
        path[2, 4] = 1.0 / threshold.CORNER_SPREAD
        usual = np.concatenate([path, self.form.prior(x)[1], self._known(x)[1]])
        lines = [view.f.size for view in self.views]
        out = np.empty((2 * sum(lines) + len(usual), x.size))
        place = 0
        for gradient, view in zip(gradients, self.views, strict=True):
            for part in (gradient.real, gradient.imag):
                np.multiply(part.T, view.weight[:, None], out=out[place : place + view.f.size])
                place += view.f.size
        out[place:] = usual
        return out

    def _known(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Deviation of the whole inertia from the known one [0 or 1 rows], and its slopes."""
        if self.inertia is None:
            return np.zeros(0), np.zeros((0, x.size))
        value, slopes = self.form.inertia(x)
        known = float(np.hypot(self.inertia.deviation, threshold.INERTIA_ALIKE))
        apart = (value - np.log(self.inertia.kgm2)) / known
        return np.array([apart]), np.asarray(slopes[None, :] / known)

    def with_views(self, views: tuple[View, ...]) -> Problem:
        """Return the problem with other views."""
        return replace(self, views=views)

    def thinned(self, lines: npt.NDArray[np.int64]) -> Problem:
        """Return the problem with some of the lines, for a first evaluation of many starts."""
        return replace(self, views=tuple(view.thinned(lines) for view in self.views))

    def solve(self, start: FloatArray, steps: int = 40, *, bound: bool = False) -> Found:
        """Return the best parameters near ``start`` within ``steps`` evaluations.

        ``bound`` keeps delays and filter near the anchor: while mechanics are missing, they would
        imitate them.
        """
        low, high = self.form.bounds(start, self.views[0].f)
        # Delays are searched for around those of the start.
        low[2:4], high[2:4] = np.maximum(start[2:4] - 1.0, -0.3), start[2:4] + 1.0
        low[4], high[4] = np.log(100.0), np.log(20000.0)
        if bound and self.anchor is not None:
            low[2:5] = np.maximum(low[2:5], self.anchor - _NEAR_ANCHOR)
            high[2:5] = np.minimum(high[2:5], self.anchor + _NEAR_ANCHOR)
        fit = minimise(
            self._misfit,
            np.clip(start, low + 1e-9, high - 1e-9),
            low,
            high,
            scale=threshold.OUTLIER,
            steps=steps,
        )
        points = sum(2 * int(np.count_nonzero(view.weight)) for view in self.views)
        # Real data are not better than the floor of their weights, as synthetic data may be.
        misfit = max(2 * fit.cost, 1e-6 * points)
        score = points * np.log(misfit / points) + start.size * np.log(points)
        values, _ = self._logs(fit.x)
        errors = [
            _median(np.abs(np.expm1(v)), w.weight) for v, w in zip(values, self.views, strict=True)
        ]
        noise = min(_median(1.0 / np.maximum(v.weight, 1e-9), v.weight) for v in self.views)
        return Found(fit.x, fit.jacobian, fit.residuals, float(score), min(errors),
                      noise, self.form.model(fit.x))  # fmt: skip


def robust_rows(residuals: FloatArray) -> FloatArray:
    """Return the weights of rows in the robust loss."""
    return np.asarray((1.0 + (residuals / threshold.OUTLIER) ** 2) ** -0.25)


def _median(values: FloatArray, weight: FloatArray) -> float:
    """Median over the lines with a weight; infinite where these are few."""
    use = weight > 0
    return float(np.median(values[use])) if np.count_nonzero(use) > 0.3 * use.size else np.inf


# --- forms ------------------------------------------------------------------------------


def _rigid_bounds(gain: float, f: FloatArray) -> tuple[list[float], list[float]]:
    """Bounds of gain and pole; those of the delays are set by the problem."""
    highest = float(np.log(0.5 * TURN * np.sqrt(f[0] * f[-1])))
    lowest = float(np.log(1e-3 * TURN * f[0]))
    return [gain - 2.5, lowest, 0.0, 0.0, 0.0], [gain + 2.5, highest, 0.0, 0.0, 0.0]


def _modal_bounds(x: FloatArray, f: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Bounds around a start, limited to physical modes."""
    low, high = _rigid_bounds(float(x[0]), f)
    for q in x[RIGID_PARAMETERS:].reshape(-1, MODE_PARAMETERS):
        low += [q[0] - 0.3, np.log(5e-4), q[2] - 4.0, -0.5]
        high += [q[0] + 0.3, 0.0, q[2] + 4.0, 0.5]
    return np.array(low), np.array(high)


def _modal_prior(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Prior: the zero of a mode is near zero."""
    places = np.arange(RIGID_PARAMETERS + 3, x.size, MODE_PARAMETERS)
    slopes = np.zeros((places.size, x.size))
    slopes[np.arange(places.size), places] = 1.0 / threshold.USUAL_ZERO
    return x[places] / threshold.USUAL_ZERO, slopes


def _chain_bounds(x: FloatArray, f: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Bounds as factors of the start."""
    whole = float(np.log(np.exp(x[0]) + np.sum(loads_of(x)[:, 0])))
    slow = np.log(1e-3 * TURN * f[0])
    fast = np.log(0.5 * TURN * np.sqrt(f[0] * f[-1]))
    low, high = [whole - 6.0, whole + slow], [whole + 1.5, whole + fast]
    low, high = [*low, 0.0, 0.0, 0.0], [*high, 0.0, 0.0, 0.0]
    stiffest = 2 * np.log(TURN * 2 * HIGHEST_TRIED * f[-1])
    softest = 2 * np.log(TURN * f[0])
    for _ in range((x.size - RIGID_PARAMETERS) // LOAD_PARAMETERS):
        low += [whole - 7.0, whole - 7.0 + softest, whole - 12.0]
        high += [whole + 1.5, whole + 1.5 + stiffest, whole + 1.5 + 0.5 * stiffest]
    return np.array(low), np.array(high)


def _chain_prior(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Prior: an ordinary damping ratio d / 2√(kJ) of the couplings."""
    logs = x[RIGID_PARAMETERS:].reshape(-1, LOAD_PARAMETERS)
    ratio = logs @ _RATIO - np.log(2 * USUAL_DAMPING)
    return ratio / threshold.DAMPING_SPREAD, _chain_prior_slopes(x.size)


#: Coefficients of a coupling's log damping ratio for its log J, log k and log d.
_RATIO = np.array([-0.5, -0.5, 1.0])


@lru_cache(maxsize=32)
def _chain_prior_slopes(size: int) -> FloatArray:
    """Slopes of the prior, which depend only on the number of parameters; cached, do not modify."""
    loads = (size - RIGID_PARAMETERS) // LOAD_PARAMETERS
    slopes = np.zeros((loads, size))
    slopes[:, RIGID_PARAMETERS:] = np.kron(np.eye(loads), _RATIO / threshold.DAMPING_SPREAD)
    return slopes


def _chain_inertia(x: FloatArray) -> tuple[float, FloatArray]:
    """Inertia of the motor and of all loads."""
    parts = np.exp(np.concatenate([x[:1], x[RIGID_PARAMETERS::LOAD_PARAMETERS]]))
    whole = float(np.sum(parts))
    slopes = np.zeros(x.size)
    slopes[0] = parts[0] / whole
    slopes[RIGID_PARAMETERS::LOAD_PARAMETERS] = parts[1:] / whole
    return float(np.log(whole)), slopes


def _modal_inertia(x: FloatArray) -> tuple[float, FloatArray]:
    """Inertia of the rigid part, whose gain is its inverse."""
    slopes = np.zeros(x.size)
    slopes[0] = -1.0
    return -float(x[0]), slopes


CHAIN = Form(chain_response_and_slopes, model_of_chain, _chain_bounds, _chain_prior, _chain_inertia)
MODAL = Form(response_and_slopes, model_of, _modal_bounds, _modal_prior, _modal_inertia)


def best_view(views: Sequence[View]) -> View:
    """Return the view with the larger weights."""
    return max(views, key=lambda v: float(np.sum(np.minimum(v.weight, 100.0))))
