"""What drives do by themselves besides following the bus: third gains, command notch, quadrant
compensation, jog by inputs, magnetic poles, and outputs and brake that process data rule.
"""

from __future__ import annotations

import math
import struct
from typing import Any

import numpy as np
import pytest

from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.mechanics import FrictionSpec, LoadSpec, MechanicsSpec, MotorSpec, TravelSpec

from .on_wire import Aborted, OnWire

ROTOR, RATED = 5e-5, 1.27
MOTOR = MotorSpec(inertia_kgm2=ROTOR, rated_torque_nm=RATED, rated_speed_rpm=3000)
BRAKED = MotorSpec(inertia_kgm2=ROTOR, rated_torque_nm=RATED, rated_speed_rpm=3000, brake=True)


def drive(name: str, **parts: Any) -> OnWire:
    return OnWire(name, MechanicsSpec(**{"motor": MOTOR, **parts}))


def moved(d: OnWire, turns: float) -> None:
    """A relative move in profile position, not waited for."""
    d.set("607A:00", turns * d.per_rev)
    d.command(0x0F, 0x5F, 0x0F)


def at_rest(d: OnWire) -> bool:
    return bool(d.device.axis.s[k.S_V_DEMAND] == 0.0)


# --- third gains of the R6L (P06.06 to P06.08, P06.56: 002:10616-10636, 002:10876) --------------


def r6l_with_third_gains() -> OnWire:
    d = drive("r6l")
    d.set_all({
        "2006:01": 250, "2006:02": 3183, "2006:03": 200, "2006:0D": 0,
        "2006:07": 1000, "2006:08": 3183, "2006:09": 800, "2006:39": 1000, "2006:33": 1,
    })  # fmt: skip
    d.set_ramps()
    d.set("6081:00", 5 * d.per_rev)
    d.enable(1)
    return d


def test_third_gains_of_the_r6l_hold_an_axis_that_rests() -> None:
    """P06.56 = 100 ms after the command has stopped, and not while it moves."""
    d = r6l_with_third_gains()
    p, s = d.device.axis.p, d.device.axis.s
    assert p[k.P_KP_POSITION_3] == pytest.approx(4 * p[k.P_KP_POSITION_1])
    assert p[k.P_KP_SPEED_3] == pytest.approx(4 * p[k.P_KP_SPEED_1])
    d.run(0.3)
    assert s[k.S_THIRD_MIX] == 1.0
    moved(d, 2.0)
    d.run(0.05)
    assert s[k.S_THIRD_MIX] == 0.0
    d.until(lambda: at_rest(d), 3.0)
    d.run(0.08)
    assert s[k.S_THIRD_MIX] == 0.0
    d.run(0.04)
    assert s[k.S_THIRD_MIX] == 1.0


@pytest.mark.parametrize("mode", [0, 1])
def test_a_push_moves_a_resting_r6l_less_under_its_third_gains(mode: int) -> None:
    """Statically, before the integral acts, a push is held by Kv·Kp: 16 times as stiff here."""
    d = r6l_with_third_gains()
    d.set("2006:33", mode)
    for key in ("2006:02", "2006:08"):
        d.set(key, 51200)  # 512 ms: the integral does not act within the push
    d.run(0.5)
    at = d.angle_rev
    d.device.inject("load_nm", 0.1)
    d.run(0.06)
    p = d.device.axis.p
    place = ("1", "3")[mode]
    stiffness = p[getattr(k, f"P_KP_SPEED_{place}")] * p[getattr(k, f"P_KP_POSITION_{place}")]
    away = abs(d.angle_rev - at) * 2 * math.pi
    assert away == pytest.approx(0.1 / stiffness, rel=0.25)


# --- command notch of the M6-L (P09.25 to P09.28: 000:3447-3450) ---------------------------------

LOAD, SWING_HZ = 2e-4, 5.0
SPRING = LOAD * (2 * math.pi * SWING_HZ) ** 2


def swinging() -> OnWire:
    """A load that swings at 5 Hz on a held motor: √(k/J)."""
    load = LoadSpec(inertia_kgm2=LOAD, stiffness_nm_per_rad=SPRING, damping_nms_per_rad=2e-5)
    d = drive("m6l", load=(load,))
    d.set_all({"2009:27": 0, "2008:01": 1500, "2008:03": 80})
    d.set_ramps()
    d.set("6081:00", 5 * d.per_rev)
    d.enable(1)
    return d


