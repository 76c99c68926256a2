"""Designs against the closed loop they predict, simulated and by python-control."""

from dataclasses import replace
from functools import cache

import control
import numpy as np
import pytest
from drive_sim import TURN, Drive, Mechanics, simulate
from measured_axes import COMPLIANT, RIGID, STIFF, measure

from backend.analysis.loop.design import design
from backend.analysis.loop.loop_goals import goals_for
from backend.analysis.loop.loop_structure import DriveLoops, step_of_closed_loop
from backend.analysis.loop.margins import margins
from backend.analysis.loop.measured_plant import MeasuredPlant, measured_plant
from backend.analysis.loop.notch import coefficients_response, encode_coefficients
from backend.analysis.mechanics.identification.identify import identify_mechanics
from backend.analysis.mechanics.mechanical_model import MechanicalModel, Mode

LOOPS = DriveLoops(1000.0, 50e-6)
#: Load-side resonance near 300 Hz, inertia ratio 6, lightly damped.
SHARP = Mechanics(5e-5, ((3e-4, 150.0, 0.004),), 2e-4, 0.02)


def mms7(notch, f):
    return coefficients_response(encode_coefficients(notch, 50e-6), f, 50e-6)


@cache
def plant_of(mechanics):
    m = measure(mechanics, 4000.0)
    found = identify_mechanics(m.records, m.path, m.quantity)
    return measured_plant(found.corrected, found.fit.model)


@cache
def designed(mechanics):
    return design(
        plant_of(mechanics), mechanics.total_kgm2, LOOPS, "medium", slots=4, notch_response=mms7
    )


def true_loop(mechanics, candidate, f):
    s = 2j * np.pi * f
    g = candidate.gains
    loop = g.speed_nms * (1 + TURN * g.integral_hz / s) / (1 + s / (TURN * 1000.0))
    loop = loop * np.exp(-s * 50e-6) * mechanics.response(f)
    for notch in candidate.notches:
        loop = loop * mms7(notch, f)
    return loop


F = np.unique(np.concatenate([np.geomspace(1.0, 6000.0, 3000), np.linspace(60, 600, 3000)]))


@pytest.mark.long
@pytest.mark.parametrize("mechanics", [RIGID, STIFF, COMPLIANT, SHARP], ids=range(4))
def test_promises_hold_on_the_true_axis(mechanics):
    table = designed(mechanics)
    marked = {mark: c for c in table for mark in c.marks}
    assert set(marked) == {"robust", "balanced", "fast"}
    for mark, c in marked.items():
        truth = margins(F, true_loop(mechanics, c, F))
        assert truth.stable
        goals = goals_for("medium", mark)
        assert truth.phase_margin_deg >= goals.phase_margin_deg - 1.0
        assert truth.ms <= goals.ms * 1.02
        assert truth.gain_margin_db is None or truth.gain_margin_db >= goals.gain_margin_db - 0.3
        assert c.nominal.phase_margin_deg == pytest.approx(truth.phase_margin_deg, abs=2.0)
        assert c.nominal.crossover_hz == pytest.approx(truth.crossover_hz, rel=0.03)
    speeds = [marked[m].gains.speed_bandwidth_hz for m in ("robust", "balanced", "fast")]
    assert speeds == sorted(speeds)


def test_goals_hold_for_shifted_modes():
    c = next(c for c in designed(SHARP) if "balanced" in c.marks)
    goals = goals_for("medium", "balanced")
    for factor in (0.95, 1.05):
        j, k, d = SHARP.loads[0]
        moved = Mechanics(SHARP.motor_kgm2, ((j, k * factor**2, d),), SHARP.viscous_nms)
        truth = margins(F, true_loop(moved, c, F))
        assert truth.stable
        assert truth.phase_margin_deg >= goals.phase_margin_deg - 2.0
        assert truth.ms <= goals.ms * 1.05


def test_notches_raise_the_bandwidth():
    table = designed(SHARP)
    fast = next(c for c in table if "fast" in c.marks)
    bare = max((c for c in table if not c.notches), key=lambda c: c.gains.speed_bandwidth_hz)
    assert fast.notches
    assert fast.gains.speed_bandwidth_hz > 2.0 * bare.gains.speed_bandwidth_hz
    assert fast.phase_cost_deg != 0


