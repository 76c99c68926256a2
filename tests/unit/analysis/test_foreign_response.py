"""Responses of recordings of others: the excitation found, the truth held, another run held."""

from __future__ import annotations

import gzip
import time
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import chirp, cont2discrete, lfilter

from backend.analysis.response.foreign_recordings.excitation_found import find_excitation
from backend.analysis.response.foreign_recordings.foreign import (
    ForeignResponse,
    NoResponse,
    evaluate,
)
from tests.support.two_masses import Bench, multisine

RATE = 2500.0
LINES = np.arange(11, 251)
MIDDLE = np.arange(30, 151)
REAL = Path(__file__).parents[2] / "data" / "two_mass_bench_a.csv.gz"


def real(column_in: int, column_out: int) -> tuple[np.ndarray, np.ndarray]:
    with gzip.open(REAL, "rt") as file:
        table = np.loadtxt(file, delimiter=",", skiprows=1)
    return table[:, column_in], table[:, column_out]


@pytest.mark.long
@pytest.mark.parametrize("column_in", [1, 2])
def test_the_real_bench_has_its_modes(column_in: int) -> None:
    found = evaluate(*real(column_in, 3), RATE)
    assert found.excitation == "periodic"
    assert found.period_s == 1.0
    assert 1 <= found.transient_periods <= 4
    assert found.frequency_hz.tolist() == LINES.tolist()
    rows = {m.row.kind: m.row for m in found.modes}
    assert len(found.modes) == 2
    assert rows["antiresonance"].frequency_hz == pytest.approx(53.0, abs=1.0)
    assert rows["resonance"].frequency_hz == pytest.approx(77.0, abs=1.0)
    for row in rows.values():
        assert row.frequency_ci95_hz is not None
        assert row.frequency_ci95_hz[1] - row.frequency_ci95_hz[0] < 2.0


@pytest.mark.long
def test_the_band_of_the_real_bench_is_neither_noise_alone_nor_idle() -> None:
    found = evaluate(*real(2, 3), RATE)
    mid = (found.frequency_hz > 90) & (found.frequency_hz < 200)
    half = 1.96 * found.std_db[mid]
    # The spread between the periods alone is 0.03 dB there.
    assert np.median(half) > 4 * 1.96 * 8.686 * np.median(found.noise[mid])
    assert np.max(half) < 1.5


@pytest.mark.long
def test_odd_lines_of_the_real_bench_predict_the_even_ones() -> None:
    """Away from the modes the truth is smooth: both odd neighbours give the line between them."""
    found = evaluate(*real(2, 3), RATE)
    f = found.frequency_hz[1:-1]
    use = (f % 2 == 0) & ((f < 45) | (f > 90))
    size_db = 20 * np.log10(np.abs(found.response))
    turn_deg = np.degrees(np.unwrap(np.angle(found.response)))
    for value, std in ((size_db, found.std_db), (turn_deg, found.std_deg)):
        left = np.abs(value[1:-1] - (value[:-2] + value[2:]) / 2)
        half = 1.96 * np.sqrt(std[1:-1] ** 2 + (std[:-2] ** 2 + std[2:] ** 2) / 4)
        assert np.mean(left[use] < half[use]) >= 0.95


def test_a_linear_axis_comes_out_as_it_is() -> None:
    """Truth is analytic: lines by DFT, zero-order hold of the torque put on by hand."""
    bench = Bench(noise=1e-4)
    f = LINES.astype(float)
    one = multisine(RATE, LINES, 1.0, 1, 3)
    spectrum = np.fft.rfft(one)
    answer = np.zeros_like(spectrum)
    answer[LINES] = spectrum[LINES] * bench.response(f)
    y = np.tile(np.fft.irfft(answer, one.size), 6)
    noise = np.random.default_rng(1).normal(size=y.size) * 1e-3 * np.std(y)
    found = evaluate(np.tile(one, 6), y + noise, RATE)
    error = np.log(found.response / bench.response(f))
    assert np.median(np.abs(error)) < 0.01
    truth = {"antiresonance": bench.antiresonance_hz, "resonance": bench.resonance_hz}
    for mode in found.modes:
        low, high = mode.row.frequency_ci95_hz or (0.0, 0.0)
        assert low < truth[mode.row.kind] < high
        assert mode.row.frequency_hz == pytest.approx(truth[mode.row.kind], rel=2e-3)
    assert {m.row.kind for m in found.modes} == set(truth)


def share_held(
    found: ForeignResponse, bench: Bench, torque: np.ndarray, lines: np.ndarray
) -> float:
    """Share of another run's lines inside the band in size and in phase."""
    u, y = bench.record(torque, RATE, 77)
    n = round(RATE)
    one, two = (np.fft.rfft(x.reshape(-1, n)[5:].mean(axis=0)) for x in (u, y))
    use = np.isin(found.frequency_hz.round().astype(int), lines)
    k = found.frequency_hz[use].round().astype(int)
    left = np.log(two[k] / one[k] / found.response[use])
    size = np.abs(left.real) * 20 / np.log(10) <= 1.96 * found.std_db[use]
    turn = np.degrees(np.abs(left.imag)) <= 1.96 * found.std_deg[use]
    return float(min(np.mean(size), np.mean(turn)))


