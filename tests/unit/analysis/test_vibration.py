"""Orders, frequencies, resonances and dwells on made recordings whose truth is known.

The recordings hold what the evaluation does not assume: coloured noise, steps of the encoder, a
speed that drifts, samples lost in runs, an order above half the sample rate, and the response of
two inertias instead of one oscillator.
"""

from __future__ import annotations

import numpy as np
import pytest

from backend.analysis.vibration.dwell import followed
from backend.analysis.vibration.level_peak import level_peaks
from backend.analysis.vibration.orders import Seen, components, levels
from backend.analysis.vibration.sinusoids import Segment, about_trend, sinusoids

RATE = 1000.0
BAND = (5.0, 400.0)
SPEEDS_RPM = np.geomspace(60.0, 900.0, 10)


def segment(
    rpm: float, seed: int, orders: dict[float, float], frequencies: dict[float, float], *,
    noise: float = 0.3, drift: float = 0.02, lost: float = 0.1, seconds: float = 1.0,
) -> Segment:  # fmt: skip
    """A speed that changes by ``drift`` meanwhile, with sines of these amplitudes (rpm).

    Encoder noise is white in position, so that it is blue in speed.
    """
    rng = np.random.default_rng(seed)
    n = round(seconds * RATE)
    time = np.arange(n + 1) / RATE
    mean = rpm / 60.0 * (1.0 + drift * (time / seconds - 0.5))
    turns = np.concatenate([[0.0], np.cumsum(0.5 * (mean[1:] + mean[:-1])) / RATE])
    speed = 60.0 * mean
    for order, amplitude in orders.items():
        speed += amplitude * np.sin(2 * np.pi * order * turns + rng.uniform(0, 6.28))
    for hertz, amplitude in frequencies.items():
        speed += amplitude * np.sin(2 * np.pi * hertz * time + rng.uniform(0, 6.28))
    speed += noise * np.diff(rng.normal(size=n + 2)) / np.sqrt(2.0)
    valid = np.ones(n + 1, np.bool_)
    run = round(lost * n / 2)
    for _ in range(2 if run else 0):
        first = int(rng.integers(0, n - run))
        valid[first : first + run] = False
    speed[~valid] = 0.0
    torque = about_trend(0.1 * speed, valid)
    return Segment(RATE, turns, about_trend(speed, valid), torque, valid)


