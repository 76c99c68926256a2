"""Mechanics and delay from direct estimates, images included.

A chain grows load by load where a search over all ways to add one finds that one is missing, as
long as the Bayesian information criterion gains (Schwarz, Ann. Statist. 6 (1978) 461). What no
chain explains (damping elsewhere than beside a spring) a free sum of modes may, from there.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

from backend.analysis.arrays import BoolArray, ComplexArray, FloatArray
from backend.analysis.chain_model import (
    LOAD_PARAMETERS,
    chain_of_modes,
    chain_response_and_slopes,
    loads_of,
    modal_start,
    model_of_chain,
    responses_with_load,
    with_load,
)
from backend.analysis.frf import Frf, valid_band_hz
from backend.analysis.mechanical_model import (
    MODE_PARAMETERS,
    RIGID_PARAMETERS,
    TURN,
    MechanicalModel,
    model_of,
    response_and_slopes,
)
from backend.analysis.sampled_model import LoopModel, SampledFit, Sampler
from backend.analysis.sampling import DIRECT_SHARE, SignalPath, delay_response, lag_response

#: Delays that no path tells are small: this one standard deviation, in s, beside the lines.
_USUAL_DELAY_S = 60e-6
#: A speed filter that nobody tells, log of Hz and its standard deviation.
_USUAL_CORNER, _CORNER_SPREAD = float(np.log(2000.0)), 1.0
#: β of a mode is this share of ω at most in ordinary machines (one standard deviation).
_USUAL_ZERO = 0.1
#: Couplings have about this damping ratio, within a factor of e² (one standard deviation).
_USUAL_DAMPING, _DAMPING_SPREAD = 0.03, 2.0
#: One more load must gain this much, free modes instead of a chain that much.
_WORTHWHILE, _MODES_GAIN = 10.0, 60.0
#: Lines with a larger relative deviation take no part.
_NOISE = 0.3
#: Antiresonances that are tried, from this share of the lowest line to this multiple of the top.
_LOWEST_TRIED, _HIGHEST_TRIED = 1.3, 4.0
#: Inertia of one more load, relative to the one that it hangs on.
_RATIOS = (0.05, 0.12, 0.25, 0.5, 1.0, 2.0, 5.0, 12.0, 30.0)


def fit_sampled_model(
    frf: Frf | None,
    path: SignalPath,
    *,
    from_position: Frf | None = None,
    loop: LoopModel | None = None,
    max_modes: int = 4,
    longest_delay_s: float | None = None,
    floor: float = 0.01,
    minimum_coherence: float = 0.6,
) -> SampledFit:
    """Fit mechanics and delay to a direct estimate, images included.

    ``frf`` is a direct estimate made with ``path`` from the velocity, ``from_position`` one from
    the position of the same recording, with the same lines; one of them may be None. Lines up to
    0.4 of the sample rate with enough coherence take part. A delay is looked for within
    ``longest_delay_s`` (three bus cycles in torque mode, a quarter of one in a closed loop)
    where none explains nothing.
    """
    given = [part for part in (frf, from_position) if part is not None]
    lines = given[0].frequency_hz
    coherence = np.max([part.coherence for part in given], axis=0)
    band = valid_band_hz(float(lines[0]), path.sample_rate_hz, model=True)
    use = np.asarray((lines <= band[1]) & (coherence >= minimum_coherence))
    if np.count_nonzero(use) < 12:
        raise ValueError("fewer than 12 coherent lines: too little excitation for a model")
    loop = LoopModel() if loop is None else loop
    period_s = 1.0 / path.sample_rate_hz
    if longest_delay_s is None:
        # Torque and velocity are reported together: only injection itself can be cycles late.
        longest_delay_s = 0.25 * period_s if loop.closed else 3 * period_s
    views = tuple(
        _View.of(
            part, use, path, loop, floor, integrated=part is not frf, second=part is not given[0]
        )
        for part in given
    )
    free_filter = path.response_bandwidth_hz is None and from_position is not None
    found = _best(views, period_s, longest_delay_s, max_modes, free_filter)
    freedom = max(found.residuals.size - found.x.size, 1)
    variance = float(found.residuals @ found.residuals) / freedom
    covariance = np.linalg.pinv(found.jacobian.T @ found.jacobian) * variance
    spread = np.sqrt(np.maximum(np.diag(covariance), 0.0)) * period_s
    return SampledFit(
        model=found.model,
        loop=loop,
        path=replace(path, response_bandwidth_hz=float(np.exp(found.x[4])))
        if free_filter
        else path,
        delay_s=float(found.x[2]) * period_s,
        delay_std_s=float(spread[2]),
        position_delay_s=float(found.x[3]) * period_s,
        position_delay_std_s=float(spread[3]),
        error=found.error,
        noise=found.noise,
        valid_band_hz=band,
    )


@dataclass(frozen=True)
class _View:
    """One estimate of the same mechanics: lines, values, weights, and how it came about."""

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
    ) -> _View:  # fmt: skip
        """Weights are those of the lines' accuracy, but nothing is better than the floor."""
        f = frf.frequency_hz[use]
        relative = np.nan_to_num(frf.std_db, nan=0.0)[use] * np.log(10) / 20
        # The logarithm of a line that is mostly noise is biased.
        weight = np.where(relative < _NOISE, 1.0 / np.hypot(relative, floor), 0.0)
        sampler = Sampler.of(f, path, loop, integrated=integrated)
        return _View(f, frf.response[use], weight, sampler, integrated, second)


