"""What the families do besides moving, over their wires: identification, gains, brake, terminals,
probes, memory and histories.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.mechanics import FrictionSpec, LoadSpec, MechanicsSpec, MotorSpec, TravelSpec

from .on_wire import Aborted, OnWire

ROTOR = 5e-5
MOTOR = MotorSpec(inertia_kgm2=ROTOR, rated_torque_nm=1.27, rated_speed_rpm=3000)


def drive(name: str, load: float = 0.0, folder: Path | None = None, **parts: Any) -> OnWire:
    """A motor, stiffly coupled to a load of so many times its inertia."""
    spec: dict[str, Any] = {"motor": MOTOR, "friction": FrictionSpec(coulomb_nm=0.02), **parts}
    if load:
        spec["load"] = (
            LoadSpec(
                inertia_kgm2=load * ROTOR, stiffness_nm_per_rad=3000, damping_nms_per_rad=0.02
            ),
        )
    return OnWire(name, MechanicsSpec(**spec), folder)


# --- identification -----------------------------------------------------------------------------


@pytest.mark.parametrize("load", [1.5, 4.0])
@pytest.mark.parametrize(
    ("name", "command", "ratio", "per_one"),
    [("m6l", "2009:01", "2009:27", 100), ("r6l", "200C:0C", "2006:0D", 100)],
)
def test_offline_inertia(name: str, command: str, ratio: str, per_one: int, load: float) -> None:
    """P09.00 to P09.04 and P09.38 (000:3417-3465); 200Ch:0Ch and P06.12 (002:11919)."""
    d = drive(name, load)
    d.set(ratio, load * per_one)  # gains that suit, as the manuals ask for a stable axis
    d.set(command, 1)
    d.until(lambda: d.device.axis.powered, 1.0)
    d.until(lambda: not d.device.axis.powered, 30.0, 0.1)
    assert d.get(ratio) / per_one == pytest.approx(load, rel=0.05)
    assert d.state != 0x08


def test_offline_inertia_tells_how_far_it_turns_and_ends_with_the_control_word() -> None:
    """P07.09 = speed × time (002:11161): 500 rpm in 125 ms up and down is 1.04 revolutions."""
    d = drive("r6l", 1.0)
    assert d.get("2007:0A") == 10
    d.set("200C:0C", 1)
    d.run(0.2)
    assert d.device.axis.powered
    d.set("6040:00", 0)
    d.run(0.01)
    assert not d.device.axis.powered


def test_an_axis_that_cannot_turn_fails_its_identification() -> None:
    """AL.273 (002:14650)."""
    d = drive("r6l", 1.0)
    d.device.inject("coulomb_nm", 50.0)
    d.set("200C:0C", 1)
    d.set("2001:3B", 0)
    d.until(lambda: d.state == 0x08, 30.0, 0.1)
    assert d.get("200D:25") in (273, 245, 247)


@pytest.mark.parametrize("mode", [0, 3])
def test_online_inertia_of_the_m6l(mode: int) -> None:
    """P09.05 (000:3422): the ratio follows while the axis works."""
    d = drive("m6l", 3.0)
    d.set_all({"2009:27": 100, "2009:06": mode})
    d.set_ramps()
    d.enable(3)
    for turn in range(30):
        d.set("60FF:00", (8 if turn % 2 else -8) * d.speed_per_rev_s)
        d.run(0.4)
    if mode:
        assert d.get("2009:27") == pytest.approx(300, rel=0.1)
    else:
        assert d.get("2009:27") == 100


def test_identification_of_the_mms7_walks_through_its_states() -> None:
    """Control word bit 11, 200Ch:05, status word bit 14 (004:2650-2819)."""
    d = drive("mms7", 2.0)
    d.enable(3)
    d.set("6040:00", 0x80F)
    seen = []
    for _ in range(4000):
        state = d.get("200C:05")
        if state not in seen:
            seen.append(state)
        if state == 12:
            break
        assert d.status & 1 << 14
        d.run(0.005)
    assert seen == sorted(seen)
    assert {1, 2, 6, 8, 12} <= set(seen)
    assert d.get("200C:0A") * 1e-7 == pytest.approx(3 * ROTOR, rel=0.05)


# --- gains --------------------------------------------------------------------------------------


def mix(d: OnWire) -> float:
    return float(d.device.axis.s[k.S_GAIN_MIX])


SETS = {
    "m6l": {
        "2008:03": 50, "2008:07": 150, "2008:01": 200, "2008:05": 600, "2008:09": 1,
        "2008:0C": 100, "2008:0D": 20, "2008:0B": 100, "2008:0E": 5,
    },
    "r6l": {
        "2006:03": 100, "2006:06": 300, "2006:01": 200, "2006:04": 600, "2006:33": 1,
        "2006:36": 100, "2006:37": 20, "2006:35": 1000, "2006:38": 50,
    },
}  # fmt: skip
SPEED_DEMAND = {"m6l": ("2008:0A", 3), "r6l": ("2006:34", 3)}


@pytest.mark.parametrize("name", ["m6l", "r6l"])
def test_gains_switch_by_speed_with_hysteresis_and_delay(name: str) -> None:
    """Second gains above 100 + 20 rpm, back below 100 − 20 rpm after 100 ms."""
    d = drive(name)
    d.set_all(SETS[name])
    key, raw = SPEED_DEMAND[name]
    d.set(key, raw)
    p = d.device.axis.p
    assert p[k.P_KP_POSITION_2] == pytest.approx(3 * p[k.P_KP_POSITION_1])
    assert p[k.P_KP_SPEED_2] == pytest.approx(3 * p[k.P_KP_SPEED_1])
    d.set_ramps()
    d.enable(3)
    for rpm, share in ((90, 0.0), (110, 0.0), (125, 1.0), (110, 1.0), (85, 1.0)):
        d.set("60FF:00", rpm / 60 * d.speed_per_rev_s)
        d.run(0.15)
        assert mix(d) == share, rpm
    d.set("60FF:00", 75 / 60 * d.speed_per_rev_s)
    d.run(0.05)
    assert mix(d) == 1.0  # the delay
    d.run(0.12)
    assert mix(d) == 0.0


@pytest.mark.parametrize(
    ("name", "terminal", "function"), [("m6l", "2003:05", 3), ("r6l", "2002:01", 7)]
)
def test_gains_switch_by_an_input(name: str, terminal: str, function: int) -> None:
    d = drive(name)
    d.set_all(SETS[name])
    d.set_all({SPEED_DEMAND[name][0]: 1, terminal: function})
    d.enable(3)
    d.run(0.05)
    assert mix(d) == 0.0
    place = 5 if name == "m6l" else 1
    d.device.inject(f"di{place}", 1)
    d.run(0.05)
    assert mix(d) == 1.0


@pytest.mark.parametrize(
    ("name", "mode", "level", "gains"),
    [
        ("m6l", "2009:07", "2009:08", ("2008:03", "2008:01")),
        ("r6l", "2007:01", "2007:02", ("2006:03", "2006:01")),
    ],
)
def test_a_rigidity_level_sets_the_gains(
    name: str, mode: str, level: str, gains: tuple[str, str]
) -> None:
    """Stiffer levels give higher gains; in manual mode a level does nothing."""
    d = drive(name)
    before = [d.get(key) for key in gains]
    d.set(level, 20)
    assert [d.get(key) for key in gains] == before
    d.set(mode, 1)
    soft = [d.get(key) for key in gains]
    d.set(level, 24)
    stiff = [d.get(key) for key in gains]
    assert all(b > a for a, b in zip(soft, stiff, strict=True))
    p = d.device.axis.p
    unit = 0.1 if name == "r6l" else 1.0
    factor = 2 * math.pi if name == "r6l" else 1.0
    assert p[k.P_KP_POSITION_1] == pytest.approx(stiff[0] * unit * factor)


def test_second_gains_of_the_ds_c_by_pa_46() -> None:
    """003:755, effective after release and writing: over the register table."""
    d = drive("ds_c")
    registers = {p.number: p.modbus_register for p in d.profile.parameters}
    d.device.write_registers(registers["PA_39"] or 0, [300])
    d.device.write_registers(registers["PA_46"] or 0, [1])
    d.enable(1)
    d.run(0.01)
    assert mix(d) == 1.0


@pytest.mark.parametrize(("name", "key", "raw"), [("m6l", "2009:20", 40), ("r6l", "2007:20", 40)])
def test_friction_compensation_takes_the_work_from_the_integral(
    name: str, key: str, raw: int
) -> None:
    """4 % of 1.27 Nm is the friction: the integral has nothing left to do."""
    friction = 0.04 * 1.27
    d = drive(name, friction=FrictionSpec(coulomb_nm=friction))
    d.turn(2.0)
    with_friction = d.device.axis.s[k.S_INTEGRAL]
    assert with_friction == pytest.approx(friction, rel=0.05)
    d.command(6)
    d.set(key, raw)
    d.turn(2.0)
    assert abs(d.device.axis.s[k.S_INTEGRAL]) < 0.1 * friction


def test_gravity_compensation_of_the_r6l() -> None:
    """P07.30 in 0.1 % (002:11328)."""
    d = drive("r6l", friction=FrictionSpec(gravity_nm=0.254))
    d.set("2007:1F", 200)
    d.enable(3)
    d.run(0.5)
    assert abs(d.device.axis.s[k.S_INTEGRAL]) < 0.02


@pytest.mark.parametrize(
    ("name", "mode", "frequency"), [("m6l", "2009:09", "2009:0F"), ("r6l", "2007:0C", "2007:13")]
)
def test_the_adaptive_notch_finds_the_resonance_and_calms_it(
    name: str, mode: str, frequency: str
) -> None:
    """A coupling rings at √(k(1/J1 + 1/J2)): 900 Hz here, too much for these gains and filters."""
    inertia, stiffness = 5e-5, 800.0
    ringing_hz = math.sqrt(stiffness * 2 / inertia) / (2 * math.pi)
    d = OnWire(
        name,
        MechanicsSpec(
            motor=MOTOR,
            friction=FrictionSpec(coulomb_nm=0.01),
            load=(
                LoadSpec(
                    inertia_kgm2=inertia, stiffness_nm_per_rad=stiffness, damping_nms_per_rad=0.004
                ),
            ),
        ),
    )
    if name == "m6l":
        d.set_all({"2009:27": 100, "2008:01": 1600, "2008:04": 3})
    else:
        d.set_all({"2006:0D": 100, "2006:01": 1600, "2005:31": 30})
    d.set(mode, 1)
    d.set_ramps()
    d.enable(3)
    d.set("60FF:00", 2 * d.speed_per_rev_s)
    off = 0 if name == "m6l" else 4000
    d.until(lambda: d.get(frequency) != off, 5.0, 0.05)
    assert d.get(frequency) == pytest.approx(ringing_hz, rel=0.15)
    d.run(1.0)
    trace = d.device.axis.trace()
    assert trace.std() < 0.1 * 1.27


# --- brake --------------------------------------------------------------------------------------

BRAKED = MotorSpec(inertia_kgm2=ROTOR, rated_torque_nm=1.27, rated_speed_rpm=3000, brake=True)


def m6l_with_brake() -> OnWire:
    """P01.17 = 1 and DO1 with function 18 (000:1362); the load hangs on the axis."""
    d = OnWire("m6l", MechanicsSpec(motor=BRAKED, friction=FrictionSpec(gravity_nm=0.4)))
    d.set_all({"2001:12": 1, "2003:10": 18, "2009:27": 0})
    return d


def brake_output(d: OnWire) -> bool:
    return bool(d.get("200B:0E") & 1)


def test_brake_of_the_m6l_in_its_order() -> None:
    """Released with the enable, commands after P02.10 = 250 ms; off: P02.11 = 150 ms of power."""
    d = m6l_with_brake()
    d.run(0.5)
    assert abs(d.angle_rev) < 1e-3  # held without power
    d.set_ramps()
    d.enable(3)
    assert brake_output(d)
    d.set("60FF:00", d.speed_per_rev_s)
    d.run(0.15)
    assert abs(d.speed_rev_s) < 0.3  # commands are not accepted yet
    d.run(0.3)
    assert d.speed_rev_s == pytest.approx(1.0, rel=0.1)
    d.set("60FF:00", 0)
    d.run(0.5)
    at = d.angle_rev
    d.set("6040:00", 6)
    assert not brake_output(d)
    d.run(0.14)
    assert d.device.axis.powered
    d.run(0.02)
    assert not d.device.axis.powered
    d.run(0.5)
    assert d.angle_rev == pytest.approx(at, abs=2e-3)  # the load did not sag


def test_brake_of_a_moving_m6l_waits_for_p02_12() -> None:
    """It stops first; the brake closes below P02.12 or after P02.13 (000:1401-1405)."""
    d = m6l_with_brake()
    d.set_ramps()
    d.set("6085:00", d.ramp(20))
    d.enable(3)
    d.run(0.3)
    d.set("60FF:00", 5 * d.speed_per_rev_s)
    d.run(0.6)
    d.set("6040:00", 6)
    d.run(0.1)
    assert d.device.axis.powered
    assert d.speed_rev_s == pytest.approx(3.0, rel=0.15)  # 5 − 20 · 0.1
    d.until(lambda: not d.device.axis.powered, 1.0)
    assert abs(d.speed_rev_s) < 0.3


def test_brake_of_a_faulty_m6l_closes_at_once() -> None:
    """000:1425."""
    d = m6l_with_brake()
    d.enable(3)
    d.run(0.5)
    d.device.inject("following_error")
    d.run(0.01)
    assert not d.device.axis.powered
    assert not brake_output(d)
    d.run(0.5)
    assert abs(d.angle_rev) < 0.02


def test_brake_of_the_r6l_by_p01_12_and_p01_13() -> None:
    """OUT1 is the brake by default: 100 ms to commands, 200 ms to the power's end."""
    d = OnWire("r6l", MechanicsSpec(motor=BRAKED, friction=FrictionSpec(gravity_nm=0.3)))
    d.set("2006:0D", 0)
    d.enable(3)
    d.run(0.3)
    at = d.angle_rev
    d.set("6040:00", 6)
    d.run(0.19)
    assert d.device.axis.powered
    d.run(0.03)
    assert not d.device.axis.powered
    d.run(0.5)
    assert d.angle_rev == pytest.approx(at, abs=3e-3)


