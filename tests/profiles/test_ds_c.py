"""Facts of manual 003, typed by hand from the lines named."""

from __future__ import annotations

import pytest

from profiles import load_profile
from profiles.check import check

PROFILE = load_profile("ds_c")
U16 = (0, 65535)
U32 = (0, 2**32 - 1)
I32 = (-(2**31), 2**31 - 1)

# key, register, type, access, unit, scale, (min, max), default, effective — line of the manual
ROWS = [
    ("2000:00", 0x0000, "UINT16", "ro", "", 1, U16, None, "now"),  # 481
    ("2100:00", 0x0006, "UINT16", "ro", "", 1, U16, None, "now"),  # 483
    ("2101:00", 0x0007, "UINT16", "ro", "", 1, U16, None, "now"),  # 484
    ("2102:00", 0x0008, "UINT16", "ro", "", 1, U16, None, "now"),  # 485
    ("2200:00", 0x0061, "UINT16", "rw", "", 1, U16, None, "now"),  # 486
    ("2201:00", 0x0063, "UINT16", "rw", "", 1, U16, None, "now"),  # 487
    ("2202:00", 0x0064, "UINT16", "rw", "", 1, U16, None, "now"),  # 488
    ("2203:00", 0x0062, "UINT16", "rw", "", 1, U16, None, "now"),  # 489
    ("2300:00", 0x0067, "UINT16", "rw", "", 1, U16, None, "power_cycle"),  # 490, 262
    ("2302:00", 0x0069, "UINT16", "rw", "", 1, U16, None, "power_cycle"),  # 495
    ("2400:01", 0x0086, "UINT16", "rw", "", 1, U16, None, "reenable"),  # 500, 859
    ("2400:05", 0x008A, "UINT16", "rw", "", 1, U16, None, "now"),  # 515
    ("2400:07", 0x0081, "UINT16", "rw", "", 1, U16, None, "now"),  # 521
    ("2400:0C", 0x008C, "UINT16", "rw", "", 1, U16, None, "now"),  # 525
    ("2400:0F", 0x008F, "UINT16", "rw", "", 1, U16, None, "now"),  # 538
    ("2401:00", 0x006A, "UINT16", "rw", "ms", 1, U16, None, "power_cycle"),  # 544
    ("2404:00", 0x006D, "UINT16", "rw", "V", 0.001, U16, None, "power_cycle"),  # 553
    ("2405:00", 0x0083, "UINT16", "rw", "", 1, U16, None, "now"),  # 560, 846
    ("2406:00", 0x0085, "UINT16", "rw", "rpm", 1, U16, None, "reenable"),  # 564, 340
    ("2500:00", 0x0076, "UINT16", "rw", "pulse", 1, U16, None, "reenable"),  # 568
    ("2501:00", 0x0070, "UINT16", "rw", "pulse", 1, U16, None, "reenable"),  # 572
    ("2502:00", 0x0071, "UINT16", "rw", "ms", 1, U16, None, "reenable"),  # 577
    ("2503:00", 0x002F, "UINT16", "rw", "V", 0.001, U16, 8000, "reenable"),  # 698
    ("2504:00", 0x0030, "UINT16", "rw", "V", 0.001, U16, 1800, "reenable"),  # 699
    ("2505:00", 0x0031, "UINT16", "rw", "%", 0.1, U16, 2500, "reenable"),  # 700
    ("2508:00", 0x0034, "UINT16", "rw", "rpm", 1, U16, 4500, "reenable"),  # 702
    ("2509:00", 0x0035, "UINT16", "rw", "%", 0.1, U16, 2000, "reenable"),  # 703
    ("250A:00", 0x0036, "UINT16", "rw", "%", 0.1, U16, 500, "reenable"),  # 704
    ("250B:00", 0x0037, "UINT16", "rw", "%", 0.1, U16, 900, "reenable"),  # 711
    ("250C:00", 0x0048, "UINT16", "rw", "", 1, U16, None, "reenable"),  # 614
    ("603F:00", 0x0200, "UINT16", "ro", "", 1, U16, None, "now"),  # 628
    ("6040:00", 0x0201, "UINT16", "rw", "", 1, U16, None, "now"),  # 629, 256
    ("6060:00", 0x0204, "INT8", "rw", "", 1, (-128, 127), None, "now"),  # 631, 249
    ("6064:00", 0x0206, "INT32", "ro", "pulse", 1, I32, None, "now"),  # 633, 266
    ("606C:00", 0x0208, "INT32", "ro", "rpm", 1, I32, None, "now"),  # 635
    ("607A:00", 0x020A, "INT32", "rw", "pulse", 1, (-1000000, 1000000), None, "now"),  # 258
    ("6081:00", 0x020C, "UINT32", "rw", "rpm", 1, (0, 3000), None, "now"),  # 639, 259
    ("6083:00", 0x020E, "UINT32", "rw", "ms", 1, (0, 2000), None, "now"),  # 641, 260
    ("6084:00", 0x0210, "UINT32", "rw", "ms", 1, (0, 2000), None, "now"),  # 643, 261
    ("6099:01", 0x0215, "UINT32", "rw", "rpm", 1, (0, 3000), None, "now"),  # 648, 361
    ("6099:02", 0x0217, "UINT32", "rw", "rpm", 1, (0, 3000), None, "now"),  # 650, 362
    ("609A:00", 0x0219, "UINT32", "rw", "ms", 1, (0, 2000), None, "now"),  # 655, 363
    ("607C:00", 0x021B, "INT32", "rw", "pulse", 1, (-1000000, 1000000), None, "now"),  # 364
    ("607D:01", 0x021D, "INT32", "rw", "pulse", 1, I32, None, "now"),  # 659
    ("607D:02", 0x021F, "INT32", "rw", "pulse", 1, I32, None, "now"),  # 661
    ("6071:00", 0x0221, "INT16", "rw", "%", 0.1, (-32768, 32767), None, "now"),  # 663, 337
    ("6072:00", 0x0222, "INT16", "rw", "%", 0.1, (-32768, 32767), None, "now"),  # 664, 338
    ("6087:00", 0x0224, "UINT32", "rw", "%/s", 0.1, (0, 65535), None, "now"),  # 666, 339
    ("60FE:02", 0x022A, "UINT32", "rw", "", 1, U32, None, "now"),  # 672
    ("PA_18", 0x0018, "UINT16", "rw", "W", 1, U16, None, "power_cycle"),  # 681
    ("PA_1A", 0x001A, "UINT16", "rw", "A", 0.001, U16, None, "power_cycle"),  # 683
    ("PA_1C", 0x001C, "UINT16", "rw", "Nm", 0.001, U16, None, "power_cycle"),  # 685
    ("PA_1F", 0x001F, "UINT16", "rw", "Ω", 0.001, U16, None, "power_cycle"),  # 688
    ("PA_20", 0x0020, "UINT16", "rw", "kg·m²", 1e-7, U16, None, "power_cycle"),  # 689
    ("PA_24", 0x0024, "UINT16", "rw", "", 1, U16, 5, "power_cycle"),  # 692
    ("PA_25", 0x0025, "UINT16", "rw", "", 1, U16, 2500, "power_cycle"),  # 693
    ("PA_3B", 0x003B, "UINT16", "rw", "%", 0.1, U16, None, "now"),  # 721, 722
    ("PA_3C", 0x003C, "UINT16", "rw", "Hz", 1, U16, None, "reenable"),  # 724
    ("PA_3D", 0x003D, "UINT16", "rw", "", 1, U16, None, "now"),  # 727
    ("PA_41", 0x0041, "UINT16", "rw", "", 1, U16, 0, "now"),  # 740, 741
    ("PA_43", 0x0043, "UINT16", "rw", "Hz", 1, U16, None, "reenable"),  # 746
    ("PA_4D", 0x004D, "UINT16", "rw", "Hz", 1, U16, None, "reenable"),  # 782
    ("PA_50", 0x0050, "UINT16", "rw", "Hz", 1, U16, None, "reenable"),  # 792
    ("PA_51", 0x0051, "UINT16", "rw", "Hz", 1, U16, None, "reenable"),  # 795
    ("PA_52", 0x0052, "UINT16", "rw", "dB", 1, U16, None, "reenable"),  # 799
    ("PA_54", 0x0054, "UINT16", "rw", "", 1, (0, 7), None, "reenable"),  # 806
]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: str(row[0]))
def test_row(row: tuple[object, ...]) -> None:
    key, *facts = row
    p = PROFILE.by_key[str(key)]
    assert [
        p.modbus_register, p.type, p.access, p.unit, p.scale, p.raw_limits, p.default_raw,
        p.effective,
    ] == facts  # fmt: skip


