"""Facts of manual 001, typed by hand from the lines named."""

from __future__ import annotations

import re

import pytest

from profiles import load_profile
from profiles.check import check

PROFILE = load_profile("ep3e")
U8 = (0, 255)
U16 = (0, 65535)
I16 = (-32768, 32767)
U32 = (0, 2**32 - 1)
I32 = (-(2**31), 2**31 - 1)

# key, type, access, pdo, unit, scale, (min, max), default — line of the manual
ROWS = [
    ("2003:00", "INT16", "ro", "none", "", 0.01, (0, 32767), None),  # 1085
    ("2005:00", "INT16", "rw", "none", "Hz", 1, (1, 3000), None),  # 1086
    ("2006:00", "INT16", "rw", "none", "ms", 0.1, (10, 10000), None),  # 1087
    ("2007:00", "INT16", "rw", "none", "ms", 0.01, (10, 5000), None),  # 1088
    ("2009:00", "INT16", "rw", "none", "Hz", 1, (1, 1000), None),  # 1089
    ("2011:00", "INT16", "rw", "none", "times", 0.1, (0, 2000), None),  # 1090
    ("2012:00", "INT16", "rw", "none", "%", 1, (0, 100), None),  # 1091
    ("2013:00", "INT16", "rw", "none", "ms", 0.01, (50, 5000), None),  # 1092
    ("2015:00", "INT16", "rw", "none", "%", 1, (0, 100), None),  # 1093
    ("2016:00", "INT16", "rw", "none", "ms", 0.01, (20, 5000), None),  # 1094
    ("201B:00", "INT16", "rw", "none", "", 1, (1, 32767), None),  # 1095
    ("201E:00", "INT16", "rw", "none", "", 1, (1, 32767), None),  # 1098
    ("202A:00", "INT16", "rw", "none", "", 1, (0, 1), None),  # 1099
    ("203C:00", "INT16", "rw", "none", "ms", 1, (0, 32767), None),  # 1100
    ("203F:00", "INT16", "rw", "none", "ms", 1, (0, 10000), None),  # 1102
    ("2041:00", "INT16", "rw", "none", "%", 1, (0, 300), None),  # 1103
    ("2042:00", "INT16", "rw", "none", "%", 1, (-300, 0), None),  # 1104
    ("2044:00", "INT16", "rw", "none", "%", 1, (-300, 0), None),  # 1106
    ("2047:00", "INT16", "rw", "none", "%", 1, (-300, 0), None),  # 1108
    ("200D:00", "UINT16", "rw", "none", "", 1, U16, None),  # 575
    ("200E:00", "INT16", "rw", "none", "", 1, I16, None),  # 576
    ("2601:00", "UINT32", "ro", "none", "", 1, (0, 0xFFFFFE00), None),  # 85-93
    ("2602:00", "UINT16", "ro", "none", "", 1, U16, None),  # 97
    ("2605:00", "UINT16", "ro", "none", "V", 1, U16, None),  # 103
    ("2606:00", "INT16", "ro", "none", "°C", 1, I16, None),  # 105-107
    ("2681:01", "INT16", "ro", "none", "rpm", 1, I16, None),  # 118-119
    ("2682:03", "INT16", "ro", "none", "A", 0.1, I16, None),  # 124-125
    ("26A1:00", "UINT16", "ro", "none", "Nm", 0.1, U16, None),  # 128
    ("6040:00", "UINT16", "rw", "rx", "", 1, U16, None),  # 308
    ("6041:00", "UINT16", "ro", "tx", "", 1, U16, None),  # 351
    ("6007:00", "INT16", "rw", "none", "", 1, (0, 3), None),  # 837
    ("605A:00", "INT16", "rw", "none", "", 1, (0, 7), None),  # 885
    ("605B:00", "INT16", "rw", "none", "", 1, (0, 1), None),  # 910
    ("605E:00", "INT16", "rw", "none", "", 1, (0, 2), None),  # 841
    ("6060:00", "INT8", "rw", "rx", "", 1, (-128, 127), None),  # 439
    ("6061:00", "INT8", "ro", "tx", "", 1, (-128, 127), None),  # 459
    ("6064:00", "INT32", "ro", "tx", "inc", 1, I32, None),  # 509
    ("606C:00", "INT32", "ro", "tx", "inc/s", 1, I32, None),  # 508
    ("6071:00", "INT16", "rw", "rx", "%", 0.1, I16, None),  # 540
    ("6072:00", "INT32", "rw", "rx", "%", 0.1, I32, None),  # 545
    ("60E1:00", "INT32", "rw", "rx", "%", 0.1, I32, None),  # 547
    ("6077:00", "INT16", "ro", "tx", "%", 0.1, I16, None),  # 507
    ("607A:00", "INT32", "rw", "rx", "inc", 1, I32, None),  # 503
    ("607C:00", "INT32", "rw", "none", "inc", 1, I32, None),  # 564
    ("607D:02", "INT32", "rw", "none", "inc", 1, I32, None),  # 573
    ("607E:00", "UINT8", "rw", "none", "", 1, U8, None),  # 1173
    ("6084:00", "UINT32", "rw", "rx", "inc/s²", 1, U32, None),  # 846
    ("6087:00", "UINT32", "rw", "rx", "%/s", 0.1, U32, None),  # 859
    ("608F:00", "UINT8", "ro", "none", "", 1, U8, 2),  # 1115
    ("608F:02", "UINT32", "ro", "none", "rev", 1, U32, 1),  # 1119-1120
    ("6091:02", "UINT32", "rw", "none", "rev", 1, U32, None),  # 1143
    ("6092:01", "UINT32", "rw", "none", "inc", 1, U32, None),  # 1157
    ("6098:00", "INT8", "rw", "rx", "", 1, (-128, 127), None),  # 581
    ("6099:02", "UINT32", "rw", "rx", "inc/s", 1, U32, None),  # 585
    ("609A:00", "UINT32", "rw", "rx", "inc/s²", 1, U32, None),  # 586
    ("60B1:00", "INT32", "rw", "rx", "inc/s", 1, I32, None),  # 505
    ("60B2:00", "INT16", "rw", "rx", "%", 0.1, I16, None),  # 506
    ("60B8:00", "UINT16", "rw", "rx", "", 1, U16, None),  # 733
    ("60BD:00", "INT32", "ro", "tx", "inc", 1, I32, None),  # 806
    ("60C6:00", "UINT32", "rw", "rx", "inc/s²", 1, U32, None),  # 868
    ("60FD:00", "UINT32", "ro", "tx", "", 1, U32, None),  # 947
    ("60FE:01", "UINT32", "rw", "rx", "", 1, U32, None),  # 986
    ("60FF:00", "INT32", "rw", "rx", "inc/s", 1, I32, None),  # 522
    ("6502:00", "UINT32", "ro", "tx", "", 1, U32, 0x3A0),  # 414, 420
    ("1010:01", "UINT32", "rw", "none", "", 1, U32, 1),  # 1208-1209
]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: str(row[0]))
def test_row(row: tuple[object, ...]) -> None:
    key, *facts = row
    p = PROFILE.by_key[str(key)]
    assert [p.type, p.access, p.pdo, p.unit, p.scale, p.raw_limits, p.default_raw] == facts


