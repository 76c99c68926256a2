"""Faults that physics provokes, in every family: the right code, its entry in the table, its reset.

Nothing is injected but changes of the machine: its supply, its load, its encoder, its temperature.
Thresholds: 004:4705-4917 and 200Bh (MMS7), P10.xx (M6-L, 000:3467-3493), P01.xx (R6L,
002:8375-8890).
"""

from __future__ import annotations

import math
from typing import Any

import pytest

from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.mechanics import (
    FrictionSpec,
    MechanicsSpec,
    MotorSpec,
    SupplySpec,
    SwitchSpec,
    TravelSpec,
)
from profiles import load_profile
from profiles.schema import Fault

from .on_wire import EVERY, OnWire

FAMILIES = tuple(name for name in EVERY if name != "generic402")
FAULT, OPERATING = 0x08, 0x27
RATED, J = 1.27, 5e-5


def drive(name: str, **parts: Any) -> OnWire:
    mechanics: dict[str, Any] = {
        "motor": MotorSpec(inertia_kgm2=J, rated_torque_nm=RATED, rated_speed_rpm=3000),
        "friction": FrictionSpec(coulomb_nm=0.01),
        **parts,
    }
    d = OnWire(name, MechanicsSpec(**mechanics))
    if name in ("m6l", "r6l"):
        d.set({"m6l": "2009:27", "r6l": "2006:0D"}[name], 0)
    if name == "mms7":
        # Protections: over-current, under-voltage, locked rotor, braking resistor, temperature.
        # The speed error is far away, and the phase current may be what 300 % torque takes.
        d.set_all({"200B:01": 0x1F, "2042:01": 0, "200B:0D": 100000, "200B:02": 60})
        write_settings(d)
    return d


def write_settings(d: OnWire) -> None:
    d.set("200D:00", 0xAAB555AA)


def in_fault(d: OnWire) -> bool:
    return bool(d.status & (0x80 if d.drive == "ds_c" else 0x08))


def entry(d: OnWire, code: str) -> Fault:
    return next(f for f in d.profile.faults if f.code == code)


def shows(d: OnWire, code: str, limit_s: float, step_s: float = 0.01) -> Fault:
    """Wait for the fault; its code must be in 603Fh and in the drive's own record."""
    d.until(lambda: in_fault(d), limit_s, step_s)
    fault = entry(d, code)
    if fault.code_raw is not None:
        assert d.get("603F:00") == fault.code_raw
    if d.drive == "ds_c":
        assert d.get("2102:00") == fault.code_raw
    if d.drive == "mms7" and fault.match:
        assert d.get("200B:0B") >> fault.match[0].bit & 1
    if d.drive == "m6l":
        assert d.get("200A:13") == int(code[-3:])
    if d.drive == "r6l":
        assert d.get("200D:25") == int(code[-3:])
    if d.drive == "ep3e":
        assert d.get("2600:00") == int(code[3:]) or code == "Err60"
    assert not d.device.axis.powered
    assert fault.name
    return fault


def resets(d: OnWire, fault: Fault) -> None:
    """By command, or only by the supply, as the table says."""
    d.command(0x00, 0x80, 0x00)
    if fault.reset_by == "power_cycle":
        assert in_fault(d)
        d.device.power_cycle()
        d.run(0.01)
    assert not in_fault(d)
    if d.drive != "ds_c":
        assert d.get("603F:00") == 0


def explained(fault: Fault) -> bool:
    """Cause and remedy are there, or it is said that the manual prints none."""
    return (
        bool(fault.causes and fault.remedies)
        or "no" in fault.notes.lower().split()
        or ("neither cause nor remedy" in fault.notes)
    )


OVER_SPEED = [("mms7", "0x8400"), ("m6l", "Er.027"), ("r6l", "AL.225"), ("ep3e", "Err1")]