def residual_nm(d: OnWire) -> float:
    """Amplitude of what the swinging load still asks of the motor 0.5 s after a move."""
    moved(d, 1.0)
    d.until(lambda: at_rest(d), 3.0)
    d.run(0.5)
    torque = []
    for _ in range(100):
        d.run(0.002)
        torque.append(float(d.device.axis.s[k.S_TORQUE]))
    return float(np.ptp(np.array(torque)) / 2)


def test_the_command_notch_of_the_m6l_leaves_no_swing() -> None:
    """A zero at the load's own frequency: the motion does not excite it."""
    before = residual_nm(swinging())
    assert before > 0.01
    d = swinging()
    d.set("2009:1B", round(SWING_HZ * 10))
    assert residual_nm(d) < 0.1 * before
    assert d.device.axis.s[k.S_SHAPE] == pytest.approx(0.0, abs=1e-3)  # it arrives in the end


def test_the_m6l_finds_the_swing_by_itself() -> None:
    """P09.25 = 1: P09.26 becomes the frequency, above the deviation P09.28."""
    d = swinging()
    d.set_all({"2008:03": 60, "2009:1A": 1})
    d.command(6)
    d.set("2009:1D", 1)
    d.enable(1)
    residual_nm(d)
    d.until(lambda: d.get("2009:1B") != 0, 3.0, 0.02)
    assert d.get("2009:1B") / 10 == pytest.approx(SWING_HZ, rel=0.1)


# --- quadrant compensation of the M6-L (P09.33 to P09.37: 000:3460-3464) --------------------------


def test_quadrant_compensation_of_the_m6l_is_late_filtered_and_ends() -> None:
    """10 % from 20 ms after the turn, with a time constant of 10 ms, over 2000 units of 10000."""
    d = drive("m6l", friction=FrictionSpec(coulomb_nm=0.02))
    d.set_all({
        "2009:22": 1000, "2009:23": 500, "2009:24": 200, "2009:25": 100, "2009:26": 2000,
    })  # fmt: skip
    s = d.device.axis.s
    d.turn(-1.0)
    assert s[k.S_QUADRANT] == 0.0  # setting off is no turn
    d.set("60FF:00", d.speed_per_rev_s)
    d.until(lambda: bool(s[k.S_V_DEMAND] > 0.0), 1.0, 1e-3)
    d.run(0.018)
    assert s[k.S_QUADRANT] == 0.0
    d.run(0.012)
    # At most 1 ms has passed before the turn was seen here.
    early, late = (0.1 * RATED * (1 - math.exp(-t)) for t in (1.0, 1.11))
    assert early * 0.99 < s[k.S_QUADRANT] < late * 1.01
    d.run(0.05)
    assert s[k.S_QUADRANT] == pytest.approx(0.1 * RATED, rel=0.01)
    d.run(0.25)  # a fifth of a revolution at 1 rev/s is behind
    assert s[k.S_QUADRANT] == pytest.approx(0.0, abs=1e-4)
    d.set("60FF:00", -d.speed_per_rev_s)
    d.until(lambda: bool(s[k.S_V_DEMAND] < 0.0), 1.0, 1e-3)
    d.run(0.08)
    assert s[k.S_QUADRANT] == pytest.approx(-0.05 * RATED, rel=0.02)


def test_quadrant_compensation_flattens_the_error_after_a_turn() -> None:
    """Friction of 10 % changes its sign: twice that is what the integral must find otherwise."""

    def error(percent: float) -> float:
        d = drive("m6l", friction=FrictionSpec(coulomb_nm=0.1 * RATED))
        d.set_all({"2009:22": round(percent * 100), "2009:26": 10000, "2008:02": 100})
        d.turn(-0.5)
        d.set("60FF:00", 0.5 * d.speed_per_rev_s)
        worst = 0.0
        for _ in range(60):
            d.run(0.002)
            s = d.device.axis.s
            worst = max(worst, abs(float(s[k.S_V_DEMAND] - s[k.S_OMEGA])))
        return worst

    assert error(20.0) < 0.6 * error(0.0)


# --- the drives' own jog (M6-L 000:1191-1193, R6L 002:9774-9807) ---------------------------------

JOGS = [
    # terminals with their functions, then speed [rpm] and the acceleration [rpm/s] of the defaults
    ("m6l", {"2003:01": 17, "2003:02": 18}, 100.0, 1000.0),
    ("r6l", {"2002:01": 39, "2002:03": 40}, 100.0, 10000.0),
]


