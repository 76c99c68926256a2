"""The mechanics against physics that can be worked out on paper."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.linalg import expm

from drivers.virtual.firmware.axis import VirtualAxis
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.objects.settings import ProtectionSettings
from drivers.virtual.mechanics import (
    EncoderSpec,
    FrictionSpec,
    LoadSpec,
    MechanicsSpec,
    MotorSpec,
    PlaceSpec,
    TravelSpec,
    analytic_response,
    load_mechanics,
)
from drivers.virtual.mechanics.chain import _without_ringing, discretise

MOTOR = MotorSpec(inertia_kgm2=5e-5, rated_torque_nm=1.27, rated_speed_rpm=3000)
FINE = EncoderSpec(counts_per_rev=2**30)
TURN = 2 * math.pi


def spec(**parts: object) -> MechanicsSpec:
    return MechanicsSpec.model_validate({"motor": MOTOR, "encoder": FINE, **parts})


def axis_with_torque(mechanics: MechanicsSpec, torque_nm: float) -> VirtualAxis:
    axis = VirtualAxis(mechanics)
    axis.apply_protections(ProtectionSettings())
    axis.run_torque(torque_nm, math.inf)
    # No speed limit, no loss of torque to the voltage: the mechanics alone are looked at.
    axis.p[k.P_TORQUE_SPEED_LIMIT] = 1e12
    axis.p[k.P_KP_SPEED_1] = 1e6
    axis.p[k.P_POWER_LIMIT_V] = 1e6
    return axis


TWO_LOADS = spec(
    friction=FrictionSpec(viscous_nms=3e-4),
    load=(
        LoadSpec(inertia_kgm2=8e-5, stiffness_nm_per_rad=60.0, damping_nms_per_rad=0.003),
        LoadSpec(inertia_kgm2=2e-5, stiffness_nm_per_rad=900.0, damping_nms_per_rad=0.01),
    ),
)


def test_analytic_response_of_two_inertias_is_the_textbook_formula() -> None:
    j1, j2, stiff, damp = 5e-5, 1e-4, 20.0, 0.002
    mechanics = spec(
        load=(LoadSpec(inertia_kgm2=j2, stiffness_nm_per_rad=stiff, damping_nms_per_rad=damp),)
    )
    f = np.array([10.0, 71.0, 123.0, 400.0])
    s = 2j * np.pi * f
    textbook = (j2 * s**2 + damp * s + stiff) / (
        s * (j1 * j2 * s**2 + (j1 + j2) * damp * s + (j1 + j2) * stiff)
    )
    np.testing.assert_allclose(analytic_response(mechanics, f), textbook, rtol=1e-12)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("mechanics", [spec(friction=FrictionSpec(viscous_nms=1e-3)), TWO_LOADS])
def test_simulated_response_meets_the_analytic_one(mechanics: MechanicsSpec) -> None:
    """Within 0.1 dB and 1° up to 2 kHz, with hold and current loop removed exactly."""
    for wanted_hz in (7.0, 40.0, 130.0, 300.0, 777.0, 1250.0, 2000.0):
        axis = axis_with_torque(mechanics, 0.0)
        current = axis.p[k.P_GEN]
        assert current == k.GEN_TORQUE
        period = round(1 / (wanted_hz * k.STEP_S))
        f_hz = 1 / (period * k.STEP_S)  # a whole number of steps per period
        settle = math.ceil(1.5 / (period * k.STEP_S))
        use = max(1, round(0.1 / (period * k.STEP_S)))
        x = np.zeros((period * use, axis._x.size))
        drive = np.sin(TURN * np.arange(period) / period)
        for turn in range(settle + use):
            for i in range(period):
                axis.s[k.S_T_DEMAND] = axis.p[k.P_T_TARGET] = 1e-3 * drive[i]
                if turn >= settle:
                    x[(turn - settle) * period + i] = axis._x
                axis.run(1)
        carrier = np.exp(-1j * TURN * np.arange(period * use) / period)
        speed = 2 * np.mean(x[:, 1] * carrier)
        torque = 2 * np.mean(x[:, 2] * carrier)
        # Speed and torque are samples of continuous states: their ratio is the plant but for
        # the images that sampling folds back, which the exact sampled model shows.
        ratio = speed / torque / _sampled_ratio(mechanics, f_hz)
        assert abs(20 * math.log10(abs(ratio))) < 0.1, f_hz
        assert abs(math.degrees(np.angle(ratio))) < 1.0, f_hz


def _sampled_ratio(mechanics: MechanicsSpec, f_hz: float) -> complex:
    """Sampled speed over sampled torque for a held command: sum over the aliased images.

    H(jω)·(1 − e^{−jωT})/(jωT) summed over ω + 2πn/T (Shannon), with the analytic plant and the
    first-order current loop at 1 kHz; images beyond n = ±200 carry less than 1e-6.
    """
    n = np.arange(-200, 201)
    omega = TURN * (f_hz + n / k.STEP_S)
    hold = (1 - np.exp(-1j * omega * k.STEP_S)) / (1j * omega * k.STEP_S)
    current = 1 / (1 + 1j * omega / (TURN * 1000.0))
    torque = hold * current
    speed = torque * analytic_response(mechanics, omega / TURN)
    return complex(speed.sum() / torque.sum())


def test_discretisation_repeats_half_steps() -> None:
    """e^{A·2T} = (e^{A·T})²: an exact property no approximation has."""
    once = discretise(TWO_LOADS, TURN * 1000, 50e-6).a[0]
    twice = discretise(TWO_LOADS, TURN * 1000, 100e-6).a[0]
    np.testing.assert_allclose(once @ once, twice, rtol=1e-9, atol=1e-12)
    assert np.allclose(expm(np.zeros((2, 2))), np.eye(2))


def test_free_fall_with_gravity() -> None:
    """θ = −½·(Tg/J)·t²."""
    axis = VirtualAxis(spec(friction=FrictionSpec(gravity_nm=0.1)))
    axis.run(4000)
    expected = -0.5 * 0.1 / 5e-5 * 0.2**2
    assert axis.angle_rad == pytest.approx(expected, rel=1e-4)


def test_coulomb_friction_stops_after_half_v_squared_over_a() -> None:
    axis = VirtualAxis(spec(friction=FrictionSpec(coulomb_nm=0.05)))
    axis._x[1] = 200.0
    axis.run(20000)
    deceleration = 0.05 / 5e-5
    # One step of 50 µs at 200 rad/s is 0.01 rad.
    assert axis.angle_rad == pytest.approx(200.0**2 / (2 * deceleration), abs=0.02)
    assert axis._x[1] == 0.0


def test_viscous_friction_lets_speed_decay_with_j_over_b() -> None:
    axis = VirtualAxis(spec(friction=FrictionSpec(viscous_nms=1e-3)))
    axis._x[1] = 100.0
    axis.run(1000)  # 50 ms, one time constant J/b
    assert axis._x[1] == pytest.approx(100.0 * math.exp(-1.0), rel=1e-9)


def test_sticks_below_breakaway_without_any_chatter() -> None:
    axis = axis_with_torque(spec(friction=FrictionSpec(coulomb_nm=0.05)), 0.049)
    angles = []
    for _ in range(2000):
        axis.run(1)
        angles.append(float(axis._x[0]))
    assert set(angles) == {0.0}


def test_stuck_axis_does_not_creep_under_a_small_oscillating_torque() -> None:
    axis = axis_with_torque(spec(friction=FrictionSpec(coulomb_nm=0.05)), 0.0)
    for step in range(4000):
        axis.p[k.P_T_TARGET] = 0.04 * math.sin(TURN * step / 100)
        axis.run(1)
    assert abs(axis._x[0]) < 1e-9


def test_breaks_away_above_coulomb_torque() -> None:
    """Acceleration is (T − Tc)/J once the current loop has settled."""
    axis = axis_with_torque(spec(friction=FrictionSpec(coulomb_nm=0.05)), 0.06)
    axis.run(400)
    before = float(axis._x[1])
    axis.run(200)
    assert (axis._x[1] - before) / 0.01 == pytest.approx(0.01 / 5e-5, rel=1e-3)


def test_end_stop_holds_against_torque_and_lets_go_backwards() -> None:
    axis = axis_with_torque(spec(travel=TravelSpec(min_rev=-1, max_rev=0.5)), 0.5)
    axis.run(4000)
    assert axis._x[0] == pytest.approx(0.5 * TURN, abs=1e-9)
    assert axis._x[1] == 0.0
    axis.run_torque(-0.5, math.inf)
    axis.run(400)
    assert axis._x[0] < 0.45 * TURN


def test_end_stop_acts_on_the_last_inertia_through_the_coupling() -> None:
    """In rest against the stop, the coupling carries the motor torque: twist = T/k."""
    load = LoadSpec(inertia_kgm2=1e-4, stiffness_nm_per_rad=50, damping_nms_per_rad=0.05)
    axis = axis_with_torque(spec(travel=TravelSpec(max_rev=0.1), load=(load,)), 0.2)
    axis.run(40000)
    assert axis._x[0] - axis._x[3] == pytest.approx(0.1 * TURN, abs=1e-6)
    assert axis._x[3] == pytest.approx(0.2 / 50, rel=1e-3)


def test_backlash_lets_the_motor_move_alone_inside_the_gap() -> None:
    load = LoadSpec(
        inertia_kgm2=1e-4, stiffness_nm_per_rad=500, damping_nms_per_rad=0.01, backlash_rad=0.1
    )
    axis = axis_with_torque(spec(load=(load,)), 0.01)
    axis.run(200)  # 10 ms: ½·(0.01/5e-5)·(0.01 s)² = 0.01 rad, still in the half gap of 0.05
    assert axis._x[4] == 0.0
    assert 0.005 < axis._x[0] < 0.011


def test_backlash_gap_is_carried_through_to_the_load_in_contact() -> None:
    """Accelerating both: twist = half gap + J2·a/k, with a = T/(J1 + J2)."""
    load = LoadSpec(
        inertia_kgm2=1e-4, stiffness_nm_per_rad=50, damping_nms_per_rad=0.1, backlash_rad=0.02
    )
    axis = axis_with_torque(spec(load=(load,)), 0.1)
    axis.run(10000)
    acceleration = 0.1 / 1.5e-4
    assert axis._x[3] == pytest.approx(0.01 + 1e-4 * acceleration / 50, rel=1e-3)


def test_encoder_counts_and_noise() -> None:
    noisy = spec(encoder=EncoderSpec(counts_per_rev=4096, noise_counts=3.0))
    axis = VirtualAxis(noisy)
    counts = []
    for _ in range(4000):
        axis.run(1)
        counts.append(axis.angle_rad / TURN * 4096)
    assert np.allclose(counts, np.round(counts), atol=1e-6)
    # Quantisation by flooring moves the mean by half a count and adds 1/12 to the variance.
    assert np.mean(counts) == pytest.approx(-0.5, abs=0.2)
    assert np.std(counts) == pytest.approx(math.sqrt(9 + 1 / 12), rel=0.05)


def test_same_seed_same_run() -> None:
    noisy = spec(encoder=EncoderSpec(noise_counts=5.0))
    runs = []
    for seed in (7, 7, 8):
        axis = VirtualAxis(noisy, seed)
        axis.run(100)
        runs.append(axis.angle_rad)
    assert runs[0] == runs[1] != runs[2]


def test_mechanics_file(tmp_path) -> None:  # type: ignore[no-untyped-def]
    path = tmp_path / "axis.toml"
    path.write_text(
        "[motor]\ninertia_kgm2=5e-5\nrated_torque_nm=1.27\nrated_speed_rpm=3000\n"
        "[travel]\nmin_rev=-2\nmax_rev=3\n[[load]]\ninertia_kgm2=1e-4\nstiffness_nm_per_rad=20\n"
    )
    mechanics = load_mechanics(path)
    assert mechanics.total_inertia_kgm2 == pytest.approx(1.5e-4)
    assert mechanics.limit_switches_rev == (-1.75, 2.75)
    path.write_text(path.read_text() + "weight=3\n")
    with pytest.raises(ValueError, match="weight"):
        load_mechanics(path)


@pytest.mark.parametrize(("low", "high"), [(1, 2), (-2, -1), (0, 0), (2, -2)])
def test_travel_must_hold_the_start_position(low: float, high: float) -> None:
    with pytest.raises(ValueError, match="start position"):
        TravelSpec(min_rev=low, max_rev=high)


def test_at_most_three_couplings_with_backlash() -> None:
    loose = LoadSpec(inertia_kgm2=1e-5, stiffness_nm_per_rad=100, backlash_rad=0.01)
    with pytest.raises(ValueError, match="three couplings"):
        spec(load=(loose,) * 4)


@pytest.mark.parametrize("stiffness", [1e6, 1e7, 1e9])
@pytest.mark.parametrize("coulomb_nm", [0.0, 0.03])
def test_what_is_meant_to_be_rigid_stays_at_its_end_stop(
    stiffness: float, coulomb_nm: float
) -> None:
    """Undamped couplings far above the steps used to gain energy at the stop without end."""
    load = LoadSpec(inertia_kgm2=1e-4, stiffness_nm_per_rad=stiffness)
    friction = FrictionSpec(viscous_nms=2e-4, coulomb_nm=coulomb_nm)
    mechanics = spec(travel=TravelSpec(min_rev=-1, max_rev=1), friction=friction, load=(load,))
    axis = axis_with_torque(mechanics, 1.27)
    for _ in range(20):
        axis.run(400)
    assert axis.angle_rad == pytest.approx(TURN, abs=0.01)


def test_damping_of_rigid_couplings_does_not_show_in_the_response() -> None:
    """Within 0.1 dB and 1° up to 2 kHz of the chain as it is written."""
    f = np.linspace(50, 2000, 100)
    for ratio in (0.1, 1.0, 10.0):
        inverse = 1 / 5e-5 + 1 / (ratio * 5e-5)
        stiffness = (2 * math.pi * 20_001) ** 2 / inverse
        written = spec(load=(LoadSpec(inertia_kgm2=ratio * 5e-5, stiffness_nm_per_rad=stiffness),))
        run = _without_ringing(written, 50e-6)
        assert run.load[0].damping_nms_per_rad > 0
        change = analytic_response(run, f) / analytic_response(written, f)
        assert np.max(np.abs(20 * np.log10(np.abs(change)))) < 0.1
        assert np.max(np.abs(np.angle(change, deg=True))) < 1.0


def test_a_load_out_of_balance_swings_like_a_pendulum() -> None:
    """Small swings about the lower rest: ω = √(A·k / J), k = 1 for one period to a turn."""
    mechanics = spec(place=PlaceSpec(torque_nm=0.02))
    axis = axis_with_torque(mechanics, 0.0)
    axis._x[0] = 0.02
    crossings, before = [], axis._x[0]
    for step in range(20_000):
        axis.run(1)
        if before > 0.0 >= axis._x[0]:
            crossings.append(step * k.STEP_S)
        before = axis._x[0]
    period = float(np.mean(np.diff(crossings)))
    assert period == pytest.approx(TURN / math.sqrt(0.02 / 5e-5), rel=1e-3)


def test_a_spring_is_a_place_torque_of_a_long_period() -> None:
    """Held still at one revolution it takes 2π · torque / period."""
    mechanics = spec(
        place=PlaceSpec(torque_nm=2.0, period_rev=200.0), travel=TravelSpec(min_rev=-5, max_rev=5)
    )
    axis = axis_with_torque(mechanics, TURN * 2.0 / 200.0)
    axis._x[0] = TURN
    axis.run(200)
    # What the current loop is late by: 1 / (2π · 1 kHz) of the acceleration. Not held: 12 rad/s.
    late = TURN * 2.0 / 200.0 / 5e-5 / (TURN * 1000.0)
    assert axis._x[1] == pytest.approx(-late, rel=0.05)


def test_a_fan_slows_an_axis_down_by_the_square_of_its_speed() -> None:
    """J·dω/dt = −c·ω²: ω(t) = ω₀ / (1 + ω₀·c·t/J)."""
    axis = axis_with_torque(spec(friction=FrictionSpec(fan_nms2=1e-6)), 0.0)
    axis._x[1] = -100.0
    axis.run(20_000)
    assert axis._x[1] == pytest.approx(-100.0 / (1 + 100.0 * 1e-6 * 1.0 / 5e-5), rel=1e-3)


def test_a_place_that_no_motor_can_hold_is_refused() -> None:
    with pytest.raises(ValidationError, match="torque_nm 9 of place is more than this motor holds"):
        spec(place=PlaceSpec(torque_nm=9.0))


def test_an_axis_breaks_away_at_its_static_friction_and_runs_at_its_coulomb_friction() -> None:
    friction = FrictionSpec(coulomb_nm=0.03, static_nm=0.08, stribeck_rad_s=1.0)
    held = axis_with_torque(spec(friction=friction), 0.079)
    held.run(2000)
    assert held._x[1] == 0.0
    axis = axis_with_torque(spec(friction=friction), 0.081)
    axis.run(4000)
    before = axis._x[1]
    axis.run(2000)
    assert (axis._x[1] - before) / 0.1 == pytest.approx((0.081 - 0.03) / 5e-5, rel=1e-6)