# --- terminals and probes -----------------------------------------------------------------------

PROBES = [
    ("mms7", {"2030:01": 4, "200D:00": 0xAAB555AA}, "di1"),
    ("m6l", {"2003:03": 49}, "di3"),
    ("r6l", {}, "di7"),
    ("ep3e", {}, "di6"),
]


@pytest.mark.parametrize(("name", "settings", "terminal"), PROBES)
def test_touch_probe_latches_both_edges(name: str, settings: dict[str, int], terminal: str) -> None:
    d = drive(name)
    d.set_all(settings)
    d.set("60B8:00", 0x31)
    for rev, level in ((0.25, 1), (0.75, 0)):
        d.device.inject("turn_to_rev", rev)
        d.run(0.001)
        d.device.inject(terminal, level)
    assert d.get("60B9:00") & 0x7 == 0x7
    assert d.get("60BA:00") == pytest.approx(0.25 * d.per_rev, abs=0.003 * d.per_rev)
    assert d.get("60BB:00") == pytest.approx(0.75 * d.per_rev, abs=0.003 * d.per_rev)
    # Single: a second edge changes nothing until the probe is started again.
    d.device.inject("turn_to_rev", 1.5)
    d.run(0.001)
    d.device.inject(terminal, 1)
    assert d.get("60BA:00") == pytest.approx(0.25 * d.per_rev, abs=0.003 * d.per_rev)
    d.set("60B8:00", 0)
    assert d.get("60B9:00") & 0x7 == 0


