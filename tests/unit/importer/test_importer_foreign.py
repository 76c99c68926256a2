"""Legal but rare contents of makers' files that were dropped or taken for something else."""

from __future__ import annotations

import json
import math
import struct
from datetime import datetime

import pytest
from importer_samples import GOOD_EDS

from profiles.export import show
from profiles.importer import (
    ImportReport,
    build_profile,
    describe_dictionary,
    export_dcf,
    import_file,
    read_dcf_values,
)
from profiles.importer.dictionary import DictionaryEntry
from profiles.importer.esi.controller import read_controllers
from profiles.loader import load_profile

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


MAPPED = """
[1401]
ParameterName=RPDO
ObjectType=0x9
SubNumber=3
[{com}0]
ParameterName=n
DataType=5
AccessType=ro
DefaultValue=2
[{com}1]
ParameterName=COB-ID
DataType=7
AccessType=ro
DefaultValue=$NODEID+0x300
[{com}2]
ParameterName=type
DataType=5
AccessType=rw
DefaultValue=1
[1601]
ParameterName=Map
ObjectType=0x9
SubNumber=3
[{map}0]
ParameterName=n
DataType=5
AccessType=ro
DefaultValue=1
[{map}1]
ParameterName=1
DataType=7
AccessType=ro
DefaultValue=0x60400010
[{map}2]
ParameterName=2
DataType=7
AccessType=ro
DefaultValue=0x20100010
"""


@pytest.mark.parametrize(
    ("com", "mapping"),
    [("1401sub", "1601sub"), ("0x1401sub0", "0x1601sub0"), ("1401h Sub 0", "1601h Sub 0")],
)
def test_subindices_in_every_spelling_of_their_headings(com: str, mapping: str) -> None:
    """Count and identifier of a PDO were found only under one spelling."""
    text = GOOD_EDS + MAPPED.format(com=com, map=mapping)
    pdo = import_file(text.encode(), "d.eds").profile.pdo
    assert pdo is not None
    first = next(each for each in pdo.sets if each.index == 0x1601)
    assert first.entries == ("6040:00",)
    assert first.identifier is not None
    assert (first.identifier.cob_id, first.identifier.of_node) == (0x300, True)


UNTYPED = """
[2300]
ParameterName=Blob
ObjectType=0x7
DataType=0x0099
AccessType=ro
PDOMapping=1
[1A01]
ParameterName=Map
ObjectType=0x9
SubNumber=3
[1A01sub0]
ParameterName=n
DataType=5
AccessType=ro
DefaultValue=2
[1A01sub1]
ParameterName=1
DataType=7
AccessType=ro
DefaultValue=0x23000010
[1A01sub2]
ParameterName=2
DataType=7
AccessType=ro
DefaultValue=0x60410010
"""


def test_a_mapped_object_of_unknown_type_keeps_its_place() -> None:
    """The status word behind it was expected two bytes earlier."""
    pdo = import_file((GOOD_EDS + UNTYPED).encode(), "d.eds").profile.pdo
    assert pdo is not None
    first = next(each for each in pdo.sets if each.index == 0x1A01)
    assert [(part.key, part.bits) for part in first.layout] == [(None, 16), ("6041:00", 16)]


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_real_number_that_is_none_in_the_drives_own_dictionary(value: float) -> None:
    """A drive may report no limit as infinity, and an unset default as NaN."""
    data = struct.pack("<f", value)
    entry = DictionaryEntry(
        0x2000, 0, "Factor", 0x08, 32, 0x3F, default=data, minimum=data, maximum=data
    )
    report = ImportReport()
    profile = build_profile(describe_dictionary([entry], name="ES4", report=report), report).profile
    json.dumps(show(profile), allow_nan=False)
    factor = profile.by_key["2000:00"]
    assert (factor.default_raw, factor.min_raw, factor.max_raw) == (None, None, None)


def controller(sync_managers: str, clock: str) -> bytes:
    return (
        "<EtherCATInfo><Vendor><Id>#x0B95</Id></Vendor><Descriptions><Devices><Device>"
        f'<Type ProductCode="#xA001" RevisionNo="#x2">A</Type>{sync_managers}'
        f"<Dc><OpMode><Name>DC</Name>{clock}</OpMode></Dc>"
        "</Device></Devices></Descriptions></EtherCATInfo>"
    ).encode()


MANAGERS = (
    '<Sm StartAddress="#x1000" ControlByte="#x26" DefaultSize="256">{}</Sm>'
    '<Sm StartAddress="#x1400" ControlByte="#x22" DefaultSize="256">{}</Sm>'
)
DRIVE = (0x0B95, 0xA001, 2)


