"""Search for one more load in a chain: many ways are tried, images included, and ranked.

Each way is a load at a place of the chain; ways that differ only in gain and delay count as one.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from backend.analysis.mechanics.chain_model import (
    LOAD_PARAMETERS,
    chain_of_modes,
    loads_of,
    responses_with_load,
    with_load,
)
from backend.analysis.mechanics.identification.fit_problem import (
    HIGHEST_TRIED,
    USUAL_DAMPING,
    Found,
    Problem,
    View,
    best_view,
)
from backend.analysis.mechanics.mechanical_model import RIGID_PARAMETERS, TURN
from backend.analysis.response.signal_path.sampling import delay_response
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.analysis.thresholds import load_search as threshold


def with_one_more(problem: Problem, found: Found) -> list[FloatArray]:
    """Return the best starts with one more load, from many candidates evaluated on some lines."""
    view = best_view(problem.views)
    lines = informative_lines(view, found)
    f = view.f[lines]
    weight = np.minimum(view.weight[lines], 100.0).astype(np.float32)
    cycles_per_sample = (f * problem.period_s).astype(np.float32)
    # Images from beyond a few kHz are weak.
    images = max(1, round(threshold.SEARCHED_HZ * problem.period_s))
    sampler = view.sampler.thinned(lines).nearest(images).single()
    every = sampler.frequency_hz
    late = sampler.late(float(found.x[2]) * problem.period_s).astype(np.complex64)
    further = problem.further(found.x, view, sampler)
    if further is not None:
        further = further.astype(np.complex64)
    measured = view.g[lines].astype(np.complex64)
    top = float(view.f[-1])
    grid_hz = np.concatenate(
        [
            np.geomspace(threshold.LOWEST_TRIED * float(f[0]), 0.8 * top, 26),
            np.geomspace(0.8 * top, HIGHEST_TRIED * top, 20),
        ]
    )
    worst_hz = _worst_hz(view, found)
    places = range(1 + (found.x.size - RIGID_PARAMETERS) // LOAD_PARAMETERS)
    trials: list[_Trial] = []
    for place in places:
        new = _new_loads(found.x, place, grid_hz, worst_hz)
        plants = responses_with_load(found.x, place, new, every.ravel())
        seen = sampler.shown(plants.reshape(-1, *every.shape) * late, further)
        rest, gain, cycles = _without_gain_and_delay(
            np.log(seen / measured), cycles_per_sample, weight
        )
        error = np.abs(rest) * weight
        costs = np.sum(np.sqrt(1.0 + error**2 / 9.0) - 1.0, axis=1)
        best = np.argsort(costs)[:150]
        kept, inertia, stiffness, _ = new[best].T
        frequencies, ratios = np.log(stiffness / inertia) / 2, np.log(inertia / kept)
        trials += [
            _Trial(
                float(costs[i]), place, frequency, ratio, new[i], float(gain[i]), float(cycles[i])
            )
            for i, frequency, ratio in zip(best, frequencies, ratios, strict=True)
        ]
    ranked = sorted(trials, key=lambda t: t.cost)
    edges = np.log(TURN * np.array([0.0, 0.3 * top, 0.7 * top, np.inf]) + 1e-12)
    chosen = ranked[:1]
    for (low, high), count in zip(itertools.pairwise(edges), (1, 1, threshold.FOLDED), strict=True):
        here = [t for t in ranked if low <= t.frequency < high]
        apart = threshold.APART if count == 1 else threshold.APART_FOLDED
        chosen += _different(here, chosen, count, apart)
    return [t.start(found.x) for t in chosen + _different(ranked, chosen, 1)]


def _without_gain_and_delay(
    logs: ComplexArray, cycles: FloatArray, weight: FloatArray
) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Logarithms [n, lines] without a common gain and delay, and these two [n].

    ``cycles`` are the lines' frequencies times the sampling period, in which the delay is counted.
    """
    squared = weight**2
    gain = logs.real @ squared / np.sum(squared)
    turn = TURN * cycles
    late = -(logs.imag @ (squared * turn)) / np.sum(squared * turn**2)
    late = np.clip(late, -threshold.LATE, threshold.LATE)
    return np.asarray(logs - gain[:, None] + 1j * late[:, None] * turn), gain, late


