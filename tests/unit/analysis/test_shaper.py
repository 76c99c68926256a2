"""Input shapers against printed figures, and against an oscillator that is integrated."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import lsim

from backend.analysis.signals.arrays import FloatArray
from backend.analysis.signals.shaper import (
    KINDS,
    Band,
    Kind,
    design,
    residual,
    residual_range,
    shaped,
    tolerated,
)


def after(setpoints: FloatArray, rate: float, frequency_hz: float, damping: float) -> FloatArray:
    """Amplitude [n] at which a load on a spring oscillates about its setpoint.

    J x'' = -k (x - u) - d (x' - u'), integrated; the amplitude is that of the state of the mode.
    """
    omega = 2 * math.pi * frequency_hz
    # Of the deviation e = x - u: e'' + 2 zeta omega e' + omega^2 e = -u''.
    system = (
        np.array([[0.0, 1.0], [-(omega**2), -2 * damping * omega]]),
        np.array([[0.0], [-1.0]]),
        np.array([[1.0, 0.0]]),
        np.array([[0.0]]),
    )
    pull = np.asarray(np.gradient(np.gradient(setpoints, 1 / rate), 1 / rate), np.float64)
    _, _, states = lsim(system, pull, np.arange(setpoints.size) / rate)
    about, speed = states.T
    turned = (speed + damping * omega * about) / (omega * math.sqrt(1 - damping**2))
    return np.asarray(np.hypot(about, turned))


def move(rate: float) -> FloatArray:
    """A trapezoid of speed: 0.1 s of acceleration, 0.13 s at speed, 0.1 s of braking."""
    speed = np.interp(np.arange(0.0, 0.33, 1 / rate), [0.0, 0.1, 0.23, 0.33], [0.0, 1.0, 1.0, 0.0])
    return np.cumsum(speed) / rate


def held(values: FloatArray, count: int) -> FloatArray:
    return np.concatenate([values, np.full(count - values.size, values[-1])])


def left_by(kind: Kind, real_hz: float, real_damping: float, damping: float = 0.02) -> float:
    """Vibration after the shaped move over that of the unshaped one, at the same time."""
    rate, count = 4000.0, 8000
    made = design(kind, 8.0, damping, 0.05)
    plain = move(rate)
    long = shaped(plain, made, rate)
    place = long.size + 8
    loud = after(held(plain, count), rate, real_hz, real_damping)[place]
    quiet = after(held(long, count), rate, real_hz, real_damping)[place]
    return float(quiet / loud)


def test_impulses_without_damping_are_the_printed_ones() -> None:
    assert design("zv", 5.0, 0.0, 0.05).amplitudes == pytest.approx((0.5, 0.5))
    assert design("zvd", 5.0, 0.0, 0.05).amplitudes == pytest.approx((0.25, 0.5, 0.25))
    # Singhose: (1 + V)/4, (1 - V)/2, (1 + V)/4.
    assert design("ei", 5.0, 0.0, 0.05).amplitudes == pytest.approx((0.2625, 0.475, 0.2625))
    assert design("zv", 5.0, 0.0, 0.05).times_s == pytest.approx((0.0, 0.1))
    assert design("ei", 5.0, 0.0, 0.05).times_s == pytest.approx((0.0, 0.1, 0.2))


def test_impulses_with_damping_are_those_of_singer_and_seering() -> None:
    """K = exp(-zeta pi / sqrt(1 - zeta^2)) is 0.72925 at zeta 0.1."""
    k = 0.72925
    assert design("zv", 5.0, 0.1, 0.0).amplitudes == pytest.approx(
        (1 / (1 + k), k / (1 + k)), rel=1e-4
    )
    three = (1 / (1 + k) ** 2, 2 * k / (1 + k) ** 2, k**2 / (1 + k) ** 2)
    assert design("zvd", 5.0, 0.1, 0.0).amplitudes == pytest.approx(three, rel=1e-4)
    # Half of the damped period: 0.1 s / sqrt(1 - 0.01).
    assert design("zv", 5.0, 0.1, 0.0).delay_s == pytest.approx(0.100504, rel=1e-5)


@pytest.mark.parametrize(("kind", "printed"), [("zv", 0.06), ("zvd", 0.286), ("ei", 0.399)])
def test_insensitivity_at_five_percent_is_the_printed_one(kind: Kind, printed: float) -> None:
    """Width of the frequencies with at most 5 %, over the mode's (Singhose, 1997)."""
    made = design(kind, 8.0, 0.0, 0.05)
    place = np.linspace(6.0, 10.0, 8001)
    within = place[np.array([residual(made, f, 0.0) for f in place]) <= 0.05 + 1e-9]
    assert np.ptp(within) / 8.0 == pytest.approx(printed, abs=0.005)
    low, high = tolerated(made, 8.0, 0.0, 0.05 + 1e-9)
    assert (high - low) / 8.0 == pytest.approx(printed, abs=0.005)


@pytest.mark.long(keep=6)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("real_hz", "real_damping"), [(8.0, 0.02), (7.4, 0.01), (8.9, 0.06)])
def test_prediction_is_what_an_oscillator_does(
    kind: Kind, real_hz: float, real_damping: float
) -> None:
    predicted = residual(design(kind, 8.0, 0.02, 0.05), real_hz, real_damping)
    assert left_by(kind, real_hz, real_damping) == pytest.approx(predicted, abs=0.006)


def test_the_worst_of_a_band_lies_at_its_ends_or_above() -> None:
    made = design("zvd", 8.0, 0.02, 0.05)
    band = Band((7.2, 8.4), (0.01, 0.03))
    ends = [residual(made, f, z) for f in band.frequency_hz for z in band.damping]
    assert residual_range(made, band)[1] >= max(ends) > 0.02


@pytest.mark.parametrize("kind", KINDS)
def test_shaped_setpoints_end_where_the_others_do(kind: Kind) -> None:
    plain = move(1000.0) - 3.0
    made = design(kind, 7.3, 0.03, 0.05)
    long = shaped(plain, made, 1000.0)
    assert long.size == plain.size + math.ceil(1000.0 * made.delay_s)
    assert long[0] == pytest.approx(plain[0])
    assert long[-1] == pytest.approx(plain[-1], abs=1e-9)
    assert np.all(np.diff(long) >= -1e-12)
    # Neither faster nor steeper than the move itself.
    assert np.max(np.diff(long)) <= np.max(np.diff(plain)) + 1e-12


def test_what_is_no_oscillation_is_refused() -> None:
    for frequency, damping, tolerance in ((0.0, 0.1, 0.05), (5.0, 1.0, 0.05), (5.0, 0.1, 1.0)):
        with pytest.raises(ValueError, match="damping ratio below 1"):
            design("zv", frequency, damping, tolerance)
