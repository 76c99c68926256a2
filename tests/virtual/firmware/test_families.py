"""Families other than MMS7: conventions from profiles, traits from their manuals."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from drivers.virtual.device import SdoAbort
from drivers.virtual.firmware import families, make_device
from drivers.virtual.firmware.families.mms7 import Mms7
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.servo import VirtualServo
from drivers.virtual.mechanics import MechanicsSpec, TravelSpec
from profiles.loader import drive_names, load_profile
from profiles.schema import (
    Fault,
    GainSpec,
    Identity,
    NotchSlot,
    NotchSpec,
    Parameter,
    Profile,
    Signal,
    UnitSpec,
)

from .servo_bench import ROWS, TURN, Bench, rigid

REV = 10000


def parameter(key: str, kind: str, default: Any = None, **more: Any) -> Parameter:
    return Parameter(
        key=key, name=key, group="t", type=kind, default_raw=default, source="000:1", **more
    )  # type: ignore[arg-type]


def family_profile(drive: str, *extra: Parameter, **fields: Any) -> Profile:
    """The standard 6xxx objects without defaults, plus a family's own parameters."""
    own = {p.key for p in extra}
    standard = [
        parameter(row[0], row[1], access=row[2], pdo=row[3])
        for row in ROWS
        if row[0].startswith("6") and row[0] not in own
    ]
    fields = {
        "units": UnitSpec(counts_per_rev=REV),
        "supported_modes": (1, 3, 4, 6, 8, 9, 10),
        **fields,
    }
    return Profile(
        drive=drive,
        title=drive,
        manual="000",
        identity=Identity(maker="m", model=drive),
        links=(),
        parameters=(*standard, *extra),
        **fields,
    )


@pytest.fixture
def family() -> Callable[..., Bench]:
    def build(
        profile: Profile, spec: MechanicsSpec | None = None, folder: Path | None = None
    ) -> Bench:
        device = make_device(profile, spec or rigid(), folder)
        assert isinstance(device, VirtualServo)
        return Bench(device)

    return build


M6L_GAINS = (
    parameter("2008:01", "UINT16", 400, unit="Hz", scale=0.1),
    parameter("2008:02", "UINT16", 500, unit="ms", scale=0.1),
    parameter("2008:03", "UINT16", 60, unit="rad/s"),
    parameter("2008:04", "UINT16", 2, unit="ms", scale=0.1),
    parameter("2008:0F", "UINT16", 50, unit="ms", scale=0.01),
    parameter("2008:10", "UINT16", 0, unit="%", scale=0.01),
    parameter("2005:11", "UINT16", 1),
    parameter("2009:27", "UINT16", 300, scale=0.01),
    parameter("2009:0B", "UINT16", 0, unit="Hz"),
    parameter("2009:0C", "UINT16", 100, unit="Hz"),
    parameter("2011:19", "UINT16", 1),
    parameter("2011:1B", "UINT16", 0),
)
M6L = family_profile(
    "m6l",
    *M6L_GAINS,
    gains=GainSpec(
        convention="gain", position="2008:03", speed="2008:01", integral="2008:02",
        torque_filter="2008:04", inertia="2009:27", inertia_meaning="ratio", source="000:3390",
    ),
    notch=NotchSpec(
        encoding="hz_width", slots=(NotchSlot(frequency_key="2009:0B", width_key="2009:0C"),),
        source="000:3429",
    ),
    faults=(
        Fault(code="Er.032", name="Excessive position deviation", code_raw=0xFF20, source="000:1"),
        Fault(code="Er.027", name="Servo motor overspeed", code_raw=0xFF1B, source="000:3905"),
    ),
)  # fmt: skip


def test_gains_in_hz_ms_and_rad_per_s(family) -> None:
    """Speed gain 40 Hz, integral time 50 ms, position gain 60 /s, inertia ratio 3.00."""
    p = family(M6L).servo.axis.p
    inertia = 5e-5 * 4
    assert p[k.P_KP_POSITION_1] == 60
    assert p[k.P_KP_SPEED_1] == pytest.approx(TURN * 40 * inertia)
    assert p[k.P_KI_SPEED_1] == pytest.approx(TURN * 40 * inertia / 0.05)
    assert p[k.P_TORQUE_FILTER] == pytest.approx(1 - math.exp(-50e-6 / 0.2e-3))