@pytest.mark.parametrize(("name", "code"), OVER_SPEED)
def test_over_speed_by_a_pulling_load(name: str, code: str) -> None:
    """The load overhauls a motor whose torque is limited, beyond the over-speed threshold."""
    d = drive(name)
    if name == "m6l":
        d.set("200A:0D", 3600)
    d.turn(5.0)
    d.set_all({key: 100 for key in ("6072:00", "60E0:00", "60E1:00") if d.has(key)})
    d.device.inject("load_nm", -0.6)  # gravity that pulls upwards
    fault = shows(d, code, 5.0, 0.005)
    assert explained(fault)
    d.device.inject("load_nm", 0.0)
    d.device.inject("coulomb_nm", 0.3)
    d.until(lambda: abs(d.speed_rev_s) < 1.0, 10.0)
    resets(d, fault)


OVER_VOLTAGE = [
    ("mms7", "0x3210"),
    ("m6l", "Er.002"),
    ("r6l", "AL.210"),
    ("ep3e", "Err2"),
    ("ds_c", "1001"),
]


@pytest.mark.parametrize(("name", "code"), OVER_VOLTAGE)
def test_over_voltage_by_regeneration(name: str, code: str) -> None:
    """A great inertia, braked hard, on a supply that feeds nothing back and without a resistor."""
    heavy = MotorSpec(inertia_kgm2=1e-2, rated_torque_nm=RATED, rated_speed_rpm=3000)
    volts = 48.0 if name in ("mms7", "ds_c") else 310.0
    supply = SupplySpec(
        voltage_v=volts,
        sinks=False,
        capacitance_f=1e-4,
        braking_resistor=name not in ("ep3e", "ds_c"),  # none at its terminals
    )
    d = drive(name, motor=heavy, supply=supply)
    if name == "mms7":
        d.set("200B:01", 0x03)  # neither resistor nor lock protection
        write_settings(d)
    without_resistor = {"m6l": ("2002:13", 2), "r6l": ("2001:19", 2)}
    if name in without_resistor:
        d.set(*without_resistor[name])
    for key in ("6083:00", "6084:00"):
        if d.has(key):
            d.set(key, d.ramp(30))
    d.enable(d.speed_mode)
    d.set("60FF:00", 30 * d.speed_per_rev_s)
    d.until(lambda: d.speed_rev_s > 28, 20.0, 0.05)
    d.set("60FF:00", 0)
    fault = shows(d, code, 20.0)
    assert d.device.axis.s[k.S_VOLTAGE] > 1.1 * volts
    assert explained(fault)


@pytest.mark.parametrize("name", ["ep3e", "ds_c"])
def test_with_its_resistor_the_same_stop_is_no_fault(name: str) -> None:
    """25 Ω take 5 kW at 372 V and 130 W at 58 V; the stops give 220 W and 55 W at most."""
    inertia, volts, ramp = (2e-3, 48.0, 25) if name == "ds_c" else (1e-2, 310.0, 20)
    heavy = MotorSpec(inertia_kgm2=inertia, rated_torque_nm=RATED, rated_speed_rpm=3000)
    supply = SupplySpec(voltage_v=volts, sinks=False, capacitance_f=1e-3)
    d = drive(name, motor=heavy, supply=supply)
    for key in ("6083:00", "6084:00"):
        if d.has(key):
            d.set(key, d.ramp(ramp))
    d.enable(d.speed_mode)
    d.set("60FF:00", 30 * d.speed_per_rev_s)
    d.until(lambda: d.speed_rev_s > 28, 30.0, 0.05)
    d.set("60FF:00", 0)
    d.until(lambda: abs(d.speed_rev_s) < 0.1, 30.0, 0.05)
    assert not in_fault(d)


