"""Facts of manual 000, typed by hand from the lines named."""

from __future__ import annotations

import pytest

from profiles import load_profile
from profiles.check import check

PROFILE = load_profile("m6l")

# number, type, access, unit, scale, min, max, default, effective, settable — line of the manual
ROWS = [
    ("P00.01", "UINT16", "ro", "", 0.01, 0, 9999, None, "now", "any"),  # 3167
    ("P01.03", "UINT16", "rw", "A", 0.1, 1, 9999, None, "power_cycle", "stopped"),  # 3180
    ("P01.08", "UINT16", "rw", "kg·cm²", 0.001, 1, 65535, None, "power_cycle", "stopped"),  # 3185
    ("P01.19", "UINT32", "rw", "", 1, 1, 4194304, 2097152, "now", "stopped"),  # 3198
    ("P01.22", "UINT16", "rw", "°", 0.1, 0, 3599, 1800, "now", "stopped"),  # 3201
    ("P01.29", "UINT16", "rw", "mm", 0.01, 1, 65535, 3200, "now", "stopped"),  # 3211
    ("P02.04", "UINT16", "rw", "P/r", 1, 1, 32768, 2500, "now", "any"),  # 3228
    ("P02.10", "UINT16", "rw", "ms", 1, 20, 500, 250, "now", "any"),  # 3234
    ("P02.13", "UINT16", "rw", "ms", 1, 1, 30000, 500, "now", "any"),  # 3240
    ("P03.08", "UINT16", "rw", "", 1, 0, 50, 36, "now", "stopped"),  # 3265
    ("P03.11", "UINT16", "rw", "ns", 100, 0, 127, 50, "now", "any"),  # 3273
    ("P03.13", "UINT16", "rw", "", 1, 0, 0x1FF, 0, "now", "any"),  # 3275
    ("P05.05", "UINT32", "rw", "P/r", 1, 0, 8388608, 10000, "now", "stopped"),  # 3296
    ("P05.07", "UINT16", "rw", "ms", 0.1, 0, 128, 0, "now", "any"),  # 3298
    ("P05.08", "UINT32", "rw", "", 1, 1, 1073741824, 8388608, "now", "stopped"),  # 3299
    ("P05.12", "UINT32", "rw", "", 1, 1, 1073741824, 10000, "now", "stopped"),  # 3306
    ("P05.21", "UINT16", "rw", "encoder unit", 1, 0, 32767, 20000, "now", "any"),  # 3317
    ("P06.05", "UINT16", "rw", "rpm", 0.1, 0, 60000, 1000, "now", "stopped"),  # 3344
    ("P06.11", "UINT16", "rw", "rpm", 0.1, 0, 60000, 60000, "now", "any"),  # 3350
    ("P06.16", "UINT16", "rw", "%", 0.1, 0, 4000, 1000, "now", "any"),  # 3358
    ("P06.20", "UINT16", "rw", "", 0.001, 0, 6000, 1000, "now", "any"),  # 3365
    ("P07.03", "INT16", "rw", "%", 0.1, -4000, 4000, 0, "now", "any"),  # 3374
    ("P07.05", "UINT16", "rw", "ms", 0.1, 0, 300, 10, "now", "stopped"),  # 3376
    ("P08.00", "UINT16", "rw", "Hz", 0.1, 1, 50000, 200, "now", "any"),  # 3390
    ("P08.01", "UINT16", "rw", "ms", 0.1, 0, 10000, 500, "now", "any"),  # 3391
    ("P08.02", "UINT16", "rw", "rad/s", 1, 1, 8000, 100, "now", "any"),  # 3392
    ("P08.03", "UINT16", "rw", "ms", 0.1, 0, 320, 8, "now", "any"),  # 3393
    ("P08.14", "UINT16", "rw", "ms", 0.01, 0, 6400, 50, "now", "any"),  # 3407
    ("P08.15", "UINT16", "rw", "%", 0.01, 0, 10000, 0, "now", "any"),  # 3408
    ("P09.01", "UINT16", "rw", "rpm", 1, 200, 2000, 800, "now", "stopped"),  # 3418
    ("P09.03", "UINT16", "rw", "rev", 0.01, 0, 65535, 0, "now", "stopped"),  # 3420
    ("P09.17", "UINT16", "rw", "Hz", 1, 10, 1000, 100, "now", "stopped"),  # 3436
    ("P09.29", "INT16", "rw", "%", 0.01, -30000, 30000, 0, "now", "any"),  # 3451
    ("P09.38", "UINT16", "rw", "", 0.01, 0, 12000, 100, "now", "stopped"),  # 3465
    ("P10.07", "UINT16", "rw", "%", 0.1, 200, 3000, 1000, "now", "any"),  # 3480
    ("P10.12", "UINT16", "rw", "rpm", 1, 0, 10000, 6000, "now", "stopped"),  # 3485
    ("P10.22", "INT16", "ro", "A", 0.1, -10000, 10000, 0, "now", "any"),  # 3510
    ("P10.59", "INT16", "ro", "°C", 0.1, -400, 1500, 0, "now", "any"),  # 3556
    ("P11.06", "INT16", "ro", "Nm", 0.01, -30000, 30000, None, "now", "any"),  # 3564
    ("P11.09", "UINT16", "ro", "V", 1, 0, 900, None, "now", "any"),  # 3567
    ("P11.33", "UINT16", "ro", "rev", 1, 0, 65535, None, "now", "any"),  # 3594
    ("P12.05", "UINT16", "rw", "rpm", 0.1, 0, 10000, 1000, "now", "stopped"),  # 3631
    ("P12.09", "UINT16", "rw", "ms", 1, 0, 65535, 60000, "now", "stopped"),  # 3635
    ("P17.24", "UINT16", "rw", "", 1, 0, 1, 1, "now", "stopped"),  # 3670
    ("P17.25", "UINT16", "rw", "s", 0.1, 0, 10000, 1, "power_cycle", "stopped"),  # 3674
    ("P18.02", "UINT16", "rw", "", 0.01, 1, 50000, 1000, "now", "stopped"),  # 3679
    ("P20.08", "UINT16", "rw", "", 1, 0, 65535, 0, "power_cycle", "stopped"),  # 3689
    ("P20.20", "UINT16", "rw", "%/ms", 0.01, 0, 65535, 0, "now", "stopped"),  # 2992
    ("P23.20", "UINT16", "rw", "%", 0.1, 0, 4000, 300, "now", "stopped"),  # 2708
    ("P24.07", "UINT16", "rw", "%", 0.1, 100, 3000, 1000, "now", "stopped"),  # 3730
    ("P24.17", "UINT16", "rw", "", 1, 4, 31, 16, "now", "stopped"),  # 3745
    ("P24.26", "INT16", "rw", "°C", 0.1, -1500, 1500, 1000, "now", "any"),  # 3757
    ("P24.29", "UINT16", "rw", "kHz", 1, 8, 16, 8, "power_cycle", "stopped"),  # 3760
]

