"""What lies between setpoints and torque, found again from simulated recordings."""

from dataclasses import replace

import numpy as np
import pytest
from drive_sim import TURN, Drive, Mechanics
from random_axes import RATED_NM, Case, errors, played, result_of
from scipy.optimize import least_squares
from scipy.signal import lfilter

from backend.analysis.mechanics.identification import identification_trials, model_fit
from backend.analysis.mechanics.identification.identification_trials import Task
from backend.analysis.mechanics.identification.identify import (
    Identification,
    _undecided,
    _without_path,
    identify_with_path,
)
from backend.analysis.mechanics.identification.robust_fit import minimise
from backend.analysis.response.frf import estimate_periodic
from backend.analysis.response.signal_path.path_fit import find_paths, moved_path
from backend.analysis.response.signal_path.sampling import (
    SignalPath,
    sampled_command,
    sampled_command_response,
)
from backend.analysis.response.stated_band import unexplained
from backend.analysis.signals.line_spectra import Record

ONE = Mechanics(loads=((1e-4, 20.0, 0.002),))


def case_of(rate, *, late_steps, current_hz=700.0, interpolates=False, loop_hz=0.0, **drive):
    kp = TURN * loop_hz * ONE.total_kgm2
    made = Drive(
        RATED_NM, 3 * RATED_NM, current_hz, kp_nms=kp, ki_nm=kp * TURN * loop_hz / 8,
        speed_filter_hz=1000.0, command_late_steps=late_steps, interpolates=interpolates, **drive,
    )  # fmt: skip
    return Case("one", ONE, made, rate, loop_hz, known_lag=False)


def records_of(case):
    return tuple(
        Record(s.excitation, r.velocity_rad_s, r.torque_nm, r.valid, r.position_rad)
        for s, r in played(case)
    )


@pytest.mark.long
@pytest.mark.parametrize(
    ("cycles", "interpolates"), [(0.0, True), (1.0, False), (1.5, False), (2.4, True)]
)
def test_hold_delay_and_corner_are_found_where_no_drive_tells_them(cycles, interpolates):
    case = case_of(4000.0, late_steps=round(5 * cycles), interpolates=interpolates)
    records = records_of(case)
    found = identify_with_path(records, SignalPath(4000.0), "torque_mode", hold_known=False)
    path = found.fit.path
    assert path.current_bandwidth_hz == pytest.approx(700.0, rel=0.03)
    # Behind a slow current loop a straight line looks like a late staircase: the mean counts.
    period_s = 1 / 4000.0
    mean_s = path.command_delay_s + period_s * (1.0 if path.hold == "linear" else 0.5)
    true_s = round(5 * cycles) * 50e-6 + (period_s - 25e-6 if interpolates else 0.5 * period_s)
    assert mean_s + found.fit.delay_s == pytest.approx(true_s, abs=10e-6)
    e = errors(found.corrected, ONE, 5.0, 1000.0)
    assert e.magnitude_db < 0.1
    assert e.phase_deg < 0.5


@pytest.mark.parametrize("interpolates", [False, True])
def test_a_straight_line_is_distinguished_from_a_staircase(interpolates):
    case = case_of(1000.0, late_steps=20, interpolates=interpolates, current_hz=1000.0)
    best = find_paths(records_of(case), SignalPath(1000.0), loop_closed=False, hold_known=False)[0]
    assert best.hold == ("linear" if interpolates else "zero")
    late_s = 1e-3 - (25e-6 if interpolates else 0.0)
    # The line is one of 50 µs steps; mistaken for a straight one it is 20 µs off, the corner 14 %.
    assert best.command_delay_s == pytest.approx(late_s, abs=5e-6)
    if interpolates:
        assert best.current_bandwidth_hz == pytest.approx(1000.0, rel=0.03)


@pytest.mark.parametrize("known_hz", [None, 1000.0])
def test_a_line_that_begins_in_its_own_cycle_is_a_line(known_hz):
    """Setpoints that act at once: the line of steps is 25 µs before one of whole cycles.

    A staircase with part of a cycle of delay is near it in the sampled torque (0.68 cycles, a
    current loop of 1 kHz), and 25 µs too late a line explains less than that.
    """
    case = case_of(1000.0, late_steps=0, interpolates=True, current_hz=1000.0)
    path = SignalPath(1000.0, current_bandwidth_hz=known_hz)
    best = find_paths(records_of(case), path, loop_closed=False, hold_known=False)[0]
    assert best.hold == "linear"
    assert best.command_delay_s == pytest.approx(-25e-6, abs=5e-6)


def test_a_delay_just_short_of_whole_cycles_is_found():
    """Two samples show it: beyond the whole cycle the misfit hardly changes any more."""
    path = SignalPath(1000.0, current_bandwidth_hz=700.0)
    best = find_paths(
        records_of(case_of(1000.0, late_steps=39)), path, loop_closed=False, hold_known=False
    )[0]
    assert best.hold == "zero"
    assert best.command_delay_s == pytest.approx(39 * 50e-6, abs=5e-6)