def test_a_braking_resistor_keeps_the_r6l_below_its_limit() -> None:
    """The same, with the resistor of P01.24 = 1: 50 Ω above 380 V."""
    heavy = MotorSpec(inertia_kgm2=1e-2, rated_torque_nm=RATED, rated_speed_rpm=3000)
    d = drive("r6l", motor=heavy, supply=SupplySpec(voltage_v=310, sinks=False, capacitance_f=1e-4))
    d.set("6083:00", d.ramp(20))
    d.set("6084:00", d.ramp(20))
    d.enable(3)
    d.set("60FF:00", 30 * d.speed_per_rev_s)
    d.until(lambda: d.speed_rev_s > 28, 20.0, 0.05)
    d.set("60FF:00", 0)
    d.until(lambda: abs(d.speed_rev_s) < 0.1, 20.0, 0.05)
    assert d.state == OPERATING


UNDER_VOLTAGE = [
    ("mms7", "0x3220"),
    ("m6l", "Er.020"),
    ("r6l", "AL.211"),
    ("ep3e", "Err27"),
    ("ds_c", "1002"),
]


@pytest.mark.parametrize(("name", "code"), UNDER_VOLTAGE)
def test_under_voltage_when_the_supply_sags(name: str, code: str) -> None:
    d = drive(name)
    volts = d.device.mechanics.supply.voltage_v
    d.turn(5.0)
    d.device.inject("supply_v", 0.2 * volts)
    fault = shows(d, code, 5.0)
    assert explained(fault)
    d.device.inject("supply_v", volts)
    d.run(0.5)
    resets(d, fault)


FOLLOWING = [("m6l", "Er.032"), ("r6l", "AL.240"), ("ep3e", "Err4"), ("ds_c", "1008")]


@pytest.mark.parametrize(("name", "code"), FOLLOWING)
def test_following_error_of_a_jammed_axis(name: str, code: str) -> None:
    """The shaft is stuck while the demand goes on."""
    d = drive(name)
    window = {"ds_c": "2500:00"}.get(name, "6065:00")
    if d.has(window):
        d.set(window, round(0.2 * d.per_rev))
    if d.has("6066:00"):
        d.set("6066:00", 20)
    d.set_ramps()
    mode = 1 if 1 in d.profile.supported_modes else 8
    d.enable(mode)
    d.device.inject("coulomb_nm", 50.0)
    if mode == 1:
        d.set_all({"607A:00": 3 * d.per_rev, "6081:00": 5 * d.speed_per_rev_s})
        d.set("6040:00", 0x1F)
    else:
        for step in range(1, 30):
            if in_fault(d):
                break
            d.set("607A:00", step * 0.05 * d.per_rev)
            d.run(0.005)
    fault = shows(d, code, 2.0)
    assert explained(fault)
    d.device.inject("coulomb_nm", 0.0)
    resets(d, fault)


ENCODER = [
    ("mms7", "SENSOR_ERR"),
    ("m6l", "Er.019"),
    ("r6l", "AL.121"),
    ("ep3e", "Err40"),
    ("ds_c", "1003"),
]


@pytest.mark.parametrize(("name", "code"), ENCODER)
def test_encoder_cable_pulled_in_motion(name: str, code: str) -> None:
    d = drive(name)
    d.turn(5.0)
    d.device.inject("encoder_loss")
    fault = shows(d, code, 0.5)
    assert explained(fault)
    d.command(0x00, 0x80, 0x00)
    assert in_fault(d)  # the cause is still there
    d.device.inject("encoder_loss", 0.0)
    resets(d, fault)


TEMPERATURE = [("mms7", "0x4210"), ("m6l", "Er.008"), ("r6l", "AL.248"), ("ep3e", "Err18")]


@pytest.mark.parametrize(("name", "code"), TEMPERATURE)
def test_over_temperature_in_a_hot_cabinet(name: str, code: str) -> None:
    d = drive(name)
    if name == "mms7":
        d.turn(5.0)
        d.device.inject("temperature_c", 70)
        d.run(0.01)
        assert d.status & 1 << 7  # 20 °C below the threshold of 85 (004:4842)
    else:
        d.turn(5.0)
    d.device.inject("ambient_c", 150)
    d.device.inject("temperature_c", 99)
    fault = shows(d, code, 120.0, 0.5)
    assert explained(fault)
    d.command(0x00, 0x80, 0x00)
    assert in_fault(d)
    d.device.inject("ambient_c", 25)
    d.device.inject("temperature_c", 40)
    d.run(0.05)
    resets(d, fault)


