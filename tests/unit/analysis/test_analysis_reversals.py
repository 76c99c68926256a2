"""Strong friction with soft modes, images by speed and position, and uncertain modes."""

from dataclasses import replace

import numpy as np
import pytest
from drive_sim import TURN, Drive, Mechanics
from random_axes import ENVELOPE, RATED_NM, Case, errors, facts_of, played

from backend.analysis.mechanics.identification import identification_trials
from backend.analysis.mechanics.identification.fit_problem import CHAIN, Problem, View
from backend.analysis.mechanics.identification.mode_uncertainty import (
    ModeUncertainty,
    mode_uncertainties,
)
from backend.analysis.mechanics.identification.resonance_table import resonance_table
from backend.analysis.mechanics.mechanical_model import MechanicalModel, Mode
from backend.analysis.mechanics.resonance import Resonance
from backend.analysis.response.frf import Frf
from backend.analysis.response.signal_path.sampled_model import LoopModel, seen_response
from backend.analysis.response.signal_path.sampling import SignalPath
from backend.analysis.signals.line_spectra import Record, collect
from backend.tools.tuning.sweep.evaluation import SweepSettings, evaluate

DRIVE = Drive(
    rated_nm=RATED_NM,
    limit_nm=3 * RATED_NM,
    current_hz=1000.0,
    counts_per_rev=2**20,
    speed_filter_hz=1000.0,
    interpolates=True,
    seed=3,
)


def _case(mechanics, loop_hz=0.0):
    kp = TURN * loop_hz * mechanics.total_kgm2
    drive = replace(DRIVE, kp_nms=kp, ki_nm=kp * TURN * loop_hz / 8)
    return Case("own", mechanics, drive, 1000.0, loop_hz)


def _found(case):
    records = played(case)
    assert records is not None
    loop = "speed" if case.loop_hz else "none"
    facts = facts_of(case)
    return evaluate(records, 1000.0, facts, SweepSettings(ENVELOPE), loop, dc=False), records


@pytest.fixture(scope="module")
def rubbed():
    """A soft, hardly damped mode next to a friction of 8 % of the rated torque."""
    mechanics = Mechanics(1.2e-4, ((1e-4, 3.0, 2e-4),), 1e-4, 0.1)
    case = _case(mechanics, 10.0)
    return case, *_found(case)


@pytest.mark.long
def test_strong_friction_hardly_damps_a_soft_mode(rubbed):
    case, found, _ = rubbed
    [(hz, zeta)], _ = case.mechanics.modes()
    assert zeta < 0.01
    [row] = [r for r in found.resonances if r.kind == "resonance"]
    assert row.frequency_hz == pytest.approx(hz, rel=0.01)
    assert row.damping == pytest.approx(zeta, rel=0.15)
    assert row.damping_ci95[0] < zeta < row.damping_ci95[1]
    assert found.frf.coulomb_nm == pytest.approx(0.1, rel=0.03)


def test_where_friction_rules_the_lines_are_right_and_their_band_holds(rubbed):
    case, found, _ = rubbed
    low = errors(found.frf, case.mechanics, 5.0, 150.0)
    assert low.magnitude_db < 0.1
    assert low.phase_deg < 0.6
    assert low.covered >= 0.9


@pytest.mark.long
def test_a_balance_that_leaves_realisations_less_alike_is_not_believed(rubbed, monkeypatch):
    """Directions some cycles too late take the wrong friction, and damp the mode instead."""
    case, found, records = rubbed

    def late(given, *_):
        directions = [np.roll(r.direction(0.0), 6) for r in given]
        return tuple(replace(r, known_direction=d) for r, d in zip(given, directions, strict=True))

    monkeypatch.setattr(identification_trials, "with_balanced_reversals", late)
    settings = SweepSettings(ENVELOPE)
    again = evaluate(records, 1000.0, facts_of(case), settings, "speed", dc=False)
    assert again.frf.coulomb_nm == pytest.approx(0.1, rel=0.05)
    low = errors(again.frf, case.mechanics, 5.0, 150.0)
    assert low.phase_deg < 1.5
    # The speed shows reversals less well, and the band says so.
    assert np.median(again.frf.std_deg) > np.median(found.frf.std_deg)