@dataclass(frozen=True)
class _Form:
    """A way to write mechanics down in parameters: what they mean, their bounds and habits."""

    response: Callable[[FloatArray, FloatArray], tuple[ComplexArray, ComplexArray]]
    model: Callable[[FloatArray], MechanicalModel]
    bounds: Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
    prior: Callable[[FloatArray], tuple[FloatArray, FloatArray]]
    """What is usual: rows that ought to be near zero, and their slopes [rows, parameters]."""
    steps: tuple[float, ...]
    """Typical changes of a load's or mode's parameters."""


@dataclass(frozen=True)
class _Found:
    """One solution."""

    x: FloatArray
    jacobian: FloatArray
    residuals: FloatArray
    score: float
    error: float
    noise: float
    model: MechanicalModel


@dataclass(frozen=True)
class _Problem:
    """One nonlinear least-squares problem over all views."""

    views: tuple[_View, ...]
    period_s: float
    form: _Form
    free_filter: bool
    """Whether the drive's speed filter is unknown."""

    @cached_property
    def _frequencies(self) -> FloatArray:
        # All views have the same lines, and so the same images.
        return self.views[0].sampler.frequency_hz

    def _parts(self, x: FloatArray) -> tuple[list[ComplexArray], list[ComplexArray]]:
        """Per view log(seen/measured) [lines] and its slopes [parameters, lines]."""
        f = self._frequencies
        plant, slopes = self.form.response(x, f)
        late = delay_response(f, float(x[2]) * self.period_s)
        plant = plant * late
        slopes = slopes * late
        turn = -2j * np.pi * f * self.period_s
        slopes[2] = turn * plant
        values, gradients = [], []
        for view in self.views:
            corner = np.exp(x[4])
            further: ComplexArray | None = None
            if view.integrated:
                further = delay_response(f, float(x[3] - x[2]) * self.period_s)
            elif self.free_filter:
                further = lag_response(f, float(corner))
            seen, by_plant, by_further = view.sampler.seen(plant, further)
            gradient = np.einsum("pil,il->pl", slopes, by_plant)
            if further is not None and view.integrated:
                by_delay = np.sum(turn * further * by_further, axis=0)
                gradient[2] -= by_delay
                gradient[3] += by_delay
            elif further is not None:
                by_corner = further * (1j * f / corner) / (1.0 + 1j * f / corner)
                gradient[4] = np.sum(by_corner * by_further, axis=0)
            values.append(np.log(seen / view.g))
            gradients.append(gradient / seen)
        return values, gradients

    def misfit(self, x: FloatArray) -> FloatArray:
        """Weighted logarithmic error: peaks and valleys alike, sane far from the solution."""
        values, _ = self._parts(x)
        rows = [v * view.weight for v, view in zip(values, self.views, strict=True)]
        path = [*(x[2:4] * self.period_s / _USUAL_DELAY_S), (x[4] - _USUAL_CORNER) / _CORNER_SPREAD]
        usual = [np.array(path), self.form.prior(x)[0]]
        return np.concatenate([p for e in rows for p in (e.real, e.imag)] + usual)

    def slope(self, x: FloatArray) -> FloatArray:
        """Jacobian [residuals, parameters] of `misfit`."""
        _, gradients = self._parts(x)
        rows = [g * view.weight for g, view in zip(gradients, self.views, strict=True)]
        path = np.zeros((3, x.size))
        path[0, 2] = path[1, 3] = self.period_s / _USUAL_DELAY_S
        path[2, 4] = 1.0 / _CORNER_SPREAD
        usual = [path, self.form.prior(x)[1]]
        return np.concatenate([p.T for e in rows for p in (e.real, e.imag)] + usual)

    def solve(self, start: FloatArray) -> _Found:
        """Best parameters near ``start``."""
        low, high = self.form.bounds(start, self.views[0].f)
        # A delay that a start brings along is looked for around it.
        around = start[2:4]
        low[2:4], high[2:4] = np.maximum(around - 1.0, -0.3), around + 1.0
        low[4], high[4] = np.log(100.0), np.log(20000.0)
        count = (start.size - RIGID_PARAMETERS) // len(self.form.steps)
        fit = least_squares(
            self.misfit, np.clip(start, low + 1e-9, high - 1e-9), self.slope, bounds=(low, high),
            x_scale=np.array([0.3, 1.0, 0.05, 0.05, 0.3, *self.form.steps * count]),
            loss="soft_l1", f_scale=3.0, max_nfev=40, ftol=1e-4, xtol=1e-5,
        )  # fmt: skip
        points = sum(2 * int(np.count_nonzero(view.weight)) for view in self.views)
        score = points * np.log(2 * fit.cost / points) + start.size * np.log(points)
        values, _ = self._parts(fit.x)
        errors = [
            _median(np.abs(np.expm1(v)), w.weight) for v, w in zip(values, self.views, strict=True)
        ]
        noise = min(_median(1.0 / np.maximum(v.weight, 1e-9), v.weight) for v in self.views)
        return _Found(fit.x, np.asarray(fit.jac), np.asarray(fit.fun), float(score), min(errors),
                      noise, self.form.model(fit.x))  # fmt: skip