def test_predicted_step_is_the_simulated_one():
    mechanics = Mechanics(5e-5, (), 2e-4, 0.0)
    table = designed(mechanics)
    c = next(c for c in table if "balanced" in c.marks)
    drive = Drive(
        kp_nms=c.gains.speed_nms,
        ki_nm=c.gains.speed_nms * TURN * c.gains.integral_hz,
        noise_counts=0.0,
    )
    rate = 20_000.0
    target = np.concatenate([np.zeros(10), np.ones(4000)])
    run = simulate(mechanics, drive, rate, velocity=target)
    overshoot = 100 * (run.velocity.max() - 1.0)
    assert c.overshoot_percent == pytest.approx(overshoot, abs=2.0)


def test_step_from_a_frequency_response_against_control():
    system = control.tf([(TURN * 30) ** 2], [1, 2 * 0.4 * TURN * 30, (TURN * 30) ** 2])
    f = np.geomspace(0.5, 3000.0, 1500)
    time, value = step_of_closed_loop(f, system(2j * np.pi * f))
    _, expected = control.step_response(system, time)
    early = time < 0.4
    assert np.max(np.abs(value[early] - expected[early])) < 0.01


def test_a_drive_limit_on_the_bandwidth_is_kept():
    plant = plant_of(RIGID)
    limited = DriveLoops(1000.0, 50e-6, highest_speed_bandwidth_hz=120.0)
    table = design(plant, RIGID.total_kgm2, limited, "stiff", slots=0)
    assert max(c.gains.speed_bandwidth_hz for c in table) == pytest.approx(120.0)


def test_notches_that_the_drive_cannot_make_are_left_out():
    def never(notch, f):
        raise ValueError("no")

    plant = plant_of(SHARP)
    table = design(plant, SHARP.total_kgm2, LOOPS, "medium", slots=4, notch_response=never)
    assert table
    assert not any(c.notches for c in table)


def test_a_variant_of_the_mechanics_keeps_the_goals_too():
    """An axis with backlash: within the gap the motor is alone, here a third of the whole."""
    third = Mechanics(RIGID.total_kgm2 / 3, (), RIGID.viscous_nms)
    alone = MechanicalModel(3.0 / RIGID.total_kgm2, 0.0)
    plant = replace(plant_of(RIGID), variants=(alone,))
    table = design(plant, RIGID.total_kgm2, LOOPS, "compliant", slots=0)
    for c in table:
        goals = goals_for("compliant", c.marks[0])
        for mechanics in (RIGID, third):
            truth = margins(F, true_loop(mechanics, c, F))
            assert truth.stable
            assert truth.phase_margin_deg >= goals.phase_margin_deg
            assert truth.ms <= goals.ms
    # The motor alone answers three times as much, so up to a third of the gain is left.
    free = design(plant_of(RIGID), RIGID.total_kgm2, LOOPS, "compliant", slots=0)
    ratio = free[0].gains.speed_bandwidth_hz / table[0].gains.speed_bandwidth_hz
    assert 2.0 < ratio < 3.1


def test_a_mode_that_no_line_shows_may_lie_anywhere_near():
    """Above the measured band a mode is shifted by four times as much as within it."""
    model = MechanicalModel(1e4, 0.0, (Mode(1000.0, 0.02, 1e4, 0.0),))
    f = np.array([100.0, 1000.0 * 1.05**4])
    flat = np.ones(2, dtype=complex)
    moved = MeasuredPlant(f, flat, model, 400.0).response(1.05)
    assert moved[1] == pytest.approx(
        MeasuredPlant(f * [1.0, 1.05**-4], flat, model, 4000.0).response()[1], rel=0.25
    )
    # 1.05⁴ = 1.2155: the peak itself is there now, 1/(2ζ) = 25 instead of 1/(1.1576² - 1) = 2.9.
    assert abs(moved[1]) > 4 * abs(MeasuredPlant(f, flat, model, 4000.0).response(1.05)[1])