def test_it_says_that_it_is_partial() -> None:
    assert PROFILE.partial
    assert any("excerpt" in note.help for note in PROFILE.notes)


def test_check_has_nothing_to_say() -> None:
    assert [str(finding) for finding in check(PROFILE)] == []


def test_numbers_follow_the_inferred_rule() -> None:
    """Pnnn is 2000h + nnn: P029 and P030 (1009) are 201Dh and 201Eh (1097-1098)."""
    numbered = [p for p in PROFILE.parameters if p.number is not None]
    for p in numbered:
        assert p.number is not None
        assert re.fullmatch(r"P\d{3}", p.number)
        assert p.index == 0x2000 + int(p.number[1:])
        assert "inferred" in p.notes.lower(), p.key
    assert PROFILE.parameter("P029") is PROFILE.by_key["201D:00"]
    # 12, 875, 1009, 1295, 1301, 1402: what the text names has an entry
    named = {"P009", "P013", "P027", "P028", "P029", "P030", "P070", "P071", "P072", "P097"}
    assert named | {"P160", "P164"} <= {p.number for p in numbered}


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("2005:00", "setting value 45 Hz"), ("2006:00", "setting value 1.5 ms"),
        ("2042:00", "setting value -200 %"), ("203C:00", "0-300000"), ("6041:00", "bits 14 and 15"),
        ("6061:00", "PP, PV and PT"), ("605E:00", "brake acts at once"), ("2682:04", "sub-index 3"),
        ("60FE:01", "DO0 to DO4"), ("200D:00", "P013"),
    ],
)  # fmt: skip
def test_contradictions_are_kept(key: str, words: str) -> None:
    assert any(words in text for text in PROFILE.by_key[key].also_printed)


def test_modes() -> None:
    # 37-43, 404-409
    assert PROFILE.supported_modes == (6, 8, 9, 10)
    assert sorted(PROFILE.by_key["6060:00"].enum) == [0, 6, 8, 9, 10]
    pause = next(note for note in PROFILE.notes if note.source == "001:486")
    assert "20 ms" in pause.help


def test_quick_stop_codes() -> None:
    # 889-903: 4 does not exist
    assert sorted(PROFILE.by_key["605A:00"].enum) == [0, 1, 2, 3, 5, 6, 7]
    assert sorted(PROFILE.by_key["607E:00"].enum) == [0, 224]  # 1184-1188