def jam(d: OnWire) -> None:
    """At speed, then stuck."""
    d.turn(5.0)
    d.device.inject("coulomb_nm", 50.0)


def test_locked_rotor_of_the_mms7() -> None:
    """Above rated current without motion for 200Bh:06 = 1 s (004:4752)."""
    d = drive("mms7")
    jam(d)
    fault = shows(d, "0x7121", 3.0)
    resets(d, fault)


def test_overload_of_the_mms7() -> None:
    """More than 2042h:02 for 2042h:03 (004:4780)."""
    d = drive("mms7")
    d.set_all({"2042:01": 1, "2042:02": 1500, "2042:03": 200, "200B:01": 0})
    write_settings(d)
    jam(d)
    resets(d, shows(d, "0x3230", 2.0))


def test_speed_error_of_the_mms7() -> None:
    """More than 200Bh:0D for 200Bh:0E = 10 ms (004:4880)."""
    d = drive("mms7")
    d.set_all({"200B:0D": 200, "200B:01": 0})
    write_settings(d)
    jam(d)
    resets(d, shows(d, "0x8401", 2.0, 1e-3))


def test_over_current_of_the_mms7() -> None:
    """A threshold below what 250 % torque takes (004:4713)."""
    d = drive("mms7")
    peak_a = 2.5 * d.device.axis.motor.rated_current_a * math.sqrt(2)
    d.set_all({"200B:02": int(peak_a) - 3})
    write_settings(d)
    d.device.inject("coulomb_nm", 50.0)
    d.enable(4)
    d.set_all({"6087:00": 100000, "6071:00": 2500})
    resets(d, shows(d, "0x2300", 1.0, 1e-3))


def test_position_limit_of_the_mms7() -> None:
    """A limit switch in motion (004:4800)."""
    d = drive(
        "mms7",
        travel=TravelSpec(min_rev=-4, max_rev=4),
        switches=SwitchSpec(negative_limit_rev=-3, positive_limit_rev=3),
    )
    d.set("2030:02", 2)
    write_settings(d)
    d.turn(5.0, seconds=0.4)
    shows(d, "POS_LIMIT", 2.0)
    d.command(0x00, 0x80, 0x00)
    assert not in_fault(d)


def test_stall_of_the_r6l() -> None:
    """Torque at its limit for P01.57 = 200 ms (002:8656-8690)."""
    d = drive("r6l")
    d.set("2006:02", 2000)
    jam(d)
    stuck_s = d.until(lambda: in_fault(d), 5.0, 0.01)
    assert stuck_s > 0.2
    resets(d, shows(d, "AL.247", 0.1))


def test_stall_of_the_r6l_can_be_switched_off() -> None:
    """P01.58 = 0: the overload protection is what is left."""
    d = drive("r6l")
    d.set("2001:3B", 0)
    jam(d)
    shows(d, "AL.245", 10.0, 0.05)


OVERLOAD = [("r6l", "AL.245"), ("ep3e", "Err16"), ("ds_c", "1007")]


@pytest.mark.long(keep=2)
@pytest.mark.parametrize(("name", "code"), OVERLOAD)
def test_overload_at_twice_the_rated_torque(name: str, code: str) -> None:
    """I²t: a weight of 1.9 times the rated torque is held for a while, and no longer."""
    heavy = MotorSpec(inertia_kgm2=2e-3, rated_torque_nm=RATED, rated_speed_rpm=3000)
    d = drive(name, motor=heavy)
    if name == "ds_c":
        d.set("2506:00", 1000)  # acts at the next enabling
    d.turn(0.5)
    d.device.inject("load_nm", 1.9 * RATED)
    fault = shows(d, code, 20.0, 0.1)
    assert explained(fault)
    d.device.inject("load_nm", 0.0)
    d.command(0x00, 0x80, 0x00)
    if fault.reset_by == "command":
        assert in_fault(d)  # still hot
        d.run(5.0)
    resets(d, fault)


