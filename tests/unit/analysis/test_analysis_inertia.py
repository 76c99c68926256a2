"""Inertia and friction against simulated axes (tuning.md, section 3)."""

from dataclasses import replace

import numpy as np
import pytest
from drive_sim import TURN, Drive, Mechanics, simulate

from backend.analysis.mechanics.slow_moves.identification_path import MoveLimits, design_moves
from backend.analysis.mechanics.slow_moves.inertia import estimate_inertia

MOTOR = 5e-5


def moved(mechanics, rate=1000.0, travel=4 * TURN, torque=1.27, seed=1, guess=0.8, drive=None):
    limits = MoveLimits(travel, 200.0, torque)
    path = design_moves(limits, guess * mechanics.total_kgm2, rate, friction_nm=0.05)
    kp = TURN * 15.0 * mechanics.total_kgm2
    drive = drive or Drive()
    drive = replace(drive, kp_nms=kp, ki_nm=kp * TURN * 2, position_gain=20.0, seed=seed)
    return path, simulate(
        mechanics, drive, rate, position=path.position_rad, velocity=path.velocity_rad_s
    )


def axis(ratio, **kwargs):
    loads = ((MOTOR * ratio, 60.0 + 20 * ratio, 0.002 + 0.001 * ratio),) if ratio else ()
    return Mechanics(MOTOR, loads, 2e-4, 0.05, **kwargs)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("rate", [1000.0, 4000.0])
@pytest.mark.parametrize("ratio", [0, 1, 5, 15, 30, 60])
def test_inertia_and_friction_within_the_required_accuracy(ratio, rate):
    mechanics = axis(ratio, gravity_nm=0.1 if ratio == 5 else 0.0)
    _, run = moved(mechanics, rate)
    found = estimate_inertia(run.torque, run.velocity, rate, motor_inertia_kgm2=MOTOR)
    assert found.reasons == ()
    assert found.inertia_kgm2.value == pytest.approx(mechanics.total_kgm2, rel=0.02)
    assert found.inertia_kgm2.low <= mechanics.total_kgm2 <= found.inertia_kgm2.high
    assert found.coulomb_nm.value == pytest.approx(0.05, rel=0.10)
    assert found.coulomb_nm.low <= 0.05 <= found.coulomb_nm.high
    assert found.gravity_nm.value == pytest.approx(mechanics.gravity_nm, abs=0.005)
    assert found.load_ratio == pytest.approx(ratio, rel=0.03, abs=0.03)
    assert found.r2 > 0.99


@pytest.mark.parametrize("travel", [0.5, 3.0, 60.0])
def test_moves_stay_in_their_envelope_and_come_back(travel):
    limits = MoveLimits(travel, 100.0, 1.0)
    path = design_moves(limits, 2e-4, 1000.0)
    assert path.position_rad.max() <= travel
    assert path.position_rad.min() >= -0.01 * travel
    assert np.abs(path.velocity_rad_s).max() <= 100.0
    assert np.abs(path.acceleration_rad_s2).max() * 2e-4 <= 1.0
    assert path.position_rad[-1] == pytest.approx(0.0, abs=1e-3 * travel)
    assert abs(path.velocity_rad_s[0]) < 1.0
    with pytest.raises(ValueError, match="do not exceed"):
        design_moves(limits, 2e-4, 1000.0, friction_nm=1.0)


def test_outliers_and_gaps_do_not_matter():
    mechanics = axis(5)
    _, run = moved(mechanics)
    torque = run.torque.copy()
    torque[::97] += 3.0
    valid = np.ones(torque.size, dtype=bool)
    valid[300:320] = False
    torque[300:320] = 1e3
    found = estimate_inertia(torque, run.velocity, 1000.0, valid=valid)
    assert found.inertia_kgm2.value == pytest.approx(mechanics.total_kgm2, rel=0.05)


def reasons(*args, **kwargs):
    found = estimate_inertia(*args, **kwargs)
    assert not found.identifiable
    return found.reasons


@pytest.mark.long
def test_wrong_situations_are_named():
    mechanics = axis(5)
    path, run = moved(mechanics)
    assert "torque-opposes-acceleration" in reasons(-run.torque, run.velocity, 1000.0)
    assert "too-few-samples" in reasons(run.torque, 0 * run.velocity, 1000.0)
    one_way = np.abs(run.velocity)
    assert "one-direction" in reasons(run.torque, one_way, 1000.0)
    assert "at-limit" in reasons(run.torque, run.velocity, 1000.0, torque_limit_nm=0.3)
    assert "below-motor-inertia" in reasons(
        run.torque, run.velocity, 1000.0, motor_inertia_kgm2=1e-3
    )
    noisy = run.torque + np.random.default_rng(1).normal(0, 30.0, run.torque.size)
    assert "too-little-acceleration" in reasons(noisy, run.velocity, 1000.0)
    with pytest.raises(ValueError, match="too few for a filter"):
        estimate_inertia(run.torque[:50], run.velocity[:50], 1000.0)
    assert path.velocity_rad_s.size == run.velocity.size


def test_steady_speed_supports_no_inertia():
    t = np.arange(4000) / 1000.0
    velocity = np.where(t < 2.0, 50.0, -50.0) + np.random.default_rng(0).normal(0, 0.1, t.size)
    torque = 0.05 * np.sign(velocity) + np.random.default_rng(1).normal(0, 0.02, t.size)
    keep = np.abs(t - 2.0) > 0.2
    found = reasons(torque, velocity, 1000.0, valid=keep)
    assert "too-little-acceleration" in found


def test_knocks_of_backlash_are_noticed():
    mechanics = axis(5)
    _, run = moved(mechanics)
    torque = run.torque.copy()
    changes = np.flatnonzero(np.diff(np.sign(torque)) != 0)
    for c in changes[:: max(1, changes.size // 12)]:
        torque[c + 5 : c + 30] += 1.5 * np.sign(torque[c + 1])
    assert "backlash" in reasons(torque, run.velocity, 1000.0)