@pytest.mark.parametrize("name", ["m6l", "r6l", "ep3e"])
def test_touch_probe_by_the_index(name: str) -> None:
    """Bit 2 of 60B8h: the encoder's zero pulse, exactly."""
    d = drive(name)
    d.set("60B8:00", 0x15)
    d.turn(2.0, seconds=0.8)
    d.set("6040:00", 0)
    assert d.get("60B9:00") & 2
    turns = d.get("60BA:00") / d.per_rev
    assert turns == pytest.approx(round(turns), abs=1e-3)


def test_m6l_polarity_turns_an_input_round_and_p03_14_switches_it_on() -> None:
    """P03.13, P03.14 (000:3275-3276)."""
    d = drive("m6l")
    bit = 1 << 18
    assert not d.get("60FD:00") & bit
    d.set("2003:0E", 0b100)
    assert d.get("60FD:00") & bit
    d.set_all({"2003:0E": 0, "2003:0F": 0b100})
    assert d.get("60FD:00") & bit


def test_m6l_outputs_by_function() -> None:
    """P03.15 … (000:3278-3290); 60FEh rules only outputs with function 28, in Op."""
    d = drive("m6l")
    d.set("2003:10", 1)  # running
    assert not d.get("200B:0E") & 1
    d.enable(3)
    assert d.get("200B:0E") & 1
    d.set_all({"60FE:02": 1 << 16, "60FE:01": 0})
    assert d.get("200B:0E") & 1


