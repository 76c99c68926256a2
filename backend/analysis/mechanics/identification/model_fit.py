"""Fit of mechanics and delay to direct estimates, images included.

A chain is extended load by load, found by a search over all ways to add one, as long as the
Bayesian information criterion improves (Schwarz, Ann. Statist. 6 (1978) 461). What no chain
explains (damping other than in parallel with a spring) is fitted by a free sum of modes from there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from backend.analysis.mechanics.chain_model import modal_start
from backend.analysis.mechanics.identification.fit_problem import (
    CHAIN,
    MODAL,
    USUAL_CORNER,
    Form,
    Found,
    KnownInertia,
    Problem,
    View,
    best_view,
)
from backend.analysis.mechanics.identification.load_search import (
    informative_lines,
    with_one_more,
    with_one_more_mode,
)
from backend.analysis.mechanics.mechanical_model import RIGID_PARAMETERS, TURN
from backend.analysis.response.frf import Frf, valid_band_hz
from backend.analysis.response.signal_path.sampled_model import LoopModel, SampledFit
from backend.analysis.response.signal_path.sampling import SignalPath
from backend.analysis.signals.arrays import BoolArray, FloatArray
from backend.analysis.thresholds import model_fit as threshold


@dataclass(frozen=True)
class Solution:
    """A fit with its problem and parameters, for further evaluation.

    The problem's views have all lines; those not used in the fit have weight zero.
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
    to_whole_cycles: bool = False,
    start: Solution | None = None,
    inertia: KnownInertia | None = None,
) -> Solution:
    """Fit mechanics and delay to a direct estimate, images included.

    ``frf`` is a direct estimate made with ``path`` from the velocity, ``from_position`` one from
    the position of the same recording, with the same lines; one of them may be None. Lines up to
    0.4 of the sample rate with enough coherence are used. Where no fit without a delay explains the
    data, a delay up to ``longest_delay_s`` is searched for (default: three bus cycles in torque
    mode, a quarter of one in a closed loop). With ``to_whole_cycles`` the mechanics are not
    searched for again where that delay is nearer to whole cycles than to none: a path can have
    those. With ``start`` only the parameters of another solution are refined. ``inertia`` is that
    of the whole axis, where moves have shown it.

    Raises:
        ValueError: too few lines are coherent.
    """
    given = [part for part in (frf, from_position) if part is not None]
    lines = given[0].frequency_hz
    coherence = np.max([part.coherence for part in given], axis=0)
    band = valid_band_hz(float(lines[0]), path.sample_rate_hz, model=True)
    use = np.asarray((lines <= band[1]) & (coherence >= threshold.LEAST_COHERENCE))
    if np.count_nonzero(use) < 12:
        raise ValueError("fewer than 12 coherent lines: too little excitation for a model")
    loop = LoopModel() if loop is None else loop
    period_s = 1.0 / path.sample_rate_hz
    if longest_delay_s is None:
        # Torque and velocity are reported together: only the injection itself can be cycles late.
        longest_delay_s = 0.25 * period_s if loop.closed else 3 * period_s
    all_views = views_of(frf, from_position, path, loop, use)
    views = tuple(view.thinned(np.flatnonzero(use)) for view in all_views)
    free_filter = path.response_bandwidth_hz is None and from_position is not None
    if start is None:
        plain = Problem(views, period_s, CHAIN, free_filter, inertia=inertia)
        found, form = _best(plain, longest_delay_s, max_modes, to_whole_cycles=to_whole_cycles)
    else:
        form = start.problem.form
        again = Problem(views, period_s, form, free_filter, inertia=inertia)
        found = again.solve(start.x)
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
    whole = Problem(all_views, period_s, form, free_filter, inertia=inertia)
    return Solution(fit, whole, found.x)