@pytest.mark.parametrize(("name", "terminals", "rpm", "ramp"), JOGS)
def test_jog_by_two_inputs(name: str, terminals: dict[str, int], rpm: float, ramp: float) -> None:
    d = drive(name, friction=FrictionSpec(coulomb_nm=0.01))
    d.set_all(terminals)
    axis = d.device.axis
    d.device.inject("di1", 1)
    half_s = 0.5 * rpm / ramp
    d.run(half_s)
    assert axis.s[k.S_V_DEMAND] == pytest.approx(0.5 * rpm * math.pi / 30, rel=0.05)
    d.run(half_s + 0.3)
    assert d.speed_rev_s == pytest.approx(rpm / 60, rel=0.02)
    d.device.inject("di2", 1)  # both at once stand still
    d.until(lambda: not axis.powered, 1.0)
    assert abs(d.speed_rev_s) < 0.2
    d.device.inject("di1", 0)
    d.run(2 * half_s + 0.3)
    assert d.speed_rev_s == pytest.approx(-rpm / 60, rel=0.02)
    d.device.inject("di2", 0)
    d.until(lambda: not axis.powered, 1.0)


@pytest.mark.parametrize(("name", "terminals", "rpm", "ramp"), JOGS)
def test_the_bus_takes_a_jogging_axis(
    name: str, terminals: dict[str, int], rpm: float, ramp: float
) -> None:
    """And while it has the axis, the inputs do nothing; nor do they in a fault."""
    d = drive(name, friction=FrictionSpec(coulomb_nm=0.01))
    d.set_all(terminals)
    d.device.inject("di1", 1)
    d.run(2 * rpm / ramp)
    d.set_ramps()
    d.enable(3)
    d.set("60FF:00", 0)
    d.run(0.5)
    assert abs(d.speed_rev_s) < 0.05
    d.device.inject("di1", 0)
    d.device.inject("di1", 1)
    d.run(0.3)
    assert abs(d.speed_rev_s) < 0.05
    d.device.inject("over_current")
    d.device.inject("di1", 0)
    d.device.inject("di1", 1)
    d.run(0.1)
    assert not d.device.axis.powered


def test_jog_stops_at_a_limit_switch() -> None:
    d = drive(
        "r6l", travel=TravelSpec(min_rev=-2, max_rev=2), friction=FrictionSpec(viscous_nms=1e-3)
    )
    d.set_all({"2002:01": 39, "2002:03": 5, "2002:04": 0})
    d.set_ramps()
    d.device.inject("di1", 1)
    d.run(3.0)
    assert 1.7 < d.angle_rev < 1.95
    assert abs(d.speed_rev_s) < 0.01


# --- magnetic poles of the M6-L (000:1163-1181) ------------------------------------------------


def direct_drive(**parts: Any) -> OnWire:
    """A linear motor with an incremental encoder and without a Hall sensor."""
    d = drive("m6l", **parts)
    d.set_all({"2001:1D": 2, "2001:13": 4, "2001:22": 0, "2009:27": 0})
    d.device.inject("turn_to_rev", 0.1)
    return d


def test_enabling_without_identification_is_er_059() -> None:
    d = direct_drive()
    d.enable(3)
    assert d.get("603F:00") == 0xFF3B


@pytest.mark.parametrize(("method", "rests"), [(1, 0.0), (2, 0.1)])
def test_identification_of_the_poles_lets_the_axis_be_enabled(method: int, rests: float) -> None:
    """Pre-positioning goes to the nearest pole, micro-motion comes back."""
    d = direct_drive()
    d.set("2018:01", method)
    d.set("2001:15", 1)
    d.until(lambda: d.device.axis.powered, 0.1)
    d.until(lambda: not d.device.axis.powered, 5.0, 0.02)
    assert d.angle_rev == pytest.approx(rests, abs=1e-3)
    d.enable(3)
    assert d.state == 0x27
    d.device.power_cycle()
    d.run(0.01)
    d.enable(3)
    assert d.get("603F:00") == 0xFF3B  # learnt again after every power-on


def test_withdrawal_after_pre_positioning() -> None:
    """P24.03 = 1 (000:3723)."""
    d = direct_drive()
    d.set_all({"2018:01": 1, "2018:04": 1, "2001:15": 1})
    d.run(0.05)
    d.until(lambda: not d.device.axis.powered, 8.0, 0.02)
    assert d.angle_rev == pytest.approx(0.1, abs=1e-3)


def test_poles_of_a_blocked_axis_are_er_058() -> None:
    d = direct_drive(friction=FrictionSpec(coulomb_nm=6.0))
    d.set_all({"2018:01": 1, "2001:15": 1})
    d.until(lambda: d.get("603F:00") == 0xFF3A, 5.0, 0.02)
    assert not d.device.axis.powered


