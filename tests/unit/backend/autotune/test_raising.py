"""How far a gain is raised, and what that decides between the possible paths of a reference.

A slow loop: far above its bandwidth T is L, so that its lines cannot tell whether reference or loop
is late. The true loop is computed from masses, spring and delay alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from backend.analysis.loop.design import Candidate
from backend.analysis.loop.loop_goals import Goals, Worst, worst_of
from backend.analysis.loop.loop_structure import Gains, speed_loop
from backend.analysis.loop.loop_verdict import LoopVerdict
from backend.analysis.loop.margins import Margins
from backend.analysis.loop.measured_plant import MeasuredPlant
from backend.analysis.mechanics.mechanical_model import MechanicalModel, Mode
from backend.analysis.response.frf import Frf
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.tuning.autotune.verification import verdict as tune_verdict
from backend.tools.tuning.autotune.verification.raising import GainRaise, by_raised_gain
from backend.tools.tuning.autotune.verification.verdict import misses, verdicts_of, worst_of_paths

MOTOR, LOAD = 3e-5, 1.8e-4
#: A motor with six times its inertia behind a coupling: it crosses 0 dB again above 400 Hz, where
#: nothing is measured.
MODEL = MechanicalModel(
    1.0 / (MOTOR + LOAD), 1.0, (Mode(400.0, 0.02, 1.0 / MOTOR - 1.0 / (MOTOR + LOAD), 0.0),)
)
GOALS = Goals(9.0, 48.0, 1.8)
FACTS = AxisFacts(1.27, True, 3000.0, 1000.0, MOTOR, None, None, True)
DENSE = np.geomspace(1.0, 6000.0, 900)
PLANT = MeasuredPlant(DENSE, np.ones(DENSE.size, np.complex128), MODEL, 246.0)
AXIS: Any = None


def fixed(_axis: Any, _facts: Any, _notches: Any, _filters: Any, f: FloatArray) -> ComplexArray:
    return np.asarray(np.exp(-2j * np.pi * f * 100e-6) / (1.0 + 1j * f / 1500.0))


@dataclass(frozen=True)
class Tuned:
    """A loop of this bandwidth on the whole axis, late by ``late_s`` beyond its prediction."""

    hz: float
    late_s: float = 0.0

    @property
    def gains(self) -> Gains:
        return Gains(2 * np.pi * self.hz * (MOTOR + LOAD), 0.1 * self.hz, self.hz, self.hz)

    @property
    def candidate(self) -> Candidate:
        worst = worst_of(self.loop(DENSE, late_s=0.0)[None, :])
        nominal = Margins(
            self.hz, worst.phase_margin_deg, self.hz, worst.gain_margin_db, 700.0, worst.ms, 400.0,
            True,
        )  # fmt: skip
        return Candidate((), self.gains, self.hz, None, nominal, GOALS, 0.0, 5.0, 0.1)

    def loop(self, f: FloatArray, late_s: float | None = None) -> ComplexArray:
        late_s = self.late_s if late_s is None else late_s
        given = MODEL.response(f) * np.exp(-2j * np.pi * f * late_s)
        return speed_loop(f, given, fixed(None, None, (), None, f), self.gains)

    @property
    def true(self) -> Worst:
        f = np.geomspace(0.5, 6000.0, 8000)
        return worst_of(self.loop(f)[None, :])

    def lines(self) -> Frf:
        rng = np.random.default_rng(1)
        f = np.unique(np.concatenate([np.arange(6.0, 92.0, 1.5), np.arange(93.0, 246.0, 6.0)]))
        loop = self.loop(f)
        noise = np.radians(1.5) * (rng.standard_normal(f.size) + 1j * rng.standard_normal(f.size))
        same = np.ones(f.size)
        return Frf(
            f, loop / (1.0 + loop) * np.exp(noise), 0.23 * same, 1.5 * same, 0.99 * same, same,
            same, 1000.0, (5.0, 246.0), 4, 0,
        )  # fmt: skip

    def verdicts(self, shown_db: float | None = None) -> tuple[LoopVerdict, ...]:
        return verdicts_of(AXIS, FACTS, PLANT, self.candidate, self.lines(), "linear", shown_db)


def known(tuned: Tuned, verdicts: Sequence[LoopVerdict], goals: Goals = GOALS) -> GainRaise:
    return GainRaise(AXIS, FACTS, PLANT, tuned.candidate, goals, verdicts)


@pytest.fixture(autouse=True)
def without_a_drive(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tune_verdict, "fixed_of", fixed)


def test_a_raised_gain_decides_between_paths_that_the_lines_do_not_tell() -> None:
    tuned = Tuned(10.0)
    before = tuned.verdicts()
    assert len(before) == 2
    worst = worst_of_paths(before)
    missed = misses(worst, GOALS)
    assert missed
    assert all(by_raised_gain(each) for each in missed)
    to_db = known(tuned, before).raised_to(missed)
    assert to_db is not None
    assert GOALS.gain_margin_db < to_db < tuned.true.gain_margin_db
    after = worst_of_paths(tuned.verdicts(to_db))
    assert not misses(after, GOALS)
    assert after.worst.phase_margin_deg <= tuned.true.phase_margin_deg
    assert after.worst.gain_margin_db <= tuned.true.gain_margin_db
    assert after.worst.ms >= tuned.true.ms


def test_a_path_that_a_raised_gain_contradicts_is_left_out() -> None:
    tuned = Tuned(7.0)
    far_db = tuned.true.gain_margin_db - 0.5
    found = tuned.verdicts(far_db)
    assert [each.contradicted for each in found].count(True) == 1
    assert not worst_of_paths(found).contradicted
    # Where every path is contradicted nothing is known.
    all_of_them = tuned.verdicts(far_db + 12.0)
    assert worst_of_paths(all_of_them).contradicted


@pytest.mark.long(keep=2)
@pytest.mark.parametrize("late_s", [100e-6, 250e-6, 400e-6])
def test_a_loop_that_is_late_is_not_kept_unless_it_is_sound(late_s: float) -> None:
    for hz in (5.0, 7.0, 10.0):
        tuned = Tuned(hz, late_s)
        before = tuned.verdicts()
        missed = misses(worst_of_paths(before), GOALS)
        kept = not missed
        if missed and all(by_raised_gain(each) for each in missed):
            to_db = known(tuned, before).raised_to(missed)
            shown_db = min(to_db or 0.0, tuned.true.gain_margin_db - 0.1)
            kept = to_db is not None and shown_db >= to_db - 0.1
            kept = kept and not misses(worst_of_paths(tuned.verdicts(shown_db)), GOALS)
        holds = tuned.true.meets(Goals(8.0, 43.0, 1.8 * 10 ** (1.0 / 20)))
        assert holds or not kept, (hz, tuned.true)


def test_where_no_raise_within_reach_decides_a_softer_design_is_named() -> None:
    """Its loops of less than 47° are stable with up to 1 dB less than it is itself."""
    tuned, goals = Tuned(40.0), Goals(9.0, 52.0, 1.7)
    before = tuned.verdicts()
    missed = misses(worst_of_paths(before), goals)
    assert known(tuned, before, goals).raised_to(missed) is None
    share = known(tuned, before, goals).share_to_show(missed)
    assert share is not None
    assert 0.6 < share < 0.95
    less = Tuned(share * tuned.hz)
    verdicts = less.verdicts()
    missed = misses(worst_of_paths(verdicts), goals)
    to_db = known(less, verdicts, goals).raised_to(missed)
    assert to_db is not None
    assert to_db < less.true.gain_margin_db
    assert not misses(worst_of_paths(less.verdicts(to_db)), goals)


def test_no_raise_is_sure_where_a_possible_loop_is_not_stable() -> None:
    tuned = Tuned(16.0)
    verdicts = tuned.verdicts()
    assert not all(each.stable for each in verdicts)
    assert known(tuned, verdicts).surely_db() == 0.0
