"""Load of a cycle: figures that are known by formula, and heat of motors with other physics."""

from __future__ import annotations

import numpy as np
import pytest

from backend.analysis.duty.heat import heat_of, permitted_rise
from backend.analysis.duty.load import (
    Signals,
    effective_torque,
    i2t,
    mean_speed_rpm,
    period_of,
    power_of,
    share_above,
    whole_periods,
)
from tests.support.warm_motor import RATED_RISE_K, WarmMotor

PERIOD_S = 1.6
LOSSES_W, RATED_RPM = 90.0, 3000.0
#: Peak of the torque in %, temperature about the motor in °C.
CASES = ((120.0, 40.0), (170.0, 40.0), (200.0, 40.0), (230.0, 25.0), (300.0, 40.0))


def machine(
    seconds: float,
    rate_hz: float,
    *,
    peak: float = 200.0,
    jitter: float = 0.0,
    hold: float = 10.0,
    seed: int = 1,
) -> Signals:
    """Trapezoids: 0.2 s up, 0.4 s at 1500 rpm, 0.2 s down, 0.8 s standing; sampled unevenly."""
    random = np.random.default_rng(seed)
    time = np.arange(0.0, seconds, 1.0 / rate_hz)
    time = np.sort(time + jitter / rate_hz * random.uniform(-0.5, 0.5, time.size))
    phase = time % PERIOD_S
    torque = np.select(
        [phase < 0.2, phase < 0.6, phase < 0.8], [peak + hold, hold, hold - peak], 0.0
    )
    speed = 1500.0 * np.interp(phase, [0.0, 0.2, 0.6, 0.8, PERIOD_S], [0.0, 1.0, 1.0, 0.0, 0.0])
    return Signals(time, torque, speed)


def test_figures_of_a_trapezoid() -> None:
    signals = machine(16.0, 2000.0)
    period = period_of(signals)
    assert period == pytest.approx(PERIOD_S, rel=1e-3)
    moments = whole_periods(signals, period)
    assert moments.size - 1 in (9, 10)
    # 0.2 s each at 210 and −190 %, 0.4 s at 10 %.
    squares = (0.2 * 210.0**2 + 0.2 * 190.0**2 + 0.4 * 10.0**2) / PERIOD_S
    found = effective_torque(signals, moments)
    assert found.value == pytest.approx(np.sqrt(squares), rel=2e-3)
    low, high = found.ci95
    assert low is not None
    assert high is not None
    assert low <= np.sqrt(squares) * 1.002
    assert high >= np.sqrt(squares) * 0.998
    assert mean_speed_rpm(signals, moments) == pytest.approx(1500.0 * 0.6 / PERIOD_S, rel=2e-3)
    assert share_above(signals, 100.0) == pytest.approx(0.4 / PERIOD_S, rel=0.01)
    # Braking at −190 % of 2 N·m from 1500 rpm in 0.2 s: half of torque times speed times time.
    power = power_of(signals, 2.0, moments)
    omega = 1500.0 * 2 * np.pi / 60.0
    assert power.braking_j == pytest.approx(0.5 * 3.8 * omega * 0.2, rel=5e-3)
    assert power.highest_w == pytest.approx(4.2 * omega, rel=5e-3)
    assert power.highest_braking_w == pytest.approx(3.8 * omega, rel=5e-3)
    assert power.braking_mean_w == pytest.approx(power.braking_j / PERIOD_S, rel=1e-3)


def test_slow_uneven_polling_finds_the_same_within_its_interval() -> None:
    """30 samples a second, as a serial line has them, over 40 cycles."""
    signals = machine(64.0, 31.7, jitter=0.6)
    period = period_of(signals)
    assert period == pytest.approx(PERIOD_S, rel=0.01)
    found = effective_torque(signals, whole_periods(signals, period))
    truth = np.sqrt((0.2 * 210.0**2 + 0.2 * 190.0**2 + 0.4 * 10.0**2) / PERIOD_S)
    assert found.value == pytest.approx(truth, rel=0.05)
    low, high = found.ci95
    assert low is not None
    assert high is not None
    assert low < found.value < high


@pytest.mark.parametrize("kind", ["noise", "ramp", "still"])
def test_what_does_not_repeat_has_no_period(kind: str) -> None:
    time = np.arange(0.0, 20.0, 0.01)
    random = np.random.default_rng(3)
    torque = {
        "noise": random.normal(size=time.size),
        "ramp": time,
        "still": np.full(time.size, 7.0),
    }[kind]
    assert period_of(Signals(time, torque, np.zeros(time.size))) is None


def test_a_gap_counts_for_nothing() -> None:
    whole = machine(16.0, 500.0)
    kept = (whole.time_s < 5.0) | (whole.time_s > 8.2)
    cut = Signals(whole.time_s[kept], whole.torque_percent[kept], whole.speed_rpm[kept])
    assert cut.longest_gap_s == pytest.approx(3.2, abs=0.01)
    ends = np.array([0.0, 16.0])
    assert effective_torque(cut, ends).value == pytest.approx(
        effective_torque(whole, ends).value, rel=0.02
    )