def seen_of(segments: list[Segment]) -> list[Seen]:
    return [
        Seen(row, row // 2, each.speed_rps, float(each.turns[-1]), one)
        for row, each in enumerate(segments)
        for one in sinusoids(each, max(BAND[0], 3.0 / each.duration_s), BAND[1])
    ]


def ladder(seed: int, orders: dict[float, float], frequencies: dict[float, float]) -> list[Segment]:
    return [
        segment(rpm, 1000 * seed + 10 * number + way, orders, frequencies)
        for number, rpm in enumerate(SPEEDS_RPM)
        for way in (0, 1)
    ]


def test_one_sinusoid_in_noise_has_its_deviations() -> None:
    """Frequency and amplitude scatter as the deviations state, with samples lost in runs."""
    errors, amplitudes = [], []
    for seed in range(40):
        (one, *_) = sinusoids(segment(300.0, seed, {}, {87.3: 1.0}, drift=0.0), *BAND)
        errors.append((one.frequency_hz - 87.3) / one.deviation_hz)
        amplitudes.append((one.amplitude - 1.0) / one.amplitude_deviation)
    assert 0.7 < np.std(errors) < 1.4
    assert 0.7 < np.std(amplitudes) < 1.4
    assert abs(np.mean(errors)) < 0.4


def test_noise_alone_has_no_component() -> None:
    found = [components(seen_of(ladder(seed, {}, {})))[0] for seed in range(4)]
    assert found == [[]] * 4


@pytest.mark.long
def test_orders_and_frequencies_are_told_apart_with_intervals_that_hold() -> None:
    inside, stated = 0, 0
    for seed in range(8):
        found, _ = components(seen_of(ladder(seed, {24.0: 0.8, 7.31: 0.6}, {133.7: 0.5})))
        by_kind = [(each.kind, round(each.value)) for each in found]
        assert sorted(by_kind) == [("frequency", 134), ("order", 7), ("order", 24)]
        for each in found:
            truth = min((24.0, 7.31, 133.7), key=lambda v, at=each.value: abs(v - at))
            stated += 1
            inside += each.ci95[0] <= truth <= each.ci95[1]
            # Narrow enough to be of use: a tenth of a percent.
            assert each.ci95[1] - each.ci95[0] < 2e-3 * truth
    assert inside / stated >= 0.9


def test_what_the_sampling_folds_is_no_order_and_no_frequency() -> None:
    """Order 120 is above half the sample rate from 250 rpm on and comes back at fs - order·n."""
    fast = np.geomspace(300.0, 430.0, 8)
    segments = [
        segment(rpm, 7 + n, {120.0: 1.0}, {}, drift=0.0) for n, rpm in enumerate(np.repeat(fast, 2))
    ]
    found, left = components(seen_of(segments))
    assert found == []
    assert len({one.speed for one in left}) >= 6


def test_levels_are_those_of_the_orders_with_lost_samples_and_drift() -> None:
    segments = ladder(3, {24.0: 0.8, 7.31: 0.6}, {})
    found, _ = components(seen_of(segments))
    amplitude, deviation, torque = levels(segments, found, BAND)
    for column, each in enumerate(found):
        truth = 0.8 if round(each.value) == 24 else 0.6
        shown = np.isfinite(amplitude[:, column])
        error = (amplitude[shown, column] - truth) / deviation[shown, column]
        assert np.mean(np.abs(error) < 1.96) >= 0.85
        assert np.nanmedian(torque[:, column]) == pytest.approx(0.1 * truth, rel=0.1)


def two_inertias(f: np.ndarray, mode_hz: float, ratio: float, damping: float) -> np.ndarray:
    """Torque to speed of two inertias with a spring, by its magnitude; `ratio` load over motor."""
    s = 2j * np.pi * f
    mode = 2 * np.pi * mode_hz
    anti = mode / np.sqrt(1.0 + ratio)
    top = s**2 + 2 * damping * anti * s + anti**2
    bottom = s**2 + 2 * damping * np.sqrt(1.0 + ratio) * mode * s + mode**2
    return np.abs(top / bottom / s)


@pytest.mark.long
def test_a_mode_of_two_inertias_is_found_with_an_interval_that_holds() -> None:
    """Levels scatter by 5 %; the inertias' ratio, damping, mode and speeds are drawn."""
    inside, found_in, rounds = 0, 0, 60
    for seed in range(rounds):
        rng = np.random.default_rng(seed)
        mode_hz, ratio = float(rng.uniform(80.0, 160.0)), float(rng.uniform(0.3, 1.2))
        damping = float(rng.uniform(0.02, 0.05))
        order = np.repeat([0, 1], 24)
        f = mode_hz * np.exp(rng.uniform(-0.35, 0.35, 48))
        level = np.array([1.0, 0.6])[order] * two_inertias(f, mode_hz, ratio, damping)
        level /= two_inertias(np.array([mode_hz]), mode_hz, ratio, damping)
        level *= np.exp(0.05 * rng.normal(size=48))
        amplitude = np.abs(level + 0.01 * rng.normal(size=48))
        peaks = level_peaks(f, amplitude, np.full(48, 0.01), order)
        assert all(abs(each.frequency_hz / mode_hz - 1.0) < 0.1 for each in peaks), "no other mode"
        found_in += len(peaks) == 1
        inside += sum(e.frequency_ci95_hz[0] <= mode_hz <= e.frequency_ci95_hz[1] for e in peaks)
    assert found_in >= 0.9 * rounds
    assert inside >= 0.92 * found_in


@pytest.mark.long
def test_levels_without_a_mode_show_none() -> None:
    """Slopes, a broad hump of a speed loop, scatter, and levels that are noise alone."""
    for seed in range(40):
        rng = np.random.default_rng(seed)
        order = np.repeat([0, 1, 2], 20)
        f = np.exp(rng.uniform(np.log(10.0), np.log(380.0), 60))
        away = f / 45.0 - 45.0 / f
        level = np.exp(0.1 * rng.normal(size=60)) / np.hypot(away, 2 * 0.4)
        level *= np.array([1.0, 0.3, 0.02])[order]
        amplitude = np.abs(level + 0.01 * rng.normal(size=60))
        assert level_peaks(f, amplitude, np.full(60, 0.01), order) == []


def test_a_dwell_has_intervals_that_hold_beside_drift_and_lost_samples() -> None:
    inside, rounds = 0, 120
    for seed in range(rounds):
        rng = np.random.default_rng(seed)
        n, hertz = 5000, 43.7
        phase = 2 * np.pi * hertz / RATE * np.arange(n)
        drift = 3.0 * np.cumsum(rng.normal(size=n)) / np.sqrt(n) + 20.0 * np.arange(n) / n
        signal = 0.5 * np.cos(phase + 0.7) + 0.05 * np.cos(2 * phase) + 0.2 * rng.normal(size=n)
        valid = np.ones(n, np.bool_)
        first = int(rng.integers(0, n - 500))
        valid[first : first + 300] = False
        signal = np.where(valid, signal + drift, 0.0)
        found = followed(signal, valid, hertz, RATE, 0, 2)
        inside += abs(abs(found.mean()) - 0.5) <= found.half()
        assert np.angle(found.mean()) == pytest.approx(0.7, abs=0.1)
        assert abs(found.mean(1)) == pytest.approx(0.05, abs=0.03)
    assert inside >= 0.9 * rounds
