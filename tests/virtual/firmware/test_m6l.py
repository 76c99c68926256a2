"""The virtual M6-L with its real profile: what the page converts is what the drive does."""

from __future__ import annotations

from pathlib import Path

import pytest

from backend.units import AxisUnits
from drivers.virtual.firmware import make_device
from drivers.virtual.firmware.servo import VirtualServo
from profiles import load_profile

from .servo_bench import Bench, rigid

PROFILE = load_profile("m6l")
COUNTS = 10000  # P05.05 (000:3296)


def bench(folder: Path | None = None) -> Bench:
    device = make_device(PROFILE, rigid(), folder)
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
    """606Bh (000:3785) beside 606Ch (000:3786)."""
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
