"""Design of loop gains and notches on the measured response.

For each mark the candidates are the best loops with no notch, one, two, …, each with the highest
gain that meets the goals for all modes shifted by ±5 % and a range of damping. The prediction uses
the measured lines, and the model only between and above them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from backend.analysis.loop.loop_goals import Goals, LoadClass, Mark, Worst, goals_for, worst_of
from backend.analysis.loop.loop_search import (
    BEGUN,
    INTEGRAL_RATIO,
    TRIED_AT_LAST,
    Found,
    LoopSearch,
)
from backend.analysis.loop.loop_structure import (
    TURN,
    DriveLoops,
    Gains,
    LoopFilters,
    NotchResponse,
    continuous_notch,
    speed_loop,
    step_of_closed_loop,
)
from backend.analysis.loop.margins import Margins, bandwidth, closed_from_open, margins
from backend.analysis.loop.measured_plant import MeasuredPlant
from backend.analysis.loop.notch import Notch
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.analysis.signals.step import step_metrics

MARKS: tuple[Mark, ...] = ("robust", "balanced", "fast")
_POSITION_GOALS = Goals(8.0, 60.0, 1.6)


@dataclass(frozen=True)
class Candidate:
    """One row of the candidate table.

    ``bandwidth_hz`` (-3 dB), ``overshoot_percent`` and ``settling_s`` (2 %) are of the speed loop;
    ``nominal`` margins are predicted for the axis as measured, ``guaranteed`` are the worst over
    all shifts less the reserve for measurement errors; ``phase_cost_deg`` is the phase loss of the
    notches at the crossover frequency. ``filters`` are the filter corners that the design assumes.
    """

    notches: tuple[Notch, ...]
    gains: Gains
    bandwidth_hz: float | None
    position_bandwidth_hz: float | None
    nominal: Margins
    guaranteed: Goals
    phase_cost_deg: float
    overshoot_percent: float
    settling_s: float | None
    marks: tuple[Mark, ...] = ()
    filters: LoopFilters = field(default_factory=LoopFilters)


def design(
    plant: MeasuredPlant,
    inertia_kgm2: float,
    loops: DriveLoops,
    load: LoadClass,
    *,
    slots: int,
    notch_response: NotchResponse = continuous_notch,
) -> tuple[Candidate, ...]:
    """Return all useful candidates, fastest first; up to three carry a mark.

    ``inertia_kgm2`` is that of the whole axis, ``slots`` the number of the drive's notches,
    ``notch_response`` the response of a notch as the drive realises it (it raises ValueError where
    the drive cannot; the notch is then left out). Empty when no loop meets any goal.
    """
    search = LoopSearch(plant, inertia_kgm2, loops, notch_response)
    goals = {mark: goals_for(load, mark).with_reserve() for mark in MARKS}
    best = {mark: search.best(goals[mark], slots) for mark in MARKS}
    firsts = [max(found, key=_merit) for found in best.values() if found]
    rows: list[Candidate] = []
    stricter: Found | None = None
    for mark in MARKS:
        if not best[mark]:
            continue
        winner = _winner(search, best[mark], firsts, goals[mark])
        if stricter is not None:
            # A loop that meets the stricter goals meets these with at least as much gain.
            winner = search.better(winner, stricter.shape, goals[mark])
        stricter = winner
        rows += [_candidate(search, found, ()) for found in best[mark] if found is not winner]
        rows.append(_candidate(search, winner, (mark,)))
    return _table(rows)


def _winner(
    search: LoopSearch, found: Sequence[Found], others: Sequence[Found], goals: Goals
) -> Found:
    """The best design reached from these, and from the best ones for the other goals."""
    first = max(found, key=_merit)
    bar = replace(first, merit=BEGUN * first.merit)
    shapes = [s for s in dict.fromkeys(other.shape for other in others) if s != first.shape]
    begun = [first, *(search.better(bar, shape, goals) for shape in shapes)]
    return max(
        (search.shaken(each, goals, TRIED_AT_LAST) for each in begun if each is not bar), key=_merit
    )


def _merit(found: Found) -> float:
    return found.merit


def _candidate(search: LoopSearch, found: Found, marks: tuple[Mark, ...]) -> Candidate:
    """Complete one row with position gain, prediction and step response."""
    f, plant, shape = search.frequency_hz, search.plant, found.shape
    filters = search.fixed(shape)
    assert filters is not None
    hz = found.bandwidth_hz
    loops = search.loops_at(filters, hz)
    gains = Gains(
        TURN * hz * search.inertia_kgm2, hz / INTEGRAL_RATIO, _position_gain(f, loops, hz), hz
    )
    row = described(
        f,
        plant.response(),
        filters,
        gains,
        worst_of(loops).guaranteed,
        notches=shape.notches,
        filters=search.filters[shape.choice],
    )
    cost = _phase_cost(search, found, filters, row.nominal.crossover_hz)
    return replace(row, phase_cost_deg=cost, marks=marks)


def described(
    f: FloatArray, plant: ComplexArray, fixed: ComplexArray, gains: Gains, guaranteed: Goals, *,
    notches: tuple[Notch, ...], filters: LoopFilters,
) -> Candidate:  # fmt: skip
    """Return prediction and step of a loop on a plant; ``fixed`` is the loop except its gains."""
    loop = speed_loop(f, plant, fixed, gains)
    closed = closed_from_open(loop)
    time, value = step_of_closed_loop(f, closed)
    metrics = step_metrics(time, value, target=1.0, initial=0.0)
    outer = closed_from_open(gains.position_1_s / (1j * TURN * f) * closed)
    return Candidate(
        notches=tuple(sorted(notches, key=lambda notch: notch.center_hz)),
        gains=gains,
        bandwidth_hz=bandwidth(f, closed).minus_3db_hz,
        position_bandwidth_hz=bandwidth(f, outer).minus_3db_hz,
        nominal=margins(f, loop),
        guaranteed=guaranteed,
        phase_cost_deg=0.0,
        overshoot_percent=metrics.overshoot_percent,
        settling_s=metrics.settling_s,
        filters=filters,
    )


def _phase_cost(
    search: LoopSearch, found: Found, filters: ComplexArray, crossover_hz: float | None
) -> float:
    """Phase loss of the notches at the crossover frequency, in degrees."""
    bare = search.fixed(replace(found.shape, notches=()))
    if crossover_hz is None or not found.shape.notches or bare is None:
        return 0.0
    taken = np.unwrap(np.angle(filters / bare))
    return -float(np.degrees(np.interp(crossover_hz, search.frequency_hz, taken)))


def _position_gain(f: FloatArray, loops: ComplexArray, speed_bandwidth_hz: float) -> float:
    """Highest position gain with 8 dB, 60° and Ms 1.6, at most a quarter of the speed bandwidth.

    Where no tried gain meets them, a quarter of the lowest tried, without a check.
    """
    outer = closed_from_open(loops) / (1j * TURN * f)
    trial = np.geomspace(0.05, 1.0, 16) * TURN * speed_bandwidth_hz / 4.0
    for gain in trial[::-1]:
        worst: Worst = worst_of(np.asarray(gain * outer))
        if worst.meets(_POSITION_GOALS):
            return float(gain)
    return float(trial[0]) / 4.0


def _table(found: list[Candidate]) -> tuple[Candidate, ...]:
    """Merge equal rows with all their marks, and sort them fastest first."""
    rows: dict[tuple[object, ...], Candidate] = {}
    for c in found:
        key = (c.notches, c.gains, c.filters)
        same = rows.get(key)
        rows[key] = c if same is None else replace(same, marks=same.marks + c.marks)
    return tuple(sorted(rows.values(), key=lambda c: -c.gains.speed_bandwidth_hz))
