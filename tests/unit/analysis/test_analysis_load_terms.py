"""Machines that need torque torque_of inertia and friction: springs, arms, imbalance, fans.

Torque is worked out from the moves themselves (inverse dynamics), which has no estimator.
"""

import numpy as np
import pytest

from backend.analysis.mechanics.slow_moves.identification_path import MoveLimits, design_moves
from backend.analysis.mechanics.slow_moves.inertia import estimate_inertia

TURN = 2 * np.pi
RATE = 1000.0
MOTOR = 5e-5
COULOMB, VISCOUS = 0.03, 2e-4
WAY = 2.4 * TURN


def moved(inertia, torque_of=lambda angle, speed: 0.0 * angle, noise_nm=0.002, seed=1):
    """Torque and speed of the moves that the tool makes within 3 revolutions and 960 rpm."""
    speed = 960.0 / 60.0 * TURN
    gentle = max(inertia * speed / 0.15, 4 * COULOMB)
    path = design_moves(
        MoveLimits(WAY, speed, min(0.7, COULOMB + gentle / 0.7)),
        inertia,
        RATE,
        friction_nm=COULOMB,
        repetitions=4,
        smoothing_s=0.03,
        dwell_s=0.1,
    )
    velocity, angle = path.velocity_rad_s, path.position_rad
    torque = inertia * path.acceleration_rad_s2 + VISCOUS * velocity
    torque = torque + COULOMB * np.tanh(velocity / 0.05) + torque_of(angle, velocity)
    random = np.random.default_rng(seed)
    return torque + random.normal(0.0, noise_nm, torque.size), velocity


def found(*args, **kwargs):
    return estimate_inertia(*moved(*args, **kwargs), RATE, cutoff_hz=25.0)


def unbalanced(angle, _speed):
    return 0.1 * np.sin(angle + 1.0)


def arm(angle, _speed):
    return 0.2 * np.sin(angle / 50.0 + 1.0)


def spring(angle, _speed):
    return 0.02 * angle


def fan(_angle, speed):
    return 3e-5 * speed * np.abs(speed)


def fan_on_an_arm(angle, speed):
    return arm(angle, speed) + fan(angle, speed)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("ratio", [1, 10])
@pytest.mark.parametrize("noise_nm", [0.002, 0.02])
@pytest.mark.parametrize("torque_of", [unbalanced, arm, spring, fan, fan_on_an_arm])
def test_inertia_and_friction_are_found_beside_it(torque_of, noise_nm, ratio):
    inertia = MOTOR * (1 + ratio)
    result = found(inertia, torque_of, noise_nm)
    assert result.reasons == ()
    assert result.inertia_kgm2.value == pytest.approx(inertia, rel=0.02)
    assert result.inertia_kgm2.low <= inertia <= result.inertia_kgm2.high
    assert result.coulomb_nm.value == pytest.approx(COULOMB, rel=0.10)
    assert result.coulomb_nm.low <= COULOMB <= result.coulomb_nm.high
    if noise_nm < 0.01:
        assert result.viscous_nms.low <= VISCOUS <= result.viscous_nms.high


@pytest.mark.long
def test_what_it_is_and_how_large_is_reported():
    place = found(2 * MOTOR, unbalanced).load_terms
    assert place.place_nm == pytest.approx(0.1, rel=0.05)
    assert place.periods_rad == pytest.approx((TURN,), rel=0.01)
    assert place.fan_nm == 0.0
    blown = found(2 * MOTOR, fan).load_terms
    assert blown.fan_nm == pytest.approx(3e-5 * (960.0 / 60.0 * TURN) ** 2, rel=0.05)
    assert blown.place_nm == 0.0
    straight = found(2 * MOTOR, spring).load_terms
    assert straight.place_nm == pytest.approx(0.5 * 0.02 * WAY * 0.95, rel=0.1)
    assert min(straight.periods_rad) > 0.0


