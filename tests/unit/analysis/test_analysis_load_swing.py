"""Loads that swing behind their couplings: inertia and friction in spite of them.

The axes are `drive_sim`'s, which shares nothing with the product; closed forms show the rest.
"""

from dataclasses import replace

import numpy as np
import pytest
from drive_sim import TURN, Drive, Mechanics, simulate

from backend.analysis.mechanics.slow_moves.identification_path import MoveLimits, design_moves
from backend.analysis.mechanics.slow_moves.inertia import (
    _columns,
    _smooth,
    _smoothing_kernel,
    _swinging_variance,
    estimate_inertia,
)
from backend.analysis.mechanics.slow_moves.load_swing import Swing, find_swings, lag_of_load

RATE = 1000.0
RATED_NM = 1.27


def moved(mechanics, drive):
    """Torque and speed of the moves that the tool makes with 4 revolutions and 1500 rpm."""
    speed = 0.8 * 1500 * TURN / 60
    friction = mechanics.coulomb_nm + abs(mechanics.gravity_nm)
    gentle = max(mechanics.total_kgm2 * speed / 0.15, 4 * mechanics.coulomb_nm)
    limits = MoveLimits(3.2 * TURN, speed, min(0.7 * RATED_NM, friction + gentle / 0.7))
    path = design_moves(
        limits,
        mechanics.total_kgm2,
        RATE,
        friction_nm=friction,
        repetitions=4,
        smoothing_s=0.03,
        dwell_s=0.1,
    )
    reference = np.concatenate([path.velocity_rad_s, np.zeros(200)])
    return simulate(mechanics, drive, RATE, velocity=reference)


def soft_axis(seed):
    """The lowest antiresonance at 6 to 30 Hz, friction of up to 8 % of the rated torque."""
    rng = np.random.default_rng(seed)
    motor = float(np.exp(rng.uniform(np.log(2e-5), np.log(2e-4))))
    ratio = float(np.exp(rng.uniform(np.log(1.0), np.log(30.0))))
    count = int(rng.integers(1, 4))
    shares = rng.dirichlet(np.full(count, 1.5))
    scale = float(rng.uniform(6.0, 30.0))
    loads = []
    for place, share in enumerate(shares):
        load = max(float(share) * ratio * motor, 0.05 * motor)
        w = TURN * scale * (1.0 if place == 0 else float(rng.uniform(2.0, 8.0)))
        zeta = float(np.exp(rng.uniform(np.log(0.006), np.log(0.05))))
        loads.append((load, w * w * load, 2 * zeta * w * load))
    mechanics = Mechanics(
        motor,
        tuple(loads),
        float(rng.uniform(5e-5, 5e-4)),
        float(rng.uniform(0.02, 0.1)),
        float(rng.uniform(0.05, 0.3)) if seed % 5 == 4 else 0.0,
    )
    loop = float(np.exp(rng.uniform(np.log(3.0), np.log(15.0))))
    kp = TURN * loop * min(mechanics.total_kgm2, 4 * motor)
    drive = Drive(
        kp_nms=kp,
        ki_nm=kp * TURN * loop / 5,
        seed=seed,
        speed_filter_hz=float(rng.choice([400.0, 1000.0, 2000.0])),
        noise_counts=float(rng.choice([1.0, 5.0, 30.0])),
    )
    return mechanics, drive


def contains(interval, truth):
    return interval.low <= truth <= interval.high


@pytest.mark.long
def test_soft_axes_are_right_or_say_that_they_are_not():
    """Of all that is identified, J is within 2 %, Coulomb friction within 10 % (tuning.md,
    section 3), and the intervals contain the truth of J and both frictions.
    """
    answered = 0
    for seed in range(5):
        mechanics, drive = soft_axis(seed)
        run = moved(mechanics, drive)
        found = estimate_inertia(run.torque, run.velocity, RATE, cutoff_hz=25.0)
        if found.reasons:
            continue
        answered += 1
        where = f"axis {seed}: {found}, {mechanics}, {mechanics.modes()[1]}"
        assert found.inertia_kgm2.value == pytest.approx(mechanics.total_kgm2, rel=0.02), where
        assert found.coulomb_nm.value == pytest.approx(mechanics.coulomb_nm, rel=0.10), where
        assert contains(found.inertia_kgm2, mechanics.total_kgm2), where
        assert contains(found.coulomb_nm, mechanics.coulomb_nm), where
        assert contains(found.viscous_nms, mechanics.viscous_nms), where
    assert answered >= 4


def test_a_swing_is_found_with_its_frequency_and_damping():
    load, hz, zeta = 3e-4, 12.0, 0.02
    w = TURN * hz
    mechanics = Mechanics(1e-4, ((load, w * w * load, 2 * zeta * w * load),), 2e-4, 0.0)
    run = moved(mechanics, Drive(kp_nms=5e-3, ki_nm=0.05))
    # Plain columns will do where there is no Coulomb friction.
    a = np.gradient(run.velocity) * RATE
    others = np.column_stack([a, run.velocity, np.ones(a.size)])
    (found,) = find_swings(others, run.torque, a, np.ones(a.size, np.bool_), RATE, 50.0, most=1)
    assert found.frequency_hz == pytest.approx(hz, rel=0.01)
    assert found.damping == pytest.approx(zeta, rel=0.1)


def test_an_axis_of_one_piece_has_no_swing():
    mechanics = Mechanics(4e-4, (), 2e-4, 0.05)
    run = moved(mechanics, replace(Drive(), kp_nms=1e-2, ki_nm=0.1, noise_counts=30.0))
    kernel = _smoothing_kernel(RATE, 25.0)
    others = _columns(run.velocity, kernel, 5.0, RATE)
    moving = np.abs(others[:, 1]) > 5.0
    torque = _smooth(run.torque, kernel)
    assert find_swings(others, torque, others[:, 0], moving, RATE, 50.0) == ()


def test_a_load_lags_behind_its_motor_as_an_oscillator_does():
    """After a step of the acceleration the load's is 1 − e^(−ζωt)·(cos ω_d·t − ζω/ω_d·sin ω_d·t)
    of it: the closed form of (2ζωs + ω²)/(s² + 2ζωs + ω²)/s.
    """
    hz, zeta = 9.0, 0.05
    w, t = TURN * hz, np.arange(2000) / RATE
    damped = w * np.sqrt(1 - zeta**2)
    # The line from nothing to the step, over one sample, counts as a step in its middle.
    t = t + 0.5 / RATE
    swing = np.cos(damped * t) - zeta * w / damped * np.sin(damped * t)
    lag = lag_of_load(np.ones(t.size), Swing(hz, zeta), RATE)
    assert lag == pytest.approx(-np.exp(-zeta * w * t) * swing, abs=2e-3)


def test_a_residual_that_is_alike_for_long_makes_a_mean_uncertain():
    """The mean of n samples of a moving sum of q has the variance q²σ²/n, q times what samples
    that know nothing of each other would give.
    """
    n, q, block = 40_000, 20, 400
    noise = np.random.default_rng(3).normal(size=n + q - 1)
    residual = np.convolve(noise, np.ones(q), "valid")
    found = _swinging_variance(np.ones((n, 1)), residual, np.ones(n), np.ones(n, np.bool_), block)
    assert found[0] == pytest.approx(q * q / n, rel=0.3)
