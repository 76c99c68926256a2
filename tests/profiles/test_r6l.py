"""Facts of manual 002, typed by hand from the lines named."""

from __future__ import annotations

from collections import Counter

import pytest

from backend.axes.axis.axis import Axis
from backend.axes.drive.drive import Drive
from backend.axes.drive.ports import Port
from backend.foundation.work.jobs import Progress
from backend.tools.moving.moves.procedures import run_procedure
from drivers.link import Found
from profiles import load_profile
from profiles.check import check
from tests.support.memory_link import MemoryLink

PROFILE = load_profile("r6l")
BIG = 2**31

# key, number, type, access, pdo, unit, scale, min, max, default — line of the manual
ROWS = [
    ("2000:12", "P00.17", "UINT16", "rw", "none", "kW", 0.01, 0, 65535, None),  # 7610
    ("2000:16", "P00.21", "UINT16", "rw", "none", "rpm", 1, 0, 65535, None),  # 7687
    ("2000:19", "P00.24", "UINT16", "rw", "none", "kg·cm²", 0.01, 0, 65535, None),  # 7747
    ("2000:24", "P00.35", "UINT32", "rw", "none", "encoder inc", 1, 0, 2**32 - 1, 0),  # 7953
    ("2001:01", "P01.00", "UINT16", "rw", "none", "", 1, 0, 8, 3),  # 8032
    ("2001:05", "P01.04", "UINT16", "rw", "none", "ms", 1, 0, 1000, 500),  # 8121
    ("2001:0D", "P01.12", "UINT16", "rw", "none", "ms", 1, 0, 2000, 100),  # 8263
    ("2001:15", "P01.20", "UINT16", "ro", "none", "Ω", 1, 0, 65535, 40),  # 8312
    ("2001:1C", "P01.27", "UINT16", "rw", "none", "V", 1, 0, 999, 380),  # 8375
    ("2001:1E", "P01.29", "UINT16", "rw", "none", "ms", 1, 500, 65535, 8000),  # 8408
    ("2001:31", "P01.48", "UINT16", "rw", "none", "V", 1, 0, 999, 420),  # 8550
    ("2001:3C", "P01.59", "UINT16", "rw", "none", "%", 1, 40, 500, 100),  # 8693
    ("2001:53", "P01.82", "UINT16", "rw", "none", "%", 0.1, 10, 3000, 2400),  # 8886
    ("2001:58", "P01.87", "UINT16", "rw", "none", "rpm", 1, 500, 10000, 4500),  # 8946
    ("2002:05", "P02.04", "UINT16", "rw", "rxtx", "", 1, 0, 63, 11),  # 9089
    ("2002:0F", "P02.14", "UINT16", "rw", "rxtx", "", 1, 0, 63, 31),  # 9186
    ("2002:25", "P02.36", "UINT16", "rw", "rxtx", "", 1, 0, 31, 2),  # 9282
    ("2003:05", "P03.04", "UINT16", "rw", "rxtx", "ms", 0.1, 0, 1280, 0),  # 9462
    ("2003:1D", "P03.28", "INT16", "rw", "none", "pulse", 1, -32768, 32767, 10000),  # 9540
    ("2003:41", "P03.64", "INT64", "rw", "none", "", 1, -(2**63), 2**63 - 1, 0),  # 9593
    ("2003:51", "P03.80", "INT32", "ro", "none", "", 1, -BIG, BIG - 1, 0),  # 9711
    ("2004:05", "P04.04", "UINT16", "rw", "rxtx", "rpm", 1, 0, 6000, 100),  # 9774
    ("2004:0D", "P04.12", "UINT16", "rw", "none", "rpm", 1, 0, 6000, 5000),  # 9873
    ("2004:1F", "P04.30", "INT32", "rw", "none", "rpm", 0.001, -9000000, 9000000, 0),  # 9943
    ("2004:57", "P04.86", "UINT16", "rw", "none", "", 1, 0, 99, 10),  # 10013
    ("2005:12", "P05.17", "UINT16", "rw", "rxtx", "%", 0.1, 0, 3000, 300),  # 10330
    ("2005:15", "P05.20", "INT32", "rw", "rxtx", "%", 0.001, -300000, 300000, 0),  # 10350
    ("2005:31", "P05.48", "UINT16", "rw", "none", "ms", 0.01, 0, 3000, 80),  # 10421
    ("2006:01", "P06.00", "UINT16", "rw", "rxtx", "Hz", 0.1, 1, 50000, 250),  # 10556
    ("2006:02", "P06.01", "UINT16", "rw", "rxtx", "ms", 0.01, 15, 51200, 3183),  # 10566
    ("2006:03", "P06.02", "UINT16", "rw", "rxtx", "Hz", 0.1, 0, 50000, 400),  # 10576
    ("2006:0D", "P06.12", "UINT16", "rw", "rxtx", "%", 1, 0, 12000, 100),  # 10659
    ("2006:15", "P06.20", "UINT16", "rw", "rxtx", "Hz", 1, 100, 4000, 4000),  # 10754
    ("2006:41", "P06.64", "UINT16", "rw", "none", "", 1, 0, 65535, 200),  # 10938
    ("2006:4D", "P06.76", "UINT16", "rw", "rxtx", "%", 0.1, 0, 2250, 2250),  # 10995
    ("2006:51", "P06.80", "UINT16", "rw", "rxtx", "%", 0.1, 350, 1000, 707),  # 11035
    ("2007:02", "P07.01", "UINT16", "rw", "rxtx", "", 1, 0, 31, 12),  # 11109
    ("2007:08", "P07.07", "UINT16", "rw", "rxtx", "ms", 1, 20, 800, 125),  # 11141
    ("2007:0A", "P07.09", "UINT16", "ro", "tx", "rev", 0.1, 0, 65535, None),  # 11161
    ("2007:16", "P07.21", "UINT16", "rw", "rxtx", "Hz", 1, 50, 4000, 4000),  # 11278
    ("2007:1F", "P07.30", "INT16", "rw", "rxtx", "%", 0.1, -1000, 1000, 0),  # 11328
    ("2008:0C", "P08.11", "UINT16", "rw", "none", "", 1, 0, 7, 0),  # 11421
    ("2008:18", "P08.23", "UINT16", "rw", "none", "", 1, 0, 5000, 3000),  # 11559
    ("2008:1F", "P08.30", "UINT16", "rw", "none", "ms", 1, 0, 5000, 3500),  # 11626
    ("200C:0B", "P12.10", "UINT16", "rw", "none", "", 1, 0, 65535, 0),  # 11909
    ("200C:1B", "P12.26", "UINT16", "rw", "none", "%", 0.1, 0, 3000, 200),  # 12017
    ("200D:18", "P13.23", "UINT16", "ro", "none", "V", 0.1, 0, 65535, None),  # 12294
    ("200D:24", "P13.35", "UINT16", "rw", "none", "", 1, 0, 9, None),  # 12361
    ("200D:26", "P13.37", "UINT16", "ro", "none", "A", 0.01, 0, 65535, None),  # 12381
    ("200D:5D", "P13.92", "UINT16", "ro", "none", "µs", 1 / 288, 0, 65535, None),  # 12647
    ("605A:00", None, "INT16", "rw", "none", "", 1, 0, 7, 2),  # 12828
    ("6065:00", None, "UINT32", "rw", "rx", "inc", 1, 0, 2**32 - 1, 1310720),  # 12946
    ("6067:00", None, "UINT32", "rw", "rx", "encoder inc", 1, 0, 65535, 65),  # 13008
    ("6071:00", None, "INT16", "rw", "rx", "%", 0.1, -5000, 5000, 0),  # 13091
    ("6077:00", None, "INT16", "ro", "tx", "%", 0.1, -5000, 5000, None),  # 13140
    ("6083:00", None, "UINT32", "rw", "rx", "inc/s²", 1, 1, 2**32 - 1, 131072),  # 13323
    ("6087:00", None, "UINT32", "rw", "rx", "%/s", 0.1, 0, 2**32 - 1, 131072),  # 13384
    ("6091:01", None, "UINT32", "rw", "rx", "", 1, 1, 2**32 - 1, 1),  # 13471
    ("6098:00", None, "INT8", "rw", "rx", "", 1, 0, 35, 19),  # 13491
    ("6099:02", None, "UINT32", "rw", "rx", "inc/s", 1, 0, 2**32 - 1, 65535),  # 13550
    ("60B2:00", None, "INT16", "rw", "rx", "%", 0.1, -5000, 5000, 0),  # 13618
    ("60FF:00", None, "INT32", "rw", "rx", "inc/s", 1, -BIG, BIG - 1, 131072),  # 14058
]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: str(row[0]))
def test_row(row: tuple[object, ...]) -> None:
    key, *facts = row
    p = PROFILE.by_key[str(key)]
    low, high = p.raw_limits
    shown = [p.number, p.type, p.access, p.pdo, p.unit, p.scale, low, high, p.default_raw]
    assert shown == facts


