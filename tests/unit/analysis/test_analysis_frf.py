"""The estimators against the analytic response of simulated axes (tuning.md, section 2)."""

from dataclasses import replace

import numpy as np
import pytest
from drive_sim import TURN, Drive, Mechanics, simulate
from measured_axes import HEAVY, NAMED, ONE, RIGID, STIFF, THREE, TWO, VERTICAL, errors, measure

from backend.analysis.mechanics.identification.identify import identify_mechanics
from backend.analysis.response.frf import estimate_periodic, valid_band_hz
from backend.analysis.response.frf_stepped import estimate_stepped
from backend.analysis.response.signal_path.sampling import (
    SignalPath,
    hold_response,
    sampled_command,
)
from backend.analysis.signals.chirp import chirp
from backend.analysis.signals.excitation import choose_lines, multisine, scaled
from backend.analysis.signals.line_spectra import Record
from backend.analysis.signals.stepped_sine import stepped_sine


def matches(found, mechanics, low_hz, high_hz):
    """Every true mode that is visible in the band is found within 1 % and 15 % of damping."""
    modes = [(m.frequency_hz, m.damping) for m in found.fit.model.modes]
    for f, z in mechanics.modes()[0]:
        if low_hz <= f <= high_hz:
            near = min(modes, key=lambda m: abs(m[0] - f))
            assert near[0] == pytest.approx(f, rel=0.01)
            assert near[1] == pytest.approx(z, rel=0.15)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("mechanics", [RIGID, ONE, THREE, STIFF, VERTICAL], ids=range(5))
def test_torque_mode_at_4_khz(mechanics):
    m = measure(mechanics, 4000.0)
    assert m.duration_s <= 10.0
    found = identify_mechanics(m.records, m.path, m.quantity)
    e = errors(found.corrected, mechanics, 5.0, 1000.0)
    assert e.lines > 150
    assert e.magnitude_db < 0.3
    assert e.phase_deg < 3.0
    assert e.covered >= 0.9
    matches(found, mechanics, 20.0, 1000.0 if len(mechanics.loads) < 3 else 300.0)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("mechanics", [RIGID, ONE, TWO, THREE, HEAVY], ids=range(5))
def test_torque_mode_at_1_khz_direct_and_model(mechanics):
    m = measure(mechanics, 1000.0)
    assert m.duration_s <= 10.0
    found = identify_mechanics(m.records, m.path, m.quantity)
    assert found.trusted
    for frf in (found.direct, found.corrected):
        low = errors(frf, mechanics, 5.0, 250.0)
        # With a heavy load on a light motor the images alone reach 0.3 dB in the direct estimate.
        assert low.magnitude_db < (0.4 if frf is found.direct and mechanics is HEAVY else 0.3)
        assert low.phase_deg < 2.0
        assert low.covered >= 0.9
    corrected = errors(found.corrected, mechanics, 250.0, 400.0)
    assert corrected.magnitude_db < 0.6
    assert corrected.phase_deg < 4.0
    matches(found, mechanics, 20.0, 400.0 if mechanics is not HEAVY else 10.0)
    f = np.geomspace(250.0, 400.0, 30)
    ratio = found.fit.model.response(f) / mechanics.response(f)
    assert np.median(np.abs(20 * np.log10(np.abs(ratio)))) < 0.6
    assert np.median(np.abs(np.degrees(np.angle(ratio)))) < 4.0


@pytest.mark.long
@pytest.mark.parametrize(
    ("mechanics", "loop_hz", "position"),
    [
        (RIGID, 150.0, False),
        (ONE, 40.0, False),
        (TWO, 40.0, True),
        (VERTICAL, 40.0, True),
        (HEAVY, 4.0, False),
    ],
)
def test_closed_loops_at_1_khz(mechanics, loop_hz, position):
    m = measure(mechanics, 1000.0, loop_hz, position=position)
    found = identify_mechanics(m.records, m.path, m.quantity)
    assert found.trusted
    for frf in (found.direct, found.corrected):
        e = errors(frf, mechanics, 5.0, 200.0)
        assert e.magnitude_db < 0.4
        assert e.phase_deg < 3.0
        assert e.covered >= 0.9
    matches(found, mechanics, 20.0, 200.0)