# key, type, pdo, unit, scale — line of the manual
OBJECTS = [
    ("605A:00", "INT16", "rx", "", 1),  # 3772
    ("6061:00", "INT8", "tx", "", 1),  # 3777
    ("6065:00", "UINT32", "rx", "inc", 1),  # 3780
    ("606B:00", "INT32", "tx", "rpm", 1),  # 3785
    ("606D:00", "UINT16", "rx", "rpm", 1),  # 3787
    ("6071:00", "INT16", "rx", "%", 0.1),  # 3793
    ("607E:00", "UINT8", "rx", "", 1),  # 3800
    ("6080:00", "UINT32", "rx", "rpm", 1),  # 3802
    ("6084:00", "UINT32", "rx", "inc/s²", 1),  # 3805
    ("6087:00", "UINT16", "rx", "%/s", 0.1),  # 3807
    ("60B8:00", "INT16", "rx", "", 1),  # 3812
    ("60F4:00", "INT32", "tx", "inc", 1),  # 3822
    ("60FF:00", "INT32", "rx", "inc/s", 1),  # 3825
]

# number, value, a word of its label — line of the manual
LABELS = [
    ("P01.18", 5, "17-bit"),  # 3197
    ("P01.28", 2, "linear"),  # 3210
    ("P02.00", 8, "EtherCAT"),  # 3222
    ("P02.18", 1, "external"),  # 3245
    ("P02.22", 1, "fault memory"),  # 3254
    ("P03.04", 50, "touch probe 2"),  # 3271
    ("P03.15", 28, "forced output"),  # 3285
    ("P05.31", 2, "after homing"),  # 3335
    ("P06.12", 3, "External"),  # 3354
    ("P08.09", 10, "actual speed"),  # 3402
    ("P09.08", 4, "default"),  # 3427
    ("P10.06", 2, "set stop mode"),  # 3479
    ("P10.18", 66, "Homing logic"),  # 3504
    ("P10.20", 85, "disconnection"),  # 3506, by 3508
    ("P12.00", 4, "Immediately"),  # 3618
    ("P12.01", 7, "negative limit"),  # 3622
    ("P17.26", 2, "Save"),  # 3675
    ("P20.15", 1, "Command unit"),  # 3696
    ("P24.01", 2, "servo"),  # 3721
]