def test_an_eni_gets_the_clock_that_the_profile_of_the_same_file_has() -> None:
    """``0300`` became 300 (012Ch), and a shift before SYNC0 became none."""
    clock = "<AssignActivate>0300</AssignActivate><ShiftTimeSync0>-250000</ShiftTimeSync0>"
    data = controller(MANAGERS.format("MBoxOut", "MBoxIn"), clock)
    found = read_controllers([(data, "a.xml")], [DRIVE])[0]
    assert (found.assign_activate, found.shift_ns) == (0x0300, -250_000)


@pytest.mark.parametrize("names", [("MbxOut", "MbxIn"), ("Mbox Out", "Mbox In"), ("", "")])
def test_an_eni_knows_mailboxes_as_the_profile_does(names: tuple[str, str]) -> None:
    data = controller(MANAGERS.format(*names), "<AssignActivate>#x0300</AssignActivate>")
    found = read_controllers([(data, "a.xml")], [DRIVE])[0]
    assert [each.kind for each in found.sync_managers] == ["mailbox_out", "mailbox_in"]


MODULES = """<EtherCATInfo><Vendor><Id>1</Id></Vendor><Descriptions><Devices><Device>
<Type ProductCode="#x1" RevisionNo="#x1">A</Type>
<Slots DownloadModuleIdentList="1" SlotIndexIncrement="#x800" SlotPdoIncrement="#x10">
<Slot><ModuleIdent Default="1">#x11</ModuleIdent></Slot>
<Slot><ModuleIdent>#x11</ModuleIdent></Slot>
<Slot><ModuleIdent Default="1">#x22</ModuleIdent></Slot>
<Slot><ModuleIdent>#x22</ModuleIdent></Slot>
</Slots><Mailbox><CoE/></Mailbox></Device></Devices><Modules>
<Module><Type ModuleIdent="#x11">M</Type><Profile><Dictionary><Objects><Object>
<Index DependOnSlot="1">#x6040</Index><Name>Controlword</Name><Type>UINT</Type>
<BitSize>16</BitSize></Object></Objects></Dictionary></Profile></Module>
<Module><Type ModuleIdent="#x22">N</Type></Module>
</Modules></Descriptions></EtherCATInfo>"""


def test_an_empty_slot_has_its_place_in_the_list_of_modules() -> None:
    """ETG.5001: subindex n of F030h is slot n; the module behind an empty slot moved up."""
    rules = import_file(MODULES.encode(), "a.xml").profile.bring_up
    assert rules is not None
    assert rules.init_commands[0].data == struct.pack("<H3I", 3, 0x11, 0, 0x22).hex().upper()


def test_values_of_a_dcf_with_absurd_subindices_and_texts() -> None:
    text = (
        "[FileInfo]\nx=1\n[DeviceComissioning]\nNodeID=5\n"
        f"[2000Value]\nNrOfEntries=1\n{'1' * 5000}=7\n1=8\n"
        "[2001]\nDataType=0x0009\nAccessType=rw\nParameterValue=NodeID\n"
    )
    report = ImportReport()
    found = [(v.index, v.subindex, v.text) for v in read_dcf_values(text.encode(), "d", report)]
    assert found == [(0x2000, 1, "8"), (0x2001, 0, "NodeID")]


def test_a_dcf_holds_the_number_of_mapped_objects() -> None:
    """1600h:00 can be written, and was in neither the file nor the count of what it lacks."""
    profile = load_profile("ds_c")
    values = {"1600:00": 2, "1600:01": 0x60400010, "1600:02": 0x607A0020}
    text = export_dcf(profile, values, datetime(2026, 1, 2), file_name="a.dcf")
    found = read_dcf_values(text.encode(), "a.dcf", ImportReport())
    keys = {f"{v.index:04X}:{v.subindex:02X}": int(v.text, 0) for v in found}
    assert keys == values
    section = text.partition("[1600sub0]")[2].partition("[")[0]
    assert "AccessType=rw\r\n" in section
    assert "DataType=0x0005\r\n" in section
    assert text.count("[1600sub0]") == 1


@pytest.mark.parametrize("text", ["0xFFFFFFFF", "0x20012345", "$NODEID+0x20000200"])
def test_an_identifier_of_29_bits_or_a_placeholder_is_no_identifier(text: str) -> None:
    """Its lowest 11 bits were taken: 7FFh for a template's FFFFFFFFh."""
    eds = GOOD_EDS + MAPPED.format(com="1401sub", map="1601sub").replace("$NODEID+0x300", text)
    pdo = import_file(eds.encode(), "d.eds").profile.pdo
    assert pdo is not None
    first = next(each for each in pdo.sets if each.index == 0x1601)
    assert first.identifier is None