def views_of(
    frf: Frf | None,
    from_position: Frf | None,
    path: SignalPath,
    loop: LoopModel,
    use: BoolArray | None = None,
) -> tuple[View, ...]:
    """Return the estimates as the fit uses them; lines not in ``use`` have weight zero."""
    given = [part for part in (frf, from_position) if part is not None]
    if use is None:
        use = np.ones(given[0].frequency_hz.size, dtype=np.bool_)
    return tuple(
        View.of(
            part,
            use,
            path,
            loop,
            threshold.FLOOR,
            integrated=part is not frf,
            second=part is not given[0],
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
    chain: Problem, longest_delay_s: float, max_modes: int, *, to_whole_cycles: bool
) -> tuple[Found, Form]:
    """The chain with the best criterion, or free modes where they are much better."""
    views, period_s = chain.views, chain.period_s
    found = _grown(chain, _rigid_start(views[0], 0.0), max_modes)
    if found.error > max(threshold.LATE, threshold.ABOVE_NOISE * found.noise):
        # There may be a delay that no path shows.
        step_s = (0.5 if to_whole_cycles else 0.25) * period_s
        late = np.arange(step_s, longest_delay_s + 1e-9, step_s) / period_s
        tried = [_grown(chain, _rigid_start(views[0], float(d)), 1) for d in late]
        start = min([found, *tried], key=lambda t: t.score)
        if start is not found and to_whole_cycles and round(float(start.x[2])):
            return start, CHAIN
        if start is not found:
            again = _rigid_start(views[0], float(start.x[2]))
            found = min(found, _grown(chain, again, max_modes), key=lambda t: t.score)
    if found.x.size > RIGID_PARAMETERS:
        modal = replace(chain, form=MODAL).solve(modal_start(found.x))
        # Free modes also imitate delays and noise, so they must explain much that no chain does.
        if modal.score < found.score - threshold.MODES_GAIN and modal.error < 0.7 * found.error:
            return modal, MODAL
    return found, CHAIN


def _rigid_start(view: View, delay: float) -> FloatArray:
    """A single inertia, from the low lines, where every chain moves as one."""
    low = slice(0, max(3, view.f.size // 6))
    inertia = 1.0 / float(np.median(np.abs(view.g[low]) * TURN * view.f[low]))
    return np.array(
        [np.log(inertia), np.log(0.02 * TURN * view.f[0] * inertia), delay, delay, USUAL_CORNER]
    )


def _grown(problem: Problem, start: FloatArray, max_modes: int) -> Found:
    """Add loads one by one as long as the criterion improves."""
    problem = replace(problem, anchor=start[2:RIGID_PARAMETERS])
    best = now = problem.solve(start, bound=True)
    misses = 0
    for _ in range(max_modes):
        starts = [*with_one_more(problem, now), *with_one_more_mode(problem, now)]
        now = _best_end(problem, now, starts)
        if now.score < best.score - threshold.WORTHWHILE:
            best, misses = now, 0
        else:
            misses += 1
        # With so small a misfit, no further load can be hidden behind one that alone gains little.
        if misses == 2 or (misses and best.error < threshold.EXPLAINED) or best.error < 0.0004:
            break
    return problem.solve(best.x)


def _best_end(problem: Problem, now: Found, starts: list[FloatArray]) -> Found:
    """The best solution from the starts: all of them on few lines first, the best on all lines."""
    coarse = problem.thinned(
        informative_lines(best_view(problem.views), now, threshold.COARSE_LINES)
    )
    looked = sorted(
        (coarse.solve(x, threshold.COARSE_STEPS, bound=True) for x in starts), key=lambda t: t.score
    )
    ends = [problem.solve(t.x, bound=True) for t in looked[: threshold.FINISHED]]
    least = min(e.score for e in ends)
    followed = (e for e in ends if e.score < least + threshold.WORSE)
    return min(
        (problem.solve(e.x, bound=e.error > threshold.FREED) for e in followed),
        key=lambda t: t.score,
    )
