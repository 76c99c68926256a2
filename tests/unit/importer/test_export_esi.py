"""A profile as an ESI file: an independent reader finds in it what the maker's file had."""

from __future__ import annotations

from xml.etree import ElementTree

import pytest

from profiles import load_profile
from profiles.importer import export_esi, import_file
from profiles.schema import Parameter
from tests.wire.makers_files.samples import SAMPLES
from tests.wire.makers_files.strict_slave import File

_FIELDS = ("type", "access", "pdo", "default_raw", "min_raw", "max_raw", "name")
_REGISTERS = ("Reg0400", "Reg0410", "Reg0420")


def read(data: bytes) -> File:
    device = ElementTree.fromstring(data).find("Descriptions/Devices/Device")
    assert device is not None
    return File(device)


def told(parameter: Parameter) -> dict[str, object]:
    return {name: getattr(parameter, name) for name in _FIELDS}


@pytest.mark.parametrize("name", SAMPLES)
def test_the_way_to_operational_is_that_of_the_makers_file(name: str) -> None:
    """Compared by the reader of the strict slave, which shares nothing with the importer."""
    original = SAMPLES[name]
    exported = export_esi(import_file(original, "a.xml").profile)
    ours, theirs = read(exported), read(original)
    assert ours.pdos == theirs.pdos
    assert ours.managers == theirs.managers
    assert ours.modes == theirs.modes
    assert ours.commands == theirs.commands
    assert [ours.register(n) for n in _REGISTERS] == [theirs.register(n) for n in _REGISTERS]
    for flag in ("SdoInfo", "PdoAssign", "PdoConfig", "PdoUpload", "CompleteAccess"):
        said = [None if f.coe is None else f.coe.get(flag) for f in (ours, theirs)]
        assert len({{"true": "1", "false": "0"}.get(str(s), s) for s in said}) == 1, flag


@pytest.mark.parametrize("name", SAMPLES)
def test_it_imports_as_the_same_profile(name: str) -> None:
    before = import_file(SAMPLES[name], "a.xml").profile
    data = export_esi(before)
    after = import_file(data, "a.xml").profile
    assert after.bring_up == before.bring_up
    assert after.pdo == before.pdo
    assert after.identity == before.identity
    assert {p.key: told(p) for p in after.parameters} == {p.key: told(p) for p in before.parameters}
    assert export_esi(after) == data


@pytest.mark.parametrize("family", ["mms7", "el7"])
def test_objects_of_a_family(family: str) -> None:
    """Types by the names of IEC 61131-3, bytes as they travel."""
    profile = load_profile(family)
    device = read(export_esi(profile)).device
    objects = {o.findtext("Index"): o for o in device.iterfind("Profile/Dictionary/Objects/Object")}
    assert len(objects) == len({p.index for p in profile.parameters if p.index is not None})
    control = objects["#x6040"]
    assert (control.findtext("Type"), control.findtext("Flags/PdoMapping")) == ("UINT", "R")
    records = {
        t.findtext("Name"): [s.findtext("SubIdx") for s in t.iterfind("SubItem")]
        for t in device.iterfind("Profile/Dictionary/DataTypes/DataType")
    }
    for name, element in objects.items():
        assert name is not None
        kind = element.findtext("Type")
        assert kind in records
        subindices = {p.subindex for p in profile.parameters if p.index == int(name[2:], 16)}
        if records[kind]:
            assert {int(each or "") for each in records[kind]} == subindices | {0}
            assert len(element.findall("Info/SubItem")) == len(records[kind])
        else:
            assert subindices == {0}
    # Nobody knows these numbers, so none is written.
    assert device.find("Type[@ProductCode]") is None


def test_a_station_without_coe_is_not_said_to_have_it() -> None:
    """A digital output: a controller would send start-up lists to a mailbox that is not there."""
    digital = b"""<EtherCATInfo><Vendor><Id>1</Id></Vendor><Descriptions><Devices><Device>
    <Type ProductCode="#x2" RevisionNo="#x1">O8</Type><Name>O8</Name>
    <Sm StartAddress="#xF00" ControlByte="#x44" Enable="1">Outputs</Sm>
    <RxPdo Fixed="1" Sm="0"><Index>#x1600</Index><Name>O</Name><Entry><Index>#x7000</Index>
    <SubIndex>1</SubIndex><BitLen>8</BitLen><Name>o</Name><DataType>USINT</DataType></Entry></RxPdo>
    </Device></Devices></Descriptions></EtherCATInfo>"""
    before = import_file(digital, "a.xml").profile
    data = export_esi(before)
    assert ElementTree.fromstring(data).find(".//CoE") is None
    assert import_file(data, "a.xml").profile.bring_up == before.bring_up
    # A family without a maker's file is read by CoE.
    assert ElementTree.fromstring(export_esi(load_profile("mms7"))).find(".//CoE") is not None