def test_every_cia402_mode_moves_a_family_without_printed_defaults(family) -> None:
    b = family(M6L)
    b.set("2009:27", 0)
    b.enable(1)
    b.set("607A:00", 5 * REV)
    b.set("6040:00", 0x1F)
    b.run(1.5)
    assert b.get("6064:00") == pytest.approx(5 * REV, abs=REV / 360)
    b.set("6060:00", 3)
    b.set("60FF:00", 10 * REV)
    b.run(0.8)
    assert b.get("606C:00") == pytest.approx(10 * REV, rel=0.02)


def test_set_points_are_buffered_unless_bit_5_says_at_once(family) -> None:
    """CiA 402-2 "single setpoint" and "set of setpoints"."""
    b = family(M6L)
    b.set("2009:27", 0)
    b.enable(1)
    b.set("607A:00", REV)
    b.set("6040:00", 0x1F)
    b.set("6040:00", 0x0F)
    b.run(0.1)
    b.set("607A:00", 3 * REV)
    b.set("6040:00", 0x1F)
    assert b.status & 1 << 12
    b.set("6040:00", 0x0F)
    assert b.status & 1 << 12  # still full
    b.run(0.15)
    assert b.servo.axis.p[k.P_TARGET] == pytest.approx(TURN)
    b.run(1.5)
    assert not b.status & 1 << 12
    assert b.get("6064:00") == pytest.approx(3 * REV, abs=REV / 360)


def test_following_error_is_a_fault_with_the_maker_s_code(family) -> None:
    b = family(M6L)
    b.set("6065:00", 100)
    b.set("6066:00", 20)
    b.enable(8)
    rx = b.servo.map_process_data([0x60400010, 0x607A0020], "rx")
    for cycle in range(1, 100):
        rx.unpack((15).to_bytes(2, "little") + (cycle * 100).to_bytes(4, "little"))
        b.run(1e-3)
    assert b.get("603F:00") == 0xFF20


def test_feed_forward_takes_the_lag_away(family) -> None:
    """v/Kp without, nothing with 100 % (P08.15), and again v/Kp when deselected (P05.16)."""
    b = family(M6L)
    b.set("2009:27", 0)
    lags = []
    for gain, select in ((0, 1), (10000, 1), (10000, 0)):
        b.set("2008:10", gain)
        b.set("2005:11", select)
        b.enable(1)
        b.set("607A:00", b.get("6064:00") + 10 * REV)
        b.set("6040:00", 0x0F)
        b.set("6040:00", 0x1F)
        b.run(0.7)
        lags.append(b.get("60F4:00"))
        b.run(1.0)
        b.set("6040:00", 6)
    assert lags[0] == pytest.approx(10 * REV / 60, rel=0.02)
    assert abs(lags[1]) < 20
    assert lags[2] == pytest.approx(lags[0], rel=0.02)


def test_hz_width_notch_removes_its_centre(family) -> None:
    b = family(M6L)
    b.set("2009:0B", 500)
    p = b.servo.axis.p
    assert p[k.P_NOTCH_COUNT] == 1
    a1, a2, b1, b2 = p[k.P_NOTCHES : k.P_NOTCHES + 4]
    z = complex(math.cos(TURN * 500 * 50e-6), math.sin(TURN * 500 * 50e-6))
    gain = abs((z * z + a1 * z + a2) / (z * z + b1 * z + b2))
    assert gain < 0.15
    one = abs((1 + a1 + a2) / (1 + b1 + b2))
    assert one == pytest.approx(1.0)


