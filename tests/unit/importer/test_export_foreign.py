"""Profiles of odd files, exported as ESI and read again."""

from __future__ import annotations

from xml.etree import ElementTree

from importer_samples import GOOD_EDS

from profiles.importer import export_esi, import_file
from profiles.schema import Profile

ODD = """
[2300]
ParameterName=Pair
ObjectType=0x9
SubNumber=3
[2300sub0]
ParameterName=n
DataType=5
AccessType=ro
DefaultValue=2
[2300sub1]
ParameterName=plain
DataType=6
AccessType=rw
[2300sub2]
ParameterName=mapped
DataType=6
AccessType=rww
PDOMapping=1
[2301]
ParameterName=Name
DataType=9
AccessType=rw
DefaultValue=Servo\x07 1
[2302]
ParameterName=Braking current
DataType=3
AccessType=rw
DefaultValue=-5
LowLimit=-100
HighLimit=-1
"""


def both() -> tuple[Profile, Profile]:
    before = import_file((GOOD_EDS + ODD).encode(), "d.eds").profile
    data = export_esi(before)
    ElementTree.fromstring(data)
    return before, import_file(data, "d.xml").profile


def test_a_member_that_is_not_mapped_stays_so() -> None:
    before, after = both()
    for key in ("2300:01", "2300:02"):
        assert after.by_key[key].pdo == before.by_key[key].pdo, key


def test_a_greatest_value_of_minus_one_is_not_the_greatest_of_the_type() -> None:
    _, after = both()
    current = after.by_key["2302:00"]
    assert (current.default_raw, current.min_raw, current.max_raw) == (-5, -100, -1)
