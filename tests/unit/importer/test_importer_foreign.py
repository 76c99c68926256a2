"""Legal but rare contents of makers' files that were dropped or taken for something else."""

from __future__ import annotations

from importer_samples import GOOD_EDS

from profiles.importer import (
    import_file,
)

REAL = """
[2200]
ParameterName=Factor
ObjectType=0x7
DataType=0x0008
AccessType=rw
DefaultValue=0x3FC00000 ; 1.5
LowLimit=0x3F800000 // 1.0

[2201]
ParameterName=Rate
ObjectType=0x7
DataType=0x0006
AccessType=rw
DefaultValue=0x10 // sixteen

[2202]
ParameterName=Name
ObjectType=0x7
DataType=0x0009
AccessType=rw
DefaultValue=a;b // c
"""


def test_defaults_with_a_remark_behind_them() -> None:
    """The bits of a real number with a remark became the number 1069547520."""
    by_key = import_file((GOOD_EDS + REAL).encode(), "d.eds").profile.by_key
    assert by_key["2200:00"].default_raw == 1.5
    assert by_key["2200:00"].min_raw == 1.0
    assert by_key["2201:00"].default_raw == 16
    assert by_key["2202:00"].default_raw == "a;b // c"


def test_bit_rates_with_a_remark_behind_them() -> None:
    data = GOOD_EDS.replace("[DeviceInfo]\n", "[DeviceInfo]\nBaudRate_500=1 ; yes\n")
    assert import_file(data.encode(), "d.eds").profile.links[0].baudrates == (500_000,)