def _median(values: FloatArray, weight: FloatArray) -> float:
    """Median over the lines that take part; infinite where these are few."""
    use = weight > 0
    return float(np.median(values[use])) if np.count_nonzero(use) > 0.3 * use.size else np.inf


# --- forms ------------------------------------------------------------------------------


def _rigid_bounds(gain: float, f: FloatArray) -> tuple[list[float], list[float]]:
    """Gain, pole and delays (these are set by the problem)."""
    highest = float(np.log(0.5 * TURN * np.sqrt(f[0] * f[-1])))
    lowest = float(np.log(1e-3 * TURN * f[0]))
    return [gain - 2.5, lowest, 0.0, 0.0, 0.0], [gain + 2.5, highest, 0.0, 0.0, 0.0]


def _modal_bounds(x: FloatArray, f: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Around a start, as far as modes are physical."""
    low, high = _rigid_bounds(float(x[0]), f)
    for q in x[RIGID_PARAMETERS:].reshape(-1, MODE_PARAMETERS):
        low += [q[0] - 0.3, np.log(5e-4), q[2] - 4.0, -0.5]
        high += [q[0] + 0.3, 0.0, q[2] + 4.0, 0.5]
    return np.array(low), np.array(high)


def _modal_prior(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Modes that are damped alike at both ends."""
    places = np.arange(RIGID_PARAMETERS + 3, x.size, MODE_PARAMETERS)
    slopes = np.zeros((places.size, x.size))
    slopes[np.arange(places.size), places] = 1.0 / _USUAL_ZERO
    return x[places] / _USUAL_ZERO, slopes


def _chain_bounds(x: FloatArray, f: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Within factors of what the growth starts with."""
    whole = float(np.log(np.exp(x[0]) + np.sum(loads_of(x)[:, 0])))
    slow = np.log(1e-3 * TURN * f[0])
    fast = np.log(0.5 * TURN * np.sqrt(f[0] * f[-1]))
    low, high = [whole - 6.0, whole + slow], [whole + 1.5, whole + fast]
    low, high = [*low, 0.0, 0.0, 0.0], [*high, 0.0, 0.0, 0.0]
    stiffest = 2 * np.log(TURN * 2 * _HIGHEST_TRIED * f[-1])
    softest = 2 * np.log(TURN * f[0])
    for _ in range((x.size - RIGID_PARAMETERS) // LOAD_PARAMETERS):
        low += [whole - 7.0, whole - 7.0 + softest, whole - 12.0]
        high += [whole + 1.5, whole + 1.5 + stiffest, whole + 1.5 + 0.5 * stiffest]
    return np.array(low), np.array(high)


def _chain_prior(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Couplings with an ordinary damping ratio d / 2√(kJ)."""
    logs = x[RIGID_PARAMETERS:].reshape(-1, LOAD_PARAMETERS)
    ratio = logs[:, 2] - 0.5 * (logs[:, 0] + logs[:, 1]) - np.log(2 * _USUAL_DAMPING)
    slopes = np.zeros((len(logs), x.size))
    for i in range(len(logs)):
        place = RIGID_PARAMETERS + LOAD_PARAMETERS * i
        slopes[i, place : place + LOAD_PARAMETERS] = np.array([-0.5, -0.5, 1.0]) / _DAMPING_SPREAD
    return ratio / _DAMPING_SPREAD, slopes


_CHAIN = _Form(
    chain_response_and_slopes, model_of_chain, _chain_bounds, _chain_prior, (0.3, 0.1, 0.5)
)
_MODAL = _Form(response_and_slopes, model_of, _modal_bounds, _modal_prior, (0.03, 0.5, 0.5, 0.05))


# --- growth -----------------------------------------------------------------------------


def _best(
    views: tuple[_View, ...], period_s: float, longest_delay_s: float, max_modes: int,
    free_filter: bool,
) -> _Found:  # fmt: skip
    """The chain that the criterion likes best, or modes where they gain much over it."""
    chain = _Problem(views, period_s, _CHAIN, free_filter)
    found = _grown(chain, _rigid_start(views[0], 0.0), max_modes)
    if found.error > 0.05:
        # Perhaps there is a delay that no path told.
        late = np.arange(0.25 * period_s, longest_delay_s + 1e-9, 0.25 * period_s) / period_s
        tried = [_grown(chain, _rigid_start(views[0], float(d)), 1) for d in late]
        start = min([found, *tried], key=lambda t: t.score)
        if start is not found:
            again = _rigid_start(views[0], float(start.x[2]))
            found = min(found, _grown(chain, again, max_modes), key=lambda t: t.score)
    if found.x.size > RIGID_PARAMETERS:
        modal = _Problem(views, period_s, _MODAL, free_filter).solve(modal_start(found.x))
        # Free modes also imitate delays and noise, so they must explain much that no chain does.
        if modal.score < found.score - _MODES_GAIN and modal.error < 0.7 * found.error:
            return modal
    return found


def _rigid_start(view: _View, delay: float) -> FloatArray:
    """A single inertia, from the low lines, where every chain moves as one."""
    low = slice(0, max(3, view.f.size // 6))
    inertia = 1.0 / float(np.median(np.abs(view.g[low]) * TURN * view.f[low]))
    return np.array([np.log(inertia), np.log(0.02 * TURN * view.f[0] * inertia), delay, delay,
                     _USUAL_CORNER])  # fmt: skip


def _grown(problem: _Problem, start: FloatArray, max_modes: int) -> _Found:
    """Loads one by one as long as the criterion gains."""
    best = now = problem.solve(start)
    misses = 0
    for _ in range(max_modes):
        starts = [*_with_one_more(problem, now), *_with_one_more_mode(problem, now)]
        now = min((problem.solve(x) for x in starts), key=lambda t: t.score)
        if now.score < best.score - _WORTHWHILE:
            best, misses = now, 0
        else:
            misses += 1
        if misses == 2 or best.error < 0.002:
            break
    return best


def _with_one_more(problem: _Problem, found: _Found) -> list[FloatArray]:
    """The most promising starts with one more load, by trying very many on some lines."""
    view = best_view(problem.views)
    lines = _telling_lines(view, found)
    f = view.f[lines]
    # Images are left out here, and they come in at the upper end.
    trusted = np.where(f < 0.6 * view.f[-1], 1.0, 0.3)
    weight = np.minimum(view.weight[lines], 100.0) * trusted
    delay = found.x[3 if view.integrated else 2] * problem.period_s
    goal = view.g[lines] * np.conj(delay_response(f, float(delay)))
    top = float(view.f[-1])
    grid_hz = np.geomspace(_LOWEST_TRIED * float(f[0]), _HIGHEST_TRIED * top, 36)
    worst_hz = _worst_hz(view, found)
    places = range(1 + (found.x.size - RIGID_PARAMETERS) // LOAD_PARAMETERS)
    trials: list[_Trial] = []
    for place in places:
        new = _new_loads(found.x, place, grid_hz, worst_hz)
        responses = responses_with_load(found.x, place, new, f)
        error = np.abs(np.log(responses / goal)) * weight
        costs = np.sum(np.sqrt(1.0 + error**2 / 9.0) - 1.0, axis=1)
        for i in np.argsort(costs)[:150]:
            kept, inertia, stiffness, damping = (float(v) for v in new[i])
            trials.append(
                _Trial(
                    float(costs[i]), place, np.log(stiffness / inertia) / 2,
                    np.log(inertia / kept),
                    with_load(found.x, place, (kept, inertia, stiffness, damping)),
                )
            )  # fmt: skip
    ranked = sorted(trials, key=lambda t: t.cost)
    edges = np.log(TURN * np.array([0.0, 0.3 * top, top, np.inf]) + 1e-12)
    chosen = ranked[:1]
    for low, high in itertools.pairwise(edges):
        here = [t for t in ranked if low <= t.frequency < high]
        chosen += _different(here, chosen)[:1]
    return [t.x for t in chosen + _different(ranked, chosen)[:1]]


def _with_one_more_mode(problem: _Problem, found: _Found) -> list[FloatArray]:
    """The chain whose modes are those found and the one that explains most of what is left.

    Splitting an inertia moves all modes; this start leaves the known ones where they are.
    """
    view, model = best_view(problem.views), found.model
    f = view.f
    late = delay_response(f, float(found.x[3 if view.integrated else 2]) * problem.period_s)
    scale = view.weight / np.abs(view.g)
    s = 1j * TURN * f

    def columns(hz: FloatArray, damping: FloatArray) -> FloatArray:
        w = TURN * hz
        z = s[:, None] * scale[:, None] / (s[:, None] ** 2 + 2 * damping * w * s[:, None] + w**2)
        return np.concatenate([z.real, z.imag])

    hz, damping = (
        a.ravel() for a in np.meshgrid(np.geomspace(1.5 * f[0], f[-1], 90), (0.01, 0.05))
    )
    known = columns(
        np.array([1e-3, *(m.frequency_hz for m in model.modes)]),
        np.array([0.0, *(m.damping for m in model.modes)]),
    )
    rest = (view.g * np.conj(late) - model.response(f)) * scale
    target = np.concatenate([rest.real, rest.imag])
    q, _ = np.linalg.qr(known)
    free = columns(hz, damping)
    free -= q @ (q.T @ free)
    norm = np.maximum(np.linalg.norm(free, axis=0), 1e-9)
    explained = free.T @ (target - q @ (q.T @ target)) / norm
    best = int(np.argmax(explained))
    residue = float(explained[best] / norm[best])
    if residue <= 0:
        return []
    try:
        x = chain_of_modes(
            model.gain,
            np.array([*(m.frequency_hz for m in model.modes), hz[best]]),
            np.array([*(max(m.residue, 1e-9) for m in model.modes), residue]),
            float(np.exp(found.x[1])), _USUAL_DAMPING,
        )  # fmt: skip
    except ValueError:
        return []
    x[2:RIGID_PARAMETERS] = found.x[2:RIGID_PARAMETERS]
    return [x]


@dataclass(frozen=True)
class _Trial:
    """A way to add a load: where, logarithms of its antiresonance and of its share, parameters."""

    cost: float
    place: int
    frequency: float
    ratio: float
    x: FloatArray

    def like(self, other: _Trial) -> bool:
        """Whether both lead to the same place."""
        return (
            self.place == other.place
            and abs(self.frequency - other.frequency) < 0.5
            and abs(self.ratio - other.ratio) < 1.5
        )


def _telling_lines(view: _View, found: _Found, count: int = 35) -> npt.NDArray[np.int64]:
    """Some lines evenly, and those that are explained worst so far."""
    rest = np.hypot(*np.split(_residuals_of(view, found), 2))
    even = np.linspace(0, view.f.size - 1, min(count, view.f.size)).astype(np.int64)
    return np.unique(np.concatenate([even, np.argsort(-rest)[:count]]))


def _residuals_of(view: _View, found: _Found) -> FloatArray:
    """The view's part of the residuals: views come in order, real then imaginary parts."""
    size = 2 * view.f.size
    return found.residuals[size : 2 * size] if view.second else found.residuals[:size]


def _new_loads(x: FloatArray, place: int, grid_hz: FloatArray, worst_hz: FloatArray) -> FloatArray:
    """All loads [n, 4] that are tried at one place: added to what is there, or taken from it.

    Where the explanation fails most, there is an antiresonance or a resonance.
    """
    whole = float(np.exp(x[0]) if place == 0 else loads_of(x)[place - 1, 0])
    rows = []
    for ratio in _RATIOS:
        tried_hz = np.concatenate([grid_hz, worst_hz, worst_hz / np.sqrt(1.0 + ratio)])
        for kept in (whole, whole / (1.0 + ratio)):
            inertia = kept * ratio
            stiffness = (TURN * tried_hz) ** 2 * inertia
            damping = 2.0 * _USUAL_DAMPING * np.sqrt(stiffness * inertia)
            same = np.ones(tried_hz.size)
            rows.append(np.column_stack([same * kept, same * inertia, stiffness, damping]))
    return np.concatenate(rows)


def _different(trials: list[_Trial], known: list[_Trial], count: int = 5) -> list[_Trial]:
    """The best few that are neighbours neither of the known ones nor of each other."""
    kept: list[_Trial] = []
    for trial in trials:
        if not any(trial.like(k) for k in [*known, *kept]):
            kept.append(trial)
        if len(kept) == count:
            break
    return kept


def _worst_hz(view: _View, found: _Found, count: int = 4) -> FloatArray:
    """Where the explanation fails most, at places that are not neighbours."""
    rest = np.hypot(*np.split(_residuals_of(view, found), 2))
    chosen: list[float] = []
    for i in np.argsort(-rest):
        if all(abs(np.log(view.f[i] / f)) > 0.05 for f in chosen):
            chosen.append(float(view.f[i]))
        if len(chosen) == count:
            break
    return np.array(chosen)


def best_view(views: Sequence[_View]) -> _View:
    """The one with the larger weights."""
    return max(views, key=lambda v: float(np.sum(np.minimum(v.weight, 100.0))))


def fit_loop(
    frequency_hz: FloatArray, own_torque: ComplexArray, velocity: ComplexArray, path: SignalPath
) -> LoopModel:
    """Controller of the closed loop from its own torque and the velocity, line by line.

    ``own_torque`` and ``velocity`` are cross spectra with the injection. Only lines well below
    half the sample rate are used, since both are sampled signals.
    """
    use = frequency_hz <= 0.6 * DIRECT_SHARE * path.sample_rate_hz
    if np.count_nonzero(use) < 6:
        raise ValueError("fewer than 6 lines below 0.15 of the sample rate")
    f = frequency_hz[use]
    s = 1j * TURN * f
    known = lag_response(f, path.current_bandwidth_hz) * delay_response(f, path.loop_delay_s)
    reference = -own_torque[use] / velocity[use] / known
    a = np.column_stack([np.ones(f.size), 1.0 / s, 1.0 / s**2]) / np.abs(reference)[:, None]
    b = reference / np.abs(reference)
    matrix, target = np.vstack([a.real, a.imag]), np.concatenate([b.real, b.imag])
    # A robust pass: single lines spoilt by friction must not bend the gains.
    row: FloatArray = np.ones(target.size)
    c: FloatArray = np.zeros(3)
    for _ in range(4):
        c = np.linalg.lstsq(matrix * row[:, None], target * row, rcond=None)[0]
        error = np.abs(target - matrix @ c)
        row = 1.0 / np.sqrt(1.0 + (error / max(float(np.median(error)), 1e-9) / 2.0) ** 2)
    return LoopModel(float(c[0]), float(c[1]), float(c[2]))
