"""Every stop that a manual lists, over the wire: how long it takes, where it ends, what it leaves.

Expected times are v/a and J·ω/T of a motor alone. 605Ah to 605Eh: 004:2451-2551 and 004:4920-4955
(MMS7), 000:3006-3030 (M6-L), 001:870-945 (EP3E), 002:8141-8230 and 002:12828 (R6L).
"""

from __future__ import annotations

import math
from typing import Any

import pytest

from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.mechanics import FrictionSpec, MechanicsSpec, MotorSpec

from .on_wire import EVERY, Aborted, OnWire

SOD, READY, ON, OPERATING, QUICK, FAULT = 0x40, 0x21, 0x23, 0x27, 0x07, 0x08
J, RATED = 5e-5, 1.27
SPEED = 10.0  # rev/s
FREE = MotorSpec(inertia_kgm2=J, rated_torque_nm=RATED, rated_speed_rpm=3000)


def turning(name: str, coulomb_nm: float = 0.0, **settings: float) -> OnWire:
    friction = FrictionSpec(coulomb_nm=coulomb_nm)
    d = OnWire(name, MechanicsSpec(motor=FREE, friction=friction))
    for key, raw in settings.items():
        d.set(key.removeprefix("x").replace("_", ":"), raw)
    if name in ("m6l", "r6l"):
        d.set({"m6l": "2009:27", "r6l": "2006:0D"}[name], 0)  # the motor is alone
    d.turn(SPEED)
    return d


def time_to_stop(d: OnWire, limit_s: float = 3.0) -> float:
    """Until the axis is below 12 rpm: drives cut the power at 10 rpm."""
    return d.until(lambda: abs(d.speed_rev_s) < 0.2, limit_s, 1e-3)


def at_torque(torque_nm: float) -> float:
    """Seconds from `SPEED` to rest."""
    return J * SPEED * 2 * math.pi / torque_nm


def ends(d: OnWire, state: int) -> None:
    d.run(0.1)
    expected = state | (0x20 if d.drive == "ep3e" and state == SOD else 0)
    assert d.state == expected


QUICK_STOPS: list[Any] = [
    # family, option, time to rest, state afterwards
    ("mms7", 1, SPEED / 50, SOD), ("mms7", 2, SPEED / 100, SOD),
    ("mms7", 3, at_torque(0.2 * RATED), SOD), ("mms7", 4, at_torque(3 * RATED), SOD),
    ("mms7", 5, SPEED / 50, QUICK), ("mms7", 6, SPEED / 100, QUICK),
    ("mms7", 7, at_torque(0.2 * RATED), QUICK), ("mms7", 8, at_torque(3 * RATED), QUICK),
    ("m6l", 1, SPEED / 50, SOD), ("m6l", 2, SPEED / 100, SOD),
    ("m6l", 5, SPEED / 50, QUICK), ("m6l", 6, SPEED / 100, QUICK),
    ("r6l", 1, SPEED / 50, SOD), ("r6l", 2, SPEED / 100, SOD),
    ("r6l", 5, SPEED / 50, QUICK), ("r6l", 6, SPEED / 100, QUICK),
    ("ep3e", 1, SPEED / 50, SOD), ("ep3e", 2, SPEED / 100, SOD), ("ep3e", 3, SPEED / 200, SOD),
    ("ep3e", 5, SPEED / 50, QUICK), ("ep3e", 6, SPEED / 100, QUICK),
    ("ep3e", 7, SPEED / 200, QUICK),
    ("generic402", 1, SPEED / 50, SOD), ("generic402", 2, SPEED / 100, SOD),
    ("generic402", 5, SPEED / 50, QUICK), ("generic402", 6, SPEED / 100, QUICK),
]  # fmt: skip


@pytest.mark.long(keep=8)
@pytest.mark.parametrize(("name", "option", "seconds", "state"), QUICK_STOPS)
def test_quick_stop(name: str, option: int, seconds: float, state: int) -> None:
    d = turning(name)
    d.set("605A:00", option)
    d.set("6040:00", 0x02)
    assert d.state == QUICK
    # The loop lags behind the ramp, and a torque needs its time to build up.
    assert time_to_stop(d) == pytest.approx(seconds, rel=0.25, abs=0.03)
    ends(d, state)
    assert d.device.axis.powered == (state == QUICK)