def test_r6l_resets_a_fault_by_an_input() -> None:
    """IN function 2 (002:9003)."""
    d = drive("r6l")
    d.set("2002:01", 2)
    d.device.inject("AL.247")
    d.run(0.01)
    assert d.state == 0x08
    d.device.inject("di1", 1)
    d.run(0.01)
    assert d.state == 0x40


def test_m6l_external_fault_input() -> None:
    """Function 38: Er.043 (000:3924)."""
    d = drive("m6l")
    d.set("2003:01", 38)
    d.device.inject("di1", 1)
    d.run(0.01)
    assert d.get("603F:00") == 0xFF2B


def test_a_limit_switch_without_a_function_is_not_seen() -> None:
    """M6-L DI8 and DI9 have the limits by default; without them nothing stops the axis."""
    d = drive("m6l", travel=TravelSpec(min_rev=-9, max_rev=9))
    d.set_all({"2003:08": 0, "2009:27": 0})
    d.turn(4.0, seconds=0.5)
    d.until(lambda: d.angle_rev > 8.9, 10.0)


# --- histories ----------------------------------------------------------------------------------


def test_m6l_keeps_three_faults_with_their_snapshots() -> None:
    """P10.18 to P10.59 (000:3497-3556), newest first, over a power cycle."""
    d = drive("m6l")
    d.turn(5.0)
    for code in ("Er.032", "Er.043", "Er.027", "Er.019"):
        d.device.inject(code)
        d.run(0.01)
        d.command(0x00, 0x80, 0x00)
    assert [d.get(key) for key in ("200A:13", "200A:14", "200A:15")] == [19, 27, 43]
    d.device.power_cycle()
    d.run(0.01)
    assert [d.get(key) for key in ("200A:13", "200A:14", "200A:15")] == [19, 27, 43]
    assert d.get("200A:16") == pytest.approx(310, abs=5)
    d.set("2002:17", 1)
    assert d.get("200A:13") == 0