def test_number_is_the_place_in_the_dictionary() -> None:
    # 002:5934-5942: index 2000h + group, subindex number + 1; the manual's own two examples
    assert PROFILE.by_key["2003:05"].number == "P03.04"
    assert PROFILE.by_key["200D:18"].number == "P13.23"
    for p in PROFILE.parameters:
        if p.index is not None and 0x2000 <= p.index < 0x3000 and p.subindex:
            assert p.number == f"P{p.index - 0x2000:02d}.{p.subindex - 1:02d}"
        else:
            assert p.number is None


def test_rows_of_each_group() -> None:
    # Rows of sections 8.3.1 to 8.3.11, "Maximum subindex number" included, counted in the manual.
    counts = Counter(p.key[:4] for p in PROFILE.parameters if p.key.startswith("20"))
    assert counts == {
        "2000": 31, "2001": 67, "2002": 31, "2003": 21, "2004": 36, "2005": 26,
        "2006": 45, "2007": 26, "2008": 38, "200C": 21, "200D": 55,
    }  # fmt: skip
    # 002:7462, 8024, 8981, 9407, 9766, 10209, 10548, 11080, 11383, 11810, 12092
    highest = [PROFILE.by_key[f"{index}:00"].default_raw for index in sorted(counts)]
    assert highest == [0x38, 0x58, 0x54, 0x53, 0x63, 0x3D, 0x52, 0x21, 0x37, 0x1F, 0x61]


