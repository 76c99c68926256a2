"""Start-up lists of all families against what their consumers document, and read back."""

from __future__ import annotations

import csv
import io
import struct
from dataclasses import replace
from datetime import UTC, datetime
from itertools import cycle
from xml.etree.ElementTree import Element

import canopen
import pytest
import yaml
from defusedxml.ElementTree import fromstring

from backend.axes.drive.drive import Drive
from backend.axes.drive.readings import Reading
from backend.axes.parameters.set_file import BadSet, ParameterSet, dump, parse, storable
from backend.records.handover.conflicts import resolved
from backend.records.handover.files import FORMATS, Format, files_of
from backend.records.handover.model import AxisHandover, gain_keys, hand_over
from backend.records.handover.read import read_list
from drivers.errors import NotAllowed
from drivers.link import Found
from profiles import load_profile
from profiles.schema import INTEGER_RANGE, Parameter, Profile, Raw

FAMILIES = ("mms7", "m6l", "r6l", "ep3e", "ds_c", "imported")
VENDOR, PRODUCT = 0x0000_0A88, 0x0010_0001
SAVED = datetime(2026, 3, 4, 5, 6, tzinfo=UTC)


def profile_of(family: str) -> Profile:
    if family != "imported":
        return load_profile(family)
    # Standard objects alone and a name of its own, as of a drive that a file describes.
    base = load_profile("generic402")
    return base.model_copy(update={"drive": "maker_x", "title": "Maker X"})


def some_raw(parameter: Parameter) -> Raw:
    """A value that the parameter may have; a different one than zero where possible."""
    if parameter.type not in INTEGER_RANGE:
        return 1.5
    low, high = parameter.raw_limits
    assert low is not None
    assert high is not None
    return int(max(low, min(high, 3)))


def set_of(profile: Profile, found: Found | None = None) -> ParameterSet:
    drive = Drive("a", "axis one", profile, [])
    drive.found = found or Found(1, vendor_id=VENDOR, product_code=PRODUCT, revision=7)
    readings = [
        Reading(p.key, some_raw(p), some_raw(p), None)
        for p in storable(profile, motor_individual=True)
        if p.type not in ("STRING", "OCTETS")
    ]
    return parse(dump(drive, readings, author="", notes="", saved=SAVED))


def axis_of(family: str) -> AxisHandover:
    profile = profile_of(family)
    return hand_over(set_of(profile), profile)


def made(family: str, form: Format) -> bytes:
    axis = axis_of(family)
    try:
        return files_of(axis, form, "list", SAVED)["list"]
    except NotAllowed:
        assert axis.profile.link("ethercat") is None
        pytest.skip("no EtherCAT drive")


def wire(axis: AxisHandover) -> list[tuple[int, int, bytes]]:
    return [(w.index, w.subindex, w.data) for w in axis.writes]


@pytest.mark.parametrize("family", FAMILIES)
def test_only_what_may_be_written_is_handed_over(family: str) -> None:
    axis = axis_of(family)
    by_key = axis.profile.by_key
    assert axis.writes
    for write in axis.writes:
        assert by_key[write.key].access != "ro"
        assert by_key[write.key].motion in ("none", "at_enable")
        assert not by_key[write.key].motor_individual
        assert write.transition == "PS"
    handed = {write.key for write in axis.writes}
    left = {each.key for each in axis.left_out}
    assert handed | left == {row.key for row in set_of(axis.profile).rows}
    assert not handed & left
    assert all(each.reason for each in axis.left_out)


def test_a_modbus_parameter_is_left_out_with_its_reason() -> None:
    axis = axis_of("ds_c")
    modbus = [each for each in axis.left_out if each.key.startswith("PA_")]
    assert modbus
    assert all(each.reason.code == "handover.left-out-modbus" for each in modbus)


def test_motor_data_needs_consent() -> None:
    profile = profile_of("m6l")
    content = set_of(profile)
    with_consent = hand_over(content, profile, motor_individual=True)
    assert any(profile.by_key[w.key].motor_individual for w in with_consent.writes)