def test_m6l_snapshot_is_of_the_moment() -> None:
    d = drive("m6l")
    d.turn(5.0)
    d.device.inject("Er.032")
    d.run(1.0)
    assert d.get("200A:1D") == pytest.approx(3000, rel=0.03)  # 300.0 rpm
    assert d.get("200A:21") & 1  # running


def test_r6l_keeps_ten_faults_behind_a_window() -> None:
    """200Dh:24 chooses, :25 on show (002:12361-12441)."""
    d = drive("r6l")
    resettable = [f.code for f in d.profile.faults if f.reset_by == "command"]
    for code in resettable[-11:]:
        d.device.inject(code)
        d.run(0.01)
        d.command(0x00, 0x80, 0x00)
    d.device.inject("AL.247")
    d.run(0.01)
    numbers = []
    for place in range(10):
        d.set("200D:24", place)
        numbers.append(d.get("200D:25"))
    assert numbers[0] == 247
    assert len(set(numbers)) == 10
    assert int(resettable[-11][3:]) not in numbers
    assert numbers[1] == int(resettable[-1][3:])
    d.set("200D:24", 0)
    assert d.get("200D:2A") == pytest.approx(310, abs=5)
    d.set("200C:01", 2)
    assert d.get("200D:25") == 0


def test_mms7_keeps_twenty_that_no_object_shows() -> None:
    """004:6290; clearing is a command of 200Dh."""
    d = drive("mms7")
    for _ in range(25):
        d.device.inject("overload")
        d.run(0.01)
        d.command(0x00, 0x80, 0x00)
    assert len(d.device.control.alarms.log.records) == 20
    d.set("200D:00", 0x11111120)
    assert not d.device.control.alarms.log.records


