"""Speeds and torques that are reported otherwise than an estimate takes them to be."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from drive_sim import TURN, Drive, simulate
from measured_axes import ONE, tuned_drive
from random_axes import errors
from scipy.signal import butter, lfilter

from backend.analysis.mechanics.identification import identification_trials
from backend.analysis.mechanics.identification.identification_trials import Task
from backend.analysis.mechanics.identification.identify import identify_with_path
from backend.analysis.response.reported_signals.reported import (
    commanded,
    current_uncertainty,
    mean_cycles,
)
from backend.analysis.response.reported_signals.reported_speed import derivative, signals_differ
from backend.analysis.response.signal_path.sampling import SignalPath, lag_response
from backend.analysis.signals.excitation import BaseMotion, choose_lines, multisine, scaled
from backend.analysis.signals.line_spectra import Record
from backend.axes.axis.axis import Envelope
from backend.tools.measuring import excite
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.measuring.recording import Recording
from backend.tools.tuning.sweep.evaluation import SweepSettings, evaluate

RATE = 1000.0


@cache
def recorded(loop_hz=0.0, filter_hz=0.0):
    """Two pairs of realisations with their positions, with no loop or next to the speed loop."""
    period = 750
    lines = choose_lines(5.0, 400.0, RATE / period, count=150)
    drive = replace(tuned_drive(ONE, loop_hz) if loop_hz else Drive(), speed_filter_hz=filter_hz)
    found = []
    for i in range(4):
        e = multisine(
            sample_rate_hz=RATE, period_samples=period, lines=lines, realisation=i // 2,
            invert=bool(i % 2), integrations=0 if loop_hz else 2, iterations=40,
            base=None if loop_hz else BaseMotion(0.5), ramp_samples=period // 8,
        )  # fmt: skip
        e = scaled(e, 0.35 * drive.rated_nm, drive.torque_step * drive.rated_nm)
        moving = 20.0 * np.sin(TURN * np.arange(e.samples.size) / period)
        given = {"velocity": moving} if loop_hz else {}
        run = simulate(ONE, drive, RATE, torque=e.samples, **given)
        found.append(Record(e, run.velocity, run.torque, None, run.position))
    return tuple(found)


def averaged(records, cycles):
    def mean(r):
        before = np.concatenate([np.full(cycles, r.position[0]), r.position[:-cycles]])
        return (r.position - before) * RATE / cycles

    return tuple(replace(r, response=mean(r)) for r in records)


@pytest.mark.parametrize("loop_hz", [0.0, 40.0])
@pytest.mark.parametrize("cycles", [1, 2, 4, 16])
def test_a_mean_of_cycles_is_recognised(loop_hz, cycles):
    assert mean_cycles(averaged(recorded(loop_hz), cycles)) == cycles


@pytest.mark.parametrize("filter_hz", [0.0, 300.0, 1000.0])
def test_a_filtered_speed_is_no_mean(filter_hz):
    assert mean_cycles(recorded(40.0, filter_hz)) is None
    assert mean_cycles(tuple(replace(r, position=None) for r in recorded())) is None


@pytest.mark.parametrize(("loop", "loop_hz"), [("none", 0.0), ("speed", 40.0)])
def test_nothing_is_concluded_from_a_mean(loop, loop_hz):
    records = averaged(recorded(loop_hz), 4)
    taken = tuple(
        (
            excite.Sequence(r.excitation),
            Recording(RATE, r.position, r.response, r.torque, r.torque, r.torque,
                      np.ones(r.torque.size, dtype=bool)),
        )
        for r in records
    )  # fmt: skip
    facts = AxisFacts(1.27, True, 3000.0, 1000.0, None, 5e-5, None, False)
    settings = SweepSettings(Envelope(4.0, 1500.0, 100.0, 60.0))
    with pytest.raises(ValueError, match="mean of 4 cycles"):
        evaluate(taken, RATE, facts, settings, loop, True)


def test_a_torque_that_is_the_command_hides_the_current_loop():
    assert commanded(SignalPath(RATE, current_bandwidth_hz=5900.0))
    assert not commanded(SignalPath(RATE, current_bandwidth_hz=2000.0))
    assert not commanded(SignalPath(RATE))
    f = np.geomspace(5.0, 400.0, 100)
    uncertainty = current_uncertainty(f)
    assert uncertainty.real == pytest.approx(np.log(np.abs(lag_response(f, 1000.0))))
    # A delay is found anyway: what is left of the phase is its curvature.
    assert np.max(np.abs(uncertainty.imag)) < 0.1 * np.max(
        np.abs(np.angle(lag_response(f, 1000.0)))
    )


FINER = 20


def _late_mean(speed):
    """A mean over 1.25 ms that is 0.4 ms old: nulls beyond the band, unlike a lag."""
    return lfilter(np.concatenate([np.zeros(8), np.full(25, 1 / 25)]), 1.0, speed)


def _slow_mean(speed):
    """A mean over 3 ms that is 1 ms old: nulls within the band."""
    return lfilter(np.concatenate([np.zeros(20), np.full(60, 1 / 60)]), 1.0, speed)


def _triangle(speed):
    """A mean of means over 1 ms each."""
    return lfilter(np.convolve(np.full(20, 1 / 20), np.full(20, 1 / 20)), 1.0, speed)


def _observer(speed):
    """Second order, 200 Hz, with an overshoot."""
    return lfilter(*butter(2, 200.0, fs=FINER * RATE), speed)


@cache
def recorded_finely():
    """Records of `recorded` without a loop, and their true speeds at 20 kHz."""
    found = []
    for r in recorded():
        torque = np.repeat(r.excitation.samples, FINER)
        run = simulate(ONE, Drive(), FINER * RATE, torque=torque)
        record = Record(
            r.excitation, run.velocity[::FINER], run.torque[::FINER], None, run.position[::FINER]
        )
        found.append((record, np.gradient(run.position) * FINER * RATE))
    return tuple(found)


@pytest.mark.long
@pytest.mark.parametrize("filter_hz", [None, 1000.0])
@pytest.mark.parametrize("reported", [_late_mean, _triangle, _observer])
def test_a_speed_that_no_lag_explains_is_not_used(reported, filter_hz):
    """The band held 6 to 79 % of the phases where a drawn 606Ch was late and a mean."""
    records = tuple(replace(r, response=reported(fine)[::FINER]) for r, fine in recorded_finely())
    path = SignalPath(RATE, current_bandwidth_hz=1000.0, response_bandwidth_hz=filter_hz)
    found = identify_with_path(records, path, "torque_mode", hold_known=False)
    assert found.speed_dropped
    assert not found.torque_dropped
    assert found.trusted
    e = errors(found.corrected, ONE, 5.0, 400.0)
    assert e.covered > 0.9
    assert e.magnitude_db < 0.1
    assert e.phase_deg < 0.5


def test_a_speed_that_no_lag_explains_costs_no_search_with_it(monkeypatch):
    """Mechanics that explain both were searched for first, with twelve delays: 11 of 13 s."""
    records = tuple(replace(r, response=_slow_mean(fine)[::FINER]) for r, fine in recorded_finely())
    path = SignalPath(RATE, current_bandwidth_hz=1000.0)
    searched = []
    fit = identification_trials.fit_sampled_model

    def fitted(velocity, path, **given):
        if given.get("start") is None:
            searched.append(float(np.min(velocity.std_db)))
        return fit(velocity, path, **given)

    monkeypatch.setattr(identification_trials, "fit_sampled_model", fitted)
    found = identify_with_path(records, path, "torque_mode", hold_known=False)
    assert found.speed_dropped
    # The position alone: the speed's lines have no weight.
    assert min(searched) >= 1e3


@pytest.mark.parametrize("corner_hz", [None, 150.0, 2000.0])
def test_a_speed_behind_a_lag_and_a_delay_does_not_differ_from_the_position(corner_hz):
    finely = recorded_finely()
    path = SignalPath(RATE, current_bandwidth_hz=1000.0)
    a = 0.0 if corner_hz is None else float(np.exp(-TURN * corner_hz / (FINER * RATE)))
    late = np.concatenate([np.zeros(8), [1.0]])

    def differs(shown):
        records = tuple(replace(r, response=shown(fine)[::FINER]) for r, fine in finely)
        views = Task(records, "torque_mode").views(path, None)
        return signals_differ(views.velocity, views.position, path)

    assert not differs(lambda fine: lfilter(late * (1.0 - a), [1.0, -a], fine))
    assert differs(_slow_mean)


@pytest.mark.long
@pytest.mark.parametrize("filter_hz", [300.0, 1000.0])
def test_a_speed_behind_one_lag_is_used(filter_hz):
    a = float(np.exp(-TURN * filter_hz / (FINER * RATE)))
    records = tuple(
        replace(r, response=lfilter([1.0 - a], [1.0, -a], fine)[::FINER])
        for r, fine in recorded_finely()
    )
    path = SignalPath(RATE, current_bandwidth_hz=1000.0)
    found = identify_with_path(records, path, "torque_mode", hold_known=False)
    assert not found.speed_dropped
    assert found.fit.path.response_bandwidth_hz == pytest.approx(filter_hz, rel=0.1)


def test_the_derivative_of_a_position_is_its_speed():
    t = np.arange(3000) / RATE
    place = 2.0 * t + np.sin(TURN * 7.0 * t) + 0.02 * np.sin(TURN * 180.0 * t)
    speed = derivative(place, RATE)
    true = 2.0 + TURN * (7.0 * np.cos(TURN * 7.0 * t) + 3.6 * np.cos(TURN * 180.0 * t))
    inner = slice(100, -100)
    assert np.max(np.abs(speed - true)[inner]) < 0.01 * np.max(np.abs(true))


@cache
def recorded_beside_loop(loop_hz, *, demand):
    """Records beside a speed loop whose 6077h is the demand, or the torque."""
    drive = replace(tuned_drive(ONE, loop_hz), speed_filter_hz=1000.0, torque_step=1e-9)
    kept = float(np.exp(-TURN * drive.current_hz / (FINER * RATE)))
    found = []
    for r in recorded(loop_hz):
        t = np.arange(FINER * r.excitation.samples.size) / (FINER * RATE)
        run = simulate(
            ONE,
            drive,
            FINER * RATE,
            torque=np.repeat(r.excitation.samples, FINER),
            velocity=20.0 * np.sin(TURN * t / 0.75),
        )
        torque = run.torque
        if demand:
            torque = np.diff(torque, prepend=0.0) / (1.0 - kept) + np.concatenate(
                [[0.0], torque[:-1]]
            )
        shown = [np.asarray(x[::FINER]) for x in (run.velocity, torque, run.position)]
        shown[1] = np.round(shown[1], 3)
        found.append(Record(r.excitation, shown[0], shown[1], None, shown[2]))
    return tuple(found)


@pytest.mark.long
@pytest.mark.parametrize("known_hz", [None, 1000.0])
@pytest.mark.parametrize("demand", [True, False])
def test_a_demand_beside_a_loop_passes_the_current_loop_too(demand, known_hz):
    """The loop's own part was taken for the acting torque: 0.3 dB and 2° wrong, on drawn axes."""
    records = recorded_beside_loop(40.0, demand=demand)
    path = SignalPath(RATE, current_bandwidth_hz=known_hz, response_bandwidth_hz=1000.0)
    found = identify_with_path(records, path, "torque_injection", hold_known=False)
    assert found.torque_is_demand is demand
    e = errors(found.corrected, ONE, 20.0, 250.0)
    assert e.covered > 0.9
    assert e.magnitude_db < 0.2
    assert e.phase_deg < 1.5


