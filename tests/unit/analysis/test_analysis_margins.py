"""Margins, rational fit, steps and spectra against closed forms, python-control and scipy."""

import control
import numpy as np
import pytest

from backend.analysis.loop.margins import bandwidth, closed_from_open, margins, open_from_closed
from backend.analysis.signals.spectrum import power_density
from backend.analysis.signals.step import move_metrics, step_metrics

TURN = 2 * np.pi
F = np.geomspace(0.1, 3000.0, 3000)


def response(system, f=F):
    return system(2j * np.pi * f)


LOOPS = {
    "third order": control.tf([4e6], [1, 300, 2e4, 0]) * 0.2,
    "pi on inertia with lag": control.tf([300.0, 18000.0], [1, 0, 0])
    * control.tf([6283.0], [1, 6283.0]),
    "resonant": control.tf([200.0], [1, 0])
    * control.tf([1, 20, 4e5], [1, 30, 6e5])
    * control.tf([3000.0], [1, 3000.0]),
}


@pytest.mark.parametrize("name", LOOPS)
def test_margins_agree_with_python_control(name):
    system = LOOPS[name]
    found = margins(F, response(system))
    gm, pm, sm, wpc, wgc, _ = control.stability_margins(system)
    assert found.phase_margin_deg == pytest.approx(pm, abs=0.2)
    assert found.phase_margin_hz == pytest.approx(wgc / TURN, rel=2e-3)
    assert found.ms == pytest.approx(1 / sm, rel=5e-3)
    if np.isfinite(gm) and gm > 1:
        assert found.gain_margin_db == pytest.approx(20 * np.log10(gm), abs=0.05)
        assert found.gain_margin_hz == pytest.approx(wpc / TURN, rel=2e-3)
    else:
        assert found.gain_margin_db is None


@pytest.mark.parametrize("gain", [0.05, 0.2, 0.9, 1.1, 2.0, 10.0])
@pytest.mark.parametrize("name", LOOPS)
def test_stability_agrees_with_the_closed_loop_poles(name, gain):
    system = LOOPS[name] * gain * (1.5 if name == "third order" else 30.0)
    poles = control.feedback(system).poles()
    f = np.geomspace(0.01, 1e5, 6000)
    assert margins(f, response(system, f)).stable == bool(np.all(poles.real < 0))


def test_open_and_closed_are_inverse():
    loop = response(LOOPS["resonant"])
    assert np.allclose(open_from_closed(closed_from_open(loop)), loop)


def test_bandwidth_of_a_damped_second_order_system():
    # ζ = 1/√2: -3 dB exactly at the natural frequency, -90° there as well
    w = TURN * 40.0
    closed = response(control.tf([w**2], [1, np.sqrt(2) * w, w**2]))
    found = bandwidth(F, closed)
    assert found.minus_3db_hz == pytest.approx(40.0, rel=1e-3)
    assert found.minus_90deg_hz == pytest.approx(40.0, rel=1e-3)
    assert bandwidth(F[:100], closed[:100]).minus_3db_hz is None


def test_bandwidth_is_counted_from_standstill_wherever_the_lowest_line_lies():
    # PI on an inertia rises above 0 dB where its integral acts; -3 dB lies where it lies.
    loop = response(control.tf([TURN * 50.0, TURN * 50.0 * TURN * 20.0], [1, 0, 0]))
    closed = closed_from_open(loop)
    assert np.abs(closed[F > 10.0][0]) > 1.05
    whole = bandwidth(F, closed).minus_3db_hz
    assert bandwidth(F[F > 10.0], closed[F > 10.0]).minus_3db_hz == pytest.approx(whole, rel=1e-6)
    w = TURN * whole
    value = TURN * 50.0 * (1j * w + TURN * 20.0) / (1j * w) ** 2
    assert np.abs(value / (1 + value)) == pytest.approx(10 ** (-3.0103 / 20), rel=1e-3)


@pytest.mark.long
def test_step_metrics_of_a_second_order_step():
    zeta, wn = 0.3, TURN * 10.0
    t = np.linspace(0.0, 1.0, 100_001)
    _, y = control.step_response(control.tf([wn**2], [1, 2 * zeta * wn, wn**2]), t)
    m = step_metrics(t, 5.0 * y + 2.0, target=7.0, initial=2.0)
    assert m.overshoot_percent == pytest.approx(
        100 * np.exp(-np.pi * zeta / np.sqrt(1 - zeta**2)), abs=0.01
    )
    assert m.peak_time_s == pytest.approx(np.pi / (wn * np.sqrt(1 - zeta**2)), rel=1e-3)
    info = control.step_info(control.tf([wn**2], [1, 2 * zeta * wn, wn**2]), T=t)
    assert m.rise_s == pytest.approx(info["RiseTime"], rel=2e-3)
    assert m.settling_s == pytest.approx(info["SettlingTime"], rel=2e-3)
    assert step_metrics(t[:2000], 5 * y[:2000], target=5.0).settling_s is None
    with pytest.raises(ValueError, match="size zero"):
        step_metrics(t, y, target=0.0, initial=0.0)


def test_move_metrics_of_a_lagging_axis():
    t = np.arange(0, 2.0, 1e-3)
    demand = np.clip(t, 0.0, 1.0)
    actual = demand - 0.05 * np.exp(-np.maximum(t - 1.0, 0.0) / 0.1) * (t > 0)
    m = move_metrics(t, demand, actual, window=0.01, torque=np.full(t.size, -2.0))
    assert m.following_peak == pytest.approx(0.05, rel=1e-3)
    assert m.settling_s == pytest.approx(0.1 * np.log(5.0), abs=2e-3)
    assert (m.torque_peak, m.torque_rms) == (2.0, 2.0)
    assert m.overshoot == pytest.approx(0.0, abs=1e-9)


def test_density_of_white_noise_integrates_to_its_power():
    x = np.random.default_rng(1).normal(0, 2.0, 40_000)
    s = power_density(x, 1000.0)
    assert np.mean(s.value[1:-1]) == pytest.approx(4.0 / 500.0, rel=0.03)


def test_a_stable_loop_that_leads_has_a_positive_phase_margin():
    """L = 2ζw·10·s/(s² + 2ζws + w²) lies on the circle over [0, 10], right of the critical point.

    |L| is 1 where cos φ = 1/10, on both sides of the resonance: 180° - 84.26° away from -1.
    """
    f = np.geomspace(1.0, 1000.0, 4000)
    s, w = 2j * np.pi * f, TURN * 60.0
    loop = 10 * 0.1 * w * s / (s**2 + 0.1 * w * s + w**2)
    found = margins(f, loop)
    assert found.stable
    assert found.phase_margin_deg == pytest.approx(180.0 - np.degrees(np.arccos(0.1)), abs=0.2)


def test_an_unstable_loop_keeps_its_negative_phase_margin():
    """w_c e^(-s d)/s with w_c d of 126°: 36° beyond the critical point."""
    s = 2j * np.pi * F
    found = margins(F, TURN * 70.0 * np.exp(-s * 5e-3) / s)
    assert not found.stable
    assert found.phase_margin_deg == pytest.approx(90.0 - 360.0 * 70.0 * 5e-3, abs=0.5)