@pytest.mark.long
def test_a_noisy_loop_leaves_no_uncertainty_of_whole_cycles():
    """A quarter of the torque is the loop's answer to noise, which looks like other paths, too."""
    case = case_of(1000.0, late_steps=0, current_hz=1400.0, loop_hz=30.0, counts_per_rev=2**20,
                   noise_counts=8.0)  # fmt: skip
    path = SignalPath(1000.0, current_bandwidth_hz=1400.0)
    records = records_of(case)
    holds = {p.hold for p in find_paths(records, path, loop_closed=True, hold_known=False)}
    assert "zero" in holds
    found = identify_with_path(records, path, "torque_injection", hold_known=False)
    assert found.fit.path.hold == "zero"
    # The filter, which nothing states, takes the rest of what the fit finds.
    assert found.fit.path.command_delay_s == pytest.approx(0.0, abs=60e-6)
    e = errors(found.corrected, ONE, 5.0, 200.0)
    assert e.magnitude_db < 0.4
    assert e.phase_deg < 3.0


@pytest.mark.long
@pytest.mark.parametrize("late_steps", [20, 36])
def test_beside_a_closed_loop_path_and_mechanics_find_each_other(late_steps):
    case = case_of(1000.0, late_steps=late_steps, loop_hz=15.0)
    found = identify_with_path(
        records_of(case), SignalPath(1000.0), "torque_injection", hold_known=False
    )
    assert found.fit.path.hold == "zero"
    assert found.fit.path.command_delay_s == pytest.approx(late_steps * 50e-6, abs=40e-6)
    assert found.fit.loop.c0 == pytest.approx(case.drive.kp_nms, rel=0.03)
    e = errors(found.corrected, ONE, 5.0, 200.0)
    assert e.magnitude_db < 0.4
    assert e.phase_deg < 3.0


def test_the_torque_alone_is_not_asked_where_it_was_not_recorded():
    records = tuple(replace(r, torque=None) for r in records_of(case_of(4000.0, late_steps=5)))
    path = SignalPath(4000.0, command_delay_s=1e-3)
    assert find_paths(records, path, loop_closed=False, hold_known=False) == (path,)


@pytest.mark.parametrize("hold", ["zero", "linear"])
def test_response_of_the_sampled_command_is_that_of_its_samples(hold):
    path = SignalPath(1000.0, hold, 300.0, 1.3e-3, direct_gain=0.5)
    period = np.random.default_rng(1).normal(size=200)
    out = sampled_command(np.tile(period, 3), path)[-200:]
    f = np.fft.rfftfreq(200, 1e-3)[1:]
    expected = (np.fft.rfft(out) / np.fft.rfft(period))[1:]
    assert np.allclose(sampled_command_response(f, path), expected, atol=1e-6)


def test_friction_is_found_behind_a_coarse_encoder():
    """2500 lines: the speed is in steps of 12 rad/s before it is filtered."""
    case = case_of(4000.0, late_steps=0, counts_per_rev=10_000)
    path = SignalPath(4000.0, current_bandwidth_hz=700.0, response_bandwidth_hz=1000.0)
    found = estimate_periodic(records_of(case), path, "torque_mode", coulomb_nm=None)
    assert found.coulomb_nm == pytest.approx(ONE.coulomb_nm, rel=0.15)


@pytest.mark.long
def test_a_delay_of_two_and_a_half_cycles_spoils_nothing():
    case = case_of(1000.0, late_steps=47, current_hz=1500.0)
    found = result_of(case, played(case))
    assert found.trusted
    assert found.delay_s == pytest.approx(47 * 50e-6, abs=40e-6)
    for low, high, db, deg in ((5.0, 250.0, 0.3, 2.0), (250.0, 400.0, 0.6, 4.0)):
        e = errors(found.frf, ONE, low, high)
        assert e.magnitude_db < db
        assert e.phase_deg < deg
        assert e.covered >= 0.9


def test_minimum_is_that_of_a_general_solver():
    t = np.linspace(0.0, 3.0, 60)
    y = 2.0 * np.exp(-1.3 * t) + 0.3
    y[::9] += 4.0  # outliers

    def both(x):
        e = np.exp(-x[1] * t)
        slopes = np.column_stack([e, -x[0] * t * e, np.ones(t.size)])
        return x[0] * e + x[2] - y, lambda: slopes

    low, high = np.array([0.0, 0.1, -1.0]), np.array([5.0, 1.2, 1.0])
    for top in (3.0, 1.2):  # free, and held by a bound
        high[1] = top
        own = minimise(both, np.array([1.0, 0.5, 0.0]), low, high, scale=0.1, steps=100,
                       cost_tolerance=1e-10, step_tolerance=1e-9)  # fmt: skip
        other = least_squares(
            lambda x: both(x)[0], [1.0, 0.5, 0.0], lambda x: both(x)[1](), bounds=(low, high),
            loss="soft_l1", f_scale=0.1, xtol=1e-12, ftol=1e-12,
        )  # fmt: skip
        assert own.cost == pytest.approx(other.cost, rel=1e-4)
        assert own.x == pytest.approx(other.x, abs=2e-3)
        assert np.all((own.x >= low) & (own.x <= high))


