"""Public facts about the EL7-EC, typed by hand: alarms of table 8.2 and the units of Pr0 to Pr2."""

from __future__ import annotations

import pytest

from profiles import load_profile
from profiles.check import check

PROFILE = load_profile("el7")

#: Key, number, unit, scale. 0.1 1/s, 0.1 Hz, 0.1 ms and 0.01 ms as in the map of the MINAS-A5.
ROWS = [
    ("2004:00", "Pr0.04", "%", 1),
    ("2100:00", "Pr1.00", "1/s", 0.1),
    ("2101:00", "Pr1.01", "Hz", 0.1),
    ("2102:00", "Pr1.02", "ms", 0.1),
    ("2104:00", "Pr1.04", "ms", 0.01),
    ("2110:00", "Pr1.10", "%", 0.1),
    ("2111:00", "Pr1.11", "ms", 0.01),
    ("2201:00", "Pr2.01", "Hz", 1),
]
#: What 603Fh shows, and what the panel shows.
ALARMS = {
    0x2211: "Er0E0", 0x3211: "Er0C0", 0x3221: "Er0d0", 0x4210: "Er0f0", 0x7321: "Er150",
    0x8301: "Er102", 0x8311: "Er100", 0x8402: "Er1A0", 0x8611: "Er180", 0x821B: "Er81b",
}  # fmt: skip


def test_nothing_is_left_to_check() -> None:
    assert check(PROFILE) == []


@pytest.mark.parametrize(("key", "number", "unit", "scale"), ROWS)
def test_a_parameter_is_as_it_is_public(key: str, number: str, unit: str, scale: float) -> None:
    found = PROFILE.by_key[key]
    assert (found.number, found.unit, found.scale) == (number, unit, scale)


def test_alarms_have_the_codes_of_the_table() -> None:
    named = {fault.code_raw: fault.code for fault in PROFILE.faults}
    assert named | ALARMS == named
    assert all(fault.remedies for fault in PROFILE.faults)


def test_an_object_is_the_digits_of_its_number() -> None:
    for parameter in PROFILE.parameters:
        if parameter.number is not None:
            assert parameter.key == f"2{parameter.number[2]}{parameter.number[4:]}:00"