def test_m6l_stores_every_write_until_p17_24_is_off(family, tmp_path: Path) -> None:
    b = family(M6L, None, tmp_path)
    b.set("2008:01", 333)
    b.set("2011:19", 0)
    b.set("2008:03", 99)
    again = family(M6L, None, tmp_path)
    assert again.get("2008:01") == 333
    assert again.get("2008:03") == 60
    b.set("2011:1B", 2)
    assert family(M6L, None, tmp_path).get("2008:03") == 99
    b.set("2011:1B", 1)
    assert family(M6L, None, tmp_path).get("2008:03") == 60


def test_r6l_stores_what_its_mask_permits(family, tmp_path: Path) -> None:
    profile = family_profile(
        "r6l", parameter("2001:01", "UINT16", 250), parameter("2008:0C", "UINT16", 0)
    )
    b = family(profile, None, tmp_path)
    b.set("2001:01", 111)
    assert family(profile, None, tmp_path).get("2001:01") == 250
    b.set("2008:0C", 2)
    b.set("2001:01", 222)
    b.set("6081:00", 7777)
    again = family(profile, None, tmp_path)
    assert again.get("2001:01") == 222
    assert again.get("6081:00") != 7777


def test_r6l_swaps_the_limit_bits(family) -> None:
    profile = family_profile("r6l")
    b = family(profile, rigid(travel=TravelSpec(min_rev=-0.2, max_rev=5)))
    b.run(1e-3)
    assert b.get("60FD:00") == 2  # negative limit in bit 1


def test_ep3e_saves_by_1010_and_shows_home_in_bit_15(family, tmp_path: Path) -> None:
    profile = family_profile("ep3e", parameter("1010:01", "UINT32", 0))
    b = family(profile, None, tmp_path)
    b.set("6081:00", 4321)
    assert b.get("1010:01") == 1  # 001:1209
    b.set("1010:01", 0x45534554)
    b.run(10.1)
    assert b.get("1010:01") == 0
    assert family(profile, None, tmp_path).get("6081:00") == 4321
    b.set("607C:00", 500)
    b.set("6098:00", 35)
    b.enable(6)
    b.set("6040:00", 0x1F)
    b.run(0.01)
    assert b.status & 1 << 15
    assert b.get("6064:00") == pytest.approx(500, abs=1)


DS_C = family_profile(
    "ds_c",
    *(parameter(f"{index:04X}:00", "UINT16", 0) for index in (0x2200, 0x2201, 0x2202, 0x2203)),
    parameter("2102:00", "UINT16", 0, access="ro"),
    parameter("2300:00", "UINT16", 1),
    parameter("2301:00", "UINT16", 1),
    units=UnitSpec(
        counts_per_rev=REV,
        velocity="rpm",
        acceleration="ms",
        ramp_reference_rpm=1000,
        gear_numerator="2300:00",
        gear_denominator="2301:00",
    ),
    supported_modes=(1, 3, 4, 6),
    signals=(Signal(role="error_code", key="2102:00"),),
    faults=(Fault(code="1007", name="Overload", code_raw=1007, source="003:1"),),
)


def test_ds_c_status_word_speeds_and_ramps(family) -> None:
    b = family(DS_C)
    for word, echo in ((0, 0), (6, 1), (7, 3), (15, 7)):
        b.set("6060:00", 3)
        b.set("6040:00", word)
        b.run(0.01)
        assert b.status & 7 == echo
    b.set("6083:00", 500)
    b.set("60FF:00", 600)
    b.run(0.15)
    # 500 ms for 1000 rpm: 300 rpm after 150 ms.
    assert b.get("606C:00") == pytest.approx(300, abs=12)
    assert not b.status & 1 << 10
    b.run(0.5)
    assert b.get("606C:00") == pytest.approx(600, abs=2)
    b.servo.inject("overload")
    assert b.status & 1 << 7
    assert b.get("2102:00") == b.get("603F:00") == 1007


def test_ds_c_position_bits(family) -> None:
    b = family(DS_C)
    b.set("6060:00", 1)
    for word in (6, 7, 15):
        b.set("6040:00", word)
    b.set("6081:00", 600)
    b.set("607A:00", 2 * REV)
    b.set("6040:00", 31)
    assert b.status & 1 << 12
    assert not b.status & 1 << 15
    b.run(1.5)
    assert b.status & 1 << 15
    assert b.get("6064:00") == pytest.approx(2 * REV, abs=REV / 300)


