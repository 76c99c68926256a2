"""Faults and alarms of the M6-L, which share their numbers in 603Fh (000:3829)."""

from __future__ import annotations

import pytest

from backend.axes.drive.drive import Drive
from backend.axes.drive.faults import active_faults, fault_keys
from backend.axes.drive.ports import Port
from backend.axes.drive.readings import Reading
from profiles import load_profile
from tests.support.memory_link import MemoryLink

PROFILE = load_profile("m6l")


@pytest.mark.parametrize(
    ("error_code", "status", "expected"),
    [
        (0xFF0C, 0x0218, ["Er.012"]),  # bit 7 off: a fault
        (0xFF0C, 0x02B7, ["AL.012"]),  # bit 7 on: an alarm
        (0xFF26, 0x02B7, ["AL.038"]),
        (0xFF20, 0x0218, ["Er.032"]),
        (0xFF05, 0x0218, ["0xFF05"]),  # in the list of P10.18 only
        (0, 0x0237, []),
    ],
)
def test_bit_7_tells_alarm_from_fault(error_code: int, status: int, expected: list[str]) -> None:
    drive = Drive("x", "X axis", PROFILE, [Port(MemoryLink({}), 1, PROFILE.links[0])])
    readings = {
        key: Reading(key, raw=raw, value=raw, time=0.0)
        for key, raw in (("603F:00", error_code), ("6041:00", status))
    }
    assert [fault.code for fault in active_faults(drive, readings)] == expected


@pytest.mark.parametrize(
    ("status", "chosen", "number", "expected"),
    [
        (0x0218, 0, 247, ["AL.247"]),  # in fault: record 0 says which (002:12361)
        (0x0218, 3, 247, ["0x7121"]),  # somebody looks at another record
        (0x0237, 0, 247, []),  # no fault: an old record
        (0x0218, 0, 999, ["0x7121"]),  # a number that no table has
    ],
)
def test_an_r6l_tells_its_fault_by_its_newest_record(
    status: int, chosen: int, number: int, expected: list[str]
) -> None:
    profile = load_profile("r6l")
    drive = Drive("x", "X axis", profile, [Port(MemoryLink({}), 1, profile.links[0])])
    raw = {
        "603F:00": 0x7121 if status & 8 else 0,
        "6041:00": status,
        "200D:24": chosen,
        "200D:25": number,
    }
    assert set(raw) <= set(fault_keys(drive))
    readings = {key: Reading(key, raw=value, value=value, time=0.0) for key, value in raw.items()}
    assert [fault.code for fault in active_faults(drive, readings)] == expected
