"""Facts of manual 004, typed by hand from the lines named."""

from __future__ import annotations

import pytest

from profiles import load_profile

PROFILE = load_profile("mms7")

# key, type, access, pdo, unit, scale, min, max, default — line of the manual
ROWS = [
    ("2001:06", "UINT32", "rw", "none", "g·cm²", 1, 0, 2**32 - 1, None),  # 5296
    ("2002:05", "UINT16", "rw", "none", "%", 0.1, 0, 3000, 200),  # 5315
    ("2002:06", "UINT16", "rw", "none", "rpm", 1, 0, 500, 10),  # 5316
    ("2002:0A", "UINT16", "rw", "none", "ns", 1, 0, 1000, 500),  # 5321
    ("2003:01", "UINT32", "rw", "none", "inc", 1, 0, 65535, 0),  # 5753
    ("2004:03", "UINT16", "rw", "none", "ms", 0.1, 0, 65535, 0),  # 5820
    ("2004:06", "UINT8", "rw", "none", "%", 1, 0, 200, 100),  # 5843
    ("2005:01", "UINT16", "rw", "none", "Hz", 0.1, 1, 2000, 200),  # 5863
    ("2005:03", "UINT16", "rw", "none", "Hz", 0.1, 1, 5000, 2000),  # 5879
    ("2005:04", "UINT16", "rw", "none", "Hz", 0.1, 1, 500, 100),  # 5889
    ("2005:05", "UINT16", "rw", "none", "Hz", 0.1, 2000, 20000, 10000),  # 5898
    ("2005:0F", "UINT16", "rw", "none", "", 1, 0, 31, 13),  # 5984
    ("2005:13", "UINT16", "rw", "none", "Hz", 0.1, 1, 2000, 200),  # 5361
    ("2005:15", "UINT16", "rw", "none", "Hz", 0.1, 1, 500, 100),  # 5364
    ("2007:01", "UINT16", "rw", "none", "Hz", 0.1, 1000, 20000, 2000),  # 6062
    ("2008:05", "UINT16", "rw", "none", "LSB", 1, 0, 65535, 0),  # 6116
    ("200B:03", "UINT16", "rw", "none", "V", 1, 8, 30, 12),  # 5080
    ("200B:04", "UINT32", "rw", "none", "inc", 1, 0, 2**32 - 1, 182),  # 5081
    ("200B:0C", "UINT32", "rw", "none", "rpm", 1, 0, 2**32 - 1, 3600),  # 5092
    ("200B:0E", "UINT16", "rw", "none", "ms", 1, 0, 65535, 10),  # 5094
    ("200C:02", "UINT16", "rw", "none", "rev", 1, 3, 65535, 50),  # 5421
    ("200C:0A", "UINT32", "ro", "none", "g·cm²", 1, 0, 2**32 - 1, 0),  # 5431
    ("200E:02", "INT16", "ro", "tx", "mA", 1, -32768, 32767, 0),  # 5438
    ("200E:0B", "UINT16", "ro", "none", "%", 0.1, 0, 65535, 0),  # 5447
    ("2030:04", "UINT8", "rw", "none", "", 1, 0, 3, 0),  # 6505
    ("2041:00", "INT16", "rw", "none", "°C", 1, -40, 125, 85),  # 6587
    ("2042:02", "UINT16", "rw", "none", "%", 0.1, 0, 3000, 3000),  # 6604
    ("2050:02", "UINT16", "rw", "none", "kΩ", 1, 1, 65535, 402),  # 6634
    ("2070:03", "UINT16", "rw", "none", "s", 1, 0, 65535, 100),  # 6661
    ("2106:00", "UINT32", "rw", "none", "bit/s", 1, 0, 2**32 - 1, 2500000),  # 6720
    ("2107:00", "UINT8", "rw", "none", "", 1, 0, 2, 2),  # 6727
    ("2109:00", "UINT16", "rw", "none", "", 1, 1, 65535, 5),  # 6740
    ("605A:00", "INT16", "rw", "none", "", 1, 0, 8, 2),  # 6808
    ("605D:00", "INT16", "rw", "none", "", 1, 0, 4, 1),  # 6872
    ("6065:00", "UINT32", "rw", "rx", "inc", 1, 0, 2**32 - 1, 182),  # 7014
    ("606C:00", "INT32", "ro", "tx", "inc/s", 1, -(2**31), 2**31 - 1, None),  # 7074
    ("6071:00", "INT16", "rw", "rx", "%", 0.1, -3000, 3000, 0),  # 5525
    ("6079:00", "UINT32", "ro", "tx", "V", 0.001, 0, 2**32 - 1, 36000),  # 5530
    ("6081:00", "UINT32", "rw", "rx", "inc/s", 1, 0, 2**32 - 1, 655360),  # 7294
    ("6083:00", "UINT32", "rw", "rx", "inc/s²", 1, 0, 2**32 - 1, 3276800),  # 7308
    ("6091:02", "UINT32", "rw", "none", "rev", 1, 0, 2**32 - 1, 1),  # 7402
    ("6092:01", "UINT32", "rw", "none", "inc", 1, 0, 2**32 - 1, 65536),  # 7415
    ("60C2:02", "INT8", "rw", "none", "", 1, -4, -3, -3),  # 7628
    ("60E0:00", "UINT16", "rw", "rx", "%", 0.1, 0, 3000, 3000),  # 7650
    ("6502:00", "UINT32", "ro", "none", "", 1, 0, 2**32 - 1, 0x3ED),  # 7762
]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: str(row[0]))
def test_row(row: tuple[object, ...]) -> None:
    key, *facts = row
    p = PROFILE.by_key[str(key)]
    low, high = p.raw_limits
    assert [p.type, p.access, p.pdo, p.unit, p.scale, low, high, p.default_raw] == facts