@pytest.mark.parametrize(
    ("family", "keys"),
    [
        # Feed-forward gains and filters stand in chapters of their own: 004:5836, 002, 006.
        ("mms7", {"2004:04", "2004:06", "2005:01", "2007:02", "2008:02"}),
        ("ep3e", {"2015:00", "2016:00"}),
        ("m6l", {"2008:12", "2009:0C", "2009:20"}),
        ("r6l", {"2006:12", "2007:0D", "2007:20"}),
    ],
)
def test_what_tuning_sets(family: str, keys: set[str]) -> None:
    profile = profile_of(family)
    assert keys <= gain_keys(profile)
    assert profile.gains is not None
    assert set(profile.gains.groups) <= {p.group for p in profile.parameters}
    tuned = hand_over(set_of(profile), profile, choice="tuned")
    assert keys <= {write.key for write in tuned.writes}


def test_units_come_before_limits_before_gains() -> None:
    axis = axis_of("mms7")
    keys = [write.key for write in axis.writes]
    assert keys.index("6091:01") < keys.index("6072:00") < keys.index("2005:01")


def test_sizes_and_byte_order_are_those_of_the_type() -> None:
    # CiA 301 clause 7.1.4.3: UNSIGNED32 1_000_000 = 000F4240h travels as 40 42 0F 00.
    profile = profile_of("mms7")
    content = replace(set_of(profile))
    rows = tuple(
        replace(row, raw=1_000_000) if row.key == "6092:01" else row for row in content.rows
    )
    axis = hand_over(replace(content, rows=rows), profile, only=["6092:01"])
    assert axis.writes[0].data == bytes([0x40, 0x42, 0x0F, 0x00])
    xml = files_of(axis, "twincat", "list", None)["list"]
    assert fromstring(xml).findtext(".//Data") == "40420f00"


@pytest.mark.long(keep=6)
@pytest.mark.parametrize("form", [form for form in FORMATS if form != "python"])
@pytest.mark.parametrize("family", FAMILIES)
def test_a_list_reads_back_and_is_exported_again_byte_by_byte(family: str, form: Format) -> None:
    axis = axis_of(family)
    data = made(family, form)
    listed = read_list(data, axis.profile)
    assert listed.format == form
    read = [(w.index, w.subindex, w.data) for w in listed.writes]
    assert (read if listed.ordered else sorted(read)) == (
        wire(axis) if listed.ordered else sorted(wire(axis))
    )
    again = replace(axis, writes=resolved(axis.profile, listed))
    assert files_of(again, form, "list", SAVED)["list"] == data


@pytest.mark.parametrize("family", FAMILIES)
def test_canopen_imports_the_dcf(family: str) -> None:
    axis = axis_of(family)
    text = made(family, "dcf").decode()
    file = io.StringIO(text)
    file.name = "list.dcf"
    dictionary = canopen.import_od(file)
    for write in axis.writes:
        entry = dictionary[write.index]
        variable = (
            entry
            if isinstance(entry, canopen.objectdictionary.ODVariable)
            else (entry[write.subindex])
        )
        assert variable.value == write.raw, write.key
        assert len(variable.encode_raw(variable.value)) == len(write.data), write.key


@pytest.mark.parametrize("family", FAMILIES)
def test_the_concise_dcf_is_that_of_cia_302(family: str) -> None:
    axis = axis_of(family)
    data = files_of(axis, "dcf", "list", SAVED)["list.1f22.bin"]
    (count,) = struct.unpack_from("<I", data)
    at, found = 4, []
    for _ in range(count):
        index, subindex, size = struct.unpack_from("<HBI", data, at)
        found.append((index, subindex, data[at + 7 : at + 7 + size]))
        at += 7 + size
    assert at == len(data)
    assert found == wire(axis)


#: Elements of `lcec`'s configuration with their attributes (needed, allowed) and children, as
#: linuxcnc-ethercat's documentation of its XML file has them.
LCEC = {
    "masters": (set(), set(), {"master"}),
    "master": (
        {"idx"},
        {"name", "appTimePeriod", "refClockSyncCycles", "refClockSlaveIdx"},
        {"slave"},
    ),
    "slave": (
        {"idx", "type"},
        {"name", "vid", "pid", "configPdos"},
        {"dcConf", "watchdog", "sdoConfig", "idnConfig", "syncManager", "modParam"},
    ),
    "dcConf": (
        {"assignActivate"},
        {"sync0Cycle", "sync0Shift", "sync1Cycle", "sync1Shift"},
        set(),
    ),
    "sdoConfig": ({"idx", "subIdx"}, set(), {"sdoDataRaw"}),
    "sdoDataRaw": ({"data"}, set(), set()),
    "syncManager": ({"idx", "dir"}, set(), {"pdo"}),
    "pdo": ({"idx"}, set(), {"pdoEntry"}),
    "pdoEntry": ({"idx", "subIdx", "bitLen"}, {"halPin", "halType"}, set()),
}


