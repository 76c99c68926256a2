"""Excitations against their defining properties."""

import numpy as np
import pytest

from backend.analysis.signals.chirp import chirp
from backend.analysis.signals.excitation import (
    BaseMotion,
    choose_lines,
    crest_factor,
    falling_amplitude,
    multisine,
    scaled,
)
from backend.analysis.signals.prbs import prbs
from backend.analysis.signals.stepped_sine import stepped_sine

LINES = choose_lines(5.0, 400.0, 1.0, count=150)


def spectrum(e):
    return np.fft.rfft(e.one_period) * 2 / e.period_samples


@pytest.mark.parametrize("odd", [False, True])
@pytest.mark.parametrize("spacing", ["log", "linear"])
def test_multisine_has_only_its_lines_flat_and_low_crest(odd, spacing):
    lines = choose_lines(5.0, 400.0, 1.0, spacing=spacing, count=150, odd_only=odd)
    e = multisine(sample_rate_hz=1000.0, period_samples=1000, lines=lines, realisation=3)
    amplitude = np.abs(spectrum(e))
    assert np.ptp(amplitude[lines]) < 1e-9 * amplitude[lines].max()
    assert np.max(np.delete(amplitude, lines)) < 1e-12
    assert crest_factor(e.one_period) <= 1.8
    assert np.max(np.abs(e.one_period)) == pytest.approx(1.0)
    if odd:
        assert np.all(lines % 2 == 1)


def test_crest_factor_of_a_sine_is_sqrt_two():
    turn = 2 * np.pi * np.arange(1000) / 100
    assert crest_factor(np.sin(turn)) == pytest.approx(np.sqrt(2), rel=1e-6)


def test_realisations_differ_and_repeat():
    def make(n):
        return multisine(
            sample_rate_hz=1000.0, period_samples=1000, lines=LINES, realisation=n
        ).one_period

    a, b = make(1), make(2)
    assert abs(np.corrcoef(a, b)[0, 1]) < 0.3
    assert np.array_equal(a, make(1))


def test_inverted_pair_keeps_the_base_motion():
    args = {
        "sample_rate_hz": 1000.0,
        "period_samples": 1000,
        "lines": LINES,
        "realisation": 1,
        "base": BaseMotion(0.5, 1.2),
    }
    plus, minus = multisine(**args), multisine(**args, invert=True)
    assert plus.base_line == 1
    half = (plus.one_period + minus.one_period) / 2
    assert np.allclose(half, 0.5 * np.sin(2 * np.pi * np.arange(1000) / 1000), atol=1e-12)


@pytest.mark.parametrize("integrations", [1, 2])
def test_axis_ends_at_rest_where_it_began_and_does_not_drift(integrations):
    e = multisine(
        sample_rate_hz=1000.0,
        period_samples=1000,
        lines=LINES,
        periods=3,
        integrations=integrations,
        base=BaseMotion(0.3),
    )
    path = e.samples
    for _ in range(integrations):
        path = np.cumsum(path)
        assert abs(path[-1]) < 1e-6 * np.max(np.abs(path))
    first = path[e.first_sample :][: e.period_samples]
    last = path[e.first_sample + 2 * e.period_samples :][: e.period_samples]
    assert np.allclose(first, last, atol=1e-6 * np.max(np.abs(path)))


def test_amplitude_falls_by_20_db_per_decade():
    f = np.array([1.0, 100.0, 1000.0, 10_000.0])
    a = 20 * np.log10(falling_amplitude(f, 100.0))
    assert a == pytest.approx([0.0, -3.0103, -20.04, -40.0], abs=0.01)
    e = multisine(
        sample_rate_hz=1000.0,
        period_samples=1000,
        lines=LINES,
        amplitude=falling_amplitude(LINES * 1.0, 50.0),
    )
    got = np.abs(spectrum(e))[LINES]
    assert np.allclose(
        got / got[0],
        falling_amplitude(LINES * 1.0, 50.0) / falling_amplitude(LINES[:1] * 1.0, 50.0),
    )