def test_p24_01_identifies_when_the_axis_is_enabled() -> None:
    d = direct_drive()
    d.set_all({"2018:01": 1, "2018:02": 2})
    d.set_ramps()
    d.enable(3)
    d.set("60FF:00", d.speed_per_rev_s)
    d.run(0.3)
    assert abs(d.speed_rev_s) < 0.3  # still looking for the pole
    d.until(lambda: d.speed_rev_s > 0.95, 5.0)
    assert d.state == 0x27


def test_poles_are_not_looked_for_under_power() -> None:
    d = drive("m6l")
    d.enable(3)
    with pytest.raises(Aborted):
        d.set("2001:15", 1)


# --- outputs and brake by process data ----------------------------------------------------------


def m6l_outputs() -> OnWire:
    """6040h and 60FFh as process data; DO1 has function 28."""
    d = drive("m6l")
    d.set_all({"2003:10": 28, "60FE:02": 1 << 16, "60FE:01": 1 << 16})
    return d


def do1(d: OnWire) -> bool:
    return bool(d.get("200B:0E") & 1)


@pytest.mark.parametrize(("kept", "afterwards"), [(0, True), (1, False)])
def test_m6l_forces_outputs_only_while_process_data_run(kept: int, afterwards: bool) -> None:
    """000:3100-3106; on leaving Op what P20.27 says."""
    d = m6l_outputs()
    d.set("2014:1C", kept)
    assert not do1(d)
    d.operate(0x1601, 0x1A02, bytes(6), 6)
    assert do1(d)
    d.set("60FE:01", 0)
    assert not do1(d)
    d.set("60FE:01", 1 << 16)
    d.leave_operation()
    assert do1(d) is afterwards


def test_m6l_forces_no_output_with_another_function() -> None:
    d = m6l_outputs()
    d.set("2003:10", 1)
    d.operate(0x1601, 0x1A02, bytes(6), 6)
    assert not do1(d)


def test_r6l_forces_outputs_with_function_31_only() -> None:
    """60FEh:02 lets its bits through (002:14003)."""
    d = drive("r6l")
    d.set_all({"2002:23": 31, "60FE:01": 1 << 17})
    assert not d.get("200D:15") & 2
    d.set("60FE:02", 1 << 17)
    assert d.get("200D:15") & 2
    d.set("2002:23", 2)
    d.set("60FE:01", 0)
    d.enable(1)
    d.run(0.1)
    assert d.get("200D:15") & 2  # in position, whatever the bus says


def ep3e_with_brake() -> OnWire:
    """A hanging load; 6040h and 60FEh:01 and :02 as process data of ten bytes."""
    d = drive("ep3e", motor=BRAKED, friction=FrictionSpec(gravity_nm=0.05))
    d.set_all({"1600:00": 0, "1600:01": 0x60400010, "1600:02": 0x60FE0120, "1600:03": 0x60FE0220})
    d.set("1600:00", 3)
    return d


def bus_brake(applied: int, mask: int = 1) -> bytes:
    return struct.pack("<HII", 0, applied, mask)


def test_ep3e_brake_follows_60feh_of_the_process_data() -> None:
    """Bit 0: 1 applies, 0 releases (001:990); released without power the load falls."""
    d = ep3e_with_brake()
    d.run(0.2)
    assert abs(d.angle_rev) < 1e-3
    d.operate(0x1600, 0x1A01, bus_brake(1), 6)
    d.exchange(bus_brake(1), 0.2)
    assert abs(d.angle_rev) < 1e-3
    d.exchange(bus_brake(0), 0.1)
    # Free fall: φ = ½·(M/J)·t²
    assert d.angle_rev * 2 * math.pi == pytest.approx(-0.5 * 0.05 / ROTOR * 0.1**2, rel=0.05)
    d.exchange(bus_brake(1), 0.5)
    assert abs(d.speed_rev_s) < 1e-6


def test_ep3e_brake_by_sdo_does_nothing() -> None:
    """001:970: through a PDO only."""
    d = drive("ep3e", motor=BRAKED, friction=FrictionSpec(gravity_nm=0.05))
    d.set_all({"60FE:02": 1, "60FE:01": 0})
    d.run(0.2)
    assert abs(d.angle_rev) < 1e-3


def test_a_fault_of_the_ep3e_applies_the_brake_whatever_the_bus_says() -> None:
    """001:940."""
    d = ep3e_with_brake()
    d.operate(0x1600, 0x1A01, bus_brake(0), 6)
    d.device.inject("Err11")
    d.exchange(bus_brake(0), 0.3)
    assert abs(d.speed_rev_s) < 1e-6