ROUGH = [
    Bench(friction_nm=0.08, ripple=0.01, distortion=0.05, noise=1e-3, filter_hz=20.0),
    Bench(motor_kgm2=3e-4, load_kgm2=2e-4, antiresonance_hz=81.0, viscous_nms=1e-3,
          friction_nm=0.12, distortion=0.03, noise=1e-3),
    Bench(friction_nm=0.05, backlash_rad=1e-4, ripple=0.02, damping=0.03, noise=1e-3),
]  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("number", range(len(ROUGH)))
def test_the_band_holds_another_run_of_a_rough_bench(number: int) -> None:
    bench = ROUGH[number]
    found = evaluate(*bench.record(multisine(RATE, LINES, 1.0, 8, 1), RATE, 5), RATE)
    others = {
        "other phases": (multisine(RATE, LINES, 1.0, 10, 22), LINES),
        "twice the level": (multisine(RATE, LINES, 2.0, 10, 23), LINES),
        "odd lines": (multisine(RATE, LINES[::2], 1.0, 10, 24), LINES[::2]),
        "0.7 of the level, 30 to 150 Hz": (multisine(RATE, MIDDLE, 0.7, 10, 25), MIDDLE),
    }
    for name, (torque, lines) in others.items():
        assert share_held(found, bench, torque, lines) >= 0.9, name


@pytest.mark.long
def test_noise_and_chirp_are_reported_and_hold_the_truth() -> None:
    bench = Bench(noise=2e-3, damping=0.04)
    n = round(16 * RATE)
    t = np.arange(n) / RATE
    noise = np.random.default_rng(3).normal(size=n)
    for kind, torque in (("noise", noise), ("chirp", chirp(t, 5.0, t[-1], 400.0))):
        u, y = bench.record(torque, RATE, 5)
        found = evaluate(u, y, RATE, (12.0, 250.0))
        assert found.excitation == kind
        assert found.method == "local polynomial"
        f = found.frequency_hz
        # The recorded value is held for a sample; Euler's steps are part of the bench.
        held = np.sinc(f / RATE) * np.exp(-1j * np.pi * f / RATE)
        left = np.log(found.response / (bench.response(f) * held))
        size = np.abs(left.real) * 20 / np.log(10) <= 1.96 * found.std_db
        assert np.mean(size) > 0.9, kind
        kinds = {m.row.kind: m.row.frequency_hz for m in found.modes}
        assert kinds["antiresonance"] == pytest.approx(53.0, rel=0.01)
        assert kinds["resonance"] == pytest.approx(bench.resonance_hz, rel=0.01)


def test_a_periodic_excitation_with_empty_lines_tells_distortion_by_parity() -> None:
    bench = Bench(friction_nm=0.15, noise=1e-4)
    found = evaluate(*bench.record(multisine(RATE, LINES[::2], 1.0, 8, 1), RATE, 5), RATE)
    even, odd = found.empty
    # Lines are odd; Coulomb friction is odd and puts nothing on the even ones between them.
    assert odd is None
    assert even is not None
    assert even < 0.2 * float(np.median(found.distortion[:20])) + 0.02


def test_periods_of_any_length_and_a_measured_input_are_found() -> None:
    one = np.random.default_rng(1).normal(size=777)
    reported = np.tile(one, 5)[: 777 * 5 - 100] + 0.02 * np.random.default_rng(2).normal(size=3785)
    found = find_excitation(reported)
    assert (found.kind, found.period_samples, found.periods) == ("periodic", 777, 4)
    assert find_excitation(np.random.default_rng(4).normal(size=4000)).kind == "noise"


def test_a_long_period_is_evaluated_within_ten_seconds_of_processor_time() -> None:
    """Four thousand lines of a two-mass axis in state space, the torque held for each sample."""
    rate, period = 2000.0, 8000
    rng = np.random.default_rng(5)
    u = np.tile(rng.normal(size=period), 4)
    zeros, poles = 2 * np.pi * 60.0, 2 * np.pi * 80.0
    top = np.array([zeros**-2, 0.04 / zeros, 1.0])
    below = np.polymul([1.0, 1.0], [poles**-2, 0.04 / poles, 1.0])
    b, a, _ = cont2discrete((top, below), 1 / rate)
    y = lfilter(b.ravel(), a, u)
    y += 0.01 * np.std(y) * rng.normal(size=y.size)
    begin = time.process_time()
    found = evaluate(u, y, rate)
    assert time.process_time() - begin < 10.0
    assert found.frequency_hz.size > 3000
    kinds = {m.row.kind: m.row.frequency_hz for m in found.modes}
    assert kinds["antiresonance"] == pytest.approx(60.0, rel=0.01)
    assert kinds["resonance"] == pytest.approx(80.0, rel=0.01)