def test_plain_division_of_sampled_signals_is_wrong_and_that_is_why():
    m = measure(TWO, 1000.0)
    e = m.records[0].excitation
    span = slice(e.first_sample + e.period_samples, e.first_sample + 3 * e.period_samples)
    y = np.fft.rfft(m.records[0].response[span])[2 * e.lines]
    u = np.fft.rfft(m.records[0].torque[span])[2 * e.lines]
    high = (e.line_hz > 150) & (e.line_hz < 250)
    plain = np.degrees(np.angle((y / u) / TWO.response(e.line_hz)))[high]
    assert np.median(np.abs(plain)) > 15.0


def test_friction_found_and_removed():
    m = measure(ONE, 4000.0)
    kept = estimate_periodic(m.records, m.path, m.quantity)
    taken = estimate_periodic(m.records, m.path, m.quantity, coulomb_nm=None)
    assert taken.coulomb_nm == pytest.approx(ONE.coulomb_nm, rel=0.05)
    low = kept.frequency_hz < 60.0
    assert np.mean(taken.distortion[low]) < 0.5 * np.mean(kept.distortion[low])
    free = measure(replace(ONE, coulomb_nm=0.0), 4000.0)
    none = estimate_periodic(free.records, free.path, free.quantity, coulomb_nm=None)
    assert none.coulomb_nm < 0.002


@pytest.mark.long
def test_a_delay_of_cycles_is_found():
    m = measure(TWO, 1000.0)
    late = tuple(
        replace(r, response=np.concatenate([np.zeros(2), r.response[:-2]])) for r in m.records
    )
    found = identify_mechanics(late, m.path, m.quantity)
    assert found.fit.delay_s == pytest.approx(2e-3 + 25e-6, abs=10e-6)
    assert errors(found.corrected, TWO, 5.0, 400.0).phase_deg < 1.0


def test_periods_with_a_gap_are_left_out():
    m = measure(ONE, 1000.0)
    first = m.records[0]
    e = first.excitation
    valid = np.ones(e.samples.size, dtype=bool)
    hit = e.first_sample + 2 * e.period_samples + 100
    valid[hit : hit + 3] = False
    spoilt = first.response.copy()
    spoilt[hit : hit + 3] = 1e6
    records = (replace(first, response=spoilt, valid=valid), *m.records[1:])
    frf = estimate_periodic(records, m.path, m.quantity, coulomb_nm=None)
    assert (frf.periods_used, frf.periods_dropped) == (7, 1)
    assert errors(frf, ONE, 5.0, 250.0).magnitude_db < 0.3
    with pytest.raises(ValueError, match="every period"):
        estimate_periodic(
            (replace(first, valid=np.zeros(e.samples.size, dtype=bool)),), m.path, m.quantity
        )


@pytest.mark.long(keep=3)
@pytest.mark.parametrize("hold", ["zero", "linear"])
@pytest.mark.parametrize("delay_s", [0.0, 0.3e-3, 2.25e-3])
def test_sampled_command_is_the_exact_response_of_hold_and_lag(hold, delay_s):
    """Against the spectrum: DFT of the result = Σ over images of hold · lag · delay."""
    n, fs = 500, 1000.0
    path = SignalPath(fs, hold, 250.0, delay_s)
    rng = np.random.default_rng(3)
    period = rng.normal(size=n)
    out = sampled_command(np.tile(period, 4), path)[-n:]
    f = np.fft.rfftfreq(n, 1 / fs)[1:200]
    images = np.arange(-4000, 4001)[:, None] * fs + f
    lag = 1 / (1 + 1j * images / 250.0)
    exact = np.sum(
        hold_response(images, fs, hold) * lag * np.exp(-2j * np.pi * images * delay_s), axis=0
    )
    got = (np.fft.rfft(out) / np.fft.rfft(period))[1:200]
    assert np.max(np.abs(got / exact - 1)) < 2e-3