@pytest.mark.parametrize("name", ["mms7", "m6l", "ep3e", "generic402"])
def test_quick_stop_option_0_coasts(name: str) -> None:
    """Without friction the axis goes on; EP3E shows that the stop is not over (001:882)."""
    d = turning(name)
    d.set("605A:00", 0)
    d.set("6040:00", 0x02)
    d.run(0.3)
    assert d.speed_rev_s == pytest.approx(SPEED, rel=0.02)
    assert not d.device.axis.powered
    assert d.state == (QUICK if name == "ep3e" else SOD)


def test_ep3e_changes_state_when_a_coasting_axis_stands() -> None:
    d = turning("ep3e", coulomb_nm=0.05)
    d.set("605A:00", 0)
    d.set("6040:00", 0x02)
    assert d.state == QUICK
    assert time_to_stop(d) == pytest.approx(at_torque(0.05), rel=0.1)
    ends(d, SOD)


@pytest.mark.parametrize(
    ("name", "key", "refused"),
    [
        ("m6l", "605A:00", (3, 4)),
        ("m6l", "605D:00", (0, 3)),
        ("m6l", "605B:00", (2,)),
        ("ep3e", "605A:00", (4,)),
        ("ep3e", "605C:00", (2,)),
        ("mms7", "605A:00", (9,)),
        ("r6l", "605A:00", (8,)),
        ("r6l", "605D:00", (0, 4)),
    ],
)
def test_options_that_are_not_listed_are_refused(name: str, key: str, refused: Any) -> None:
    d = OnWire(name, None)
    before = d.get(key)
    for option in refused:
        with pytest.raises(Aborted) as error:
            d.set(key, option)
        assert error.value.code in (0x06090030, 0x06090031, 0x06090032)
    assert d.get(key) == before


@pytest.mark.parametrize("name", ["mms7", "m6l", "ep3e", "generic402"])
@pytest.mark.parametrize(
    ("key", "word", "state"), [("605B:00", 0x06, READY), ("605C:00", 0x07, ON)]
)
@pytest.mark.parametrize("option", [0, 1])
def test_shutdown_and_disable_operation(
    name: str, key: str, word: int, state: int, option: int
) -> None:
    """0 cuts the current, 1 brakes by 6084h first."""
    d = turning(name)
    d.set(key, option)
    d.set("6040:00", word)
    if option == 1:
        assert d.state == OPERATING
        assert time_to_stop(d) == pytest.approx(SPEED / 50, rel=0.1, abs=0.02)
        ends(d, state)
    else:
        d.run(0.2)
        assert d.speed_rev_s == pytest.approx(SPEED, rel=0.02)
        assert d.state == (OPERATING if name == "ep3e" else state)
    assert not d.device.axis.powered


@pytest.mark.parametrize(("option", "seconds"), [(0, None), (1, SPEED / 50)])
def test_ep3e_uses_605b_for_disable_voltage(option: int, seconds: float | None) -> None:
    """001:905."""
    d = turning("ep3e")
    d.set("605B:00", option)
    d.set("6040:00", 0x00)
    if seconds is None:
        d.run(0.2)
        assert not d.device.axis.powered
        assert d.speed_rev_s == pytest.approx(SPEED, rel=0.02)
    else:
        assert time_to_stop(d) == pytest.approx(seconds, rel=0.1, abs=0.02)
        ends(d, SOD)


@pytest.mark.parametrize("name", ["mms7", "m6l", "generic402"])
def test_disable_voltage_coasts(name: str) -> None:
    d = turning(name)
    d.set("6040:00", 0x00)
    d.run(0.2)
    assert d.state == SOD
    assert d.speed_rev_s == pytest.approx(SPEED, rel=0.02)


HALTS = [
    ("mms7", 1, SPEED / 50), ("mms7", 2, SPEED / 100), ("mms7", 3, at_torque(0.2 * RATED)),
    ("mms7", 4, at_torque(3 * RATED)), ("m6l", 1, SPEED / 50), ("m6l", 2, SPEED / 100),
    ("r6l", 1, SPEED / 50), ("r6l", 2, SPEED / 100), ("r6l", 3, at_torque(RATED)),
    ("generic402", 1, SPEED / 50), ("generic402", 2, SPEED / 100),
]  # fmt: skip


