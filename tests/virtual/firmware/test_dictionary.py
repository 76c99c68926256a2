"""Access rules, effective time, NVM, terminals and process data."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import pytest

from drivers.virtual.device import SdoAbort
from drivers.virtual.firmware import make_device
from drivers.virtual.firmware.families.mms7 import Mms7
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.objects.dictionary import ObjectDictionary
from drivers.virtual.firmware.objects.registers import RegisterTable
from drivers.virtual.firmware.servo import VirtualServo
from drivers.virtual.mechanics import TravelSpec
from profiles.loader import load_profile
from profiles.schema import LinkSpec, Parameter, Watchdog

from .servo_bench import REV, TURN, Bench, rigid, small_profile

SAVE, RESTORE, RESET = 0x65766173, 0x64616F6C, 0x626E6E74
ZERO, CLEAR, WRITE_SETTINGS = 0x686F6F6D, 0x11111120, 0xAAB555AA


@pytest.mark.parametrize(
    ("index", "sub", "data", "code"),
    [
        (0x6041, 0, b"\0\0", 0x06010002),  # read-only
        (0x6040, 0, b"\0", 0x06070013),  # too short
        (0x6040, 0, b"\0\0\0\0", 0x06070012),  # too long
        (0x2005, 1, struct.pack("<H", 2001), 0x06090031),  # above 1 to 2000
        (0x2005, 1, struct.pack("<H", 0), 0x06090032),  # below
        (0x3FFF, 0, b"\0", 0x06020000),  # no object
        (0x2005, 0x40, b"\0\0", 0x06090011),  # no subindex
        (0x200D, 0, struct.pack("<I", 12345), 0x06090030),  # no such command
    ],
)
def test_aborts(bench, index: int, sub: int, data: bytes, code: int) -> None:
    b = bench()
    before = {entry.key: entry.value for entry in b.servo.od}
    with pytest.raises(SdoAbort) as refused:
        b.servo.write(index, sub, data)
    assert refused.value.code == code
    assert {entry.key: entry.value for entry in b.servo.od} == before


def test_reading_what_is_not_there(bench) -> None:
    b = bench()
    for index, sub, code in ((0x3FFF, 0, 0x06020000), (0x6040, 9, 0x06090011)):
        with pytest.raises(SdoAbort) as refused:
            b.servo.read(index, sub)
        assert refused.value.code == code
        with pytest.raises(SdoAbort):
            b.servo.entry(index, sub)
    with pytest.raises(SdoAbort):
        b.servo.subindices(0x3FFF)


def test_identity_and_counts(bench) -> None:
    b = bench(station=5)
    assert b.get("1018:01") == 0x1234
    assert b.get("1018:04") & 0xFF == 5
    assert b.servo.read(0x1008, 0) == b"MMS7"
    assert b.get("2005:00") == 0x15  # highest subindex
    assert b.servo.indices() == sorted(b.servo.indices())
    assert b.servo.subindices(0x6091) == [0, 1, 2]
    info = b.servo.entry(0x6040, 0)
    assert (info.bit_length, info.writable, info.pdo_rx, info.pdo_tx) == (16, True, True, False)


def test_parameters_act_after_write_settings(bench) -> None:
    b = bench()
    before = b.servo.axis.p[k.P_KP_POSITION_1]
    b.set("2005:01", 400)
    assert b.get("2005:01") == 400
    b.enable(1)  # a new start of the loops does not bring them in either
    assert b.servo.axis.p[k.P_KP_POSITION_1] == before
    b.apply()
    assert b.servo.axis.p[k.P_KP_POSITION_1] == pytest.approx(TURN * 40)
    assert b.get("200D:00") == 0


def test_trajectory_objects_act_at_once(bench) -> None:
    b = bench()
    b.enable(3)
    b.set("60FF:00", REV)
    b.run(0.2)
    assert b.get("606C:00") == pytest.approx(REV, rel=0.02)


def test_save_survives_the_process(bench, tmp_path: Path) -> None:
    path = tmp_path / "drive.json"
    b = bench(nvm_path=path)
    b.set("2005:01", 321)
    b.set("607A:00", 777)
    b.set("200D:00", SAVE)
    b.set("2005:03", 999)  # written, never saved
    again = bench(nvm_path=path)
    assert again.get("2005:01") == 321
    assert again.get("2005:03") == 2000
    assert again.get("607A:00") == 0  # a setpoint is not a parameter
    assert again.servo.axis.p[k.P_KP_POSITION_1] == pytest.approx(TURN * 32.1)


def test_a_power_cycle_forgets_what_was_not_saved(bench) -> None:
    b = bench()
    b.set("2005:01", 321)
    b.set("200D:00", SAVE)
    b.set("2005:01", 500)
    b.enable(1)
    b.servo.power_cycle(0.5)
    assert not b.servo.powered
    b.run(0.4)
    assert not b.servo.powered
    b.run(0.2)
    assert b.servo.powered
    assert b.get("2005:01") == 321
    assert b.status & 0x6F == 0x40


def test_a_damaged_memory_is_a_fault_and_gives_defaults(bench, tmp_path: Path) -> None:
    path = tmp_path / "drive.json"
    path.write_text('{"format": 1, "val')
    b = bench(nvm_path=path)
    assert b.get("200B:0B") == 1 << 7
    assert b.get("2005:01") == 200


def test_a_save_that_fails_leaves_the_old_memory(bench, tmp_path: Path) -> None:
    folder = tmp_path / "nvm"
    path = folder / "drive.json"
    b = bench(nvm_path=path)
    b.set("200D:00", SAVE)
    before = path.read_text()
    assert json.loads(before)["format"] == 1
    path.unlink()
    path.mkdir()  # replacing a folder by a file fails
    with pytest.raises(SdoAbort) as refused:
        b.set("200D:00", SAVE)
    assert refused.value.code == 0x08000020
    assert [p for p in folder.iterdir() if p != path] == []


def test_restore_defaults(bench, tmp_path: Path) -> None:
    path = tmp_path / "drive.json"
    b = bench(nvm_path=path)
    rotor = b.get("2001:06")
    b.set("2005:01", 321)
    b.set("2001:06", 12345)
    b.apply()
    b.set("200D:00", SAVE)
    b.set("200D:00", RESTORE)
    assert b.get("2005:01") == 200
    assert b.get("2001:06") == rotor  # results of identification go too (004:2379-2380)
    assert bench(nvm_path=path).get("2005:01") == 200


def test_reset_reboots_after_the_answer(bench) -> None:
    b = bench()
    b.set("2005:01", 500)
    b.enable(1)
    b.set("200D:00", RESET)
    assert b.servo.powered
    b.run(0.05)
    assert not b.servo.powered
    b.run(0.5)
    assert b.servo.powered
    assert b.get("2005:01") == 200
    assert b.status & 0x6F == 0x40


def test_zero_position_and_history(bench) -> None:
    b = bench()
    b.enable(1)
    b.set("607A:00", 3 * REV)
    b.set("6040:00", 0x1F)
    b.run(1.0)
    with pytest.raises(SdoAbort):
        b.set("200D:00", ZERO)
    b.set("6040:00", 6)
    b.set("200D:00", ZERO)
    assert abs(b.get("6064:00")) <= 1
    b.servo.power_cycle()
    b.run(0.01)
    assert abs(b.get("6064:00")) < 200  # the absolute encoder keeps its zero
    b.servo.inject("overload")
    assert [r.error_code for r in b.servo.control.alarms.log.records] == [0x3230]
    b.set("200D:00", CLEAR)
    assert b.servo.control.alarms.log.records == []


def test_mapping_rules(bench) -> None:
    b = bench()
    servo = b.servo
    with pytest.raises(SdoAbort) as refused:
        b.set("1600:01", 0x60FF0020)  # while the count is not 0
    assert refused.value.code == 0x06010000
    b.set("1600:00", 0)
    with pytest.raises(SdoAbort) as refused:
        b.set("1600:01", 0x60410010)  # an input in an output mapping
    assert refused.value.code == 0x06040041
    with pytest.raises(SdoAbort) as refused:
        b.set("1600:01", 0x60400020)  # wrong length
    assert refused.value.code == 0x06040042
    b.set("1600:01", 0x60FF0020)
    b.set("1600:02", 0x60400010)
    b.set("1600:00", 2)
    with pytest.raises(SdoAbort):
        b.set("1600:00", 13)
    with pytest.raises(SdoAbort):
        b.set("1C12:01", 0x1600)  # assignment count is not 0
    b.set("1C12:00", 0)
    with pytest.raises(SdoAbort):
        b.set("1C12:01", 0x1A00)
    b.set("1C12:01", 0x1600)
    image = servo.map_process_data([0x60FF0020, 0x60400010, 0x00000008], "rx")
    assert image.size == 7


def test_process_data_in_and_out(bench) -> None:
    b = bench()
    rx = b.servo.map_process_data([0x60400010, 0x60600008, 0x60E00010], "rx")
    tx = b.servo.map_process_data([0x60410010, 0x60610008, 0x60640020, 0x60790020], "tx")
    assert (rx.size, tx.size) == (5, 11)
    rx.unpack(struct.pack("<HbH", 6, 3, 9999))
    rx.unpack(struct.pack("<HbH", 15, 3, 9999))
    b.run(1e-3)
    status, mode, position, volts = struct.unpack("<HbiI", tx.pack())
    assert (status & 0x6F, mode, position) == (0x27, 3, b.get("6064:00"))
    assert volts == pytest.approx(48000, abs=50)
    assert b.get("60E0:00") == 3000  # out of range: limited


def test_process_images_live_through_a_restart(bench) -> None:
    b = bench()
    tx = b.servo.map_process_data([0x60410010], "tx")
    b.enable(1)
    b.servo.power_cycle()
    assert struct.unpack("<H", tx.pack())[0] & 0x6F == 0x40


def test_position_wraps_like_a_32_bit_counter(bench) -> None:
    b = bench()
    b.servo.core.zero_rad = -TURN * 32767.9999
    b.enable(3)
    b.set("60FF:00", 10 * REV)
    b.run(0.2)
    assert b.get("6064:00") < 0


def test_digital_inputs_polarity_and_simulation(bench) -> None:
    b = bench(rigid(travel=TravelSpec(min_rev=-0.2, max_rev=5)))  # on the negative switch
    b.set("2030:01", 1)
    b.apply()
    b.run(1e-3)
    assert b.get("60FD:00") == 1 << 16 | 1
    b.set("2031:01", 1)  # normally open on a normally closed contact: the wrong way round
    b.apply()
    b.run(1e-3)
    assert b.get("60FD:00") == 0
    b.set("2030:02", 2)
    b.set("2031:02", 2)
    b.set("2031:03", 2)
    b.apply()
    b.run(1e-3)
    assert int(b.servo.axis.s[k.S_SIGNALS]) & k.SIG_POSITIVE
    assert not b.get("60FD:00") & 2  # 60FDh shows terminals, not the simulation


def test_digital_outputs(bench) -> None:
    b = bench()
    b.set("2030:05", 1)  # alarm
    b.apply()
    b.servo.inject("overload")
    assert b.get("60FD:00") & 1 << 24
    b.set("60FE:02", 1 << 16)
    assert not b.get("60FD:00") & 1 << 24
    b.set("60FE:01", 1 << 16)
    assert b.get("60FD:00") & 1 << 24


def test_touch_probe_latches_the_rising_edge(bench) -> None:
    """Table 69: DI1 as probe 1, 60B8h = 13h latches continuously."""
    b = bench()
    b.set("2030:01", 4)
    b.apply()
    b.set("60B8:00", 0x0013)
    b.enable(3)
    b.set("60FF:00", 5 * REV)
    b.run(0.3)
    assert b.get("60B9:00") == 1
    position = b.get("6064:00")
    b.servo.inject("di1", 1)
    b.run(0.1)
    assert b.get("60B9:00") == 3
    assert b.get("60BA:00") == pytest.approx(position, abs=1)
    b.servo.inject("di1", 0)
    b.servo.inject("di1", 1)
    assert b.get("60BA:00") > position + REV // 3


def test_alarm_reset_input(bench) -> None:
    b = bench()
    b.set("2030:03", 4)
    b.apply()
    b.servo.inject("overload")
    b.servo.inject("di3", 1)
    assert b.status & 0x6F == 0x40


def test_same_accesses_same_run(bench) -> None:
    def play(chop_s: float) -> int:
        b: Bench = bench(seed=3)
        b.enable(1)
        b.set("607A:00", 5 * REV)
        b.set("6040:00", 0x1F)
        for _ in range(round(0.4 / chop_s)):
            b.run(chop_s)
        return b.get("6064:00")

    assert play(0.4) == play(0.001) == play(0.00025)


def test_earlier_times_do_nothing(bench) -> None:
    b = bench()
    b.run(0.1)
    steps = b.servo.axis.s[k.S_STEP]
    b.servo.advance(0)
    assert b.servo.axis.s[k.S_STEP] == steps == 2000


def test_register_table_with_the_high_word_first() -> None:
    base = small_profile()
    link = LinkSpec(
        kind="modbus", watchdog=Watchdog(present=False), word_order="high_first", source="003:1"
    )
    extra = tuple(
        Parameter(key=key, name=key, group="t", type=kind, modbus_register=register, source="003:1")
        for key, kind, register in (
            ("PA_1", "INT16", 1),
            ("PA_2", "UINT32", 2),
            ("PA_4", "UINT8", 4),
        )
    )
    profile = base.model_copy(update={"links": (link,), "parameters": base.parameters + extra})
    od = ObjectDictionary(profile, 1)
    table = RegisterTable(profile, od)
    servo = VirtualServo(profile, Mms7(), rigid())
    servo.write_registers(1, [0xFFFF, 0x0001, 0x0002, 7])
    assert servo.read_register(1, 4) == [0xFFFF, 0x0001, 0x0002, 7]
    assert servo.od.numbered["PA_2"].value == 0x00010002
    assert servo.od.numbered["PA_1"].value == -1
    assert servo.read_register(2, 1) == [1]
    assert servo.read_register(3, 2) == [2, 7]
    for start, count in ((5, 1), (0, 2), (4, 2)):
        with pytest.raises(SdoAbort):
            table.read(start, count)


def test_half_of_a_long_value_is_a_register_of_its_own() -> None:
    """003:633-673 and 003:905-990 print H and L as two registers; function 06 writes one."""
    servo = make_device(load_profile("ds_c"), rigid())
    servo.write_registers(0x20A, [0x0001, 0x0002])
    servo.write_registers(0x20B, [0x0007])
    assert servo.read_register(0x20A, 2) == [1, 7]
    servo.write_registers(0x20A, [0xFFFF])
    assert struct.unpack("<i", servo.read(0x607A, 0)) == (0xFFFF0007 - (1 << 32),)
    servo.write_registers(0x20B, [8, 0])  # the low half of 607Ah and the high half of 6081h
    assert servo.read_register(0x20A, 3) == [0xFFFF, 8, 0]
    with pytest.raises(SdoAbort):
        servo.write_registers(0x203, [0])


@pytest.mark.parametrize("word", [0x0101, 0x0080, 0xFF00])
def test_a_register_of_eight_bits_takes_no_more_than_eight(word: int) -> None:
    servo = make_device(load_profile("ds_c"), rigid())
    with pytest.raises(SdoAbort):
        servo.write_registers(0x204, [word])
    assert servo.read_register(0x204, 1) == [1]


def test_unknown_family() -> None:
    profile = small_profile().model_copy(update={"drive": "teapot"})
    with pytest.raises(ValueError, match="teapot"):
        make_device(profile, None)


def test_process_data_overrule_an_sdo_write(bench) -> None:
    b = bench()
    rx = b.servo.map_process_data([0x60400010], "rx")
    rx.unpack(struct.pack("<H", 6))
    b.set("6040:00", 0)
    assert b.status & 0x6F == 0x40
    rx.unpack(struct.pack("<H", 6))
    assert b.status & 0x6F == 0x21


def test_process_data_with_an_unknown_mode_change_nothing(bench) -> None:
    b = bench()
    rx = b.servo.map_process_data([0x60400010, 0x60600008], "rx")
    rx.unpack(struct.pack("<Hb", 6, 3))
    rx.unpack(struct.pack("<Hb", 6, 7))
    assert b.get("6061:00") == b.get("6060:00") == 3


def test_parameters_that_act_when_stopped_or_enabled_wait_for_it() -> None:
    profile = small_profile()
    classes = {"2005:01": "stopped", "2005:03": "reenable"}
    profile = profile.model_copy(
        update={
            "parameters": tuple(
                p.model_copy(update={"effective": classes.get(p.key, p.effective)})
                for p in profile.parameters
            )
        }
    )
    b = Bench(VirtualServo(profile, Mms7(), rigid()))
    p = b.servo.axis.p
    b.set("2005:01", 100)
    assert p[k.P_KP_POSITION_1] == pytest.approx(TURN * 10)
    b.enable(1)
    speed_gain = p[k.P_KP_SPEED_1]
    b.set("2005:01", 300)
    b.set("2005:03", 1000)
    assert p[k.P_KP_POSITION_1] == pytest.approx(TURN * 10)
    assert p[k.P_KP_SPEED_1] == speed_gain
    b.set("6040:00", 6)
    b.set("6040:00", 15)
    assert p[k.P_KP_POSITION_1] == pytest.approx(TURN * 30)
    assert p[k.P_KP_SPEED_1] == pytest.approx(speed_gain / 2)


def test_parameters_for_standstill_are_refused_while_enabled() -> None:
    profile = small_profile()
    profile = profile.model_copy(
        update={
            "parameters": tuple(
                p.model_copy(update={"settable": "stopped"}) if p.key == "2005:01" else p
                for p in profile.parameters
            )
        }
    )
    b = Bench(VirtualServo(profile, Mms7(), rigid()))
    b.set("2005:01", 100)
    b.enable(1)
    with pytest.raises(SdoAbort) as refused:
        b.set("2005:01", 200)
    assert refused.value.code == 0x08000022
    assert b.get("2005:01") == 100