def check_lcec(element: Element) -> None:
    needed, allowed, children = LCEC[element.tag]
    assert needed <= set(element.keys()) <= needed | allowed, element.tag
    if element.tag in ("sdoConfig", "pdo", "pdoEntry"):
        assert 0 < int(element.get("idx", ""), 16) <= 0xFFFF
    if "subIdx" in needed:
        assert 0 <= int(element.get("subIdx", ""), 16) <= 0xFF
    if element.tag == "pdoEntry" and element.get("halType"):
        assert element.get("halType") in ("bit", "u32", "s32", "float-ieee")
    for child in element:
        assert child.tag in children, child.tag
        check_lcec(child)


@pytest.mark.parametrize("family", FAMILIES)
def test_lcec_follows_the_documented_grammar(family: str) -> None:
    root = fromstring(made(family, "lcec"))
    check_lcec(root)
    slave = root.find("master/slave")
    assert slave is not None
    assert int(slave.get("vid", ""), 16) == VENDOR
    assert int(slave.get("pid", ""), 16) == PRODUCT
    pins = [e.get("halPin") for e in root.iter("pdoEntry") if e.get("halPin")]
    assert len(pins) == len(set(pins))


#: Fields of ethercat_driver_ros2's slave file that its documentation names.
ROS2_TOP = {"vendor_id", "product_id", "assign_activate", "auto_fault_reset", "sdo", "rpdo", "tpdo"}
ROS2_TYPES = {"bool", "uint8", "int8", "uint16", "int16", "uint32", "int32", "uint64", "int64"}


@pytest.mark.long(keep=3)
@pytest.mark.parametrize("family", FAMILIES)
def test_ros2_follows_the_documented_fields(family: str) -> None:
    axis = axis_of(family)
    content = yaml.safe_load(made(family, "ros2"))
    if axis.profile.link("ethercat") is None:
        drive = content["nodes"]["drive"]
        assert drive["dcf"] == "list.dcf"
        assert [row["index"] for row in drive["sdo"]] == [w.index for w in axis.writes]
        return
    assert set(content) <= ROS2_TOP
    assert (content["vendor_id"], content["product_id"]) == (VENDOR, PRODUCT)
    for row in content["sdo"]:
        assert set(row) == {"index", "sub_index", "type", "value"}
        assert row["type"] in ROS2_TYPES
        assert type(row["value"]) is int
    for pdo in content["rpdo"] + content["tpdo"]:
        for channel in pdo["channels"]:
            assert channel["type"] in ROS2_TYPES
            assert not ("command_interface" in channel and "state_interface" in channel)


@pytest.mark.long(keep=2)
@pytest.mark.parametrize("family", FAMILIES)
def test_init_commands_have_the_fields_of_etg_2100(family: str) -> None:
    fields = ["Transition", "Comment", "Timeout", "Ccs", "Index", "SubIndex", "Data"]
    for form in ("twincat", "eni"):
        root = fromstring(made(family, form))
        commands = root.findall(".//CoE/InitCmds/InitCmd")
        assert len(commands) == len(axis_of(family).writes)
        assert all([child.tag for child in command] == fields for command in commands)
    assert [child.tag for child in root.findall("Config/*")] == ["Master", "Slave", "Cyclic"]
    sent = root.findtext(".//ProcessData/Send/BitLength")
    assert sent == str(sum(int(e.text or 0) for e in root.findall(".//RxPdo/Entry/BitLen")))