def test_sampled_command_matches_the_printed_recursion():
    a = np.exp(-TURN * 1000.0 * 1e-3)
    r = np.random.default_rng(1).normal(size=50)
    u = np.zeros(50)
    for k in range(1, 50):
        u[k] = a * u[k - 1] + (1 - a) * r[k - 1]
    path = SignalPath(1000.0, current_bandwidth_hz=1000.0)
    assert np.allclose(sampled_command(r, path), u)


def test_hold_response_is_that_of_a_zero_order_hold():
    f = np.array([1e-6, 250.0, 1000.0])
    h = hold_response(f, 1000.0, "zero")
    assert np.abs(h) == pytest.approx([1.0, np.sin(np.pi / 4) / (np.pi / 4), 0.0], abs=1e-9)
    assert np.degrees(np.angle(h[1])) == pytest.approx(-45.0)


def test_closed_loop_response_of_the_speed_loop():
    """Velocity offsets around a steady speed against T = L/(1+L), friction linear."""
    fs, n = 4000.0, 4000
    kp, ki = TURN * 40.0 * RIGID.total_kgm2, TURN * 40.0 * RIGID.total_kgm2 * TURN * 5.0
    mechanics = replace(RIGID, coulomb_nm=0.0)
    lines = choose_lines(5.0, 1000.0, 1.0, count=300)
    e = scaled(multisine(sample_rate_hz=fs, period_samples=n, lines=lines), 4.0)
    # The injected sequence is interpolated by this drive: linear hold.
    run = simulate(mechanics, Drive(kp_nms=kp, ki_nm=ki), fs, velocity=e.samples)
    path = SignalPath(fs, "linear", response_delay_s=25e-6)
    frf = estimate_periodic((Record(e, run.velocity),), path, "closed_loop")
    s = 2j * np.pi * frf.frequency_hz
    forward = (kp + ki / s) / (1 + s / (TURN * 1000.0)) * mechanics.response(frf.frequency_hz)
    # The reference is a staircase ahead of the straight line by half a loop period; the fed-back
    # speed is half a period old when measured and held for another half.
    truth = forward * np.exp(s * 25e-6) / (1 + forward * np.exp(-s * 50e-6))
    use = (frf.frequency_hz < 400) & (frf.coherence > 0.9)
    ratio = frf.response[use] / truth[use]
    assert np.median(np.abs(20 * np.log10(np.abs(ratio)))) < 0.1
    assert np.median(np.abs(np.degrees(np.angle(ratio)))) < 1.5


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("reported_nm", [None, 0.04])
def test_friction_is_taken_out_of_a_closed_speed_loop(reported_nm):
    """A soft loop that is moved to and fro slows down by friction: no gain of a linear loop."""
    fs, n = 2000.0, 2000
    mechanics = replace(ONE, coulomb_nm=0.04)
    kp = TURN * 20.0 * mechanics.total_kgm2
    ki = kp * TURN * 2.0
    lines = choose_lines(5.0, 400.0, 1.0, count=150)
    base = 20.0 * np.sin(TURN * np.arange(6 * n) / n)
    records = []
    for number in range(4):
        sign = 1.0 - 2.0 * (number % 2)
        e = multisine(
            sample_rate_hz=fs,
            period_samples=n,
            lines=lines,
            periods=5,
            transient_periods=1,
            realisation=number // 2,
            invert=sign < 0,
        )
        e = scaled(e, 12.0)
        played = base + e.samples
        run = simulate(mechanics, Drive(kp_nms=kp, ki_nm=ki), fs, velocity=played)
        records.append(Record(e, run.velocity, run.torque, None, run.position))
    path = SignalPath(fs, "linear", response_delay_s=25e-6)

    def error(coulomb_nm):
        frf = estimate_periodic(tuple(records), path, "closed_loop", coulomb_nm=coulomb_nm)
        s = 2j * np.pi * frf.frequency_hz
        forward = (kp + ki / s) / (1 + s / (TURN * 1000.0)) * mechanics.response(frf.frequency_hz)
        truth = forward * np.exp(s * 25e-6) / (1 + forward * np.exp(-s * 50e-6))
        use = frf.frequency_hz < 60.0
        ratio = np.abs(np.log(frf.response[use] / truth[use]))
        return float(np.median(ratio)), frf.coulomb_nm

    without, _ = error(0.0)
    corrected, found_nm = error(reported_nm)
    assert corrected < 0.3 * without
    assert found_nm == pytest.approx(0.04, rel=0.1)


