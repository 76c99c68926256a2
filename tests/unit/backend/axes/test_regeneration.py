"""Braking energy against the equations of manual 004 (004:2250 to 004:2315) and mechanics."""

from __future__ import annotations

import math

import pytest

from backend.axes.functions.regeneration import (
    BrakingCycle,
    BrakingLimits,
    Resistor,
    braking,
)
from drivers.errors import OutOfRange

#: The manual's example: 500 g·cm², load nine times that, 3000 rpm, one cycle a second.
EXAMPLE = BrakingCycle(inertia_kgm2=10 * 500e-7, speed_rpm=3000, deceleration_s=0.1, cycle_s=1)


def test_the_example_of_the_manual_by_its_own_equation() -> None:
    # Equation 9: (N + 1)·J·n²/182. The example prints half of it (12.36 J), halving twice.
    result = braking(EXAMPLE, BrakingLimits(capacitor_j=0.3))
    assert result.kinetic_j == pytest.approx(10 * 500e-7 * 3000**2 / 182, rel=3e-3)
    assert result.kinetic_j == pytest.approx(24.674, abs=1e-3)
    assert result.average_w == pytest.approx(2 * (24.674 - 0.3), abs=1e-2)


def test_peak_power_is_torque_times_speed_when_braking_begins() -> None:
    result = braking(EXAMPLE, BrakingLimits())
    omega = 3000 * math.tau / 60
    torque = 10 * 500e-7 * omega / 0.1
    assert result.peak_w == pytest.approx(torque * omega)


def test_energy_that_the_capacitors_take_needs_no_resistor() -> None:
    result = braking(EXAMPLE, BrakingLimits(capacitor_j=25))
    assert (result.excess_j, result.average_w, result.verdict) == (0, 0, "capacitor")
    assert result.external_w is None


def test_built_in_resistor_is_enough_or_not() -> None:
    slow = BrakingCycle(EXAMPLE.inertia_kgm2, 3000, 0.1, cycle_s=20)
    limits = BrakingLimits(0.3, Resistor(50, 4), min_external_ohm=30, on_voltage_v=380)
    # 2 · 24.37 J in 20 s are 2.4 W.
    assert braking(slow, limits).verdict == "built_in"
    result = braking(EXAMPLE, limits)
    assert result.verdict == "external"
    assert result.external_w == pytest.approx(48.7, abs=0.1)
    assert result.min_ohm == 30
    # 493 W at 380 V: at most 293 Ω.
    assert result.max_ohm == pytest.approx(380**2 / result.peak_w)
    assert result.possible


def test_a_resistor_that_cannot_pass_the_peak_is_not_enough() -> None:
    hard = BrakingCycle(EXAMPLE.inertia_kgm2, 3000, 0.002, cycle_s=100)
    limits = BrakingLimits(0.3, Resistor(250, 4), min_external_ohm=100, on_voltage_v=56)
    # 24.7 kW against 56²/250 = 12.5 W, and no allowed resistor passes it either.
    result = braking(hard, limits)
    assert result.verdict == "external"
    assert not result.possible


def test_more_than_the_drive_allows_is_said() -> None:
    limits = BrakingLimits(0.3, Resistor(250, 4), min_external_ohm=100, max_external_w=10)
    # The manual comes to the same: beyond both resistors, the clamp is needed (004:2312).
    result = braking(EXAMPLE, limits)
    assert result.verdict == "beyond"
    assert not result.possible


def test_falling_load_counts_in_every_cycle() -> None:
    vertical = BrakingCycle(EXAMPLE.inertia_kgm2, 3000, 0.1, cycle_s=2, fall_energy_j=10)
    assert braking(vertical, BrakingLimits(capacitor_j=100)).average_w == pytest.approx(5)


def test_without_limits_no_verdict_is_pretended() -> None:
    assert braking(EXAMPLE, BrakingLimits()).verdict == "unknown"


def test_stops_longer_than_their_cycle_are_refused() -> None:
    absurd = BrakingCycle(EXAMPLE.inertia_kgm2, 3000, deceleration_s=2, cycle_s=1)
    with pytest.raises(OutOfRange, match="2 stops of 2 s do not fit into a cycle of 1 s"):
        braking(absurd, BrakingLimits())