def test_check_has_nothing_to_say() -> None:
    assert [str(finding) for finding in check(PROFILE)] == []


def test_enumerations() -> None:
    # 249, 509-516, 531-542, 617-621, 680, 560, 495
    modes = PROFILE.by_key["6060:00"].enum
    assert sorted(modes) == [1, 3, 4, 6]
    assert sorted(PROFILE.by_key["2400:02"].enum) == [0, 1, 2, 3, 4, 5, 6]
    assert PROFILE.by_key["2400:02"].enum[3] == "negative limit"
    outputs = PROFILE.by_key["2400:0E"].enum
    assert sorted(outputs) == [0, 1, 2, 3, 4, 5, 6, 9, 10, 11]
    assert outputs[4] == "in place"
    assert outputs[6] == "brake"
    assert PROFILE.by_key["250D:00"].enum == {0: "100 %", 1: "80 %", 2: "75 %", 3: "50 %"}
    assert PROFILE.by_key["PA_02"].enum[4].startswith("750 W")


def test_no_two_parameters_share_a_register() -> None:
    """32-bit values fill two registers, the high word first (633-634)."""
    used: dict[int, str] = {}
    for p in PROFILE.parameters:
        if p.modbus_register is None:
            continue
        words = 2 if p.type in ("INT32", "UINT32") else 1
        for register in range(p.modbus_register, p.modbus_register + words):
            assert register not in used, (p.key, used.get(register))
            used[register] = p.key
    link = PROFILE.link("modbus")
    assert link is not None
    assert link.word_order == "high_first"


