"""Friction is distinguished from play by what it leaves between the excited lines."""

from dataclasses import replace

import numpy as np
import pytest
from drive_sim import TURN, Drive, Mechanics, simulate

from backend.analysis.mechanics.identification.identify import identify_with_path
from backend.analysis.response.distortion import distortion
from backend.analysis.response.frf import estimate_periodic
from backend.analysis.response.signal_path.sampling import SignalPath
from backend.analysis.signals.excitation import BaseMotion, choose_lines, multisine, scaled
from backend.analysis.signals.line_spectra import Record, speed_lag_s

RATE, PERIOD = 1000.0, 650
LINES = choose_lines(5.0, 400.0, RATE / PERIOD, count=150)
PATH = SignalPath(RATE, current_bandwidth_hz=1000.0)


def excitations():
    for number in range(4):
        e = multisine(
            sample_rate_hz=RATE, period_samples=PERIOD, lines=LINES[LINES > 1],
            realisation=number // 2, invert=bool(number % 2), base=BaseMotion(0.5, RATE / PERIOD),
            iterations=40, integrations=2, ramp_samples=160,
        )  # fmt: skip
        yield scaled(e, 0.4)


def records_of(mechanics):
    drive = Drive(current_hz=1000.0)
    for e in excitations():
        run = simulate(mechanics, drive, RATE, torque=e.samples)
        yield Record(e, run.velocity, run.torque)


@pytest.mark.parametrize("coulomb_nm", [0.0, 0.03, 0.06])
def test_friction_is_no_play(coulomb_nm):
    records = tuple(records_of(Mechanics(loads=((1e-4, 60.0, 0.006),), coulomb_nm=coulomb_nm)))
    frf = estimate_periodic(records, PATH, "torque_mode", coulomb_nm=None)
    found = distortion(records, PATH, "torque_mode", frf)
    assert not found.play
    # Friction explains most of what it did.
    assert found.level <= 0.6 * found.before or found.before < 0.01