@pytest.mark.parametrize(("name", "option", "seconds"), HALTS)
def test_halt_holds_and_goes_on(name: str, option: int, seconds: float) -> None:
    """605Dh: at standstill under power in Operation enabled; on with the speed when bit 8 falls."""
    d = turning(name)
    d.set("605D:00", option)
    d.set("6040:00", 0x10F)
    assert time_to_stop(d) == pytest.approx(seconds, rel=0.25, abs=0.03)
    d.run(0.1)
    assert d.state == OPERATING
    assert d.status & 1 << 10  # stopped
    assert abs(d.speed_rev_s) < 0.05
    d.set("6040:00", 0x0F)
    d.run(0.6)
    assert d.speed_rev_s == pytest.approx(SPEED, rel=0.02)


def test_halt_option_0_of_the_mms7_coasts_under_power() -> None:
    """004:2600."""
    d = turning("mms7")
    d.set("605D:00", 0)
    d.set("6040:00", 0x10F)
    d.run(0.2)
    assert d.state == OPERATING
    assert d.speed_rev_s == pytest.approx(SPEED, rel=0.02)


REACTIONS = [
    (0, None),
    (1, SPEED / 50),
    (2, SPEED / 100),
    (3, at_torque(0.2 * RATED)),
    (4, at_torque(3 * RATED)),
]


@pytest.mark.parametrize(("option", "seconds"), REACTIONS)
def test_fault_reaction_of_the_mms7(option: int, seconds: float | None) -> None:
    """605Eh for a configurable fault (004:4920-4945)."""
    d = turning("mms7")
    d.set("605E:00", option)
    d.device.inject("overload")
    if seconds is None:
        d.run(0.2)
        assert d.speed_rev_s == pytest.approx(SPEED, rel=0.02)
    else:
        assert d.state == 0x0F
        assert time_to_stop(d) == pytest.approx(seconds, rel=0.25, abs=0.03)
    ends(d, FAULT)


@pytest.mark.parametrize("trouble", ["over_current", "power_stage", "over_temperature"])
def test_fixed_faults_of_the_mms7_switch_off_at_once(trouble: str) -> None:
    """004:4951-4955."""
    d = turning("mms7")
    d.set("605E:00", 2)
    d.device.inject(trouble)
    d.run(0.2)
    assert d.speed_rev_s == pytest.approx(SPEED, rel=0.02)
    assert d.state == FAULT


@pytest.mark.parametrize("name", ["m6l", "ep3e", "ds_c"])
def test_faults_of_the_others_switch_off_at_once(name: str) -> None:
    """M6-L: "protection and coast to stop"; EP3E: brake and PWM off at once (001:940)."""
    d = turning(name)
    d.device.inject("following_error")
    d.run(0.2)
    assert not d.device.axis.powered
    assert d.speed_rev_s == pytest.approx(SPEED, rel=0.02)


# --- R6L: how the servo goes off, P01.06 (002:8147), and how faults stop, P01.08 and P01.09 -----


def brakes_dynamically(d: OnWire) -> bool:
    """The shorted windings brake with J·3R/Kt², 1 ms here, behind a current loop of 0.2 ms."""
    motor = d.device.axis.motor
    tau_s = J * 3 * motor.resistance_ohm / motor.torque_constant**2
    assert tau_s == pytest.approx(1e-3, rel=0.05)
    before, then = d.speed_rev_s, d.device.axis.s.item(k.S_STEP)
    d.run(0.002)
    passed_s = (d.device.axis.s.item(k.S_STEP) - then) * k.STEP_S
    # ω' = −T/J, T' = (ω·J/τ − T)/lag with T(0) = 0: two real poles.
    lag_s = 1 / (2 * math.pi * 1000)
    root = math.sqrt(1 - 4 * lag_s / tau_s)
    slow, fast = (1 - root) / (2 * lag_s), (1 + root) / (2 * lag_s)
    share = (fast * math.exp(-slow * passed_s) - slow * math.exp(-fast * passed_s)) / (fast - slow)
    return d.speed_rev_s == pytest.approx(before * share, rel=0.25)


@pytest.mark.parametrize("option", range(5))
def test_r6l_servo_off(option: int) -> None:
    d = turning("r6l", x2001_07=option)
    d.set("6040:00", 0x06)
    if option in (0, 2):
        d.run(0.2)
        assert d.speed_rev_s == pytest.approx(SPEED, rel=0.02)
    elif option == 3:
        assert brakes_dynamically(d)
    else:
        assert time_to_stop(d) == pytest.approx(SPEED / 100, rel=0.1, abs=0.02)
        ends(d, READY)
        assert d.device.axis.powered == (option == 1)


