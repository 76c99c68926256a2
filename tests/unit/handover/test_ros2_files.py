"""What ROS 2's drivers can carry, and what they cannot; a bus.yml of somebody else."""

from __future__ import annotations

from dataclasses import replace

import pytest
import yaml

from backend.records.handover.conflicts import compare
from backend.records.handover.files import files_of, fitting
from backend.records.handover.model import AxisHandover, write_of
from backend.records.handover.read import read_list
from drivers.errors import NotAllowed
from profiles.importer import export_dcf
from profiles.importer.report import ImportReport
from profiles.importer.values import default_value
from profiles.schema import DataType, Profile, Raw
from tests.unit.handover.test_formats import SAVED, axis_of, profile_of


def one(kind: DataType, raw: Raw, family: str = "mms7") -> AxisHandover:
    """An axis with two writes, of which the second has this type and value."""
    axis = axis_of(family)
    parameter = axis.profile.by_key["6072:00"].model_copy(
        update={"type": kind, "min_raw": None, "max_raw": None}
    )
    return replace(axis, writes=(axis.writes[0], write_of(parameter, raw)))


@pytest.mark.parametrize(
    ("kind", "raw", "number"),
    [
        # The driver holds values as a C++ int and casts: FFFFFFFFh is written as −1.
        ("UINT32", 0xFFFF_FFFF, -1), ("UINT32", 0x8000_0000, -(2**31)), ("UINT32", 5, 5),
        ("INT32", -5, -5), ("UINT16", 65535, 65535), ("INT8", -1, -1), ("BOOL", True, 1),
        ("UINT64", 2**64 - 1, -1), ("INT64", -7, -7), ("REAL32", -2.0, -0x4000_0000),
    ],
)  # fmt: skip
def test_the_number_makes_the_bytes(kind: DataType, raw: Raw, number: int) -> None:
    axis = one(kind, raw)
    rows = yaml.safe_load(files_of(axis, "ros2", "list", None)["list"])["sdo"]
    assert rows[1]["value"] == number
    size = len(axis.writes[1].data)
    assert (number % (1 << 8 * size)).to_bytes(size, "little") == axis.writes[1].data


def test_what_no_int_holds_is_left_out_and_named() -> None:
    axis = fitting(one("UINT64", 2**40), "ros2")
    assert len(axis.writes) == 1
    assert [each.key for each in axis.left_out][-1:] == ["6072:00"]
    assert axis.left_out[-1].reason.code == "handover.left-out-larger-32-bits"
    alone = one("INT64", 2**40)
    with pytest.raises(NotAllowed, match="6072:00"):
        fitting(replace(alone, writes=alone.writes[1:]), "ros2")


def test_bus_yml_carries_whole_numbers_alone() -> None:
    # Lely's dcfgen makes an int of each value: 1.5 would arrive as 1.
    axis = fitting(one("REAL32", 1.5, "ds_c"), "ros2")
    assert [w.type for w in axis.writes] == [axis_of("ds_c").writes[0].type]
    assert axis.left_out[-1].key == "6072:00"
    assert len(fitting(one("REAL32", 1.5), "ros2").writes) == 2


def test_a_dcf_has_the_objects_that_every_device_has() -> None:
    # CiA 306-1 clause 7.5: 1000h, 1001h and 1018h are mandatory; the identity is that of the set.
    text = files_of(axis_of("ds_c"), "dcf", "list", SAVED)["list"].decode()
    mandatory = text.partition("[MandatoryObjects]")[2].partition("[OptionalObjects]")[0]
    assert mandatory.split() == ["SupportedObjects=3", "1=0x1000", "2=0x1001", "3=0x1018"]
    vendor = text.partition("[1018sub1]")[2].partition("[1018sub2]")[0]
    assert "DefaultValue=0xA88" in vendor
    assert "VendorNumber=0x00000A88" in text


def with_real() -> Profile:
    profile = profile_of("ds_c")
    first = next(p for p in profile.parameters if p.key == "6072:00")
    real = first.model_copy(
        update={"type": "REAL32", "default_raw": 0.5, "min_raw": None, "max_raw": None}
    )
    rest = tuple(real if p.key == "6072:00" else p for p in profile.parameters)
    return profile.model_copy(update={"parameters": rest})


def test_a_real_number_as_its_bits_reads_back() -> None:
    # IEEE 754: 1.5 is 3FC00000h, 0.5 is 3F000000h.
    text = export_dcf(with_real(), {"6072:00": 1.5}, SAVED, file_name="x.dcf", reals_as_bits=True)
    section = text.partition("[6072]")[2].partition("[")[0]
    assert "ParameterValue=0x3FC00000" in section
    assert "DefaultValue=0x3F000000" in section
    plain = export_dcf(with_real(), {"6072:00": 1.5}, SAVED, file_name="x.dcf")
    assert "ParameterValue=1.5" in plain
    assert default_value("0x3FC00000", "REAL32", "x", ImportReport()) == (1.5, "")


THEIRS = """
master: {node_id: 1}
defaults: {sdo: [{index: 0x6072, sub_index: 0, value: 900}]}
nodes:
  left: {node_id: 2}
  right: {node_id: 3, sdo: [{index: 0x6072, sub_index: 0, value: 300}]}
"""


@pytest.mark.parametrize(("slave", "value"), [(1, 900), (2, 300)])
def test_a_bus_yml_with_nodes_and_defaults(slave: int, value: int) -> None:
    # ros2_canopen's user guide: defaults apply to all nodes.
    profile = profile_of("ds_c")
    listed = read_list(THEIRS.encode(), profile, "bus.yml", slave)
    verdict = compare(profile, listed, {"6072:00": 500}, None)
    assert [each.controller for each in verdict.conflicts] == [value]
    as_rows = THEIRS.replace("  left:", "  - left:").replace("  right:", "  - right:")
    assert read_list(as_rows.encode(), profile, "bus.yml", slave).writes == listed.writes


def test_a_vendor_of_zero_is_named() -> None:
    from backend.records.handover.files import remarks

    axis = replace(axis_of("mms7"), vendor_id=0)
    assert [note.code for note in remarks([axis], "lcec")] == ["handover.note-no-vendor"]
    assert remarks([axis], "twincat") == ()
    assert remarks([axis_of("mms7")], "lcec") == ()