def test_an_axis_with_play_gets_no_model_and_no_lines_beyond_the_direct_band():
    linear = tuple(records_of(Mechanics(loads=((1e-4, 60.0, 0.006),), coulomb_nm=0.0)))
    rng = np.random.default_rng(3)
    # Motion that comes again with every period, on the empty bins only.
    e = linear[0].excitation
    empty = np.setdiff1d(np.arange(e.lines[0], e.lines[-1] + 1), e.lines)
    spectrum = np.zeros(PERIOD // 2 + 1, dtype=complex)
    sizes = np.abs(np.fft.rfft(linear[0].response[e.first_sample + PERIOD :][:PERIOD]))
    around = np.interp(empty, e.lines, sizes[e.lines])
    spectrum[empty] = 0.5 * around * np.exp(1j * rng.uniform(0, TURN, empty.size))
    own = np.tile(np.fft.irfft(spectrum, PERIOD), 8)[: e.samples.size + PERIOD]
    start = PERIOD - e.first_sample % PERIOD
    records = tuple(
        replace(r, response=r.response + own[start : start + r.response.size]) for r in linear
    )
    found = identify_with_path(records, PATH, "torque_mode", hold_known=True)
    assert found.distortion.level == pytest.approx(0.5, rel=0.15)
    assert found.distortion.before == pytest.approx(0.5, rel=0.15)
    assert found.distortion.play
    assert not found.trusted
    assert found.corrected.frequency_hz[-1] <= 250.0
    assert found.corrected.response.size == found.corrected.std_db.size
    # The band admits what was added, relative to the lines.
    assert np.median(found.corrected.std_db) > 0.25 * 8.686


@pytest.mark.parametrize("play", [True, False])
def test_play_is_distinguished_from_the_steps_of_a_coarse_encoder(play):
    """A motion that repeats itself repeats its steps as well, as on a DS_C.

    They do not scatter from period to period then, and are all that lies between the lines.
    """
    linear = tuple(records_of(Mechanics(loads=((1e-4, 60.0, 0.006),), coulomb_nm=0.0)))
    rng = np.random.default_rng(5)
    e = linear[0].excitation
    empty = np.setdiff1d(np.arange(e.lines[0], e.lines[-1] + 1), e.lines)
    sizes = np.abs(np.fft.rfft(linear[0].response[e.first_sample + PERIOD :][:PERIOD]))
    spectrum = np.zeros(PERIOD // 2 + 1, dtype=complex)
    around = np.interp(empty, e.lines, sizes[e.lines])
    spectrum[empty] = 0.5 * around * np.exp(1j * rng.uniform(0, TURN, empty.size))
    own = np.tile(np.fft.irfft(spectrum, PERIOD), 8)
    start = PERIOD - e.first_sample % PERIOD
    step = TURN / 2_500
    records = []
    for r in linear:
        n = r.response.size
        steady = e.first_sample + e.transient_periods * PERIOD
        velocity = r.response + play * own[start : start + n]
        # From the first whole period on, every one is that one.
        velocity[steady:] = np.resize(velocity[steady : steady + PERIOD], n - steady)
        velocity[steady:] -= np.mean(velocity[steady : steady + PERIOD])
        exact = np.cumsum(velocity) / RATE
        place = np.floor(exact / step) * step
        # A drive's speed shows four times as much of the steps, as it looks within the cycle.
        reported = velocity + 4.0 * np.gradient(place - exact) * RATE
        records.append(replace(r, response=reported, position=place))
    frf = estimate_periodic(tuple(records), PATH, "torque_mode")
    found = distortion(tuple(records), PATH, "torque_mode", frf)
    assert found.play is play
    if play:
        assert found.level == pytest.approx(0.5, rel=0.15)


@pytest.mark.parametrize("filter_hz", [0.0, 400.0])
def test_friction_is_what_it_is_however_late_the_speed_is_reported(filter_hz):
    """The lag of a filtered speed shows against the position; nothing states the filter."""
    mechanics = Mechanics(loads=((1e-4, 20.0, 0.002),), coulomb_nm=0.06)
    drive = Drive(current_hz=1000.0, speed_filter_hz=filter_hz)
    records = []
    for e in excitations():
        run = simulate(mechanics, drive, RATE, torque=e.samples)
        records.append(Record(e, run.velocity, run.torque, position=run.position))
    lag_s = 1.0 / (TURN * filter_hz) if filter_hz else 0.0
    assert speed_lag_s(tuple(records), PATH) == pytest.approx(lag_s, abs=60e-6)
    frf = estimate_periodic(tuple(records), PATH, "torque_mode", coulomb_nm=None)
    assert frf.coulomb_nm == pytest.approx(0.06, rel=0.06)


def _distorted_at(where):
    """Distortion of a linear axis to which a torque is added where ``where`` (speed) says."""
    rng = np.random.default_rng(7)
    mechanics = Mechanics(loads=(), coulomb_nm=0.0)
    records = []
    for e in excitations():
        plain = simulate(mechanics, Drive(current_hz=1000.0), RATE, torque=e.samples).velocity
        first = e.first_sample + PERIOD
        around = where(plain[first : first + PERIOD])
        kicks = rng.normal(0.0, 0.15, PERIOD) * around
        own = replace(
            e, samples=e.samples + np.roll(np.resize(kicks, e.samples.size), first % PERIOD)
        )
        run = simulate(mechanics, Drive(current_hz=1000.0), RATE, torque=own.samples)
        records.append(Record(e, run.velocity, run.torque))
    frf = estimate_periodic(tuple(records), PATH, "torque_mode", coulomb_nm=0.0)
    return distortion(tuple(records), PATH, "torque_mode", frf)


def test_what_happens_where_the_speed_reverses_is_friction_and_elsewhere_play():
    slow = _distorted_at(lambda v: np.abs(v) < 0.1 * np.std(v))
    fast = _distorted_at(lambda v: np.abs(v) > 0.1 * np.std(v))
    assert slow.at_reversals > 2.0
    assert fast.at_reversals < 1.0
    assert fast.play
    assert not slow.play


def test_odd_lines_tell_even_and_odd_distortion_and_noise_apart() -> None:
    """Speed is x + a·x² + b·x³ with noise; what x³ puts on the lines left out is computed."""
    odd = choose_lines(5.0, 400.0, RATE / PERIOD, odd_only=True)
    rng = np.random.default_rng(11)
    found = {}
    for name, (square, cube, noise) in {
        "even": (0.3, 0.0, 1e-4),
        "odd": (0.0, 0.3, 1e-4),
        "noise": (0.0, 0.0, 0.05),
    }.items():
        records = []
        for number in range(4):
            e = multisine(
                sample_rate_hz=RATE,
                period_samples=PERIOD,
                lines=odd,
                realisation=number // 2,
                invert=bool(number % 2),
                iterations=20,
                periods=4,
            )
            one = e.one_period / np.std(e.one_period)
            moved = one + square * one**2 + cube * one**3
            whole = np.resize(np.roll(moved, e.first_sample % PERIOD), e.samples.size)
            whole = whole + rng.normal(0.0, noise, e.samples.size) if noise else whole
            records.append(Record(e, whole, None))
        frf = estimate_periodic(tuple(records), PATH, "torque_mode")
        found[name] = distortion(tuple(records), PATH, "torque_mode", frf).detected
    assert all(each is not None for each in found.values())
    for name in ("even", "odd"):
        other = "odd" if name == "even" else "even"
        assert getattr(found[name], name) > 0.05
        assert getattr(found[name], other) < 0.01
        assert found[name].noise < 0.001
    spectrum = np.abs(np.fft.rfft(one + 0.3 * one**3))
    left_out = np.setdiff1d(np.arange(odd[0], odd[-1] + 1, 2), odd)
    expected = np.sqrt(np.mean(spectrum[left_out] ** 2) / np.mean(spectrum[odd] ** 2))
    assert found["odd"].odd == pytest.approx(expected, rel=0.2)
    assert found["noise"].noise > 2 * max(found["noise"].even, found["noise"].odd) > 0.0