def test_default_mappings() -> None:
    # 004:1279-1283 and 1393-1401
    expected = {
        "1600": [0x60400010, 0x60600008, 0x607A0020, 0x60B80010, 0x60FE0120],
        "1A01": [0x603F0010, 0x60410010, 0x60610008, 0x60640020, 0x606C0020, 0x60B90010,
                 0x60BA0020, 0x60BC0020, 0x60FD0020],
    }  # fmt: skip
    for index, entries in expected.items():
        values = [PROFILE.by_key[f"{index}:{s:02X}"].default_raw for s in range(13)]
        assert values == [len(entries), *entries, *[0] * (12 - len(entries))]
    assert PROFILE.by_key["1C12:01"].default_raw == 0x1603  # 004:1440
    assert PROFILE.by_key["1C13:01"].default_raw == 0x1A03


def test_special_commands() -> None:
    # 004:2387-2397
    written = {
        procedure.name: [s.raw for s in procedure.steps if s.do == "write"]
        for procedure in PROFILE.procedures
    }
    assert written["write_settings"] == [0xAAB555AA]
    assert written["save"][-1] == 0x65766173
    assert written["restore"] == [0x64616F6C]
    assert written["reset"] == [0x626E6E74]
    assert written["clear_history"] == [0x11111120]
    assert written["zero_position"] == [0x686F6F6D]


def test_thirteen_faults() -> None:
    # Table 70, 004:4703-4830: bit of 200Bh:0B and code of 603Fh
    seen = {fault.match[0].bit: fault.code_raw for fault in PROFILE.faults}
    assert seen == {
        0: 0x2300, 1: 0x3220, 2: 0x7121, 3: 0x5400, 4: 0x3230, 5: None, 6: None, 7: None,
        8: 0x4210, 9: 0x3210, 10: 0x8400, 11: 0x8401, 12: 0x7500,
    }  # fmt: skip
    assert all(fault.causes and fault.remedies for fault in PROFILE.faults)


def test_stiffness_table() -> None:
    # Table 38, 004:3003-3040
    (table,) = PROFILE.stiffness
    assert set(table.rows) == set(range(32))
    assert table.rows[0] == (0.3, 1.5, 0.4)
    assert table.rows[13] == (7.7, 27, 7.6)
    assert table.rows[31] == (142.9, 500, 88)


def test_homing_methods() -> None:
    # Table 50, 004:3837-3893
    methods = [m.method for m in PROFILE.homing_methods]
    assert methods == [-3, -2, *range(1, 15), *range(17, 31), 33, 34]


def test_identification_states() -> None:
    # 004:6330-6352: 0 to 18
    assert sorted(PROFILE.by_key["200C:05"].enum) == list(range(19))


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("605B:00", "default 2"), ("605E:00", "default 1"), ("606D:00", "65536"),
        ("6098:00", "default 0"), ("6099:01", "default 0"), ("2005:06", "rpm"),
        ("200B:0B", "PSFT"), ("2003:05", "Speed feedback source"), ("6041:00", "bit 12"),
    ],
)  # fmt: skip
def test_contradictions_are_kept(key: str, words: str) -> None:
    assert any(words in text for text in PROFILE.by_key[key].also_printed)


def test_write_settings_rule() -> None:
    # 004:2362-2364: control word, modes and trajectory objects act at once, the rest waits.
    assert PROFILE.by_key["2005:03"].effective == "write_settings"
    assert PROFILE.by_key["6040:00"].effective == "now"
    assert PROFILE.by_key["6081:00"].effective == "now"
