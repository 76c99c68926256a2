"""A plant from its own loop: known axes, known controllers, so that all answers are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from backend.analysis.loop.design import design
from backend.analysis.loop.loop_goals import goals_for, worst_of
from backend.analysis.loop.loop_search import LoopSearch, Shape
from backend.analysis.loop.loop_seen import LoopLines, seen_in_loop
from backend.analysis.loop.loop_structure import DriveLoops, Gains, speed_loop
from backend.analysis.loop.margins import bandwidth, closed_from_open
from backend.analysis.loop.measured_plant import MeasuredPlant
from backend.analysis.mechanics.mechanical_model import MechanicalModel
from backend.analysis.signals.arrays import ComplexArray, FloatArray

#: Rigid: 1e-4 kg·m² as measured before; within its loop a fifth of it is loose, above some 30 Hz.
BEFORE = MechanicalModel(1e4, 1.0)
LOOPS = DriveLoops(1000.0, 1e-4)
GAINS = Gains(0.06, 9.5, 100.0, 95.0)
LINES = np.arange(5.0, 400.0, 1.5)
GRID = np.geomspace(1.0, 6000.0, 400)


def loose(f: FloatArray) -> ComplexArray:
    """What the loop finds of the plant over what was measured before it: 1, later 1.25."""
    return np.asarray((1.0 + 1.25j * f / 30.0) / (1.0 + 1j * f / 30.0))


def controller(f: FloatArray) -> ComplexArray:
    return speed_loop(f, np.ones(f.size, dtype=np.complex128), LOOPS.response(f), GAINS)


def plant() -> MeasuredPlant:
    return MeasuredPlant(GRID, np.ones(GRID.size, dtype=np.complex128), BEFORE, 400.0)


def lines(deviation: float | FloatArray = 0.002, seed: int | None = None) -> LoopLines:
    """The closed loop of the axis as it is, with noise of that size where there is a seed."""
    closed = closed_from_open(BEFORE.response(LINES) * loose(LINES) * controller(LINES))
    size = np.broadcast_to(deviation, LINES.shape).astype(np.float64)
    if seed is not None:
        rng = np.random.default_rng(seed)
        noise = rng.standard_normal(LINES.size) + 1j * rng.standard_normal(LINES.size)
        closed = closed * np.exp(size * noise)
    return LoopLines(LINES, closed, size)


def off(seen: MeasuredPlant, f: FloatArray) -> FloatArray:
    """By how much the logarithm of the plant is off the truth."""
    found = seen.on(f).response() / (BEFORE.response(f) * loose(f))
    return np.abs(np.log(found))


def test_the_plant_is_what_its_loop_shows() -> None:
    seen = seen_in_loop(plant(), lines(), controller(LINES))
    # 0.22 was missing; what a line may be off by in any case leaves some of it.
    assert np.max(off(seen, np.geomspace(60.0, 350.0, 40))) < 0.02
    truth = bandwidth(LINES, lines().closed).minus_3db_hz
    first = bandwidth(LINES, closed_from_open(BEFORE.response(LINES) * controller(LINES)))
    found = bandwidth(LINES, closed_from_open(seen.on(LINES).response() * controller(LINES)))
    assert truth is not None
    assert first.minus_3db_hz is not None
    assert abs(first.minus_3db_hz / truth - 1) > 0.08, "else this shows nothing"
    assert found.minus_3db_hz == pytest.approx(truth, rel=0.01)


def test_beyond_the_lines_and_where_the_gain_is_high_it_stays_what_it_was() -> None:
    f = np.array([1.5, 3.0, 600.0, 1000.0, 3000.0])
    seen = seen_in_loop(plant(), lines(), controller(LINES))
    assert np.allclose(seen.on(f).response(), BEFORE.response(f))
    # At 5 Hz the closed loop is 1 within a thousandth, whatever the plant is: it shows little.
    strange = lines()
    closed = strange.closed.copy()
    closed[0] *= 1.002
    seen = seen_in_loop(plant(), replace(strange, closed=closed), controller(LINES))
    assert abs(np.log(seen.on(LINES[:1]).response() / BEFORE.response(LINES[:1]))[0]) < 0.05


def test_what_differs_from_line_to_line_is_no_plant() -> None:
    """Play scatters lines; 0.05 of each is 0.9° and 0.1 dB of their mean."""
    errors = [
        np.median(off(seen_in_loop(plant(), lines(0.05, seed), controller(LINES)), LINES[40:230]))
        for seed in range(5)
    ]
    assert max(errors) < 0.025


def test_single_sharp_lines_among_blurred_ones_are_not_believed() -> None:
    """A pair of realisations is quiet by chance at some lines; above 150 Hz these are all wrong."""
    blurred = np.where((LINES > 150.0) & (np.arange(LINES.size) % 3 != 0), 0.5, 0.01)
    given = lines(blurred)
    closed = given.closed.copy()
    closed[LINES > 150.0] *= 2.0
    seen = seen_in_loop(plant(), replace(given, closed=closed), controller(LINES))
    f = np.geomspace(200.0, 380.0, 20)
    assert np.allclose(seen.on(f).response(), BEFORE.response(f))
    assert np.max(off(seen, np.geomspace(60.0, 110.0, 20))) < 0.03


def test_too_few_lines_tell_no_plant() -> None:
    with pytest.raises(ValueError, match="do not tell"):
        seen_in_loop(plant(), lines(0.3), controller(LINES))
    with pytest.raises(ValueError, match="do not tell"):
        seen_in_loop(plant(), lines(np.full(LINES.size, np.nan)), controller(LINES))


@pytest.mark.parametrize("heavier", [False, True])
def test_a_design_holds_for_the_axis_before_and_within_its_loop(heavier: bool) -> None:
    before, shown = plant(), lines()
    if heavier:
        less = BEFORE.response(LINES) / loose(LINES) * controller(LINES)
        shown = replace(shown, closed=closed_from_open(less))
    seen = seen_in_loop(before, shown, controller(LINES))
    goals = goals_for("stiff", "balanced")
    found = {}
    for name, each in (("before", before), ("both", seen)):
        table = design(each, 1e-4, LOOPS, "stiff", slots=0)
        found[name] = next(row for row in table if "balanced" in row.marks).gains
    if heavier:
        # What bounds the gain is the axis as it was measured before.
        assert found["both"].speed_nms == pytest.approx(found["before"].speed_nms, rel=0.02)
    else:
        assert found["both"].speed_nms < 0.9 * found["before"].speed_nms
    for each in (before, replace(seen, also=None)):
        search = LoopSearch(each, 1e-4, LOOPS, lambda _n, f: np.ones(f.size, dtype=np.complex128))
        fixed = search.fixed(Shape())
        assert fixed is not None
        assert worst_of(search.loops_at(fixed, found["both"].speed_bandwidth_hz)).meets(goals)