def test_default_mappings() -> None:
    # 002:6256-6333, 6381-6500, 6546-6643, 6687-6824, 6868-6948, 6989
    expected = {
        "1600": [0x60400010, 0x607A0020, 0x60B80010],
        "1601": [0x60400010, 0x607A0020, 0x60810020, 0x60830020, 0x60840020, 0x60600008],
        "1602": [0x60400010, 0x60830020, 0x60840020, 0x60FF0020, 0x60600008],
        "1A00": [0x603F0010, 0x60410010, 0x60610008, 0x60640020, 0x60B90010, 0x60BA0020,
                 0x60FD0020],
        "1A01": [0x60410010, 0x60610008, 0x606C0020, 0x60FD0020],
        "1A02": [],
    }  # fmt: skip
    sizes = {"INT8": 8, "UINT16": 16, "INT32": 32, "UINT32": 32}
    assert PROFILE.pdo is not None
    for pdo in PROFILE.pdo.sets:
        entries = expected[f"{pdo.index:04X}"]
        values = [PROFILE.by_key[f"{pdo.index:04X}:{s:02X}"].default_raw for s in range(13)]
        assert values == [len(entries), *entries, *[None] * (12 - len(entries))]
        parts = [PROFILE.by_key[key] for key in pdo.entries]
        assert [
            (p.index or 0) << 16 | (p.subindex or 0) << 8 | sizes[p.type] for p in parts
        ] == entries
    assert PROFILE.by_key["1C12:01"].default_raw == 0x1600  # 002:7136
    assert PROFILE.by_key["1C13:01"].default_raw == 0x1A00  # 002:7190
    assert (PROFILE.pdo.max_entries, PROFILE.pdo.max_bytes) == (12, 48)  # 002:2137