def test_prbs_has_the_autocorrelation_of_a_maximum_length_sequence():
    e = prbs(sample_rate_hz=1000.0, order=9, samples_per_bit=2)
    bits = np.sign(e.one_period[::2])
    assert bits.size == 511
    correlation = np.fft.ifft(np.abs(np.fft.fft(bits)) ** 2).real
    assert correlation[0] == pytest.approx(511)
    assert np.allclose(correlation[1:], -1.0)


@pytest.mark.parametrize("order", range(7, 16))
def test_every_prbs_order_has_full_length(order):
    bits = np.sign(prbs(sample_rate_hz=1000.0, order=order, ramp_samples=0).one_period)
    assert bits.size == 2**order - 1
    assert abs(np.sum(bits)) == 1
    correlation = np.fft.irfft(np.abs(np.fft.rfft(bits)) ** 2, bits.size)
    assert np.max(np.abs(correlation[1:] + 1.0)) < 1e-6


def test_chirp_spends_equal_time_per_octave_and_comes_home():
    e = chirp(sample_rate_hz=4000.0, f_min_hz=10.0, f_max_hz=640.0, duration_s=6.0, integrations=1)
    crossings = np.flatnonzero(np.diff(np.sign(e.samples)) > 0)
    middle = crossings[np.abs(crossings / 4000.0 - 3.0) < 0.25]
    assert 4000.0 / np.mean(np.diff(middle)) == pytest.approx(80.0, rel=0.03)
    assert abs(np.sum(e.samples)) < 1e-6
    assert e.samples[0] == pytest.approx(0.0, abs=1e-3)


def test_stepped_sine_evaluates_whole_cycles():
    e = stepped_sine(sample_rate_hz=1000.0, frequency_hz=np.array([17.3, 101.0]))
    for s in e.segments:
        assert s.frequency_hz * s.samples / 1000.0 == pytest.approx(s.cycles)
        part = e.samples[s.start : s.start + s.samples]
        assert abs(np.mean(part)) < 0.02


def test_scaled_is_what_the_bus_object_can_carry():
    e = multisine(sample_rate_hz=1000.0, period_samples=1000, lines=LINES)
    sent = scaled(e, 0.3, 0.001).samples
    assert np.allclose(sent * 1000, np.round(sent * 1000), atol=1e-9)
    assert np.max(np.abs(sent)) == pytest.approx(0.3, abs=0.03)


@pytest.mark.parametrize(
    ("kwargs", "message"),
    [
        ({"lines": np.array([0, 3])}, "lines must lie"),
        ({"lines": np.array([3, 500])}, "lines must lie"),
        ({"lines": LINES, "periods": 1}, "leave none"),
        ({"lines": LINES, "amplitude": np.ones(2)}, "one amplitude"),
        ({"lines": LINES, "base": BaseMotion(0.5, 5.0)}, "base motion"),
    ],
)
def test_impossible_multisines_are_refused(kwargs, message):
    with pytest.raises(ValueError, match=message):
        multisine(sample_rate_hz=1000.0, period_samples=1000, **kwargs)


def test_odd_lines_leave_even_and_some_odd_ones_to_tell_distortion() -> None:
    """Of every four odd lines one is empty, not always the same place, and every time the same."""
    lines = choose_lines(5.0, 400.0, 1.0, odd_only=True)
    assert np.all(lines % 2 == 1)
    odd = np.arange(5, 400, 2)
    left_out = np.setdiff1d(odd, lines)
    groups = (left_out - 5) // 2 // 4
    assert groups.tolist() == list(range(49)) or groups.tolist() == list(range(50))
    assert np.unique((left_out - 5) // 2 % 4).size == 4
    assert np.array_equal(lines, choose_lines(5.0, 400.0, 1.0, odd_only=True))