@pytest.mark.long
def test_speed_and_position_together_leave_no_first_image():
    """What swings beyond the band of a heavy load folds 2° and more onto the speed's lines."""
    case = _case(Mechanics(5e-5, ((1.5e-3, 300.0, 0.05),), 1e-3, 0.06))
    found, _ = _found(case)
    direct = errors(found.direct, case.mechanics, 100.0, 250.0)
    assert direct.phase_deg < 0.7
    assert direct.magnitude_db < 0.15
    above = errors(found.frf, case.mechanics, 250.0, 400.0)
    assert above.phase_deg < 1.0


def test_a_position_that_ends_elsewhere_leaks_onto_no_line():
    """A ramp and a parabola in the position change no line of the velocity calculated from it."""
    _, records = _found(_case(Mechanics(loads=((1e-4, 20.0, 0.002),))))
    sequence, recording = records[0]
    path = SignalPath(1000.0, current_bandwidth_hz=1000.0)
    t = np.arange(recording.position_rad.size) / 1000.0

    def lines(position):
        record = Record(sequence.excitation, recording.velocity_rad_s, None, None, position)
        return collect((record,), path, "torque_mode", position=True).response[0]

    plain = lines(recording.position_rad)
    moved = lines(recording.position_rad + 3.0 * t + 2.0 * t**2)
    assert np.max(np.abs(moved - plain)) < 1e-6 * np.median(np.abs(plain))


def test_a_mode_that_may_be_none_is_not_listed():
    lines = np.arange(5.0, 400.0, 1.5)
    modes = (Mode(20.0, 0.03, 4e3, 0.0), Mode(120.0, 0.02, 2e3, 0.0))
    model = MechanicalModel(5e3, 0.1, modes)
    unsure, sure = ModeUncertainty(0.02, 0.5, 0.4), ModeUncertainty(0.001, 0.1, 0.05)
    rows = resonance_table(model, lines, 400.0, (unsure, sure))
    [row] = [r for r in rows if r.kind == "resonance"]
    assert isinstance(row, Resonance)
    assert row.frequency_hz == 120.0
    # 1.96 deviations to either side.
    assert row.damping_ci95 == pytest.approx((0.02 * (1 - 0.196), 0.02 * (1 + 0.196)))
    assert row.frequency_ci95_hz == pytest.approx(
        (120.0 * np.exp(-0.00196), 120.0 * np.exp(0.00196))
    )


@pytest.mark.parametrize("damping_nms", [2e-4, 2e-3])
def test_what_friction_adds_to_a_mode_is_the_same_however_it_is_damped(damping_nms):
    """Two inertias: a viscous δ at the motor adds δ·φ²/2ω, φ² = J2 / J1·(J1 + J2)."""
    inertia, stiffness, more = 1e-4, 3.0, 1e-4
    x = np.array([np.log(inertia), np.log(1e-3), 0.0, 0.0, np.log(2000.0),
                  np.log(inertia), np.log(stiffness), np.log(damping_nms)])  # fmt: skip
    lines, path = np.arange(5.0, 100.0, 1.5), SignalPath(1000.0)
    model = CHAIN.model(x)
    none = np.zeros(lines.size)
    seen = Frf(lines, seen_response(lines, model, 0.0, path, LoopModel()), none, none, none + 1.0,
               none, none, 1000.0, (5.0, 400.0), 4, 0)  # fmt: skip
    view = View.of(seen, none == 0.0, path, LoopModel(), 0.01, integrated=False, second=False)
    problem = Problem((view,), 1e-3, CHAIN, free_filter=False)
    taken = -more * model.response(lines)
    [uncertainty] = mode_uncertainties(problem, x, np.zeros((8, 8)), [taken], friction_seen=True)
    added = np.sqrt(uncertainty.damping**2 - 0.03**2) * model.modes[0].damping
    w = np.sqrt(stiffness * 2.0 / inertia)
    assert added == pytest.approx(more * 0.5 / inertia / (2.0 * w), rel=0.03)


def test_a_damping_that_is_not_known_to_half_of_itself_may_be_none():
    assert ModeUncertainty(0.0, 0.1, 0.0).damping_interval(0.02, 1.96) == pytest.approx(
        (0.01608, 0.02392)
    )
    low, high = ModeUncertainty(0.0, 0.6, 0.0).damping_interval(0.02, 1.96)
    assert low == 0.0
    assert high == pytest.approx(0.04352)


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 2])
def test_a_motor_alone_has_no_resonance(seed):
    case = _case(Mechanics(5e-5, (), 2e-4, 0.03), 10.0)
    found, _ = _found(replace(case, drive=replace(case.drive, seed=seed)))
    assert found.resonances == ()
