"""Verdict, words and stored data of a cycle that is written down by formula."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

from backend.analysis.duty.load import Signals
from backend.tools.watching.cycle.evaluate import CycleFacts, Samples, evaluate, meta_of, reevaluate
from backend.tools.watching.cycle.result import Code, CycleResult
from backend.tools.watching.cycle.run import TOOL
from backend.tools.watching.cycle.settings import CycleSettings
from backend.tools.watching.cycle.texts import TEXTS
from drivers.errors import NotAllowed

FACTS = CycleFacts(2.0, 3000.0, 300.0)


def samples(peak: float, *, seconds: float = 20.0, rate_hz: float = 200.0) -> Samples:
    """A second at +peak, a second at −peak, to and fro at 600 rpm."""
    time = np.arange(0.0, seconds, 1.0 / rate_hz)
    sign = np.where(time % 2.0 < 1.0, 1.0, -1.0)
    signals = Signals(time, peak * sign, 600.0 * sign)
    return Samples(signals, np.array([310.0, 330.0]), np.array([40.0, 42.0]))


def found(peak: float, **asked: object) -> CycleResult:
    return evaluate(samples(peak), CycleSettings.model_validate(asked), FACTS)


def said(result: CycleResult) -> list[str]:
    return [TOOL.text(each.name, "en", each.values) for each in TOOL.report(result).notes]


@pytest.mark.parametrize(
    ("peak", "verdict", "words"),
    [
        (60.0, "endures", "The motor endures this cycle"),
        (103.0, "undecided", "It cannot be decided"),
        (200.0, "overloads", "This cycle overloads the motor"),
        (0.0, "overloads", ""),
    ],
)
def test_the_verdict(peak: float, verdict: str, words: str) -> None:
    if peak == 0.0:
        still = Samples(
            Signals(np.arange(0.0, 9.0, 0.1), np.zeros(90), np.zeros(90)),
            np.empty(0),
            np.empty(0),
        )
        idle = evaluate(still, CycleSettings(), FACTS)
        assert idle.verdict == "idle"
        assert idle.heat is None
        return
    result = found(peak)
    assert result.verdict == verdict
    assert said(result)[0].startswith(words)
    assert result.rms_percent == pytest.approx(peak, rel=0.01)
    assert result.period_s == pytest.approx(2.0, rel=0.01)


def test_a_stated_period_longer_than_the_recording_is_not_a_whole_one() -> None:
    result = found(60.0, period_s=100.0)
    assert (result.period_s, result.periods) == (100.0, 0)
    assert any(each.startswith("Only 0 whole cycles") for each in said(result))
    assert result.rms_percent == pytest.approx(60.0, rel=0.01)


def test_a_stated_period_without_samples_in_it_is_none() -> None:
    """A time in ns would need a table of 2·10¹⁰ periods, more than this computer holds."""
    result = found(60.0, period_s=1e-9)
    assert result.periods == 0
    assert result.rms_percent == pytest.approx(60.0, rel=0.01)


def test_it_trips_after_minutes_that_follow_from_the_catalogue() -> None:
    result = found(200.0, thermal_time_min=20.0)
    assert result.heat is not None
    earliest, latest = result.heat.trip_s
    assert earliest is not None
    assert latest is not None
    assert result.heat.about_s is not None
    # One body and four times the losses: τ·ln(4/3) = 5.75 min; the winding is warm sooner.
    assert earliest < 5.75 * 60.0 < latest
    assert 0.5 * 60.0 < result.heat.about_s < 5.75 * 60.0
    line = next(each for each in said(result) if each.startswith("It trips"))
    assert "at 40 °C" in line
    assert "time_constant_unknown" not in {each.code for each in result.findings}


def test_what_nobody_stated_is_named() -> None:
    codes = {each.code for each in found(200.0).findings}
    assert {"time_constant_unknown", "overload_unknown"} <= codes
    unknown = evaluate(samples(200.0), CycleSettings(), CycleFacts(None, None, None))
    assert unknown.power is None
    assert {"rated_torque_unknown", "rated_speed_unknown", "peak_unknown"} <= {
        each.code for each in unknown.findings
    }
    cold = found(60.0, ambient_c=20.0)
    assert (cold.verdict, cold.heat) == ("undecided", None)
    assert "ambient_needs_rise" in {each.code for each in cold.findings}
    assert found(60.0, ambient_c=20.0, rise_k=100.0).verdict == "endures"


def test_an_overload_that_is_used_up() -> None:
    result = found(200.0, overload_percent=300.0, overload_s=3.0)
    assert result.overload is not None
    # 24 per-unit² s, of which 200 % takes three in every second.
    assert result.overload.trip_s == pytest.approx(8.0, rel=0.02)
    assert result.verdict == "overloads"


def test_peaks_against_the_limit() -> None:
    assert "peak_reached" in {each.code for each in found(299.0).findings}
    assert "peak_beyond" in {each.code for each in found(340.0).findings}
    assert not {"peak_reached", "peak_beyond"} & {each.code for each in found(250.0).findings}


def test_stored_data_give_the_same_result() -> None:
    asked, raw = CycleSettings(thermal_time_min=20.0), samples(150.0)
    again = reevaluate(raw.arrays(), meta_of(asked, FACTS))
    assert again == evaluate(raw, asked, FACTS)
    with pytest.raises(ValueError, match="not the raw data"):
        reevaluate({}, meta_of(asked, FACTS))


def test_the_cloud_keeps_the_corners_and_rises() -> None:
    result = found(150.0)
    assert min(result.cloud_torque_percent) == -150.0
    assert max(result.cloud_torque_percent) == 150.0
    assert np.all(np.diff(result.cloud_speed_rpm) > 0.0)
    assert len(result.cloud_speed_rpm) < 1700


def test_few_samples_are_refused() -> None:
    with pytest.raises(NotAllowed, match="too few"):
        evaluate(samples(50.0, seconds=0.05), CycleSettings(), FACTS)


@pytest.mark.parametrize("language", ["en", "zh"])
def test_every_note_and_row_has_words(language: str) -> None:
    assert {f"finding.{code}" for code in get_args(Code)} == {
        name for name in TEXTS if name.startswith("finding.")
    }
    asked: dict[str, object] = {"overload_percent": 300.0, "overload_s": 3.0}
    for result in (
        found(200.0, thermal_time_min=20.0, **asked),
        found(103.0, thermal_time_min=20.0),
        found(60.0),
        evaluate(samples(50.0), CycleSettings(), CycleFacts(None, None, None)),
    ):
        section = TOOL.report(result)
        words = [TOOL.text(each.name, language, each.values) for each in section.notes]  # type: ignore[arg-type]
        words += [TOOL.text(each.name, language, each.values) for each in section.rows]  # type: ignore[arg-type]
        for chart in section.charts:
            names = (chart.name, chart.x_name, chart.y_name, *(line.name for line in chart.lines))
            words += [TOOL.text(each, language) for each in names]  # type: ignore[arg-type]
        assert not [each for each in words if "{" in each or not each]
