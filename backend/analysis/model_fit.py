"""Mechanics and delay from direct estimates, images included.

A chain grows load by load where a search over all ways to add one finds that one is missing, as
long as the Bayesian information criterion gains (Schwarz, Ann. Statist. 6 (1978) 461). What no
chain explains (damping elsewhere than beside a spring) a free sum of modes may, from there.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from backend.analysis.arrays import BoolArray, ComplexArray, FloatArray
from backend.analysis.chain_model import (
    LOAD_PARAMETERS,
    chain_of_modes,
    loads_of,
    modal_start,
    responses_with_load,
    with_load,
)
from backend.analysis.fit_problem import (
    CHAIN,
    HIGHEST_TRIED,
    MODAL,
    USUAL_CORNER,
    USUAL_DAMPING,
    Form,
    Found,
    Problem,
    View,
    best_view,
)
from backend.analysis.frf import Frf, valid_band_hz
from backend.analysis.mechanical_model import RIGID_PARAMETERS, TURN
from backend.analysis.sampled_model import LoopModel, SampledFit
from backend.analysis.sampling import SignalPath, delay_response

#: One more load must gain this much, free modes instead of a chain that much.
_WORTHWHILE, _MODES_GAIN = 10.0, 60.0
#: Antiresonances that are tried, from this multiple of the lowest line.
_LOWEST_TRIED = 1.3
#: A first look takes about twice so many lines and so many steps; so many starts get further.
_COARSE_LINES, _COARSE_STEPS, _FINISHED = 40, 12, 4
#: Lines with less coherence take no part, and none is believed to be more accurate than this.
_LEAST_COHERENCE, _FLOOR = 0.6, 0.01
#: Starts nearer to each other than this (logarithm of their frequencies) lead to the same place,
#: but for what is seen by its images alone: that fits at many places which lie close together.
_APART, _APART_FOLDED, _FOLDED = 0.5, 0.12, 4
#: Below this misfit mechanics are there, and delays and filter are free.
_FREED = 0.1
#: A start is moved by this much (cycles) to where its delay fits.
_LATE = 0.1
#: Images of up to about this frequency are looked at in a search.
_SEARCHED_HZ = 2000.0
#: Inertia of one more load, relative to the one that it hangs on.
_RATIOS = (0.05, 0.12, 0.25, 0.5, 1.0, 2.0, 5.0, 12.0, 30.0)


@dataclass(frozen=True)
class Solution:
    """A fit and what it was made of, for what follows from its parameters.

    ``views`` have all lines, those that took no part in the fit with a weight of zero.
    """

    fit: SampledFit
    problem: Problem
    x: FloatArray


def fit_sampled_model(
    frf: Frf | None,
    path: SignalPath,
    *,
    from_position: Frf | None = None,
    loop: LoopModel | None = None,
    max_modes: int = 4,
    longest_delay_s: float | None = None,
    start: Solution | None = None,
) -> Solution:
    """Fit mechanics and delay to a direct estimate, images included.

    ``frf`` is a direct estimate made with ``path`` from the velocity, ``from_position`` one from
    the position of the same recording, with the same lines; one of them may be None. Lines up to
    0.4 of the sample rate with enough coherence take part. A delay is looked for within
    ``longest_delay_s`` (three bus cycles in torque mode, a quarter of one in a closed loop)
    where none explains nothing. With ``start`` only the numbers of another solution are refined.

    Raises:
        ValueError: too few lines are coherent.
    """
    given = [part for part in (frf, from_position) if part is not None]
    lines = given[0].frequency_hz
    coherence = np.max([part.coherence for part in given], axis=0)
    band = valid_band_hz(float(lines[0]), path.sample_rate_hz, model=True)
    use = np.asarray((lines <= band[1]) & (coherence >= _LEAST_COHERENCE))
    if np.count_nonzero(use) < 12:
        raise ValueError("fewer than 12 coherent lines: too little excitation for a model")
    loop = LoopModel() if loop is None else loop
    period_s = 1.0 / path.sample_rate_hz
    if longest_delay_s is None:
        # Torque and velocity are reported together: only injection itself can be cycles late.
        longest_delay_s = 0.25 * period_s if loop.closed else 3 * period_s
    all_views = views_of(frf, from_position, path, loop, use)
    views = tuple(view.thinned(np.flatnonzero(use)) for view in all_views)
    free_filter = path.response_bandwidth_hz is None and from_position is not None
    if start is None:
        found, form = _best(views, period_s, longest_delay_s, max_modes, free_filter)
    else:
        form = start.problem.form
        found = Problem(views, period_s, form, free_filter).solve(start.x)
    spread = _spread(found) * period_s
    fit = SampledFit(
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
        score=found.score,
        valid_band_hz=band,
    )
    return Solution(fit, Problem(all_views, period_s, form, free_filter), found.x)


def views_of(
    frf: Frf | None, from_position: Frf | None, path: SignalPath, loop: LoopModel,
    use: BoolArray | None = None,
) -> tuple[View, ...]:  # fmt: skip
    """The estimates as the fit sees them, all lines; those not in ``use`` weigh nothing."""
    given = [part for part in (frf, from_position) if part is not None]
    if use is None:
        use = np.ones(given[0].frequency_hz.size, dtype=np.bool_)
    return tuple(
        View.of(
            part, use, path, loop, _FLOOR, integrated=part is not frf, second=part is not given[0]
        )
        for part in given
    )


def _spread(found: Found) -> FloatArray:
    """Standard deviation of every parameter."""
    freedom = max(found.residuals.size - found.x.size, 1)
    variance = float(found.residuals @ found.residuals) / freedom
    covariance = np.linalg.pinv(found.jacobian.T @ found.jacobian) * variance
    return np.asarray(np.sqrt(np.maximum(np.diag(covariance), 0.0)))


def _best(
    views: tuple[View, ...], period_s: float, longest_delay_s: float, max_modes: int,
    free_filter: bool,
) -> tuple[Found, Form]:  # fmt: skip
    """The chain that the criterion likes best, or modes where they gain much over it."""
    chain = Problem(views, period_s, CHAIN, free_filter)
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
        modal = Problem(views, period_s, MODAL, free_filter).solve(modal_start(found.x))
        # Free modes also imitate delays and noise, so they must explain much that no chain does.
        if modal.score < found.score - _MODES_GAIN and modal.error < 0.7 * found.error:
            return modal, MODAL
    return found, CHAIN


def _rigid_start(view: View, delay: float) -> FloatArray:
    """A single inertia, from the low lines, where every chain moves as one."""
    low = slice(0, max(3, view.f.size // 6))
    inertia = 1.0 / float(np.median(np.abs(view.g[low]) * TURN * view.f[low]))
    return np.array([np.log(inertia), np.log(0.02 * TURN * view.f[0] * inertia), delay, delay,
                     USUAL_CORNER])  # fmt: skip


def _grown(problem: Problem, start: FloatArray, max_modes: int) -> Found:
    """Loads one by one as long as the criterion gains."""
    problem = replace(problem, anchor=start[2:RIGID_PARAMETERS])
    best = now = problem.solve(start, bound=True)
    misses = 0
    for _ in range(max_modes):
        starts = [*_with_one_more(problem, now), *_with_one_more_mode(problem, now)]
        now = _best_end(problem, now, starts)
        if now.score < best.score - _WORTHWHILE:
            best, misses = now, 0
        else:
            misses += 1
        if misses == 2 or best.error < 0.0004:
            break
    return problem.solve(best.x)


def _best_end(problem: Problem, now: Found, starts: list[FloatArray]) -> Found:
    """Where the starts lead: all of them on few lines first, the most promising on all lines."""
    coarse = problem.thinned(_telling_lines(best_view(problem.views), now, _COARSE_LINES))
    looked = sorted(
        (coarse.solve(x, _COARSE_STEPS, bound=True) for x in starts), key=lambda t: t.score
    )
    ends = [problem.solve(t.x, bound=True) for t in looked[:_FINISHED]]
    return min((problem.solve(e.x, bound=e.error > _FREED) for e in ends), key=lambda t: t.score)


def _with_one_more(problem: Problem, found: Found) -> list[FloatArray]:
    """The most promising starts with one more load, by trying very many on some lines."""
    view = best_view(problem.views)
    lines = _telling_lines(view, found)
    f = view.f[lines]
    weight = np.minimum(view.weight[lines], 100.0)
    # What is folded back from beyond a few kHz is weak.
    images = max(1, round(_SEARCHED_HZ * problem.period_s))
    sampler = view.sampler.thinned(lines).nearest(images)
    every = sampler.frequency_hz
    late = delay_response(every, float(found.x[2]) * problem.period_s)
    further = problem.further(found.x, view, every)
    top = float(view.f[-1])
    grid_hz = np.concatenate(
        [np.geomspace(_LOWEST_TRIED * float(f[0]), 0.8 * top, 26),
         np.geomspace(0.8 * top, HIGHEST_TRIED * top, 20)]
    )  # fmt: skip
    worst_hz = _worst_hz(view, found)
    places = range(1 + (found.x.size - RIGID_PARAMETERS) // LOAD_PARAMETERS)
    trials: list[_Trial] = []
    for place in places:
        new = _new_loads(found.x, place, grid_hz, worst_hz)
        plants = responses_with_load(found.x, place, new, every.ravel())
        seen = sampler.shown(plants.reshape(-1, *every.shape) * late, further)
        rest, gain, cycles = _without_gain_and_delay(
            np.log(seen / view.g[lines]), f * problem.period_s, weight
        )
        error = np.abs(rest) * weight
        costs = np.sum(np.sqrt(1.0 + error**2 / 9.0) - 1.0, axis=1)
        for i in np.argsort(costs)[:150]:
            kept, inertia, stiffness, damping = (float(v) for v in new[i])
            trials.append(
                _Trial(
                    float(costs[i]), place, np.log(stiffness / inertia) / 2,
                    np.log(inertia / kept),
                    _adjusted(
                        with_load(found.x, place, (kept, inertia, stiffness, damping)),
                        float(gain[i]), float(cycles[i]),
                    ),
                )
            )  # fmt: skip
    ranked = sorted(trials, key=lambda t: t.cost)
    edges = np.log(TURN * np.array([0.0, 0.3 * top, 0.7 * top, np.inf]) + 1e-12)
    chosen = ranked[:1]
    for (low, high), count in zip(itertools.pairwise(edges), (1, 1, _FOLDED), strict=True):
        here = [t for t in ranked if low <= t.frequency < high]
        apart = _APART if count == 1 else _APART_FOLDED
        chosen += _different(here, chosen, count, apart)
    return [t.x for t in chosen + _different(ranked, chosen, 1)]


def _without_gain_and_delay(
    logs: ComplexArray, cycles: FloatArray, weight: FloatArray
) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """What is left of logarithms [n, lines] without a common gain and delay, and these two [n].

    ``cycles`` are the lines' frequencies times the sampling period, in which the delay is counted.
    """
    squared = weight**2
    gain = logs.real @ squared / np.sum(squared)
    turn = TURN * cycles
    late = -(logs.imag @ (squared * turn)) / np.sum(squared * turn**2)
    late = np.clip(late, -_LATE, _LATE)
    return np.asarray(logs - gain[:, None] + 1j * late[:, None] * turn), gain, late


def _adjusted(x: FloatArray, gain: float, cycles: float) -> FloatArray:
    """A chain whose response is smaller by the logarithm ``gain`` and comes earlier by cycles."""
    out = x.copy()
    out[[0, 1, *range(RIGID_PARAMETERS, x.size)]] += gain
    out[2:4] -= cycles
    return out


def _with_one_more_mode(problem: Problem, found: Found) -> list[FloatArray]:
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
            float(np.exp(found.x[1])), USUAL_DAMPING,
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

    def like(self, other: _Trial, apart: float) -> bool:
        """Whether both lead to the same place: frequencies less ``apart`` (logarithm)."""
        return (
            self.place == other.place
            and abs(self.frequency - other.frequency) < apart
            and abs(self.ratio - other.ratio) < 1.5
        )


def _telling_lines(view: View, found: Found, count: int = 35) -> npt.NDArray[np.int64]:
    """Some lines evenly, and those that are explained worst so far."""
    rest = np.hypot(*np.split(_residuals_of(view, found), 2))
    even = np.linspace(0, view.f.size - 1, min(count, view.f.size)).astype(np.int64)
    return np.unique(np.concatenate([even, np.argsort(-rest)[:count]]))


def _residuals_of(view: View, found: Found) -> FloatArray:
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
            damping = 2.0 * USUAL_DAMPING * np.sqrt(stiffness * inertia)
            same = np.ones(tried_hz.size)
            rows.append(np.column_stack([same * kept, same * inertia, stiffness, damping]))
    return np.concatenate(rows)


def _different(
    trials: list[_Trial], known: list[_Trial], count: int, apart: float = _APART
) -> list[_Trial]:
    """The best few that are neighbours neither of the known ones nor of each other."""
    kept: list[_Trial] = []
    for trial in trials:
        if not any(trial.like(k, apart) for k in [*known, *kept]):
            kept.append(trial)
        if len(kept) == count:
            break
    return kept


def _worst_hz(view: View, found: Found, count: int = 4) -> FloatArray:
    """Where the explanation fails most, at places that are not neighbours."""
    rest = np.hypot(*np.split(_residuals_of(view, found), 2))
    chosen: list[float] = []
    for i in np.argsort(-rest):
        if all(abs(np.log(view.f[i] / f)) > 0.05 for f in chosen):
            chosen.append(float(view.f[i]))
        if len(chosen) == count:
            break
    return np.array(chosen)
