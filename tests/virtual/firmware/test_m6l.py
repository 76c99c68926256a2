"""The virtual M6-L with its real profile: what the page converts is what the drive does."""

from __future__ import annotations

import math

import pytest

from backend.axes.scales.units import AxisUnits
from drivers.virtual.firmware import make_device
from drivers.virtual.firmware.servo import VirtualServo
from drivers.virtual.mechanics import MechanicsSpec, TravelSpec
from profiles import load_profile

from .servo_bench import TURN, Bench, rigid

PROFILE = load_profile("m6l")
COUNTS = 10000  # P05.05 (000:3296)


def bench(spec: MechanicsSpec | None = None) -> Bench:
    device = make_device(PROFILE, spec or rigid(), None)
    assert isinstance(device, VirtualServo)
    b = Bench(device)
    b.set("2009:27", 0)  # P09.38: the motor is alone
    return b


def test_page_converts_homing_speeds_to_rpm_and_others_to_increments() -> None:
    """6099h in rpm (000:2167), 60FFh in increments per second (000:3825)."""
    units = AxisUnits(PROFILE.units, COUNTS)
    assert units.velocity_raw_of(PROFILE.by_key["6099:01"], 100.0) == 100
    assert units.velocity_raw_of(PROFILE.by_key["60FF:00"], 60.0) == COUNTS


def test_homing_runs_at_the_rpm_of_6099h() -> None:
    """Method 33 looks for the index backward at the low speed (000:2673)."""
    b = bench()
    b.enable(1)
    b.set("607A:00", COUNTS * 3 // 4)
    b.set("6040:00", 0x1F)
    b.run_until(lambda: abs(b.get("6064:00") - COUNTS * 3 // 4) < 20, 3.0)
    b.set("6040:00", 0x0F)
    b.set("6098:00", 33)
    b.set("6099:02", 30)
    b.set("6060:00", 6)
    b.set("6040:00", 0x1F)
    b.run(0.5)
    assert b.get("606C:00") == pytest.approx(-30 / 60 * COUNTS, rel=0.03)
    b.run_until(lambda: bool(b.status & 1 << 12), 3.0)


def test_speed_demand_is_rpm_and_speed_is_increments() -> None:
    """606Bh (000:3785) next to 606Ch (000:3786)."""
    b = bench()
    b.enable(3)
    b.set("60FF:00", 5 * COUNTS)
    b.run(1.0)
    assert b.get("606C:00") == pytest.approx(5 * COUNTS, rel=0.02)
    assert b.get("606B:00") == pytest.approx(300, abs=2)


def test_command_pulses_per_revolution_set_the_increment() -> None:
    """P05.05 (000:3139): one revolution is as many increments as it says."""
    b = bench()
    b.set("2005:06", 8388608)
    b.set("6083:00", 50 * 8388608)
    b.enable(3)
    b.set("60FF:00", 8388608)
    b.run(1.0)
    assert b.get("606B:00") == pytest.approx(60, abs=1)


@pytest.mark.parametrize(("method", "home_rev"), [(-1, 1.7), (-2, -1.7), (-3, -1.0), (-4, 1.0)])
def test_homing_against_the_mechanical_limit(method: int, home_rev: float) -> None:
    """-1 forward, -2 backward, -3 backward, -4 forward, the last two then to the Z signal
    (000:2701-2756); the numbers of the MMS7 mean other directions.
    """
    b = bench(rigid(travel=TravelSpec(min_rev=-1.7, max_rev=1.7)))
    b.set("6098:00", method)
    b.set("6099:01", 120)
    b.set("6099:02", 60)
    b.set("2017:15", 200)
    b.set("2017:16", 100)
    b.set("607C:00", 0)
    b.enable(6)
    b.set("6040:00", 0x1F)
    start = b.servo.axis.angle_rad
    b.run_until(lambda: bool(b.status & 1 << 12), 6.0)
    moved = (b.servo.axis.angle_rad - start) / TURN
    assert moved == pytest.approx(home_rev, abs=2e-3)


def test_homing_gives_up_after_p12_09() -> None:
    """Time limit in ms (000:3635)."""
    b = bench()
    b.set("200C:0A", 800)
    b.set("6098:00", 17)  # no limit switch anywhere
    b.enable(6)
    b.set("6040:00", 0x1F)
    b.run(0.7)
    assert not b.status & 1 << 13
    b.run(0.2)
    assert b.status & 1 << 13


@pytest.mark.parametrize(("method", "start_rev"), [(33, -1.2), (34, 1.2)])
def test_index_search_turns_round_at_the_limit_switch(method: int, start_rev: float) -> None:
    """No Z signal before the switch: back past one, and to it again (000:2679, 000:2693)."""
    b = bench(rigid(travel=TravelSpec(min_rev=-2.0, max_rev=2.0)))  # switches at ±1.75
    b.enable(1)
    b.set("607A:00", round(start_rev * COUNTS))
    b.set("6040:00", 0x1F)
    b.run(3.0)
    b.set("6040:00", 0x0F)
    b.set("6098:00", method)
    b.set("6099:02", 60)
    b.set("6060:00", 6)
    b.set("6040:00", 0x1F)
    b.run_until(lambda: bool(b.status & (1 << 12 | 1 << 13)), 6.0)
    assert b.status & 1 << 12
    assert b.servo.core.zero_rad / TURN == pytest.approx(math.copysign(1.0, start_rev), abs=1e-6)