def test_what_supports_no_answer_says_why() -> None:
    rng = np.random.default_rng(1)
    with pytest.raises(NoResponse, match="incoherent"):
        evaluate(rng.normal(size=20000), rng.normal(size=20000), RATE)
    t = np.arange(5000) / RATE
    with pytest.raises(NoResponse, match="few-lines"):
        evaluate(np.sin(2 * np.pi * 50 * t), np.cos(2 * np.pi * 50 * t), RATE)
    with pytest.raises(NoResponse, match="input-constant"):
        evaluate(np.ones(5000), rng.normal(size=5000), RATE)
    with pytest.raises(NoResponse, match="too-short"):
        evaluate(rng.normal(size=100), rng.normal(size=100), RATE)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("kind", ["white", "random walk", "slow input", "chirp"])
@pytest.mark.parametrize("n", [4000, 20000])
def test_an_output_without_relation_to_the_input_has_no_response(kind: str, n: int) -> None:
    """Of several hundred lines, some are coherent by chance: none of them is a response."""
    rng = np.random.default_rng(7)
    for _ in range(3):
        u, y = rng.normal(size=n), rng.normal(size=n)
        if kind == "random walk":
            y = np.cumsum(y)
        elif kind == "slow input":
            u = lfilter([1.0], [1.0, -1.9, 0.905], u)
        elif kind == "chirp":
            u = chirp(np.arange(n) / RATE, 1.0, n / RATE, 300.0)
        with pytest.raises(NoResponse, match=r"incoherent|few-lines"):
            evaluate(u, y, RATE)


@pytest.mark.long
def test_the_band_ends_where_the_output_no_longer_follows() -> None:
    """An inertia whose motion sinks into the noise of its sensor at about 60 Hz."""
    rng = np.random.default_rng(3)
    n, rate = 20000, 1000.0
    u = rng.normal(size=n)
    speed = lfilter([0.0, 1.0], [1.0, -0.995], u)
    for _ in range(4):
        y = speed + 2.5 * rng.normal(size=n)
        found = evaluate(u, y, rate)
        assert found.valid_band_hz[1] < 150.0
        # A rigid axis: what stands out where nothing is known is not a mode.
        assert found.modes == ()


@pytest.mark.long
@pytest.mark.parametrize("periods", [1, 8])
@pytest.mark.parametrize(
    ("of_input", "of_output", "code"),
    [
        (1e-200, 1e-200, "input-span"),
        (1e-160, 1.0, "input-span"),
        (1.0, 1e-200, "output-span"),
        (1.0, 1e200, "output-span"),
        (1e308, 1.0, "input-span"),
    ],
)
def test_signals_whose_power_is_no_float_are_refused(
    periods: int, of_input: float, of_output: float, code: str
) -> None:
    u = np.tile(np.random.default_rng(1).normal(size=4000 // periods), periods)
    y = np.convolve(u, [0.5, 0.5])[: u.size]
    with pytest.raises(NoResponse, match=code):
        evaluate(of_input * (u / np.max(np.abs(u))), of_output * y, RATE)
    small = evaluate(1e-60 * u, 1e-60 * y, RATE)
    usual = evaluate(u, y, RATE)
    assert small.frequency_hz.tolist() == usual.frequency_hz.tolist()
    assert np.allclose(small.response, usual.response, rtol=1e-6)


TIMES = np.arange(round(10 * RATE)) / RATE
DRAWN = np.random.default_rng(4)
EXCITED = {
    "before and after nothing": (
        np.concatenate([np.zeros(5000), multisine(RATE, LINES, 1.0, 10, 1), np.zeros(7500)]),
        "periodic",
    ),
    "noise of 10 dB": (
        multisine(RATE, LINES, 1.0, 10, 1)
        + DRAWN.normal(size=TIMES.size) * 0.32 * np.std(multisine(RATE, LINES, 1.0, 1, 1)),
        "periodic",
    ),
    "ramped in": (multisine(RATE, LINES, 1.0, 10, 1) * np.minimum(TIMES, 1.0), "periodic"),
    "chirp beside a slow motion": (
        chirp(TIMES, 5.0, 10.0, 400.0) + 2.0 * np.sin(np.pi * TIMES),
        "chirp",
    ),
    "chirp up and down": (
        np.concatenate([(c := chirp(TIMES[:12500], 5.0, 5.0, 400.0)), c[::-1]]),
        "chirp",
    ),
    "noise": (DRAWN.normal(size=TIMES.size), "noise"),
    "filtered noise": (np.convolve(DRAWN.normal(size=TIMES.size), np.ones(40), "same"), "noise"),
}


@pytest.mark.parametrize("name", EXCITED)
def test_the_excitation_is_found_as_recordings_hold_it(name: str) -> None:
    signal, kind = EXCITED[name]
    assert find_excitation(signal).kind == kind


@pytest.mark.long
def test_a_recording_with_silence_around_is_evaluated_by_its_periods() -> None:
    bench = Bench(noise=1e-4)
    torque = EXCITED["before and after nothing"][0]
    u, y = bench.record(torque, RATE, 5)
    found = evaluate(u, y, RATE)
    assert found.method == "periods"
    assert 7 <= found.periods_used <= 9
    plain = evaluate(*bench.record(multisine(RATE, LINES, 1.0, 10, 1), RATE, 5), RATE)
    assert np.median(np.abs(np.log(found.response / plain.response))) < 0.005