def test_uncertainty_tells_how_far_a_path_that_is_off_bends_the_answer():
    case = case_of(1000.0, late_steps=0, current_hz=1000.0)
    path = SignalPath(1000.0, current_bandwidth_hz=1000.0, response_bandwidth_hz=1000.0)
    task = Task(records_of(case), "torque_mode")
    found = task.trial(path)
    uncertainty = task.uncertainty(found, corner_known=True)
    # One deviation of the delay, as the covariance of the torque's fit has it, and the same again.
    std = uncertainty.path_std[0]
    other = task.trial(moved_path(path, std, 0.0), start=found.solution)
    f = found.views.velocity.frequency_hz
    now, then = (
        t.views.velocity.response / t.fit.image_factor(f) / np.exp(-1j * TURN * f * t.fit.delay_s)
        for t in (found, other)
    )
    moved = np.log(then / now)
    assert np.median(np.abs(moved.imag)) <= 1.5 * np.median(uncertainty.corrected[0].imag)
    assert np.median(np.abs(moved.real)) <= 1.5 * np.median(uncertainty.corrected[0].real)


def test_what_else_may_be_true_widens_the_band():
    case = case_of(1000.0, late_steps=0, current_hz=1000.0)
    path = SignalPath(1000.0, current_bandwidth_hz=1000.0, response_bandwidth_hz=1000.0)
    task = Task(records_of(case), "torque_mode")
    best = task.trial(path)
    other = task.trial(replace(path, current_bandwidth_hz=500.0), start=best.solution)
    frf = best.views.velocity
    plain = Identification(frf, frf, best.fit)
    wider = _undecided(plain, best, [other]).corrected
    # A corner of 500 instead of 1000 Hz: 10·lg((1 + 0.4²)/(1 + 0.8²)) at 400 Hz, but for what gain,
    # delay and mechanics make up for.
    added = np.sqrt(wider.std_db**2 - frf.std_db**2)
    ratio = np.abs(_without_path(other) / _without_path(best))
    assert added == pytest.approx(0.5 * np.abs(20 * np.log10(ratio)), abs=1e-9)
    assert 0.1 < added[-1] < 2.0
    assert _undecided(plain, best, []) is plain
    # Where no model explains the lines, another hold may be the right one: half a cycle later.
    left = unexplained(frf, best.solution, 0)
    assert np.all(left.std_deg >= 180.0 * frf.frequency_hz / 1000.0)
    assert left.valid_band_hz[1] == pytest.approx(100.0)


@pytest.mark.long
def test_a_filtered_torque_costs_no_search_with_its_own_path(monkeypatch):
    """6077h behind 1 ms: its lag is no current loop's, and mechanics behind it explain nothing."""
    case = case_of(1000.0, late_steps=0, current_hz=1000.0)
    filtered = tuple(
        replace(r, torque=lfilter([1 - np.exp(-1.0)], [1.0, -np.exp(-1.0)], r.torque))
        for r in records_of(case)
    )
    searched = []
    fit = identification_trials.fit_sampled_model

    def fitted(raw, path, **given):
        if given.get("start") is None:
            searched.append(path)
        return fit(raw, path, **given)

    monkeypatch.setattr(identification_trials, "fit_sampled_model", fitted)
    found = identify_with_path(filtered, SignalPath(1000.0), "torque_mode", hold_known=False)
    assert found.torque_dropped
    assert {path.hold for path in searched} == {"zero", "linear"}
    assert min(path.current_bandwidth_hz for path in searched) > 900.0
    e = errors(found.direct, ONE, 5.0, 250.0)
    assert e.magnitude_db < 0.1
    assert e.phase_deg < 0.5


@pytest.mark.parametrize("late_steps", [0, 40])
def test_both_holds_at_their_cycles_by_one_search_for_the_delay(monkeypatch, late_steps):
    """Without a torque that shows them: the delay of one hold was searched for again with both."""
    case = case_of(1000.0, late_steps=late_steps, current_hz=1000.0)
    records = tuple(replace(r, torque=None) for r in records_of(case))
    begun = []
    grown = model_fit._grown

    def counted(problem, start, max_modes):
        begun.append(float(start[2]))
        return grown(problem, start, max_modes)

    monkeypatch.setattr(model_fit, "_grown", counted)
    path = SignalPath(1000.0, current_bandwidth_hz=1000.0)
    found = Task(records, "torque_mode").of_both_holds(path)
    assert [trial.path.hold for trial in found] == ["zero", "linear"]
    assert found[0].path.command_delay_s == pytest.approx(late_steps * 50e-6)
    assert abs(found[0].fit.delay_s) < 10e-6
    # Delays of half a cycle to three, once; and the mechanics at each path once.
    assert sum(late > 0.0 for late in begun) == (6 if late_steps else 0)
    assert begun.count(0.0) <= 4