def test_ds_c_has_the_positive_software_limit_first(family) -> None:
    b = family(DS_C)
    b.set("607D:01", REV)
    b.set("607D:02", -REV)
    b.set("6060:00", 1)
    for word in (6, 7, 15):
        b.set("6040:00", word)
    b.set("607A:00", 5 * REV)
    b.set("6040:00", 31)
    b.run(1.5)
    assert b.get("6064:00") == pytest.approx(REV, abs=REV / 300)


def test_ds_c_triggers_stay_and_act_on_change(family) -> None:
    b = family(DS_C)
    b.servo.axis._x[0] = TURN
    b.run(1e-3)
    b.set("2200:00", 1)
    assert abs(b.get("6064:00")) <= 1
    assert b.get("2200:00") == 1
    b.servo.axis._x[0] = 2 * TURN
    b.run(1e-3)
    b.set("2200:00", 1)
    assert b.get("6064:00") == pytest.approx(REV, abs=1)
    b.set("2200:00", 0)
    b.set("2200:00", 1)
    assert abs(b.get("6064:00")) <= 1


def test_ds_c_runs_on_when_the_line_is_cut(family) -> None:
    """No watchdog is documented: that is what the tools must cope with."""
    b = family(DS_C)
    b.set("6060:00", 3)
    for word in (6, 7, 15):
        b.set("6040:00", word)
    b.set("60FF:00", 300)
    b.run(1.0)
    b.servo.communication_lost("heartbeat")
    b.run(2.0)
    assert b.get("606C:00") == pytest.approx(300, abs=2)


def test_ds_c_electronic_gear(family) -> None:
    """Numerator 2: one pulse is worth twice as much, a turn has half the pulses."""
    b = family(DS_C)
    b.set("2300:00", 2)
    b.servo.axis._x[0] = TURN
    b.run(1e-3)
    assert b.get("6064:00") == pytest.approx(REV / 2, abs=1)


def test_ds_c_has_no_cyclic_modes(family) -> None:
    with pytest.raises(SdoAbort):
        family(DS_C).set("6060:00", 8)


@pytest.mark.parametrize(("option", "bits"), [(0, 0x27), (1, 0x08), (2, 0x40), (3, 0x07)])
def test_generic_drive_obeys_6007h(family, option: int, bits: int) -> None:
    b = family(load_profile("generic402"))
    b.set("6007:00", option)
    b.enable(3)
    b.set("60FF:00", 10 * REV)
    b.run(0.5)
    b.set("605E:00", 0)
    b.servo.communication_lost("heartbeat")
    assert b.status & 0x6F == bits


@pytest.mark.parametrize("drive", sorted(set(families.names()) & set(drive_names())))
def test_every_family_turns_with_its_real_profile(family, drive: str) -> None:
    """One revolution per second in PV or CSV, seen in the profile's own units."""
    profile = load_profile(drive)
    b = family(profile)
    for index in b.servo.indices():
        for subindex in b.servo.subindices(index):
            entry = b.servo.od.find(index, subindex)
            if entry.parameter.access != "wo":
                b.servo.read(index, subindex)
    mode = 3 if 3 in profile.supported_modes else 9
    b.set("6060:00", mode)
    for word in (6, 7, 15):
        b.set("6040:00", word)
        b.run(0.02)
    one = round(abs(b.servo.core.units.speed_per_rad_s) * TURN)
    b.set("60FF:00", one)
    b.run(2.0)
    assert b.servo.axis.speed_rad_s == pytest.approx(TURN, rel=0.03)
    assert b.get("606C:00") == pytest.approx(one, rel=0.03, abs=2)
    assert b.get("603F:00") == 0


