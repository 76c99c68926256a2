"""A dwell is as long as its evaluation needs it, before anything moves."""

from __future__ import annotations

import numpy as np
import pytest

from backend.tools.measuring.recording import Recording
from backend.tools.moving.dwell.evaluate import Dwelt, evaluate
from backend.tools.moving.dwell.run import require_long_enough
from backend.tools.moving.dwell.settings import DwellSettings
from drivers.errors import OutOfRange

RATE = 1000.0


def asked(frequency_hz: float, duration_s: float, turn_rpm: float = 0.0) -> DwellSettings:
    return DwellSettings(
        travel_limit=2.0, speed_limit=600.0, torque_limit=60.0, rated_torque_nm=1.0,
        frequency_hz=frequency_hz, duration_s=duration_s, turn_rpm=turn_rpm,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("frequency_hz", "duration_s", "turn_rpm", "least_s"),
    [(1.0, 10.0, 0.0, 16.0), (10.0, 1.0, 0.0, 2.0), (30.0, 1.0, 300.0, 2.0)],
)
def test_a_time_that_ends_in_too_few_blocks_is_refused(
    frequency_hz: float, duration_s: float, turn_rpm: float, least_s: float
) -> None:
    settings = asked(frequency_hz, duration_s, turn_rpm)
    with pytest.raises(OutOfRange) as caught:
        require_long_enough(settings, RATE)
    assert caught.value.code == "dwell.too-short"
    assert caught.value.text.params["least_s"] == least_s
    assert f"{least_s:g} s" in str(caught.value.advice)
    # And the time that is named is enough, to the end.
    longer = asked(frequency_hz, least_s, turn_rpm)
    wanted = require_long_enough(longer, RATE)
    speed = (wanted.base_rpm + wanted.sine) * 2 * np.pi / 60.0
    recording = Recording(
        RATE, np.cumsum(speed) / RATE, speed, np.zeros(speed.size), speed, np.zeros(speed.size),
        np.ones(speed.size, np.bool_),
    )  # fmt: skip
    found = evaluate(Dwelt(recording, wanted.sine, wanted.counts, 1.0, 1e-6, 0.1), longer)
    assert found.speed_rpm.value == pytest.approx(5.0, rel=0.01)


@pytest.mark.parametrize("frequency_hz", [20.0, 50.0, 250.0])
def test_the_usual_time_is_enough_for_the_usual_frequencies(frequency_hz: float) -> None:
    assert require_long_enough(asked(frequency_hz, 10.0), RATE).counts.any()
