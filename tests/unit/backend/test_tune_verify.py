"""When a verified design is taken back: by its margins, and by a torque that hums."""

from __future__ import annotations

import numpy as np
import pytest

from backend.analysis.loop_goals import Goals
from backend.tools.step_response import LEAD_S, StepResult
from backend.tools.tune_verify import hum, worse_than

PROMISED = Goals(gain_margin_db=9.0, phase_margin_deg=48.0, ms=1.8)


def step(noise_percent: float) -> StepResult:
    """A step whose torque has this much noise before it begins, and 50 % after it."""
    rng = np.random.default_rng(1)
    time = np.arange(1000) / 2000.0
    torque = noise_percent * rng.standard_normal(time.size)
    torque[time >= LEAD_S] = 50.0
    none = np.zeros(time.size)
    return StepResult("speed", time, none, none, torque, None, None, 50.0, 30.0)


@pytest.mark.parametrize(("noise_percent", "hums"), [(0.5, False), (2.0, False), (6.0, True)])
def test_a_standing_axis_must_be_quiet(noise_percent: float, hums: bool) -> None:
    words = hum(step(noise_percent))
    assert bool(words) is hums
    if hums:
        # 80 samples: the root mean square is known to some ten per cent.
        assert float(words.split("with ")[1].split(" %")[0]) == pytest.approx(6.0, rel=0.2)


def test_margins_as_promised_are_kept() -> None:
    assert not worse_than(PROMISED, {"ms": 1.8, "phase_margin_deg": 48.0, "gain_margin_db": 9.0})
    # No crossing within the band is no lack of a margin.
    assert not worse_than(PROMISED, {"ms": 1.2, "phase_margin_deg": None, "gain_margin_db": None})


@pytest.mark.parametrize(
    ("found", "word"),
    [
        ({"ms": 1.9, "phase_margin_deg": 60.0, "gain_margin_db": 12.0}, "sensitivity"),
        ({"ms": 1.5, "phase_margin_deg": 46.0, "gain_margin_db": 12.0}, "phase margin"),
        ({"ms": 1.5, "phase_margin_deg": 60.0, "gain_margin_db": 7.5}, "gain margin"),
    ],
)
def test_each_margin_that_is_missed_is_named(found: dict[str, float], word: str) -> None:
    (words,) = worse_than(PROMISED, dict(found))
    assert words.startswith(word)