def test_saving_mask() -> None:
    # 002:11429-11443
    assert any(note.key == "2008:0C" for note in PROFILE.notes)
    mask = PROFILE.by_key["2008:0C"]
    assert set(mask.enum) == set(range(8))
    assert set(mask.bits) == {"0", "1", "2"}


def test_commands() -> None:
    # 002:1671, 1673, 1677, 1681, 1683; 11879
    written = {
        p.name: [(s.key, s.raw) for s in p.steps if s.do == "write"] for p in PROFILE.procedures
    }
    assert written["restore"] == [("200C:01", 1)]
    assert written["clear_history"] == [("200C:01", 2)]
    assert written["fault_reset"] == [("200C:09", 1)]
    assert written["clear_encoder_fault"] == [("200C:06", 1)]
    assert written["clear_multi_turn"] == [("200C:06", 2)]
    assert written["reset"] == [("200C:08", 1)]


def test_nothing_saves_by_the_torque_tuning() -> None:
    # 002:12982 says to save by P12.20 = 1; 002:11987 calls it the torque PI auto-tuning.
    keys = {s.key for p in PROFILE.procedures for s in p.steps if s.do == "write"}
    assert "200C:15" not in keys
    assert "torque" in PROFILE.by_key["200C:15"].name


@pytest.mark.parametrize("name", ["restore", "reset", "clear_history", "identify", "saving_on"])
def test_far_reaching_commands_ask_first(name: str) -> None:
    procedure = PROFILE.procedure(name)
    assert procedure is not None
    assert procedure.steps[0].do == "confirm"


def test_input_bits_are_forward_first() -> None:
    # 002:13914-13936; CiA 402 has the negative limit in bit 0
    bits = PROFILE.by_key["60FD:00"].bits
    assert bits["0"].startswith("forward")
    assert bits["1"].startswith("reverse")
    assert (bits["16"], bits["23"]) == ("IN1", "IN8")
    assert PROFILE.quirk("limit_bits_swapped") is not None
    assert PROFILE.by_key["6041:00"].bits["15"] == "home found"  # 12793


def test_terminal_functions() -> None:
    by_name = {t.name: t for t in PROFILE.terminals}
    assert set(by_name) == {f"DI{n}" for n in range(1, 10)} | {f"DO{n}" for n in range(1, 7)}
    inputs = {f.code: f.name for f in by_name["DI1"].functions}
    assert len(inputs) == 41  # 8997-9037
    assert inputs[5] == "positive limit"
    assert inputs[6] == "negative limit"
    assert inputs[11] == "emergency stop"
    assert inputs[23] == "home switch"
    assert inputs[40] == "jog reverse enable"  # 9035
    outputs = {f.code: f.name for f in by_name["DO4"].functions}
    assert outputs[0] == "brake"
    assert outputs[25] == "torque limited"
    assert outputs[31].startswith("universal output")  # 14003
    assert by_name["DO4"].function_key == "2002:27"  # 9300
    assert by_name["DI9"].function_key is None
    assert PROFILE.by_key["2002:02"].enum[4] == "rising/falling edge"  # 9060
    assert PROFILE.by_key["2002:22"].enum == {0: "normally open", 1: "normally closed"}  # 9255


def test_enumerations() -> None:
    enum = {key: PROFILE.by_key[key].enum for key in ("2000:02", "2001:20", "2006:34", "2008:2D")}
    assert enum["2000:02"] == {16: "R6L028E", 19: "R6L042E", 22: "R6L120E", 23: "R6L076E"}  # 7508
    assert enum["2001:20"][8] == "60%"
    assert enum["2001:20"][4] == "80%"
    assert set(enum["2006:34"]) == set(range(12))  # 10808-10830
    assert set(enum["2008:2D"]) == {0, 100, 200, 300}  # 11674-11680