def test_stiffness_row_of_the_real_profile(family) -> None:
    """Level 20 of table 38: 32.9, 115 and 22.7 Hz (004:3023)."""
    b = family(load_profile("mms7"))
    b.set("2005:0E", 1)
    b.set("2005:0F", 20)
    b.apply()
    p, inertia = b.servo.axis.p, b.get("2001:06") * 1e-7
    assert p[k.P_KP_POSITION_1] == pytest.approx(TURN * 32.9)
    assert p[k.P_KP_SPEED_1] == pytest.approx(TURN * 115 * inertia)
    assert p[k.P_KI_SPEED_1] == pytest.approx(TURN * 115 * inertia * TURN * 22.7)


def test_gains_without_a_unit_act_in_proportion(family) -> None:
    profile = family_profile(
        "ds_c",
        parameter("2510:00", "UINT16"),
        parameter("2511:00", "UINT16", 50),
        gains=GainSpec(convention="unit", position="2510:00", speed="2511:00", source="003:711"),
    )
    b = family(profile)
    p = b.servo.axis.p
    position, speed = p[k.P_KP_POSITION_1], p[k.P_KP_SPEED_1]
    b.set("2510:00", 200)
    b.set("2511:00", 25)
    assert p[k.P_KP_POSITION_1] == pytest.approx(2 * position)
    assert p[k.P_KP_SPEED_1] == pytest.approx(0.5 * speed)


def test_faults_are_those_of_the_real_profile() -> None:
    """Bits of 200Bh:0B and codes of 603Fh, written down twice from table 70 by two people."""
    printed = {
        match.bit: fault.code_raw or 0
        for fault in load_profile("mms7").faults
        for match in fault.match
        if match.key == "200B:0B"
    }
    known = {bit.bit_length() - 1: info.code for bit, info in Mms7.traits.faults.items()}
    assert known == printed


def test_commands_are_those_of_the_real_profile() -> None:
    """Every value that a procedure writes to 200Dh is a command of the firmware."""
    written = {
        step.raw
        for procedure in load_profile("mms7").procedures
        for step in procedure.steps
        if step.do == "write" and step.key == "200D:00"
    }
    assert written <= set(Mms7.traits.commands["200D:00"])


def test_homing_methods_of_the_real_profile_are_all_known(family) -> None:
    """None of them fails at once, as an unknown method does."""
    profile = load_profile("mms7")
    for method in profile.homing_methods:
        b = family(profile)
        b.set("6098:00", method.method)
        b.set("6060:00", 6)
        b.set("6040:00", 6)
        b.set("6040:00", 15)
        b.set("6040:00", 31)
        assert not b.status & 1 << 13, method.method


def test_gear_without_a_printed_default_starts_at_one_turn_and_acts_after_power_on(family) -> None:
    """6092h:01 = 3600 increments, 3 motor revolutions to 1 (001:1045-1060)."""
    b = family(load_profile("ep3e"))
    assert b.get("6092:01") == b.get("608F:01") == 2**23
    b.set("6092:01", 3600)
    b.set("6091:01", 3)
    b.set("1010:01", 0x45534554)
    b.run(10.1)
    b.servo.power_cycle()
    assert b.servo.core.units.position_per_rad * TURN == pytest.approx(3600 / 3)


def test_gains_without_a_printed_default_read_what_the_loops_use(family) -> None:
    """No default is printed for the EP3E: 40 Hz and 20 ms, not 0 in a range from 1 (001:1086)."""
    b = family(load_profile("ep3e"))
    assert b.get("2005:00") == 40
    assert b.get("2006:00") == 200  # 20.0 ms
    assert b.servo.axis.p[k.P_KP_POSITION_1] == pytest.approx(TURN * b.get("2009:00"))


def test_no_two_families_have_the_identity_of_one_another() -> None:
    """SOEM copies the EEPROM of an earlier slave of equal vendor, product and revision."""
    words = [
        tuple(make_device(name).read(0x1018, n) for n in (1, 2, 3))
        for name in ("mms7", "m6l", "r6l", "ep3e")
    ]
    assert len(set(words)) == len(words)


def test_a_count_of_entries_that_no_manual_prints_is_the_number_of_entries() -> None:
    """CiA 301 clause 7.4.1: subindex 0 shows the highest. EP3E prints no value of 607Dh:00."""
    assert make_device("ep3e").read(0x607D, 0) == b"\2"