# code, name, how many causes, a word of a cause, a word of a remedy — line of the manual
FAULTS = [
    ("Er.001", "Drive overcurrent", 6, "burned out", "unbalanced"),  # 3839-3844
    ("Er.002", "Drive main circuit overvoltage", 4, "braking resistor", "P11.09"),  # 3845-3850
    ("Er.009", "Braking resistor overload", 4, "jumper", "jumper"),  # 3862-3865
    ("Er.010", "Power module protection", 6, "shoot-through", "technical"),  # 3866-3875
    ("Er.012", "Motor overload", 6, "inertia", "capacity"),  # 3876-3881
    ("Er.013", "EEPROM read/write fault", 2, "number of times", "P02.22=2"),  # 3883-3886
    ("Er.027", "Servo motor overspeed", 6, "UVW", "P10.12"),  # 3905-3912
    ("Er.058", "Magnetic pole identification error", 0, "", ""),  # 3936
    ("Er.066", "Homing logic error", 1, "positioning", "completion"),  # 3945
    ("Er.080", "Control circuit undervoltage", 1, "USB", "wiring"),  # 3958
    ("AL.012", "Motor overload", 6, "locked rotor", "Re-adjust"),  # 3970-3975
    ("AL.038", "DI emergency brake alarm", 1, "terminal", "normal logic"),  # 3980
    ("AL.075", "Absolute encoder battery undervoltage", 1, "3.1 V", "battery"),  # 3986
]


def test_no_findings() -> None:
    assert [str(finding) for finding in check(PROFILE)] == []


@pytest.mark.parametrize("row", ROWS, ids=lambda row: str(row[0]))
def test_row(row: tuple[object, ...]) -> None:
    number, *facts = row
    p = PROFILE.parameter(str(number))
    assert p is not None
    found = [p.type, p.access, p.unit, p.scale, p.min_raw, p.max_raw, p.default_raw]
    assert [*found, p.effective, p.settable] == facts


@pytest.mark.parametrize("row", OBJECTS, ids=lambda row: row[0])
def test_object(row: tuple[str, str, str, str, float]) -> None:
    p = PROFILE.by_key[row[0]]
    assert (p.key, p.type, p.pdo, p.unit, p.scale) == row


@pytest.mark.parametrize("row", LABELS, ids=lambda row: f"{row[0]}={row[1]}")
def test_label(row: tuple[str, int, str]) -> None:
    number, code, word = row
    p = PROFILE.parameter(number)
    assert p is not None
    assert word in p.enum[code]


@pytest.mark.parametrize("row", FAULTS, ids=lambda row: row[0])
def test_fault(row: tuple[str, str, int, str, str]) -> None:
    code, name, causes, cause, remedy = row
    fault = next(f for f in PROFILE.faults if f.code == code)
    assert (fault.name, len(fault.causes)) == (name, causes)
    assert cause in " ".join(fault.causes)
    assert remedy in " ".join(fault.remedies)
    assert fault.code_raw == 0xFF00 | int(code[3:])  # 3829
    assert fault.kind == ("warning" if code.startswith("AL") else "fault")


def test_numbers_are_keys_by_the_rule_of_section_8_1() -> None:
    assert PROFILE.by_key["200C:0B"].number == "P12.10"  # 3158
    assert PROFILE.by_key["2000:01"].number == "P00.00"
    for p in PROFILE.parameters:
        if p.number:
            group, _, place = p.number[1:].partition(".")
            assert p.key == f"{0x2000 + int(group):04X}:{int(place) + 1:02X}"