@pytest.mark.parametrize(
    ("code", "key", "option", "way"),
    [
        ("AL.247", "2001:0A", 0, "coast"),
        ("AL.247", "2001:0A", 2, "dynamic"),
        ("AL.301", "2001:09", 0, "coast"),
        ("AL.301", "2001:09", 2, "dynamic"),
        ("AL.301", "2001:09", 3, "ramp"),
        ("AL.301", "2001:09", 4, "ramp"),
        ("AL.301", "2001:09", 5, "dynamic"),
    ],
)
def test_r6l_stops_by_the_kind_of_fault(code: str, key: str, option: int, way: str) -> None:
    d = turning("r6l")
    d.set(key, option)
    d.device.inject(code)
    if way == "coast":
        d.run(0.2)
        assert d.speed_rev_s == pytest.approx(SPEED, rel=0.02)
    elif way == "dynamic":
        assert brakes_dynamically(d)
    else:
        assert time_to_stop(d) == pytest.approx(SPEED / 100, rel=0.1, abs=0.02)
        ends(d, FAULT)


# --- torque modes, emergency inputs ---------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "mode", "option"), [("m6l", 4, 1), ("m6l", 10, 6), ("ep3e", 10, 2), ("ep3e", 10, 5)]
)
def test_torque_modes_take_the_torque_back_by_6087h(name: str, mode: int, option: int) -> None:
    """000:3017, 001:893: 100 % at 200 %/s take half a second."""
    d = OnWire(name, MechanicsSpec(motor=FREE, friction=FrictionSpec(viscous_nms=0.02)))
    d.set_all({"605A:00": option, "6087:00": 20000})
    d.enable(mode)
    d.set("6071:00", 1000)
    d.run(1.0)
    assert d.get("6077:00") == pytest.approx(1000, abs=20)
    d.set("6087:00", 2000)
    d.set("6040:00", 0x02)
    d.run(0.25)
    assert d.get("6077:00") == pytest.approx(500, abs=30)
    d.run(0.35)
    assert abs(d.get("6077:00")) <= 10
    d.run(0.3)
    ends(d, QUICK if option >= 5 else SOD)


@pytest.mark.parametrize(("mode", "braking"), [(0, None), (1, 100.0)])
def test_ep3e_emergency_input_follows_p164(mode: int, braking: float | None) -> None:
    """001:874-879: 0 cuts the current, 1 stops by 6085h under power."""
    d = turning("ep3e", x20A4_00=mode)
    d.device.inject("di1")
    if braking is None:
        d.run(0.2)
        assert not d.device.axis.powered
        assert d.speed_rev_s == pytest.approx(SPEED, rel=0.02)
    else:
        assert time_to_stop(d) == pytest.approx(SPEED / braking, rel=0.1, abs=0.02)


@pytest.mark.parametrize("enabled", [0, 1])
def test_m6l_emergency_input_stops_by_605a_and_warns(enabled: int) -> None:
    """Function 34 with P02.09 (000:3014, 000:3233); AL.038."""
    d = OnWire("m6l", MechanicsSpec(motor=FREE))
    d.set_all({"2003:01": 34, "2002:0A": enabled, "605A:00": 2, "2009:27": 0})
    d.turn(SPEED)
    d.device.inject("di1")
    if enabled:
        assert time_to_stop(d) == pytest.approx(SPEED / 100, rel=0.1, abs=0.02)
        assert d.status & 1 << 7
        assert d.get("603F:00") == 0xFF26
    else:
        d.run(0.3)
        assert d.speed_rev_s == pytest.approx(SPEED, rel=0.02)


def test_r6l_emergency_input_stops_and_warns() -> None:
    """Function 11 on DI3 by default (002:9089), AL.440."""
    d = turning("r6l")
    d.device.inject("di3")
    time_to_stop(d)
    assert d.status & 1 << 7
    assert d.state != OPERATING


@pytest.mark.parametrize("name", EVERY)
def test_a_stop_under_way_ends_before_enabling_again(name: str) -> None:
    """Words that come during a ramp do not accelerate the axis again."""
    d = turning(name)
    if d.has("605A:00"):
        d.set("605A:00", 2)
    d.set("6040:00", 0x0B)
    d.run(0.02)
    speed = d.speed_rev_s
    assert speed < SPEED
    d.set("6040:00", 0x0F)
    d.run(0.02)
    assert d.speed_rev_s < speed
