"""What is shown of command shaping: every verdict and finding has words in both languages."""

from __future__ import annotations

import re
from typing import Any, get_args

import pytest
from pydantic import ValidationError

from backend.commands.measuring.tools import lines_of
from backend.tools.tuning.shaping.result import (
    Code,
    DesignedShaper,
    DriveFilter,
    FilterSlot,
    ShaperImpulse,
    ShapingComparison,
    ShapingDriveValue,
    ShapingFinding,
    ShapingMode,
    ShapingResult,
    Verdict,
)
from backend.tools.tuning.shaping.run import TOOL
from backend.tools.tuning.shaping.settings import ShapingSettings
from profiles.loader import load_profile

MODE = ShapingMode(
    frequency_hz=8.0, frequency_ci95_hz=(7.9, 8.1), damping=0.02, damping_ci95=(0.01, 0.03),
    range_hz=(7.8, 8.2), range_damping=(0.01, 0.03), ring_downs=4, explained=0.9,
)  # fmt: skip
ZV = DesignedShaper(
    kind="zv",
    delay_s=0.0625,
    residual_percent=(0.0, 3.25),
    tolerated_hz=(7.75, 8.25),
    impulses=(ShaperImpulse(share=0.52, time_s=0.0), ShaperImpulse(share=0.48, time_s=0.0625)),
)
COMPARED = ShapingComparison(
    unit="%", moves=4, unshaped=10.0, unshaped_ci95=(9.0, 11.0), shaped=1.0,
    shaped_ci95=(0.5, 1.5), ratio=0.1, watched_s=2.0, settling_window=1.0, settling_unit="%",
    settling_unshaped_s=None, settling_shaped_s=0.2, settling_ratio=0.1, residuals=(),
)  # fmt: skip
ALL = tuple(
    ShapingFinding(code=code, value=7.5, unit="Hz", parameter="P09.27") for code in get_args(Code)
)


def made(**changed: Any) -> ShapingResult:
    whole: dict[str, Any] = {
        "verdict": "verified", "signal": "torque", "unit": "%", "mode": MODE, "shapers": (ZV,),
        "chosen": "zv", "comparison": COMPARED, "trace_s": (0.0, 0.1),
        "trace_unshaped": (1.0, -1.0), "trace_shaped": (0.1, 0.0), "findings": ALL,
    }  # fmt: skip
    return ShapingResult(**(whole | changed))


@pytest.mark.parametrize("verdict", get_args(Verdict))
@pytest.mark.parametrize("language", ["en", "zh"])
def test_every_verdict_and_finding_has_words(verdict: Verdict, language: Any) -> None:
    section = TOOL.report(made(verdict=verdict))
    words = [TOOL.text(note.name, language, note.values) for note in section.notes]
    assert len(words) == 1 + len(ALL)
    assert not any("{" in each for each in words)


def test_lines_of_the_command() -> None:
    lines = lines_of(TOOL, made(findings=()))
    assert lines[0] == (
        "The ZV shaper was verified: 10 % of the vibration is left, and settling takes 0.2 s "
        "instead of > 2 s."
    )
    assert "Frequency of the mode: 8 Hz (7.9 to 8.1)" in lines
    assert any("ZV, played" in each and "52.00 / 48.00" in each for each in lines)


def test_the_drives_own_parameter_has_its_name_in_chinese() -> None:
    key = load_profile("m6l").slow_vibration
    assert key is not None
    parameter = load_profile("m6l").by_key[str(key.frequency or key.period)]
    value = ShapingDriveValue(
        parameter=str(parameter.number), name=parameter.name, raw=80, value=8.0, unit="Hz"
    )
    result = made(drive_values=(value,), family="m6l")
    (chinese,) = result.in_language("zh").drive_values
    assert re.search("[\u4e00-\u9fff]", chinese.name)
    assert result.in_language("en").drive_values == (value,)
    # A file of an older version names no family.
    assert made(drive_values=(value,)).in_language("zh").drive_values == (value,)


def test_a_filter_takes_the_frequency_or_the_period_within_its_range() -> None:
    slot = FilterSlot(parameter="P03.04", name="Filter", unit="ms", scale=0.1, highest_raw=1280)
    average = DriveFilter(takes="period", slot=slot)
    (value,) = average.values_for(0.1)
    assert value.raw == 1000
    assert value.value == pytest.approx(100.0)
    # 128 ms at most (002:9464): 5 Hz is out of its range.
    assert average.values_for(0.2) == []
    also = ShapingDriveValue(parameter="P09.25", name="Mode", raw=0, value=0.0, unit="")
    suppression = DriveFilter(
        takes="frequency",
        also=(also,),
        slot=FilterSlot(parameter="P09.26", name="Hz", unit="Hz", scale=0.1, highest_raw=1000),
    )
    assert [each.raw for each in suppression.values_for(0.125)] == [0, 80]
    assert DriveFilter().values_for(0.125) == []


def test_settings_without_a_move_or_a_band_are_refused() -> None:
    limits = {"travel_limit": 1.0, "speed_limit": 100.0, "torque_limit": 50.0}
    for wrong in ({"size": 0.0}, {"lowest_hz": 12.0, "highest_hz": 6.0}):
        with pytest.raises(ValidationError):
            ShapingSettings(**limits, **wrong)
