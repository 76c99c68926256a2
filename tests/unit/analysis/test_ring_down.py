"""The mode of a ring-down against known oscillators, with noise, creep and lost samples."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pytest
from scipy.signal import lfilter

from backend.analysis.signals.ring_down import (
    Mode,
    RingDown,
    common_mode,
    fit_mode,
    mode_of,
    parts_of,
    settling_s,
)

RATE = 1000.0
FloatArray = npt.NDArray[np.float64]


def ring(
    frequency_hz: float, damping: float, seed: int, *, noise: float = 0.03, creep: float = 0.5
) -> RingDown:
    """One second and a half of a decaying oscillation, red noise, and an exponential creep."""
    random = np.random.default_rng(seed)
    time = np.arange(1500) / RATE
    omega = 2 * math.pi * frequency_hz
    wave = np.exp(-damping * omega * time) * np.sin(
        omega * math.sqrt(1 - damping**2) * time + random.uniform(0, 6)
    )
    red = lfilter([0.3], [1.0, -0.7], random.normal(0.0, noise, time.size))
    signal = wave + creep * np.exp(-time / 1.5) + red
    return RingDown(signal[:, None], np.ones(time.size, np.bool_), RATE)


@pytest.mark.parametrize(
    ("frequency_hz", "damping"), [(2.6, 0.02), (5.0, 0.01), (12.0, 0.05), (25.0, 0.1)]
)
def test_frequency_and_damping_are_found(frequency_hz: float, damping: float) -> None:
    fits = [fit_mode(ring(frequency_hz, damping, seed), 2.0, 40.0) for seed in range(4)]
    mode = mode_of([each for each in fits if each is not None])
    assert mode.frequency_hz == pytest.approx(frequency_hz, rel=0.01)
    assert mode.damping == pytest.approx(damping, rel=0.15, abs=0.003)


def test_the_interval_contains_the_truth() -> None:
    inside = np.zeros(2)
    runs = 20
    for run in range(runs):
        fits = [
            fit_mode(ring(8.0, 0.03, 100 * run + seed, noise=0.1, creep=0.0), 5.0, 12.0)
            for seed in range(4)
        ]
        mode = mode_of([each for each in fits if each is not None])
        low, high = mode.frequency_ci95_hz
        inside[0] += low <= 8.0 <= high
        low, high = mode.damping_ci95
        inside[1] += low <= 0.03 <= high
    # 95 % of 20: 16 or fewer would come with a chance of 1.6 %.
    assert np.all(inside >= 17)


def test_lost_samples_are_not_looked_at() -> None:
    whole = ring(8.0, 0.02, 1)
    valid = whole.valid.copy()
    valid[300:360] = False
    spoilt = whole.signals.copy()
    spoilt[300:360] = 50.0
    fit = fit_mode(RingDown(spoilt, valid, RATE), 4.0, 16.0)
    assert fit is not None
    assert fit.frequency_hz == pytest.approx(8.0, rel=0.01)


def test_too_few_periods_show_no_mode() -> None:
    assert fit_mode(ring(1.2, 0.02, 1), 1.0, 1.9) is None
    still = RingDown(np.zeros((1500, 1)), np.ones(1500, np.bool_), RATE)
    assert fit_mode(still, 2.0, 30.0) is None


def test_noise_alone_is_explained_by_no_mode() -> None:
    random = np.random.default_rng(3)
    noise = RingDown(random.normal(size=(1500, 1)), np.ones(1500, np.bool_), RATE)
    fit = fit_mode(noise, 2.0, 30.0)
    assert fit is not None
    assert float(fit.explained[0]) < 0.3


def test_creep_and_oscillation_are_taken_apart() -> None:
    time = np.arange(1500) / RATE
    made = ring(8.0, 0.02, 5, noise=0.0, creep=0.0).signals[:, 0] + 2.0 - 0.8 * time
    mode = Mode(8.0, 0.02, (7.9, 8.1), (0.01, 0.03))
    parts = parts_of(RingDown(made[:, None], np.ones(1500, np.bool_), RATE), mode)
    assert parts.creep[:, 0] == pytest.approx(2.0 - 0.8 * time, abs=1e-6)
    assert float(parts.amplitude[0]) == pytest.approx(1.0, abs=1e-6)


def test_a_mode_is_what_ring_downs_agree_about() -> None:
    common = common_mode([ring(8.0, 0.02, seed) for seed in range(4)], 4.0, 16.0)
    assert common is not None
    assert len(common.fits) == 4
    # Each of another frequency, and what only creeps, are no common mode.
    assert common_mode([ring(f, 0.02, 1) for f in (5.0, 7.0, 9.0, 13.0)], 4.0, 16.0) is None
    time = np.arange(1500) / RATE
    lag = RingDown(np.exp(-time / 0.02)[:, None], np.ones(1500, np.bool_), RATE)
    assert common_mode([lag, lag, lag, lag], 2.0, 30.0) is None


def test_settling_is_the_last_time_outside_of_the_window() -> None:
    time = np.arange(1000) / RATE
    # 10 exp(-t / 0.1) is 1 at 0.1 ln 10 = 0.2303 s.
    values = 10.0 * np.exp(-time / 0.1) * np.where(np.arange(1000) % 2, 1.0, -1.0)
    assert settling_s(values, 1.0, 20, RATE) == pytest.approx(0.2303, abs=0.0011)
    assert settling_s(values, 20.0, 20, RATE) == 0.0
    assert settling_s(np.ones(1000), 0.5, 20, RATE) is None