@pytest.mark.long
@pytest.mark.parametrize(("action", "state"), [(0, FAULT), (1, OPERATING)])
def test_overload_of_the_m6l_does_what_p10_06_says(action: int, state: int) -> None:
    """000:3476: fault and coast, or an alarm in bit 7; reset after 60 s only (000:3882)."""
    d = drive("m6l")
    d.set("200A:07", action)
    d.turn(0.5)
    d.device.inject("load_nm", 1.9 * RATED)
    d.until(lambda: d.get("603F:00") == 0xFF0C, 20.0, 0.1)
    assert d.state == state
    assert bool(d.status & 1 << 7) == (action == 1)
    if action == 1:
        return
    d.device.inject("load_nm", 0.0)
    d.run(50.0)
    d.command(0x00, 0x80, 0x00)
    assert in_fault(d)
    d.run(11.0)
    d.command(0x80, 0x00)
    assert not in_fault(d)


HOLDING = [("m6l", 0xFF27), ("r6l", None), ("ep3e", None), ("ds_c", None)]


@pytest.mark.parametrize(("name", "warning"), HOLDING)
def test_a_limit_switch_stops_and_lets_back(name: str, warning: int | None) -> None:
    """It brakes and holds; only the other direction is open, and a warning shows (M6-L, R6L)."""
    d = drive(
        name,
        travel=TravelSpec(min_rev=-4, max_rev=4),
        switches=SwitchSpec(negative_limit_rev=-2, positive_limit_rev=2),
    )
    d.turn(3.0, seconds=0.3)
    d.until(lambda: abs(d.speed_rev_s) < 0.05, 2.0)
    d.run(0.2)
    assert 2.0 < d.angle_rev < 2.3
    assert not in_fault(d)
    at = d.angle_rev
    if warning is not None:
        assert d.status & 1 << 7
        assert d.get("603F:00") == warning
    if name == "r6l":
        assert d.status & 1 << 7
        assert d.get("60FD:00") & 7 == 1  # bit 0 is the forward limit
    elif name != "m6l":
        assert d.get("60FD:00") & 7 == 2
    d.run(0.3)
    assert d.angle_rev == pytest.approx(at, abs=0.01)
    d.set("60FF:00", -2 * d.speed_per_rev_s)
    d.run(0.5)
    assert d.angle_rev < 1.9
    if warning is not None:
        assert not d.status & 1 << 7


def test_the_negative_limit_switch_of_the_m6l_has_a_warning_of_its_own() -> None:
    """AL.040, 603Fh FF28h: it holds, and the way forward ends it (000:3981).

    P10.04 is at its default, whose meaning is not printed and which is treated as 1.
    """
    d = drive(
        "m6l",
        travel=TravelSpec(min_rev=-4, max_rev=4),
        switches=SwitchSpec(negative_limit_rev=-2, positive_limit_rev=2),
    )
    d.turn(-3.0, seconds=0.3)
    d.until(lambda: abs(d.speed_rev_s) < 0.05, 2.0)
    d.run(0.2)
    assert -2.3 < d.angle_rev < -2.0
    assert not in_fault(d)
    assert d.status & 1 << 7
    assert d.get("603F:00") == 0xFF28
    d.set("60FF:00", 2 * d.speed_per_rev_s)
    d.run(0.5)
    assert d.angle_rev > -1.9
    assert not d.status & 1 << 7


def test_m6l_over_travel_as_a_fault() -> None:
    """P10.04 = 0: Er.039 forward, Er.040 backward (000:3474, 000:3922)."""
    for sign, code in ((1, "Er.039"), (-1, "Er.040")):
        d = drive(
            "m6l",
            travel=TravelSpec(min_rev=-4, max_rev=4),
            switches=SwitchSpec(negative_limit_rev=-2, positive_limit_rev=2),
        )
        d.set("200A:05", 0)
        d.turn(sign * 3.0, seconds=0.3)
        fault = shows(d, code, 2.0)
        assert fault.remedies