def test_process_data() -> None:
    # 232-256
    assert PROFILE.pdo is not None
    sets = {s.index: [key[:4] for key in s.entries] for s in PROFILE.pdo.sets}
    assert sets == {
        0x1600: ["6040", "6060", "607A", "60FF", "6071"],
        0x1601: ["6040", "607A"],
        0x1602: ["6040", "60FF"],
        0x1603: ["6040", "6071"],
        0x1A00: ["6041", "6061", "6064", "606C", "6077"],
        0x1A01: ["6041", "6064"],
        0x1A02: ["6041", "6064", "606C"],
        0x1A03: ["6041", "6064", "6077"],
    }
    for index, entries in sets.items():
        values = [
            PROFILE.by_key[f"{index:04X}:{n:02X}"].default_raw for n in range(len(entries) + 1)
        ]
        assert values[0] == len(entries)
        assert [f"{int(str(value)) >> 16:04X}" for value in values[1:]] == entries
    assert PROFILE.by_key["1600:02"].default_raw == 0x60600008  # SINT, 439
    assert PROFILE.by_key["1A03:03"].default_raw == 0x60770010  # INT, 507


def test_saving_and_restoring() -> None:
    # 1209-1212: same object, ten seconds without SDO, then 0 is success and 1 is failure
    signatures = {"save": 0x45534554, "restore": 0x45444546}
    for name, signature in signatures.items():
        procedure = PROFILE.procedure(name)
        assert procedure is not None
        write = next(s for s in procedure.steps if s.do == "write")
        wait = next(s for s in procedure.steps if s.do == "wait")
        poll = next(s for s in procedure.steps if s.do == "poll")
        assert (write.key, write.raw) == ("1010:01", signature)
        assert wait.seconds >= 10
        assert (poll.key, poll.equals, poll.failed) == ("1010:01", 0, (1,))
    assert "1011:01" not in PROFILE.by_key


# 1219-1267: the numbers of the list and which of them a fault reset clears
ALARMS = [
    1, 2, 4, 7, 8, 11, 12, 13, 14, 16, 17, 18, 20, 21, 22, 23, 25, 27, 29, 35, 36,
    40, 41, 42, 43, 44, 45, 46, 47, 48, 49, 50, 51, 60, 61, 62, 65, 66, 68, 80, 81, 82, 88, 89,
]  # fmt: skip
CLEARABLE = {1, 2, 4, 7, 8, 29, 60, 88, 89}


def test_forty_four_alarms() -> None:
    assert len(ALARMS) == 44
    assert [f.code_raw for f in PROFILE.faults] == [0xFF00 + n for n in ALARMS]
    assert [f.code for f in PROFILE.faults] == [f"Err{n}" for n in ALARMS]
    cleared = {n for n, f in zip(ALARMS, PROFILE.faults, strict=True) if "Not by" not in f.reset}
    assert cleared == CLEARABLE


def test_causes_and_remedies() -> None:
    """Rows of the tables in 7.2 (1273-1548), a remedy to each cause."""
    rows = {
        1: 3, 2: 3, 4: 7, 7: 1, 8: 2, 11: 5, 12: 3, 13: 4, 14: 4, 16: 2, 17: 2, 18: 2, 20: 1, 21: 1,
        22: 1, 23: 2, 25: 1, 27: 3, 29: 2, 35: 2, 36: 3, 40: 3, 41: 3, 42: 2, 43: 2, 44: 2, 45: 2,
        46: 2, 47: 1, 48: 2, 49: 1, 50: 1, 51: 2, 60: 1, 61: 2, 62: 1, 65: 1, 66: 1, 68: 1, 80: 1,
        81: 1, 82: 1, 88: 1, 89: 1,
    }  # fmt: skip
    for number, fault in zip(ALARMS, PROFILE.faults, strict=True):
        assert (len(fault.causes), len(fault.remedies)) == (rows[number], rows[number]), number


def test_homing_methods() -> None:
    # 588-691
    methods = [m.method for m in PROFILE.homing_methods]
    assert methods == [*range(1, 15), *range(17, 31), 33, 34, 35]


def test_output_functions() -> None:
    # 7-23
    outputs = [t for t in PROFILE.terminals if t.direction == "out"]
    assert [t.name for t in outputs] == ["DO1", "DO2", "DO3", "DO4", "DO5"]
    codes = [f.code for f in outputs[0].functions]
    assert codes == [0, 1, 2, 3, 4, 8, 9, 11, 12, 13, 23, 24, 25, 26, 27, 28]


def test_gear_acts_when_the_bus_starts() -> None:
    # 1005, 1018
    for key in ("6091:01", "6091:02", "6092:01", "6092:02", "607E:00", "607C:00"):
        assert PROFILE.by_key[key].effective == "power_cycle"
    assert any(note.key == "6091:01" for note in PROFILE.notes)
