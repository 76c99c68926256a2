"""A loop whose lines are each too uncertain for a margin: together they show delay and gain."""

from __future__ import annotations

import numpy as np
import pytest

from backend.analysis.loop.design import Candidate
from backend.analysis.loop.loop_goals import Goals
from backend.analysis.loop.loop_structure import Gains, LoopFilters, speed_loop
from backend.analysis.loop.loop_verdict import LoopVerdict
from backend.analysis.loop.margins import Margins
from backend.analysis.loop.measured_plant import MeasuredPlant
from backend.analysis.loop.notch import Notch
from backend.analysis.mechanics.mechanical_model import MechanicalModel, Mode
from backend.analysis.response.frf import Frf
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.axes.axis.axis import Axis
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.tuning.autotune.verification import verdict as tune_verdict
from backend.tools.tuning.autotune.verification.verdict import verdict_of

MOTOR, LOAD = 3e-5, 3e-4
#: A motor with ten times its inertia behind a coupling: 9 Hz on the whole, 220 Hz decoupled.
MODEL = MechanicalModel(
    1.0 / (MOTOR + LOAD), 1.0, (Mode(110.0, 0.03, 1.0 / MOTOR - 1.0 / (MOTOR + LOAD), 0.0),)
)
GAINS = Gains(2 * np.pi * 9.0 * (MOTOR + LOAD), 0.9, 10.0, 9.0)
GOALS = Goals(10.0, 52.0, 1.7)


def fixed(
    _axis: Axis,
    _facts: AxisFacts,
    _notches: tuple[Notch, ...],
    _filters: LoopFilters,
    f: FloatArray,
) -> ComplexArray:
    return np.asarray(np.exp(-2j * np.pi * f * 100e-6) / (1.0 + 1j * f / 1500.0))


def judged(
    monkeypatch: pytest.MonkeyPatch, std_deg: float, late_s: float, size: float, seed: int
) -> LoopVerdict:
    """The verdict on a loop with this delay and gain beyond the prediction, and noisy lines."""
    monkeypatch.setattr(tune_verdict, "fixed_of", fixed)
    rng = np.random.default_rng(seed)
    dense = np.geomspace(1.0, 6000.0, 900)
    plant = MeasuredPlant(dense, np.ones(dense.size, np.complex128), MODEL, 246.0)
    f = np.unique(np.concatenate([np.arange(6.0, 92.0, 1.5), np.arange(93.0, 246.0, 6.0)]))
    given = MODEL.response(f) * size * np.exp(-2j * np.pi * f * late_s)
    loop = speed_loop(f, given, fixed(None, None, (), LoopFilters(), f), GAINS)  # type: ignore[arg-type]
    std = np.radians(std_deg)
    noise = std * (rng.standard_normal(f.size) + 1j * rng.standard_normal(f.size))
    same = np.ones(f.size)
    frf = Frf(
        f, loop / (1.0 + loop) * np.exp(noise), 8.686 * std * same, std_deg * same, 0.96 * same,
        same, same, 1000.0, (5.0, 246.0), 4, 0,
    )  # fmt: skip
    nominal = Margins(220.0, 60.0, 220.0, 17.0, 700.0, 1.4, 400.0, True)
    candidate = Candidate((), GAINS, 9.0, None, nominal, GOALS, 0.0, 5.0, 0.1)
    facts = AxisFacts(1.27, True, 3000.0, 1000.0, None, None, None, True)
    return verdict_of(None, facts, plant, candidate, frf, "linear")  # type: ignore[arg-type]


def test_lines_too_blurred_for_a_margin_limit_delay_and_gain(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = judged(monkeypatch, 9.0, 0.0, 1.0, 1)
    # None of them shows a margin, so that the loop stays predicted.
    assert found.measured is None
    assert found.coverage == "predicted"
    assert found.designed is not None
    assert found.designed.phase_margin_deg is not None
    assert found.delay_s.high < 120e-6
    assert found.gain_db.high < 1.2
    unknown = judged(monkeypatch, 40.0, 0.0, 1.0, 1)
    assert unknown.delay_s.high == pytest.approx(200e-6)
    assert unknown.designed is not None
    assert unknown.designed.phase_margin_deg is not None
    better = found.designed.phase_margin_deg.low - unknown.designed.phase_margin_deg.low
    assert better > 3.0


@pytest.mark.long
@pytest.mark.parametrize(("late_s", "size"), [(0.0, 1.0), (150e-6, 1.0), (60e-6, 1.2)])
def test_a_delay_and_a_gain_that_the_prediction_lacks_lie_in_their_intervals(
    monkeypatch: pytest.MonkeyPatch, late_s: float, size: float
) -> None:
    within = []
    for seed in range(40):
        found = judged(monkeypatch, 9.0, late_s, size, seed)
        gain_db = 20.0 * np.log10(size)
        within.append(
            found.delay_s.high >= late_s and found.gain_db.low <= gain_db <= found.gain_db.high
        )
    # Of 95 % intervals, 40 draws: 34 and more with a probability of 99.8 %.
    assert sum(within) >= 34