LIMITED = [
    ("mms7", {}),
    ("m6l", {}),
    ("r6l", {"2001:36": 1}),
    ("ep3e", {}),
    ("generic402", {}),
]


@pytest.mark.parametrize(("name", "settings"), LIMITED)
def test_software_limits_stop_a_move(name: str, settings: dict[str, int]) -> None:
    """607Dh; a target beyond is cut off and bit 11 shows so."""
    d = drive(name)
    d.set_all(settings)
    d.set_all({"607D:01": -d.per_rev, "607D:02": d.per_rev})
    d.set_ramps()
    if 1 in d.profile.supported_modes:
        d.set("6081:00", 5 * d.speed_per_rev_s)
        d.enable(1)
        d.set("607A:00", 3 * d.per_rev)
        d.set("6040:00", 0x1F)
    else:
        d.enable(8)
        for step in range(1, 151):
            d.set("607A:00", 0.02 * step * d.per_rev)
            d.run(0.004)
    d.run(1.0)
    assert d.angle_rev == pytest.approx(1.0, abs=0.01)
    assert d.status & 1 << 11


def test_ds_c_and_r6l_software_limits_wait_for_homing() -> None:
    """2405h = 1 (003:560) and P01.53 = 2 (002:8620)."""
    for name, key, raw in (("ds_c", "2405:00", 1), ("r6l", "2001:36", 2)):
        d = drive(name)
        first, second = (1, -1) if name == "ds_c" else (-1, 1)
        d.set_all({key: raw, "607D:01": first * d.per_rev, "607D:02": second * d.per_rev})
        d.set_ramps()
        d.set("6081:00", 5 * d.speed_per_rev_s)
        d.set("6098:00", 35)
        d.enable(1)
        d.set("607A:00", 3 * d.per_rev)
        d.set("6040:00", 0x1F)
        d.run(2.0)
        assert d.angle_rev == pytest.approx(3.0, abs=0.01)
        d.set("6040:00", 0x0F)
        d.set("6060:00", 6)
        d.command(0x1F)
        d.run(0.05)
        d.set("6040:00", 0x0F)
        d.set("6060:00", 1)
        d.set("607A:00", 3 * d.per_rev)
        d.set("6040:00", 0x1F)
        d.run(2.0)
        assert d.angle_rev == pytest.approx(4.0, abs=0.01)


# --- everything else is injected ---------------------------------------------------------------


def every_entry() -> list[tuple[str, str]]:
    """All but the warnings that live and die with a limit switch."""
    switches = ("AL.039", "AL.040", "AL.480", "AL.481")
    return [
        (name, fault.code)
        for name in FAMILIES
        for fault in load_profile(name).faults
        if fault.code not in switches
    ]


@pytest.mark.long(keep=22)
@pytest.mark.parametrize(("name", "code"), every_entry())
def test_every_entry_of_every_table_can_be_raised_and_ends_as_it_says(name: str, code: str) -> None:
    d = OnWire(name, None)
    fault = entry(d, code)
    if name == "m6l":
        d.set("200A:07", 0)  # the overload is a fault, not an alarm
    d.device.inject(code)
    d.run(0.01)
    if fault.kind == "warning":
        assert d.status & 1 << 7
        assert not in_fault(d)
        if fault.code_raw is not None:
            assert d.get("603F:00") == fault.code_raw
        return
    assert in_fault(d)
    if fault.code_raw is not None:
        assert d.get("603F:00") == fault.code_raw
    d.run(61.0 if code in ("Er.011", "Er.012") else 0.0)
    d.command(0x00, 0x80, 0x00)
    assert in_fault(d) == (fault.reset_by != "command")
    if in_fault(d):
        d.device.power_cycle()
        d.run(0.01)
        assert not in_fault(d)