def test_every_group_is_complete() -> None:
    """Entries per group that are not marked reserved, counted in the tables of 8.1."""
    counted = {
        "P00": 7, "P01": 34, "P02": 24, "P03": 19, "P05": 32, "P06": 25, "P07": 16, "P08": 20,
        "P09": 38, "P10": 60, "P11": 44, "P12": 12, "P17": 25, "P18": 4, "P20": 15, "P24": 31,
    }  # fmt: skip
    found = {
        name: sum(1 for p in PROFILE.parameters if (p.number or "").startswith(name + "."))
        for name in counted
    }
    assert found == counted
    # P23.20 and P23.21 are printed in 7.4.4.5 only (2708)
    special = [p.number for p in PROFILE.parameters if (p.number or "").startswith("P23")]
    assert special == ["P23.06", "P23.07", "P23.11", "P23.12", "P23.20", "P23.21"]


def test_faults_alarms_and_homing_methods_are_all_there() -> None:
    kinds = [fault.kind for fault in PROFILE.faults]
    assert (kinds.count("fault"), kinds.count("warning")) == (67, 7)  # tables 9-1 and 9-2
    methods = {m.method: m for m in PROFILE.homing_methods}
    assert set(methods) == {-4, -3, -2, -1, *range(1, 15), *range(17, 31), 33, 34, 35}
    assert methods[-1].direction == "positive"  # 2703
    assert methods[-2].direction == "negative"  # 2719
    assert methods[-3].direction == "negative"  # 2735
    assert methods[-3].uses_index
    assert "2017:15" in methods[-4].parameters  # 2749
    assert {m for m, x in methods.items() if x.signal == "limit"} == {1, 2, 17, 18}
    backward = {5, 6, 11, 12, 13, 14, 21, 22, 27, 28, 29, 30, 33, 1, 17, -2, -3}
    assert {m for m, x in methods.items() if x.direction == "negative"} == backward


def test_process_data() -> None:
    pdo = PROFILE.pdo
    assert pdo is not None
    assert (pdo.max_entries, pdo.max_bytes, pdo.cycle_min_us) == (10, 40, 250)  # 1552, 1610
    fixed = {s.index: s.entries for s in pdo.sets if s.fixed}
    assert fixed[0x1A03] == ("6041:00", "6064:00", "6077:00")  # 1559
    assert len(fixed) == 6  # 1549
    assert PROFILE.by_key["1601:02"].default_raw == 0x60FF0020  # 1553, coded by 1569-1583


def test_bits() -> None:
    inputs = PROFILE.by_key["60FD:00"].bits
    assert (inputs["0"], inputs["1"], inputs["24"]) == ("negative limit", "positive limit", "DI9")
    assert inputs["25"] == "Z signal"  # 3094
    assert PROFILE.by_key["607E:00"].bits["5"].startswith("torque")  # 1937
    status = PROFILE.parameter("P11.11")
    assert status is not None
    assert status.bits["9"] == "DC overvoltage limiting"  # 3572
    assert PROFILE.by_key["605A:00"].enum.keys() == {0, 1, 2, 5, 6}  # 3017


def test_eeprom_is_spared_while_tuning() -> None:
    begin, end = PROFILE.procedure("tuning_begin"), PROFILE.procedure("tuning_end")
    assert begin is not None
    assert end is not None
    assert [(s.key, s.raw) for s in begin.steps if s.do == "write"] == [("2011:19", 0)]  # 3670
    assert [(s.key, s.raw) for s in end.steps if s.do == "write"] == [("2011:1B", 2)]  # 3675
    assert any(note.key == "2011:19" for note in PROFILE.notes)


def test_what_starts_motion_or_belongs_to_one_motor_is_never_cloned() -> None:
    for number in ("P01.20", "P01.22", "P01.32", "P02.01", "P03.14", "P09.00", "P12.00", "P20.08"):
        p = PROFILE.parameter(number)
        assert p is not None
        assert p.motor_individual


def test_increments_come_from_the_drive() -> None:
    """Two defaults of P05.05 are printed (3296 and 3139): the tool must read it."""
    assert PROFILE.units.feed == "2005:06"
    p = PROFILE.by_key["2005:06"]
    assert "8388608" in p.also_printed[0]