# --- memory -------------------------------------------------------------------------------------

#: family, parameter, value, how it is saved (key, raw, seconds)
SAVING = [
    ("mms7", "2005:03", 1234, ("200D:00", 0x65766173, 0.0)),
    ("r6l", "2006:01", 333, None),
    ("ep3e", "2005:00", 77, ("1010:01", 0x45534554, 10.1)),
    ("ds_c", "6083:00", 321, ("2201:00", 1, 0.0)),
]


@pytest.mark.parametrize(("name", "key", "raw", "how"), SAVING)
def test_what_is_not_saved_is_lost(
    name: str, key: str, raw: int, how: tuple[str, int, float] | None, tmp_path: Path
) -> None:
    d = drive(name, folder=tmp_path)
    before = d.get(key)
    d.set(key, raw)
    d.device.power_cycle()
    d.run(0.01)
    assert d.get(key) == before
    if how is None:
        d.set("2008:0C", 6)  # the saving mask lets later writes through (002:11421)
        d.set(key, raw)
    else:
        d.set(key, raw)
        d.set(how[0], how[1])
        d.run(how[2])
    d.device.power_cycle()
    d.run(0.01)
    assert d.get(key) == raw
    again = drive(name, folder=tmp_path)
    assert again.get(key) == raw


RESTORING = [
    ("mms7", "2005:03", "200D:00", 0x64616F6C, 0.0),
    ("m6l", "2008:01", "2011:1B", 1, 0.0),
    ("r6l", "2006:01", "200C:01", 1, 0.0),
    ("ep3e", "2005:00", "1010:01", 0x45444546, 10.1),
    ("ds_c", "6083:00", "2202:00", 1, 0.0),
]


@pytest.mark.parametrize(("name", "key", "command", "raw", "seconds"), RESTORING)
def test_restore_brings_the_start_values_back(
    name: str, key: str, command: str, raw: int, seconds: float
) -> None:
    d = drive(name)
    before = d.get(key)
    d.set(key, before + 7)
    d.set(command, raw)
    d.run(seconds)
    assert d.get(key) == before