@pytest.mark.parametrize("dropped", [False, True])
def test_a_loop_whose_speed_contradicts_its_position_is_that_of_the_position(dropped):
    """A loop of first order, 60 Hz, beside a reported speed that is late by 1 ms at 1 kHz."""
    period, corner_hz = 750, 60.0
    lines = choose_lines(5.0, 240.0, RATE / period, count=100)
    a = float(np.exp(-TURN * corner_hz / (FINER * RATE)))
    records = []
    for i in range(2):
        e = multisine(
            sample_rate_hz=RATE, period_samples=period, lines=lines, realisation=0,
            invert=bool(i % 2), integrations=0, iterations=20, ramp_samples=period // 8,
        )  # fmt: skip
        fine = lfilter([1.0 - a], [1.0, -a], np.repeat(e.samples, FINER))
        place = np.cumsum(fine) / (FINER * RATE)
        nothing = np.zeros(e.samples.size)
        reported = _late_mean(fine)[::FINER]
        valid = np.ones(e.samples.size, np.bool_)
        recording = Recording(RATE, place[::FINER], reported, nothing, e.samples, nothing, valid)
        records.append((excite.Sequence(e), recording))
    settings = SweepSettings(
        Envelope(4.0, 1500.0, 100.0, 60.0), kind="speed_loop", hold="zero", coulomb_nm=0.0,
        speed_dropped=dropped,
    )  # fmt: skip
    facts = AxisFacts(1.27, True, 3000.0, 1000.0, None, None, None, False)
    frf = evaluate(tuple(records), RATE, facts, settings, "speed", True).frf
    use = frf.in_band & (frf.frequency_hz > 20.0)
    f = frf.frequency_hz[use]
    ratio = frf.response[use] * (1.0 + 1j * f / corner_hz)
    off_db = float(np.max(np.abs(20 * np.log10(np.abs(ratio)))))
    if dropped:
        assert off_db < 0.3
    else:
        assert off_db > 1.0
