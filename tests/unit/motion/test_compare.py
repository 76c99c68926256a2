"""A recording's 606Ch against its 6064h, beyond what the loop may decide while it moves."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pytest

from backend.axes.scales.compare import disagreement_of, measured_scale
from drivers.halt import HaltCause
from drivers.objects.feedback import Disagreement, FeedbackScale

COUNTS, CYCLE_S = 65_536, 1e-3
RPM = COUNTS / 60.0
SCALE = FeedbackScale(1.0, 30.0 * RPM)
FloatArray = npt.NDArray[np.float64]
TIME = np.arange(4000) * CYCLE_S


def places(rpm: float, hz: float, rest_s: float = 0.2) -> FloatArray:
    """Increments of a swing of this speed that begins after a rest."""
    t = np.maximum(TIME - rest_s, 0.0)
    swing = rpm / 60 / (2 * np.pi * hz) * (1 - np.cos(2 * np.pi * hz * t))
    return np.asarray(np.round(COUNTS * swing))


def speeds(position: FloatArray, late: int = 0, mean: int = 1) -> FloatArray:
    """Mean speed over the cycles before each sample, reported ``late`` cycles later."""
    padded = np.concatenate([np.full(late + mean, position[0]), position])
    before = padded[: len(position)]
    return np.asarray((padded[mean : mean + len(position)] - before) / (mean * CYCLE_S))


HARMLESS: dict[str, Callable[[FloatArray], FloatArray]] = {
    "exact": speeds,
    "2 cycles late": lambda p: speeds(p, late=2),
    "mean of 3 cycles": lambda p: speeds(p, mean=3),
    "10 rpm, cut off": lambda p: np.trunc(speeds(p) / RPM / 10) * 10 * RPM,
}
WRONG: dict[str, tuple[Callable[[FloatArray], FloatArray], Disagreement]] = {
    "0.1 rpm": (lambda p: np.round(speeds(p) / RPM * 10), Disagreement.SCALE),
    "stuck": (lambda p: np.zeros(len(p)), Disagreement.SPEED_STANDS),
    "other sign": (lambda p: -speeds(p), Disagreement.SIGN),
    "half": (lambda p: 0.5 * speeds(p), Disagreement.SCALE),
}


@pytest.mark.parametrize("rpm", [20.0, 600.0])
@pytest.mark.parametrize("hz", [0.5, 3.0, 12.0])
@pytest.mark.parametrize("honest", HARMLESS)
def test_what_lags_averages_or_rounds_agrees(honest: str, hz: float, rpm: float) -> None:
    position = places(rpm, hz)
    assert disagreement_of(position, HARMLESS[honest](position), CYCLE_S, SCALE) is None


@pytest.mark.parametrize("rpm", [20.0, 600.0])
@pytest.mark.parametrize("wrong", WRONG)
def test_another_scale_or_sign_does_not(wrong: str, rpm: float) -> None:
    """Also at 20 rpm to and fro, where the loop would wait for more."""
    position, (made, kind) = places(rpm, 1.0), WRONG[wrong]
    halt = disagreement_of(position, made(position), CYCLE_S, SCALE)
    assert halt is not None
    assert (halt.cause, halt.note) == (HaltCause.CONTRADICTION, kind.value)


def test_the_scale_of_an_unknown_606c_is_measured() -> None:
    """0.1 rpm: 600 raw are one rev/s, 65 536 increments per second."""
    position = places(60.0, 0.5)
    found = measured_scale(position, np.round(speeds(position) / RPM * 10), CYCLE_S)
    assert found == pytest.approx(600 / COUNTS, rel=0.02)
    assert measured_scale(position, np.zeros(len(position)), CYCLE_S) is None


def test_a_straight_line_across_lost_samples_is_no_contradiction() -> None:
    """What a gap hides is guessed of both, and differs where the axis swings meanwhile."""
    position = places(600.0, 15.0)
    velocity = speeds(position)
    valid = (np.arange(len(position)) % 400) >= 40
    rows, good = np.arange(len(position)), np.flatnonzero(valid)
    place, speed = (np.interp(rows, good, x[good]) for x in (position, velocity))
    assert disagreement_of(place, speed, CYCLE_S, SCALE) is not None
    assert disagreement_of(place, speed, CYCLE_S, SCALE, valid) is None
    # A wrong scale shows next to the gaps.
    assert disagreement_of(place, 0.5 * speed, CYCLE_S, SCALE, valid) is not None