def test_ep3e_bears_no_sdo_while_it_stores() -> None:
    """001:1209-1212: Err68, 1010h:01 reads 1, and what was to be saved is not."""
    d = drive("ep3e")
    d.set("2005:00", 77)
    d.set("1010:01", 0x45534554)
    d.run(0.2)
    with pytest.raises(Aborted):
        d.get("6041:00")
    d.run(10.1)
    assert d.get("1010:01") == 1
    assert d.get("603F:00") == 0xFF44
    d.device.power_cycle()
    d.run(0.01)
    assert d.get("2005:00") != 77


def test_ep3e_gear_out_of_range_is_err80_at_init_to_preop() -> None:
    """001:1035-1036: 1/1000 to 1000, effective from Init to Pre-Operational."""
    d = drive("ep3e")
    d.set_all({"6092:01": 100, "6091:01": 1, "6091:02": 1})
    d.run(0.01)
    assert d.state == 0x60
    d.restart_network()
    d.run(0.01)
    assert d.state == 0x08
    assert d.get("603F:00") == 0xFF50


def test_m6l_write_protection() -> None:
    """P02.21 (000:3248): 1 leaves itself and P06.01, 2 only itself."""
    d = drive("m6l")
    d.set("2002:16", 1)
    with pytest.raises(Aborted):
        d.set("2008:01", 300)
    d.set("2006:02", 10)
    d.set("2002:16", 2)
    with pytest.raises(Aborted):
        d.set("2006:02", 20)
    d.set("2002:16", 0)
    d.set("2008:01", 300)


def test_m6l_memory_wears_out() -> None:
    """P17.24 = 1 stores every write (000:3670); a worn memory is Er.013."""
    d = drive("m6l")
    storage = d.device._storage  # nobody writes a hundred thousand times
    before = storage.writes
    d.set("2008:01", 300)
    assert storage.writes == before + 1
    storage.writes = 100_000
    with pytest.raises(Aborted) as error:
        d.set("2008:01", 301)
    assert error.value.code == 0x08000020
    assert d.get("603F:00") == 0xFF0D
    assert d.get("2008:01") in (300, 301)


@pytest.mark.parametrize(
    ("name", "key"), [("m6l", "2009:27"), ("m6l", "2003:01"), ("m6l", "2008:01")]
)
def test_m6l_refuses_what_is_only_set_at_stop(name: str, key: str) -> None:
    """The property column (000:3174 on)."""
    d = drive(name)
    raw = d.get(key)
    d.enable(3)
    if d.profile.by_key[key].settable == "stopped":
        with pytest.raises(Aborted) as error:
            d.set(key, raw)
        assert error.value.code == 0x08000022
    else:
        d.set(key, raw)
    d.command(6)
    d.set(key, raw)


def test_mms7_settings_act_after_write_settings() -> None:
    """004:2362."""
    d = drive("mms7")
    p = d.device.axis.p
    before = p[k.P_KP_SPEED_1]
    d.set("2005:03", 1000)
    assert p[k.P_KP_SPEED_1] == before
    d.set("200D:00", 0xAAB555AA)
    assert p[k.P_KP_SPEED_1] == pytest.approx(before / 2)


def test_ds_c_settings_act_at_the_next_enabling_or_power_on() -> None:
    """Effective after release and writing, after power-on (003:490-620)."""
    d = drive("ds_c")
    d.enable(3)
    d.set("2506:00", 500)
    assert d.device.core.number("2506:00") == 2500
    d.command(6, 7, 15)
    assert d.device.core.number("2506:00") == 500
    before = d.device.core.units.position_per_rad
    d.command(0)
    d.set("2300:00", 2 * max(d.get("2300:00"), 1))
    assert d.device.core.units.position_per_rad == before
    d.set("2201:00", 1)
    d.device.power_cycle()
    d.run(0.01)
    assert d.device.core.units.position_per_rad == pytest.approx(before / 2)