def linear_response(excitation, mechanics):
    e = scaled(excitation, 0.4)
    run = simulate(replace(mechanics, coulomb_nm=0.0), Drive(), e.sample_rate_hz, torque=e.samples)
    return Record(e, run.velocity, run.torque), SignalPath(
        e.sample_rate_hz, current_bandwidth_hz=1000.0, response_delay_s=25e-6
    )


def test_stepped_sine():
    e = stepped_sine(sample_rate_hz=4000.0, frequency_hz=np.array([30.0, 100.0, 400.0, 440.0]))
    record, path = linear_response(e, STIFF)
    frf = estimate_stepped(record, path, "torque_mode")
    ratio = frf.response / STIFF.response(frf.frequency_hz)
    assert np.all(np.abs(20 * np.log10(np.abs(ratio))) < 0.3)
    assert np.all(np.abs(np.degrees(np.angle(ratio))) < 2.0)


def test_noise_level_and_deviation_are_those_of_the_added_noise():
    lines = choose_lines(5.0, 400.0, 1.0, spacing="linear")
    rng = np.random.default_rng(5)
    records = []
    for i in range(6):
        e = multisine(
            sample_rate_hz=1000.0,
            period_samples=1000,
            lines=lines,
            periods=5,
            realisation=i,
            iterations=8,
        )
        records.append(Record(e, 2.0 * e.samples + rng.normal(0, 0.5, e.samples.size)))
    path = SignalPath(1000.0)
    path = replace(path, command_delay_s=-0.5e-3)  # samples compared with samples: no hold
    frf = estimate_periodic(tuple(records), path, "closed_loop")
    # White noise of variance v has amplitude sqrt(4v/N) per line (RMS of the complex amplitude).
    assert np.median(frf.noise) == pytest.approx(0.5 * np.sqrt(4 / 1000), rel=0.05)
    truth = 2.0 / np.sinc(frf.frequency_hz / 1000.0)
    inside = np.abs(20 * np.log10(np.abs(frf.response) / truth)) < 1.96 * frf.std_db
    assert 0.92 <= np.mean(inside) <= 0.99


def test_band_shrinks_with_jitter():
    assert valid_band_hz(5.0, 1000.0) == (5.0, 250.0)
    assert valid_band_hz(5.0, 1000.0, model=True) == (5.0, 400.0)
    assert valid_band_hz(5.0, 500.0, jitter_s=1e-3)[1] == pytest.approx(0.05 / (2 * np.pi * 1e-3))


def test_useless_input_is_refused():
    m = measure(ONE, 1000.0)
    first = m.records[0]
    with pytest.raises(ValueError, match="reported torque"):
        estimate_periodic((replace(first, torque=None),), m.path, "torque_injection")
    with pytest.raises(ValueError, match="samples"):
        Record(first.excitation, first.response[:-1])
    e = chirp(sample_rate_hz=1000.0, f_min_hz=5.0, f_max_hz=100.0, duration_s=1.0)
    with pytest.raises(ValueError, match="periodic"):
        estimate_periodic((Record(e, e.samples),), m.path, m.quantity)
    with pytest.raises(ValueError, match="reference"):
        identify_mechanics(m.records, m.path, "closed_loop")


def test_named_axes_are_what_they_claim():
    """The simulation's own truth: an independent closed form for one load."""
    f, z = ONE.modes()[0][0]
    j1, (j2, k, d) = ONE.motor_kgm2, ONE.loads[0]
    assert f == pytest.approx(np.sqrt(k * (1 / j1 + 1 / j2)) / TURN, rel=2e-3)
    assert z == pytest.approx(d / 2 * np.sqrt((1 / j1 + 1 / j2) / k), rel=0.05)
    assert ONE.modes()[1][0][0] == pytest.approx(np.sqrt(k / j2) / TURN, rel=1e-6)
    assert NAMED["rigid"] == Mechanics()