def hose(angle, _speed):
    """Bouc-Wen hysteresis of second order over 0.6 rad, which is neither a play nor Dahl's law."""
    force, state = np.zeros(angle.size), 0.0
    for i, step in enumerate(np.diff(angle), 1):
        state += step / 0.6 * (1.0 - np.sign(step * state) * state**2)
        force[i] = state = float(np.clip(state, -1.0, 1.0))
    return 0.02 * force


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("ratio", [1, 8, 25])
def test_a_hose_that_yields_is_friction_and_no_inertia(ratio):
    inertia = MOTOR * (1 + ratio)
    result = found(inertia, hose)
    assert result.reasons == ()
    assert result.inertia_kgm2.low <= inertia <= result.inertia_kgm2.high
    assert result.inertia_kgm2.value == pytest.approx(inertia, rel=0.005)
    assert result.coulomb_nm.low <= COULOMB + 0.02 <= result.coulomb_nm.high
    assert result.coulomb_nm.value == pytest.approx(COULOMB + 0.02, rel=0.05)
    assert result.load_terms.place_nm == 0.0


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("order", [1, 2])
def test_an_inertia_that_varies_by_the_position_is_neither_friction_nor_place(order):
    def crank(angle, speed):
        """T = dJ·a + dJ'·v²/2 (Lagrange)."""
        phase, share = order * angle + 0.7, 0.15 * MOTOR
        acceleration = np.gradient(speed) * RATE
        return share * (np.sin(phase) * acceleration + 0.5 * order * np.cos(phase) * speed**2)

    result = found(2 * MOTOR, crank)
    assert result.reasons == ()
    assert result.inertia_kgm2.low <= 2 * MOTOR <= result.inertia_kgm2.high
    assert result.inertia_kgm2.value == pytest.approx(2 * MOTOR, rel=0.005)
    assert result.coulomb_nm.low <= COULOMB <= result.coulomb_nm.high
    assert result.load_terms.place_nm == 0.0


@pytest.mark.long
@pytest.mark.parametrize("ratio", [0, 1, 10, 30])
@pytest.mark.parametrize("noise_nm", [0.0005, 0.002, 0.02])
def test_nothing_is_seen_where_nothing_is(ratio, noise_nm):
    for seed in range(5):
        result = found(MOTOR * (1 + ratio), noise_nm=noise_nm, seed=seed)
        assert result.load_terms.place_nm == 0.0
        assert result.load_terms.fan_nm == 0.0


def test_friction_that_depends_on_the_direction_is_none():
    def uneven(_angle, speed):
        return np.where(speed > 0, 0.01, -0.002) * np.abs(np.tanh(speed / 0.05))

    result = found(2 * MOTOR, uneven)
    assert result.load_terms.periods_rad == ()
    assert result.coulomb_nm.value == pytest.approx(COULOMB + 0.006, rel=0.05)
    assert result.gravity_nm.value == pytest.approx(0.004, abs=0.001)


def test_friction_that_drives_is_no_answer():
    def driven(_angle, speed):
        return -0.06 * np.tanh(speed / 0.05)

    result = found(2 * MOTOR, driven)
    assert not result.identifiable
    assert "negative-friction" in result.reasons


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("ratio", [1, 10])
def test_cogging_is_neither_play_nor_the_machine_s(ratio):
    inertia = MOTOR * (1 + ratio)
    result = found(inertia, lambda angle, _speed: 0.03 * np.sin(8 * angle))
    assert result.reasons == ()
    assert result.inertia_kgm2.value == pytest.approx(inertia, rel=0.02)
    assert result.coulomb_nm.value == pytest.approx(COULOMB, rel=0.10)
    assert result.load_terms.place_nm == 0.0


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("ratio", [1, 10])
def test_static_friction_is_no_inertia(ratio):
    def static(_angle, speed):
        return 0.05 * np.exp(-((speed / 2.0) ** 2)) * np.tanh(speed / 0.05)

    inertia = MOTOR * (1 + ratio)
    result = found(inertia, static)
    assert result.reasons == ()
    assert result.inertia_kgm2.value == pytest.approx(inertia, rel=0.02)
    assert result.coulomb_nm.value == pytest.approx(COULOMB, rel=0.10)
    assert result.load_terms.place_nm == result.load_terms.fan_nm == 0.0