def test_i2t_of_a_constant_overload_is_the_formula() -> None:
    time = np.arange(0.0, 10.0, 0.01)

    def constant(percent: float) -> Signals:
        return Signals(time, np.full(time.size, percent), np.zeros(time.size))

    # 300 % for 3 s: 24 per-unit² s; at 200 % that lasts 8 s, at 110 % 24 / 0.21 s.
    assert i2t(constant(200.0), 300.0, 3.0).trip_s == pytest.approx(8.0, rel=0.01)
    assert i2t(constant(110.0), 300.0, 3.0).trip_s == pytest.approx(24.0 / 0.21, rel=0.1)
    rest = i2t(constant(99.0), 300.0, 3.0)
    assert rest.trip_s is None
    assert rest.used == 0.0


def test_i2t_falls_in_pauses() -> None:
    # 2 s at 200 % (6 of 24), 8 s at standstill: all of it is gone again.
    time = np.arange(0.0, 60.0, 0.01)
    torque = np.where(time % 10.0 < 2.0, 200.0, 0.0)
    found = i2t(Signals(time, torque, np.zeros(time.size)), 300.0, 3.0)
    assert found.trip_s is None
    assert found.used == pytest.approx(6.0 / 24.0, rel=0.02)


def test_what_is_permitted_at_another_temperature() -> None:
    assert permitted_rise(40.0, None) == 1.0
    assert permitted_rise(20.0, None) is None
    assert permitted_rise(20.0, 100.0) == pytest.approx(1.2)
    assert permitted_rise(60.0, 100.0) == pytest.approx(0.8)


MOTORS = {
    "ordinary": WarmMotor(),
    "thin winding": WarmMotor(slot_to_iron=2.5, capacities=(60.0, 40.0, 500.0, 1200.0)),
    "much iron": WarmMotor(iron_share=0.3, iron_to_frame=6.0, saturation=0.0),
    "saturates": WarmMotor(saturation=0.06, capacities=(150.0, 90.0, 800.0, 600.0)),
}


@pytest.mark.long(keep=3)
@pytest.mark.parametrize("name", MOTORS)
def test_the_range_holds_for_motors_of_other_physics(name: str) -> None:
    """Four bodies, convection and iron by other laws: when they are too warm is in the range, and
    whoever is said to endure a cycle does."""
    motor = MOTORS[name]
    air = motor.calibrated(LOSSES_W)
    tau = motor.time_constant_s(LOSSES_W, air)
    decided = 0
    for peak, ambient in (
        (120.0, 40.0),
        (170.0, 40.0),
        (200.0, 40.0),
        (230.0, 25.0),
        (300.0, 40.0),
    ):
        signals = machine(16.0, 200.0, peak=peak)
        truth = motor.too_warm_s(
            LOSSES_W, air, signals.torque_percent / 100.0, signals.speed_rpm / RATED_RPM, ambient
        )
        permitted = permitted_rise(ambient, RATED_RISE_K)
        assert permitted is not None
        found = heat_of(signals, RATED_RPM, permitted=permitted, time_constant_s=tau)
        earliest, latest = found.trip_s
        low, high = found.rise
        if truth is None:
            assert low < 1.0
            assert latest is None
        else:
            assert high > 1.0
            assert earliest is not None
            assert earliest <= truth
            assert latest is None or truth <= latest
        decided += latest is not None or high < 1.0
    # A range that holds everything would be worth nothing.
    assert decided >= 3


def test_without_a_time_constant_the_verdict_stays() -> None:
    light, heavy = machine(16.0, 200.0, peak=60.0), machine(16.0, 200.0, peak=400.0)
    for signals, endures in ((light, True), (heavy, False)):
        found = heat_of(signals, 3000.0, permitted=1.0, time_constant_s=None)
        assert found.trip_s == (None, None)
        assert (found.rise[1] < 1.0) is endures
        assert (found.rise[0] > 1.0) is not endures


def test_the_torque_at_standstill_narrows_the_range() -> None:
    """Without iron losses the copper may have them, too: T₀² = 1 / (1 − share)."""
    motor = MOTORS["ordinary"]
    air = motor.calibrated(LOSSES_W)
    tau = motor.time_constant_s(LOSSES_W, air)
    cycle = machine(16.0, 200.0, peak=300.0)
    truth = motor.too_warm_s(
        LOSSES_W, air, cycle.torque_percent / 100.0, cycle.speed_rpm / RATED_RPM
    )
    wide = heat_of(cycle, RATED_RPM, permitted=1.0, time_constant_s=tau)
    stated = (1.0 - motor.iron_share) ** -0.5
    found = heat_of(cycle, RATED_RPM, permitted=1.0, time_constant_s=tau, standstill=stated)
    assert truth is not None
    (earliest, latest), (first, last) = found.trip_s, wide.trip_s
    assert earliest is not None
    assert latest is not None
    assert first is not None
    assert last is not None
    assert earliest <= truth <= latest
    assert first <= earliest
    assert latest < 0.8 * last