def _adjusted(x: FloatArray, gain: float, cycles: float) -> FloatArray:
    """A chain whose response is smaller by the logarithm ``gain`` and earlier by ``cycles``."""
    out = x.copy()
    out[[0, 1, *range(RIGID_PARAMETERS, x.size)]] += gain
    out[2:4] -= cycles
    return out


def with_one_more_mode(problem: Problem, found: Found) -> list[FloatArray]:
    """Return the chain with the modes found and the one that explains most of the residual.

    Splitting an inertia shifts all modes; this start keeps the known ones in place.
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
            float(np.exp(found.x[1])),
            USUAL_DAMPING,
        )
    except ValueError:
        return []
    x[2:RIGID_PARAMETERS] = found.x[2:RIGID_PARAMETERS]
    return [x]


@dataclass(frozen=True)
class _Trial:
    """A way to add a load: place, logarithms of its antiresonance and of its inertia ratio.

    ``new`` [4] as in `responses_with_load`; ``gain`` (logarithm) and ``cycles`` (delay) are the
    common corrections with which it fits best.
    """

    cost: float
    place: int
    frequency: float
    ratio: float
    new: FloatArray
    gain: float
    cycles: float

    def start(self, x: FloatArray) -> FloatArray:
        """Return the start parameters, from those of the chain that it is added to."""
        kept, inertia, stiffness, damping = (float(v) for v in self.new)
        more = with_load(x, self.place, (kept, inertia, stiffness, damping))
        return _adjusted(more, self.gain, self.cycles)

    def like(self, other: _Trial, apart: float) -> bool:
        """Return whether both lead to the same solution: log frequencies closer than ``apart``."""
        return (
            self.place == other.place
            and abs(self.frequency - other.frequency) < apart
            and abs(self.ratio - other.ratio) < 1.5
        )


def informative_lines(view: View, found: Found, count: int = 35) -> npt.NDArray[np.int64]:
    """Return some lines evenly spaced, and those that are explained worst so far."""
    rest = np.hypot(*np.split(_residuals_of(view, found), 2))
    even = np.linspace(0, view.f.size - 1, min(count, view.f.size)).astype(np.int64)
    return np.unique(np.concatenate([even, np.argsort(-rest)[:count]]))


def _residuals_of(view: View, found: Found) -> FloatArray:
    """The view's part of the residuals: views come in order, real then imaginary parts."""
    size = 2 * view.f.size
    return found.residuals[size : 2 * size] if view.second else found.residuals[:size]


def _new_loads(x: FloatArray, place: int, grid_hz: FloatArray, worst_hz: FloatArray) -> FloatArray:
    """All loads [n, 4] to be tried at one place: added to the inertia there, or split from it.

    The worst explained lines are tried both as antiresonance and as resonance.
    """
    whole = float(np.exp(x[0]) if place == 0 else loads_of(x)[place - 1, 0])
    rows = []
    for ratio in threshold.RATIOS:
        tried_hz = np.concatenate([grid_hz, worst_hz, worst_hz / np.sqrt(1.0 + ratio)])
        for kept in (whole, whole / (1.0 + ratio)):
            inertia = kept * ratio
            stiffness = (TURN * tried_hz) ** 2 * inertia
            damping = 2.0 * USUAL_DAMPING * np.sqrt(stiffness * inertia)
            same = np.ones(tried_hz.size)
            rows.append(np.column_stack([same * kept, same * inertia, stiffness, damping]))
    return np.concatenate(rows)


def _different(
    trials: list[_Trial], known: list[_Trial], count: int, apart: float = threshold.APART
) -> list[_Trial]:
    """The best few that are similar neither to the known ones nor to each other."""
    kept: list[_Trial] = []
    for trial in trials:
        if not any(trial.like(k, apart) for k in [*known, *kept]):
            kept.append(trial)
        if len(kept) == count:
            break
    return kept


def _worst_hz(view: View, found: Found, count: int = 4) -> FloatArray:
    """The worst explained frequencies that are not neighbours."""
    rest = np.hypot(*np.split(_residuals_of(view, found), 2))
    chosen: list[float] = []
    for i in np.argsort(-rest):
        if all(abs(np.log(view.f[i] / f)) > 0.05 for f in chosen):
            chosen.append(float(view.f[i]))
        if len(chosen) == count:
            break
    return np.array(chosen)