def test_alarms() -> None:
    codes = [f.code for f in PROFILE.faults]
    # 14313-14951 without AL.000, the normal state
    assert Counter(code[3] for code in codes) == {"1": 53, "2": 43, "3": 35, "4": 23}
    by_code = {f.code: f for f in PROFILE.faults}
    assert by_code["AL.240"].name == "Position is out of tolerance"  # 14728
    assert len(by_code["AL.240"].remedies) == 3  # 14730-14734
    assert by_code["AL.110"].name == "Drive IPM module overcurrent"  # 14378
    assert any("P05.04" in text for text in by_code["AL.111"].remedies)  # 14390
    assert by_code["AL.104"].name == by_code["AL.105"].name  # 14357, 14361
    assert any("P01.56" in text for text in by_code["AL.130"].remedies)  # 14489
    assert any("30 s" in text for text in by_code["AL.101"].remedies)  # 14333
    assert "P12.05" in by_code["AL.221"].reset  # 14693
    assert by_code["AL.305"].name == "Power supply phase failure"  # 14815
    assert by_code["AL.416"].name == "Parameter identification exception"  # 14897
    assert by_code["AL.299"].name == "EtherCAT bus error fault"  # 14796


def test_alarm_classes() -> None:
    # 14296-14303
    for fault in PROFILE.faults:
        first = fault.code[3]
        assert (fault.kind == "warning") == (first == "4")
        assert ("not resettable" in fault.severity) == (first == "1")
        assert ("second type" in fault.severity) == (first == "3")
        if first == "1":
            assert "power off" in fault.reset
        assert fault.code_raw is None  # no table connects AL numbers with 603Fh


def test_homing_methods() -> None:
    # 002:4530-5593
    methods = [m.method for m in PROFILE.homing_methods]
    assert methods == [*range(1, 15), *range(17, 31), *range(33, 40)]
    by_number = {m.method: m for m in PROFILE.homing_methods}
    # 5520: 33 with 37; 5524: 34 with 36
    assert by_number[33].direction == by_number[37].direction == "negative"
    assert by_number[34].direction == by_number[36].direction == "positive"
    assert all("6098h ends at 35" in by_number[m].notes for m in range(36, 40))  # 13493


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("6060:00", "default 8"), ("6065:00", "393216"), ("6067:00", "default 92"),
        ("6068:00", "default 10"), ("6072:00", "default 3000"), ("6081:00", "default 10000"),
        ("6087:00", "default 3000"), ("6099:01", "default 10000"), ("6099:02", "default 2000"),
        ("609A:00", "default 100000"), ("60FF:00", "default 0"), ("6502:00", "default 941"),
        ("2006:01", "default 4000"), ("2006:02", "default 1500"), ("2006:03", "default 800"),
        ("2003:14", "0 command unit"), ("1A00:04", "0x60400020"), ("2003:05", "type Uint8"),
    ],
)  # fmt: skip
def test_contradictions_are_kept(key: str, words: str) -> None:
    # Tables of chapter 7 (3118-3219, 3730-3798, 4438-4527) against chapter 8
    assert any(words in text for text in PROFILE.by_key[key].also_printed)


def test_no_findings() -> None:
    assert [str(finding) for finding in check(PROFILE)] == []


async def test_save_writes_changes_again_while_the_mask_lets_them_through() -> None:
    # The drive stores a value only while it is written (002:11425).
    link = MemoryLink(
        {
            (0x6041, 0): b"\x50\x02",
            (0x2006, 1): (250).to_bytes(2, "little"),
            (0x2006, 3): (400).to_bytes(2, "little"),
            (0x2008, 12): b"\0\0",
        }
    )
    drive = Drive("x", "X axis", PROFILE, [Port(link, 1, PROFILE.links[0])])
    drive.found = Found(1)
    await drive.read("2006:03")
    await drive.write("2006:01", 300)
    assert drive.unsaved == {"2006:01"}
    link.written.clear()
    procedure = PROFILE.procedure("save")
    assert procedure is not None
    await run_procedure(Axis(drive), procedure, True, Progress(lambda: None))
    assert link.written == [
        ((0x2008, 12), b"\6\0"),
        ((0x2006, 1), (300).to_bytes(2, "little")),
        ((0x2008, 12), b"\0\0"),
    ]
    assert drive.unsaved == frozenset()
