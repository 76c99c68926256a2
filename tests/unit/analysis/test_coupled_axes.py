"""2×2 response, modes and joint stability against a gantry whose equations are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from backend.analysis.coupled.excitation import SIGNS, orthogonal_multisines
from backend.analysis.coupled.modes import _Fit, common_and_differential, find_modes
from backend.analysis.coupled.response import (
    Controllers,
    CoupledResponse,
    PairRecord,
    estimate,
)
from backend.analysis.coupled.stability import (
    coupling,
    design,
    eigenloci,
    interaction,
    is_stable,
    joint_margins,
    shows_coupling,
)
from backend.analysis.signals.excitation import choose_lines
from tests.unit.analysis.gantry_plant import Gantry

RATE = 1000.0
N = 1000
GAIN, INTEGRAL_HZ = 0.02, 3.0
LINES = choose_lines(4.0, 250.0, 1.0, count=70)


def controllers(f, gain=(GAIN, GAIN), delay_s=0.0):
    s = 2j * np.pi * f
    pi = 1.0 + 2 * np.pi * INTEGRAL_HZ / s
    return np.stack([g * pi * np.exp(-s * delay_s) for g in gain], axis=1)


def records(
    plant, rng, *, noise=(2e-3, 5e-4), periods=8, realisations=2, peak=2.0, gain=(GAIN, GAIN),
    cubic=0.0, lines=LINES,
):  # fmt: skip
    """Both axes within their loops, in the steady state; noise of speed (fed back) and torque."""
    made = orthogonal_multisines(
        sample_rate_hz=RATE,
        period_samples=N,
        lines=lines,
        periods=periods + 1,
        transient_periods=1,
        realisations=realisations,
        ramp_samples=0,
    )
    found = []
    size = N * (periods + 1)
    f = np.fft.rfftfreq(size, 1 / RATE)
    g = np.zeros((f.size, 2, 2), complex)
    g[1:] = plant.response(f[1:])
    c = np.zeros((f.size, 2), complex)
    c[1:] = controllers(f[1:], gain)
    loop = g * c[:, None, :]
    s = np.linalg.inv(np.eye(2) + loop)
    for each in made:
        sent = peak * np.outer(each.signs, each.excitation.samples)
        r = np.fft.rfft(sent).T
        nu = np.fft.rfft(noise[1] * rng.standard_normal((2, size))).T
        ny = np.fft.rfft(noise[0] * rng.standard_normal((2, size))).T
        # y = G (u + nu), u = C (r - y - ny)
        drive = np.einsum("kij,kj->ki", loop, r - ny) + np.einsum("kij,kj->ki", g, nu)
        y = np.einsum("kij,kj->ki", s, drive)
        u = c * (r - y - ny)
        speed = np.fft.irfft((y + ny).T, size)
        torque = np.fft.irfft(u.T, size)
        if cubic:
            speed = speed + cubic * speed**3
        found.append(PairRecord(each.excitation, sent, torque, speed))
    return tuple(found)


class Apart:
    """Two motors with a load each, and nothing between them."""

    def __init__(self, plant):
        self._plant = plant

    def response(self, f):
        return self._plant.response(f) * np.eye(2)


def exact(plant, f=None):
    f = LINES.astype(float) if f is None else f
    n = f.size
    return CoupledResponse(
        f, plant.response(f), np.zeros((n, 4, 4), complex), 10**6, np.ones((n, 2, 2)), np.ones(n),
        1, 0,
    )  # fmt: skip


def test_two_machines_show_no_coupling_and_one_does_through_any_noise():
    plant = Gantry()
    for seed in range(5):
        found = estimate(records(plant, np.random.default_rng(seed)))
        ratio, deviation = coupling(found)
        assert shows_coupling(ratio, found.spread * deviation)
    apart = Apart(plant)
    for seed in range(20):
        found = estimate(records(apart, np.random.default_rng(seed)))
        ratio, deviation = coupling(found)
        assert not shows_coupling(ratio, found.spread * deviation), seed


def test_both_experiments_excite_every_line_at_full_amplitude_and_are_orthogonal():
    made = orthogonal_multisines(
        sample_rate_hz=RATE,
        period_samples=N,
        lines=LINES,
        periods=3,
        transient_periods=1,
        realisations=2,
    )
    assert [each.signs for each in made] == [*SIGNS, *SIGNS]
    signs = np.array(SIGNS)
    assert np.array_equal(signs.T @ signs, 2 * np.eye(2))
    assert np.array_equal(made[0].excitation.samples, made[1].excitation.samples)
    assert not np.allclose(made[0].excitation.one_period, made[2].excitation.one_period)
    # A speed: its integral ends where it began.
    assert abs(np.sum(made[0].excitation.samples)) < 1e-9


@pytest.mark.parametrize("off_centre", [0.0, 0.3])
def test_without_noise_the_response_is_that_of_the_equations_of_motion(off_centre):
    plant = Gantry(off_centre=off_centre)
    found = estimate(records(plant, np.random.default_rng(1), noise=(0.0, 0.0)))
    truth = plant.response(found.frequency_hz)
    assert np.max(np.abs(found.response - truth) / np.abs(truth)) < 1e-6


@pytest.mark.long
def test_torques_that_the_loops_make_of_noise_do_not_bias_the_response():
    """Y/U of one axis alone comes to the inverse of the controller where noise is large."""
    plant = Gantry()
    rng = np.random.default_rng(2)
    mean = np.mean(
        [estimate(records(plant, rng, noise=(0.05, 0.0))).response for _ in range(40)], axis=0
    )
    truth = plant.response(LINES.astype(float))
    size = np.linalg.norm(truth, axis=(1, 2))
    assert np.median(np.linalg.norm(mean - truth, axis=(1, 2)) / size) < 0.02


@pytest.mark.long
@pytest.mark.parametrize("noise", [(2e-3, 5e-4), (1e-2, 5e-3)])
def test_intervals_of_the_entries_hold_the_truth_in_95_of_100_draws(noise):
    plant, rng = Gantry(), np.random.default_rng(3)
    inside = []
    for _ in range(120):
        found = estimate(records(plant, rng, noise=noise))
        off = found.response - plant.response(found.frequency_hz)
        half = found.spread * found.std
        inside.append([np.abs(off.real) <= half, np.abs(off.imag) <= half])
    covered = np.mean(inside, axis=(0, 1, 2))
    assert np.all(covered > 0.935), covered
    # Not by being wide: distortion that is none adds a little.
    assert np.all(covered < 0.985), covered


def test_distortion_that_repeats_with_each_period_widens_the_intervals():
    plant, rng = Gantry(), np.random.default_rng(4)
    plain = estimate(records(plant, rng, realisations=4))
    bent = estimate(records(plant, rng, realisations=4, cubic=0.05))
    assert np.median(plain.distortion) < 1.3
    assert np.median(bent.distortion) > 5.0


def test_images_of_the_setpoints_and_filters_of_the_speed_are_removed():
    """What is sampled of the torque: its own line, and what each loop makes of the image."""
    plant, f = Gantry(), LINES.astype(float)
    g = plant.response(f)
    share = (f / (RATE - f)) ** 2
    at_line, at_image = controllers(f), controllers(RATE - f)
    r = np.array([[1.0, 1.0], [1.0, -1.0]])
    u = np.linalg.inv(np.eye(2) + at_line[:, :, None] * g) @ (at_line[:, :, None] * r)
    y = g @ u
    sampled = u + share[:, None, None] * at_image.conj()[:, :, None] * r
    filters = 1.0 / (1.0 + 1j * f / 500.0)[:, None] * np.ones(2)
    seen = replace(exact(plant), response=y @ np.linalg.inv(sampled))
    assert np.max(np.abs(seen.response / g - 1.0)) > 0.05
    nothing = np.zeros(f.size)
    plain = seen.without_images(share, nothing, Controllers(at_line, at_image))
    assert np.allclose(plain.response, g, rtol=1e-9)
    # Images that were not subtracted stay within the intervals, whatever their phase.
    for turn in np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 7)):
        further = sampled + 0.1 * turn * share[:, None, None] * at_image.conj()[:, :, None] * r
        more = replace(exact(plant), response=y @ np.linalg.inv(further))
        held = more.without_images(share, 0.1 * share, Controllers(at_line, at_image))
        off = np.abs((held.response - g).real)
        assert np.all(off <= 1.05 * np.sqrt(2.0) * held.spread * held.std)
        assert np.max(off / (held.spread * held.std)) > 0.3
    unknown = seen.without_images(share, nothing, None)
    assert np.allclose(unknown.response, seen.response)
    half = unknown.spread * unknown.std[:, 0, 0] / np.abs(seen.response[:, 0, 0])
    assert half == pytest.approx(share)
    late = replace(exact(plant), response=filters[:, :, None] * g).without_filter(filters)
    assert np.allclose(late.response, g)


def test_a_period_with_a_gap_is_left_out():
    plant, rng = Gantry(), np.random.default_rng(5)
    whole = records(plant, rng)
    valid = np.ones(whole[0].speed.shape[1], bool)
    valid[3 * N + 17] = False
    broken = whole[0].speed.copy()
    broken[:, 3 * N : 3 * N + 200] = 99.0
    found = estimate((replace(whole[0], speed=broken, valid=valid), *whole[1:]))
    assert (found.periods_used, found.periods_dropped) == (31, 1)
    truth = plant.response(found.frequency_hz)
    assert np.median(np.abs(found.response - truth) / np.abs(truth)) < 0.05
    valid[N:] = False
    with pytest.raises(ValueError, match="too few periods"):
        estimate((replace(whole[0], valid=valid), *whole[1:]))


def test_common_and_differential_motion_of_a_symmetric_gantry_are_apart():
    plant = Gantry(off_centre=0.0)
    found = common_and_differential(exact(plant))
    off = np.abs(found.response[:, [0, 1], [1, 0]])
    assert np.max(off) < 1e-9 * np.max(np.abs(found.response))
    # At 4 Hz all turns as one body: 1/(s J + b) of both motors and the beam.
    s = 2j * np.pi * found.frequency_hz[0]
    rigid = 1.0 / (s * (1e-4 + 2e-4) + 4e-4)
    assert abs(found.response[0, 0, 0] / rigid - 1.0) < 0.02


@pytest.mark.long
@pytest.mark.parametrize(
    "plant",
    [
        Gantry(),
        Gantry(off_centre=0.0),
        Gantry(off_centre=-0.35, joints=(20.0, 32.0)),
        Gantry(yaw_stiffness=12.0, yaw_damping=8e-3, motors=(5e-5, 8e-5)),
    ],
)
def test_modes_of_a_gantry_are_found_with_their_kind(plant):
    found = find_modes(estimate(records(plant, np.random.default_rng(6))))
    truth = [mode for mode in plant.modes() if 4.0 < mode[0] < 230.0]
    assert len(found.modes) == len(truth)
    for mode, (frequency_hz, damping, share) in zip(found.modes, truth, strict=True):
        assert mode.frequency_hz == pytest.approx(frequency_hz, rel=0.01)
        assert mode.damping == pytest.approx(damping, rel=0.15)
        assert mode.kind == ("skew" if share > 0.5 else "common")
        assert mode.skew_share == pytest.approx(share, abs=0.08)
    total = sum(plant.motors) + plant.beam
    assert found.inertia_kgm2 == pytest.approx(total, rel=0.02)


def static_stiffness(plant):
    """Half the difference of the torques over the difference of the positions."""
    _, _, k = plant.matrices()
    compliance = np.linalg.pinv(k)[:2, :2]
    difference = np.array([1.0, -1.0])
    return 1.0 / float(difference @ compliance @ difference)


@pytest.mark.long
def test_intervals_of_modes_inertia_and_skew_stiffness_hold_the_truth_in_95_of_100_draws():
    plant, rng = Gantry(), np.random.default_rng(7)
    truth = [mode for mode in plant.modes() if 4.0 < mode[0] < 230.0]
    total, stiffness = sum(plant.motors) + plant.beam, static_stiffness(plant)
    # Searched once, so that a draw takes a tenth of a second; each is fitted again from there.
    poles = [0.0, *np.log((0.5, 10.0))]
    for frequency_hz, damping, _ in truth:
        poles += [np.log(frequency_hz), np.log(damping)]
    inside = []
    for _ in range(100):
        fit = _Fit.of(estimate(records(plant, rng, noise=(5e-3, 2e-3))))
        found = fit.described(fit.solved(np.array(poles)))
        assert len(found.modes) == len(truth)
        for mode, (frequency_hz, damping, _) in zip(found.modes, truth, strict=True):
            low, high = mode.frequency_ci95_hz
            inside.append(low <= frequency_hz <= high)
            low, high = mode.damping_ci95
            inside.append(low <= damping <= high)
        low, high = found.inertia_ci95_kgm2
        inside.append(low <= total <= high)
        assert found.skew_stiffness_ci95 is not None
        low, high = found.skew_stiffness_ci95
        inside.append(low <= stiffness <= high)
    rows = np.array(inside).reshape(100, -1)
    covered = rows.mean(axis=0)
    assert covered.mean() > 0.94, covered
    assert np.all(covered >= 0.9), covered


@pytest.mark.long
def test_a_beam_that_turns_freely_has_no_skew_stiffness():
    plant = Gantry(yaw_stiffness=0.0, yaw_damping=0.0)
    found = find_modes(estimate(records(plant, np.random.default_rng(8))))
    assert found.skew_stiffness_nm_per_rad is None


def test_coupling_is_that_of_the_equations():
    plant = Gantry(off_centre=0.0)
    ratio, _ = coupling(exact(plant))
    # At 4 Hz, below the skew mode, both axes are nearly one body.
    assert ratio[0] > 0.9
    apart = exact(Gantry(joints=(1e-3, 1e-3), joint_damping=1e-6))
    assert np.max(coupling(apart)[0]) < 1e-3
    assert np.allclose(interaction(apart.response), 1.0, atol=1e-5)
    g = plant.response(LINES.astype(float))
    gain = g * np.transpose(np.linalg.inv(g), (0, 2, 1))
    assert np.allclose(interaction(g), np.abs(gain[:, 0, 0]))


@pytest.mark.parametrize("factor", [0.5, 1.0, 2.0, 4.0, 8.0, 16.0])
@pytest.mark.parametrize("off_centre", [0.0, 0.35])
def test_the_joint_criterion_agrees_with_the_poles(factor, off_centre):
    """With a delay the pair becomes unstable; the delay is a Padé approximation of order one."""
    plant = Gantry(off_centre=off_centre)
    f = np.geomspace(0.5, 2000.0, 6000)
    g = plant.response(f)
    t = 1.2e-3
    s = 2j * np.pi * f
    pade = (1 - s * t / 2) / (1 + s * t / 2)
    c = controllers(f, (factor * GAIN, factor * GAIN)) * pade[:, None]
    # The same by poles: states of the plant, of both delays and of both integrals.
    a = plant.state()
    mass, _, _ = plant.matrices()
    b = np.zeros((8, 2))
    b[4:] = np.linalg.inv(mass)[:, :2]
    speeds = np.zeros((2, 8))
    speeds[0, 4] = speeds[1, 5] = 1.0
    k = factor * GAIN
    ki = k * 2 * np.pi * INTEGRAL_HZ
    # Delay: x' = -2/t x + v, out = 4/t x - v; v = -k y + z, z' = -ki y
    whole = np.zeros((12, 12))
    whole[:8, :8] = a + b @ (k * speeds)
    whole[:8, 8:10] = 4 / t * b
    whole[:8, 10:] = -b
    whole[8:10, :8] = -k * speeds
    whole[8:10, 8:10] = -2 / t * np.eye(2)
    whole[8:10, 10:] = np.eye(2)
    whole[10:, :8] = -ki * speeds
    stable = np.max(np.linalg.eigvals(whole).real) < 1e-6
    assert is_stable(g * c[:, None, :]) is bool(stable)


def test_loops_that_are_sound_alone_may_not_be_for_the_pair():
    """Two stiffly joined axes: each alone sees the whole machine, both together twice its gain."""
    plant = Gantry(
        off_centre=0.0, joints=(5e3, 5e3), joint_damping=0.1, yaw_stiffness=5e3, yaw_damping=0.1
    )
    f = np.geomspace(0.5, 1500.0, 4000)
    total = sum(plant.motors) + plant.beam
    k = 2 * np.pi * 40.0 * total
    c = controllers(f, (k, k), delay_s=3.0e-3)
    found = joint_margins(exact(plant, f), c)
    assert max(found.ms_alone) < 3.5
    assert found.stable is False
    # At half the gain the pair is what each axis was alone.
    half = joint_margins(exact(plant, f), c, 0.5)
    assert half.stable is True
    assert half.ms == pytest.approx(max(found.ms_alone), rel=0.05)


def test_beyond_the_band_nothing_is_stated():
    plant = Gantry()
    f = np.geomspace(4.0, 20.0, 50)
    found = joint_margins(exact(plant, f), controllers(f, (0.5, 0.5)))
    assert found.stable is None
    assert (
        design(exact(plant, f), controllers(f, (50.0, 50.0)), ms=1.8, phase_margin_deg=40) is None
    )


@pytest.mark.long
def test_the_interval_of_ms_holds_the_truth_in_95_of_100_draws():
    plant, rng = Gantry(), np.random.default_rng(9)
    c = controllers(LINES.astype(float), delay_s=1e-3)
    truth = joint_margins(exact(plant), c)
    inside = []
    for _ in range(150):
        found = joint_margins(estimate(records(plant, rng, noise=(5e-3, 2e-3))), c)
        low, high = found.ms_ci95
        inside.append(low <= truth.ms <= high)
    assert np.mean(inside) >= 0.93


@pytest.mark.long
def test_a_design_keeps_its_goals_for_the_true_machine():
    plant, rng = Gantry(), np.random.default_rng(10)
    c = controllers(LINES.astype(float), delay_s=1e-3)
    kept, factors = [], []
    for _ in range(40):
        found = design(estimate(records(plant, rng)), c, ms=2.0, phase_margin_deg=30.0)
        assert found is not None
        truth = joint_margins(exact(plant), c, found.factor)
        kept.append(truth.stable and truth.ms <= 2.0)
        factors.append(found.factor)
    assert np.mean(kept) >= 0.95
    best = design(exact(plant), c, ms=2.0, phase_margin_deg=30.0)
    assert best is not None
    assert not best.at_end
    assert np.median(factors) > 0.8 * best.factor


def test_eigenloci_are_followed_from_line_to_line():
    plant = Gantry()
    f = np.geomspace(1.0, 400.0, 2000)
    loci = eigenloci(plant.response(f) * controllers(f)[:, None, :])
    assert np.max(np.abs(np.diff(np.log(loci), axis=0).real)) < 0.2