@pytest.mark.parametrize("family", FAMILIES)
def test_codesys_rows_have_value_and_bit_length(family: str) -> None:
    text = made(family, "codesys").decode("utf-8-sig")
    for row, write in zip(
        csv.DictReader(io.StringIO(text), delimiter=";"), axis_of(family).writes, strict=True
    ):
        bits = int(row["Bit length"])
        value = int(row["Value"].removeprefix("16#"), 16)
        assert value.to_bytes(bits // 8, "little") == write.data


@pytest.mark.parametrize("family", FAMILIES)
def test_the_script_is_python(family: str) -> None:
    names: dict[str, object] = {"__name__": "checked"}
    exec(compile(made(family, "python"), "list", "exec"), names)
    assert names["WRITES"] == [(w.key, w.raw) for w in axis_of(family).writes]


def test_a_format_that_compares_identity_needs_it() -> None:
    profile = profile_of("mms7")
    axis = hand_over(set_of(profile, Found(1)), profile)
    for form in ("eni", "lcec", "ros2"):
        with pytest.raises(NotAllowed, match="vendor"):
            files_of(axis, form, "list", None)


def test_the_sheet_has_scaling_resolution_direction_and_limits() -> None:
    profile = profile_of("mms7")
    content = set_of(profile)
    # 5:1 gear, 10 mm lead in µm: 65536 increments of the encoder × 5 / 10000 per µm.
    wanted = {"6091:01": 5, "6091:02": 1, "6092:01": 10000, "6092:02": 1, "6072:00": 1500}
    rows = tuple(replace(row, raw=wanted.get(row.key, row.raw)) for row in content.rows)
    axis = hand_over(replace(content, rows=rows), profile)
    text = files_of(axis, "csv", "list", None)["list.scaling.txt"].decode()
    encoder = profile.units.encoder_counts_per_rev
    assert encoder is not None
    assert f"increments per feed unit: {encoder * 5 / 10000:.9g}" in text
    assert f"encoder counts per revolution: {encoder}" in text
    assert "direction (polarity) 607E:00" in text
    assert "maximum torque 6072:00: 150" in text
    assert "gear numerator 6091:01: 5" in text
    # A list that leaves the gearing out states no scaling.
    some = hand_over(content, profile, only=["6072:00"])
    text = files_of(some, "csv", "list", None)["list.scaling.txt"].decode()
    assert "increments per feed unit: not certain" in text
    assert "gear numerator 6091:01: not handed over" in text


def test_a_segment_is_one_file_or_one_for_each_drive() -> None:
    axes = [axis_of("mms7"), axis_of("m6l")]
    files = files_of(axes, "lcec", "list", None)
    root = fromstring(files["list"])
    check_lcec(root)
    assert [e.get("idx") for e in root.iterfind("master/slave")] == ["0", "1"]
    assert "lcec.0.drive2." in files["list.hal"].decode()
    first = read_list(files["list"], axes[0].profile, slave=1)
    assert [(w.index, w.subindex, w.data) for w in first.writes] == wire(axes[0])
    with pytest.raises(BadSet, match="2 slaves"):
        read_list(files["list"], axes[0].profile)
    second = read_list(files_of(axes, "eni", "list", None)["list"], axes[1].profile, slave=2)
    assert [(w.index, w.subindex, w.data) for w in second.writes] == wire(axes[1])
    files = files_of(axes, "ros2", "list", None)
    control = fromstring(files["list"])
    assert [e.text for e in control.iterfind(".//param[@name='slave_config']")] == [
        "list.1.yaml",
        "list.2.yaml",
    ]
    assert yaml.safe_load(files["list.2.yaml"])["sdo"]
    with pytest.raises(NotAllowed, match="one drive"):
        files_of(axes, "twincat", "list", None)


def test_a_name_with_control_characters_makes_no_broken_file() -> None:
    axis = replace(axis_of("mms7"), name="axis \x01\x0b <one> -- \n two")
    forms: tuple[Format, ...] = ("eni", "lcec", "ros2", "igh")
    for form in forms:
        files = files_of(axis, form, "list", None)
        assert read_list(files["list"], axis.profile).writes


def test_a_table_has_no_formulas() -> None:
    """Names and units of an imported description are of somebody else's making."""
    begins = ("=1+1", "@cmd", "-2+3", "\t=1", " =1", "\uff1d1", "\uff0b1", "\n+1")
    profile = profile_of("imported")
    hostile = tuple(
        p.model_copy(update={"name": text, "unit": text})
        for p, text in zip(profile.parameters, cycle(begins), strict=False)
    )
    fields = {name: getattr(profile, name) for name in Profile.model_fields}
    made = Profile.model_construct(**{**fields, "parameters": hostile})
    axis = replace(hand_over(set_of(profile), made, motor_individual=True), profile=made)
    tables: tuple[tuple[Format, str, tuple[str, ...]], ...] = (
        ("csv", ",", ("name", "unit")),
        ("codesys", ";", ("Name",)),
    )
    for form, separator, columns in tables:
        data = files_of(axis, form, "list.csv", SAVED)["list.csv"].decode("utf-8-sig")
        rows = list(csv.DictReader(io.StringIO(data), delimiter=separator))
        assert len(rows) > len(begins)
        assert all(row[column].startswith("'") for row in rows for column in columns)