def test_dip_switches() -> None:
    # 226-232 and the stations of 208-224
    link = PROFILE.link("canopen")
    assert link is not None
    assert link.baudrates == (1000000, 500000, 250000, 125000)


def test_special_commands() -> None:
    # 410-422 and 486-489
    writes = {
        procedure.name: [(s.key, s.raw) for s in procedure.steps if s.do == "write"]
        for procedure in PROFILE.procedures
    }
    assert writes["save"][0] == ("2201:00", 1)
    assert writes["restore"][0] == ("2202:00", 1)
    assert writes["fault_reset"] == [("2203:00", 1), ("2203:00", 0)]
    assert writes["zero_position"] == [("2200:00", 0), ("2200:00", 1), ("2200:00", 0)]


def test_error_codes() -> None:
    # 485
    assert [f.code_raw for f in PROFILE.faults] == list(range(1001, 1013))
    names = {f.code_raw: f.name for f in PROFILE.faults}
    assert names[1003] == "Encoder HALL signal error"
    assert names[1008] == "Position out of tolerance"
    assert names[1011] == "Bus voltage calibration error"
    assert names[1012] == "EEPROM writing error"
    assert all(f.causes and f.remedies for f in PROFILE.faults)


def test_homing_methods() -> None:
    # 360; described at 370, 374, 378 and 386
    methods = {m.method: m for m in PROFILE.homing_methods}
    assert list(methods) == [*range(1, 15), *range(17, 31), 33, 34, 35]
    described = {n: m.source for n, m in methods.items() if not m.notes}
    assert described == {17: "003:370", 18: "003:374", 24: "003:378", 29: "003:386"}
    assert methods[17].direction == methods[29].direction == "negative"
    assert methods[18].direction == methods[24].direction == "positive"


def test_status_word_is_its_own() -> None:
    # 301-306
    bits = PROFILE.by_key["6041:00"].bits
    assert set(bits) == {"15", "12", "10", "8", "7", "2-0"}
    assert "alarm" in bits["7"]
    assert PROFILE.quirk("own_status_word") is not None
    assert any(note.source == "003:659" for note in PROFILE.notes)  # 659-661


@pytest.mark.parametrize(
    ("key", "words"),
    [("60FF:00", "0 to 3000"), ("6099:02", "creep time"), ("6077:00", "RW"),
     ("2400:01", "00006"), ("PA_46", "number 0"), ("PA_44", "at once"), ("PA_45", "at once")],
)  # fmt: skip
def test_contradictions_are_kept(key: str, words: str) -> None:
    assert any(words in text for text in PROFILE.by_key[key].also_printed)


def test_gains_and_notch_exist_over_modbus_only() -> None:
    # 710-806: PA_38 to PA_54 have no object
    for number in ("38", "3D", "3F", "44", "4B", "50", "52", "53"):
        assert PROFILE.by_key[f"PA_{number}"].index is None
