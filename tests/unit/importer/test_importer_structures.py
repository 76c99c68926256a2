"""Files built as makers build theirs: modules, padding, records, notations, encodings, headings.

Each expected value is read off the file's own text by hand.
"""

from __future__ import annotations

import re

import pytest

from profiles.check import check
from profiles.importer import ImportedProfile, ImportFailed, ImportReport, import_file
from profiles.importer.eds.dcf import read_dcf_values
from profiles.schema import Parameter
from tests.unit.importer.test_importer_oddities import (
    CONTROL,
    HEAD,
    POSITIONS,
    SPEEDS,
    STATUS,
    TAIL,
    device,
    esi,
    scalar,
)

BASE = CONTROL + STATUS + SPEEDS + POSITIONS


def usable(data: bytes, name: str = "odd.xml", **chosen: int) -> ImportedProfile:
    imported = import_file(data, name, **chosen)
    assert [str(finding) for finding in check(imported.profile)] == []
    return imported


def codes(imported: ImportedProfile) -> list[str]:
    return [finding.code for finding in imported.report.findings]


def parameter(imported: ImportedProfile, key: str) -> Parameter:
    return next(p for p in imported.profile.parameters if p.key == key)


def keys(imported: ImportedProfile) -> set[str]:
    return {p.key for p in imported.profile.parameters}


def sets(imported: ImportedProfile) -> dict[int, tuple[str, ...]]:
    assert imported.profile.pdo is not None
    return {each.index: each.entries for each in imported.profile.pdo.sets}


def entry(index: str, bits: int | str, kind: str = "", flag: str = "") -> str:
    return (
        f"<Entry><Index{flag}>{index}</Index><SubIndex>0</SubIndex><BitLen>{bits}</BitLen>"
        f"<Name>e</Name><DataType>{kind}</DataType></Entry>"
    )


# ESI: revisions and modules ----------------------------------------------------------------------


def test_of_one_product_with_three_revisions_the_newest_or_the_chosen_one() -> None:
    """``HideType`` of a newer device names the older one; the order in the file says nothing."""
    devices = [
        device(BASE, revision=revision, name=f"ES4 r{revision}").replace(
            "<Profile>", f'<HideType RevisionNo="#x{revision - 1:X}"/><Profile>'
        )
        for revision in (3, 5, 4)
    ]
    newest = usable(esi(*devices))
    assert (newest.profile.identity.revision, newest.profile.identity.model) == (5, "ES4 r5")
    assert [other.revision for other in newest.others] == [3, 4]
    chosen = usable(esi(*devices), product_code=0x190, revision=4)
    assert chosen.profile.identity.revision == 4


_SLOT = ' DependOnSlot="1"'
MODULE = (
    '<Modules><Module><Type ModuleIdent="#x10">AX</Type><Name>Axis</Name>'
    f'<RxPdo Fixed="1" Sm="2"><Index{_SLOT}>#x1600</Index><Name>o</Name>'
    + entry("#x6040", 16, "UINT", _SLOT)
    + entry("#x607A", 32, "DINT", _SLOT)
    + f'</RxPdo><TxPdo Fixed="1" Sm="3"><Index{_SLOT}>#x1A00</Index><Name>i</Name>'
    + entry("#x6041", 16, "UINT", _SLOT)
    + entry("#x6064", 32, "DINT", _SLOT)
    + "</TxPdo><Profile><Dictionary><DataTypes/><Objects>"
    + (CONTROL + STATUS + POSITIONS).replace("<Index>", f"<Index{_SLOT}>")
    + "</Objects></Dictionary></Profile></Module></Modules>"
)


def modular(slots: str, pdos: str = "") -> bytes:
    body = f'<Device><Type ProductCode="400" RevisionNo="1">M</Type><Name>M</Name>{pdos}{slots}'
    tail = TAIL.replace("</Devices>", f"</Devices>{MODULE}")
    return f"{HEAD}{body}</Device>{tail}".encode()


_TWO = "<Slot>{0}</Slot><Slot>{0}</Slot>".format('<ModuleIdent Default="1">#x10</ModuleIdent>')
_INSTANCES = (
    '<Slot MinInstances="2" MaxInstances="2"><ModuleIdent Default="1">#x10</ModuleIdent></Slot>'
)


@pytest.mark.parametrize("inner", [_TWO, _INSTANCES], ids=["two slots", "two instances of one"])
@pytest.mark.parametrize("numbers", [("#x10", "#x800"), ("16", "2048")])
def test_objects_and_pdos_of_the_second_axis_lie_behind_the_first(
    inner: str, numbers: tuple[str, str]
) -> None:
    """16 PDOs and 800h objects a slot; a ``Slot`` may stand for several."""
    pdos, objects = numbers
    slots = f'<Slots SlotPdoIncrement="{pdos}" SlotIndexIncrement="{objects}">{inner}</Slots>'
    found = usable(modular(slots))
    assert sets(found) == {
        0x1600: ("6040:00", "607A:00"),
        0x1A00: ("6041:00", "6064:00"),
        0x1610: ("6840:00", "687A:00"),
        0x1A10: ("6841:00", "6864:00"),
    }
    assert parameter(found, "6864:00").type == "INT32"


def test_a_pdo_of_the_device_that_its_module_overwrites() -> None:
    own = (
        '<RxPdo OverwrittenByModule="1" Sm="2" Fixed="1"><Index>#x1600</Index><Name>d</Name>'
        + entry("#x6040", 16, "UINT")
        + '</RxPdo><RxPdo OverwrittenByModule="1"><Index>#x1620</Index><Name>d</Name>'
        + entry("#x6040", 16, "UINT")
        + "</RxPdo>"
    )
    slots = "<Slots><Slot><ModuleIdent>#x10</ModuleIdent></Slot></Slots>"
    found = sets(usable(modular(slots, own)))
    assert found[0x1600] == ("6040:00", "607A:00")
    assert found[0x1620] == ("6040:00",), "no module brings this one"


# ESI: process data and types ---------------------------------------------------------------------


def test_padding_of_any_length_keeps_what_follows_in_its_place() -> None:
    """24 bits; index missing; 520 bits, which no single entry of a mapping object can say."""
    pdos = (
        '<RxPdo Sm="2" Fixed="1"><Index>#x1600</Index><Name>o</Name>'
        + entry("#x6040", 16)
        + entry("0", 24)
        + entry("#x607A", 32)
        + "<Entry><BitLen>#x10</BitLen></Entry></RxPdo>"
        + '<TxPdo Sm="3" Fixed="1"><Index>#x1A00</Index><Name>i</Name>'
        + entry("#x6041", 16)
        + entry("#x0000", 520)
        + entry("#x6064", 32)
        + "</TxPdo>"
    )
    found = usable(esi(device(BASE, pdos)))
    assert found.profile.pdo is not None
    rx, tx = found.profile.pdo.sets
    assert [(p.key, p.bits) for p in rx.layout] == [
        ("6040:00", 16),
        (None, 24),
        ("607A:00", 32),
        (None, 16),
    ]
    assert sum(p.bits for p in tx.layout) == 16 + 520 + 32
    assert (tx.layout[0].key, tx.layout[-1].key) == ("6041:00", "6064:00")
    assert codes(found) == []


def test_an_entry_without_length_is_reported() -> None:
    pdos = (
        '<RxPdo Sm="2"><Index>#x1600</Index><Name>o</Name><Entry><Index>0</Index></Entry>'
        + entry("#x6040", 16)
        + "</RxPdo>"
    )
    assert "description.padding-unknown" in codes(usable(esi(device(BASE, pdos))))


def test_flags_of_pdos_in_every_spelling() -> None:
    pdos = (
        '<RxPdo Mandatory="TRUE" Fixed="true" Sm="2"><Index>5632</Index><Name>a</Name>'
        + entry("24640", "#x10")
        + '</RxPdo><RxPdo Sm=""><Index>0X1601</Index><Name>b</Name>'
        + entry("0x607a", "0x20")
        + '</RxPdo><TxPdo Mandatory="0" Sm="#x3" Fixed="0"><Index>#X1a00</Index><Name>i</Name>'
        + entry("#X6041", 16)
        + "</TxPdo>"
    )
    found = usable(esi(device(BASE, pdos)))
    assert found.profile.pdo is not None
    flags = [(p.index, p.mandatory, p.fixed, p.sync_manager) for p in found.profile.pdo.sets]
    assert flags == [
        (0x1600, True, True, 2),
        (0x1601, False, False, None),
        (0x1A00, False, False, 3),
    ]
    assert sets(found)[0x1600] == ("6040:00",)
    assert sets(found)[0x1601] == ("607A:00",)


def sub_item(index: int, name: str, kind: str, bits: int, offset: int) -> str:
    return (
        f"<SubItem><SubIdx>{index}</SubIdx><Name>{name}</Name><Type>{kind}</Type>"
        f"<BitSize>{bits}</BitSize><BitOffs>{offset}</BitOffs></SubItem>"
    )


def test_members_that_begin_between_bytes_and_types_of_types() -> None:
    types = (
        "<DataType><Name>DT2100</Name><BitSize>48</BitSize>"
        + sub_item(0, "Number", "USINT", 8, 0)
        + sub_item(1, "Enable", "BOOL", 1, 16)
        + sub_item(2, "Mode", "BIT3", 3, 17)
        + sub_item(3, "Level", "BIT12", 12, 20)
        + sub_item(5, "Rate", "DT_A", 16, 32)
        + "</DataType><DataType><Name>DT_A</Name><BaseType>DT_B</BaseType><BitSize>16</BitSize>"
        "</DataType><DataType><Name>DT_B</Name><BaseType>INT</BaseType><BitSize>16</BitSize>"
        "</DataType>"
    )
    values = (
        ("Number", "05"),
        ("Enable", "01"),
        ("Mode", "05"),
        ("Level", "FF0F"),
        ("Rate", "FEFF"),
    )
    info = "".join(
        f"<SubItem><Name>{name}</Name><Info><DefaultData>{data}</DefaultData></Info></SubItem>"
        for name, data in values
    )
    found = usable(esi(device(BASE + scalar(0x2100, "Rec", "DT2100", 48, info=info), types=types)))
    assert "2100:04" not in keys(found)
    held = {n: parameter(found, f"2100:0{n}") for n in (1, 2, 3, 5)}
    assert [(p.type, p.default_raw) for p in held.values()] == [
        ("BOOL", 1),
        ("UINT8", 5),
        ("UINT16", 0xFFF),
        ("INT16", -2),
    ]


@pytest.mark.parametrize("bits", [32, 48])
def test_a_record_within_a_record_is_bytes_and_never_a_number(bits: int) -> None:
    """Written as a number of 8 bytes, an object of 6 would be refused or, worse, cut."""
    types = (
        f"<DataType><Name>DTIN</Name><BitSize>{bits}</BitSize>"
        + sub_item(1, "A", "UINT", 16, 0)
        + "</DataType><DataType><Name>DT2200</Name><BitSize>112</BitSize>"
        + sub_item(0, "SubIndex 000", "USINT", 8, 0)
        + sub_item(1, "In", "DTIN", bits, 16)
        + sub_item(2, "Last", "INT", 16, 64)
        + "</DataType>"
    )
    found = usable(esi(device(BASE + scalar(0x2200, "Nest", "DT2200", 112), types=types)))
    assert parameter(found, "2200:01").type == "OCTETS"
    assert parameter(found, "2200:02").type == "INT16"


def test_an_array_whose_count_has_16_bits_and_names_of_its_own() -> None:
    types = (
        "<DataType><Name>DT2400ARR</Name><BaseType>INT</BaseType><BitSize>48</BitSize>"
        "<ArrayInfo><LBound>1</LBound><Elements>3</Elements></ArrayInfo></DataType>"
        "<DataType><Name>DT2400</Name><BitSize>64</BitSize>"
        + sub_item(0, "SubIndex 000", "UINT", 16, 0)
        + "<SubItem><Name>Elements</Name><Type>DT2400ARR</Type><BitSize>48</BitSize>"
        "<BitOffs>16</BitOffs></SubItem></DataType>"
    )
    info = "".join(
        f"<SubItem><Name>{name}</Name><Info><DefaultData>{data}</DefaultData></Info></SubItem>"
        for name, data in (("SubIndex 000", "0300"), ("X", "0100"), ("Y", "FFFF"), ("Z", "E803"))
    )
    found = usable(
        esi(device(BASE + scalar(0x2400, "Table", "DT2400", 64, info=info), types=types))
    )
    elements = [parameter(found, f"2400:0{n}") for n in (1, 2, 3)]
    assert [(p.name, p.type, p.default_raw) for p in elements] == [
        ("Table: X", "INT16", 1),
        ("Table: Y", "INT16", -1),
        ("Table: Z", "INT16", 1000),
    ]


def test_an_enumeration_in_three_languages_and_notations() -> None:
    types = (
        "<DataType><Name>DT0800EN08</Name><BaseType>USINT</BaseType><BitSize>8</BitSize>"
        '<EnumInfo><Text LcId="1031">Aus</Text><Text LcId="1033">Off</Text>'
        '<Text LcId="2052">关</Text><Enum>0</Enum></EnumInfo>'
        '<EnumInfo><Text LcId="1031">Nur deutsch</Text><Enum>#x0A</Enum></EnumInfo>'
        "<EnumInfo><Text><![CDATA[On & on]]></Text><Enum>0x10</Enum></EnumInfo>"
        "<EnumInfo><Text>None</Text><Enum>-1</Enum></EnumInfo>"
        "<EnumInfo><Text>Too large</Text><Enum>256</Enum></EnumInfo></DataType>"
    )
    choice = scalar(0x2300, "Choice", "DT0800EN08", 8, info="<DefaultValue>10</DefaultValue>")
    found = usable(esi(device(BASE + choice, types=types)))
    held = parameter(found, "2300:00")
    assert (held.type, held.default_raw) == ("UINT8", 10)
    # -1 travels as FFh in a byte.
    assert dict(held.enum) == {0: "Off", 10: "Nur deutsch", 16: "On & on", 255: "None"}
    assert codes(found) == ["description.enum-negative", "description.does-not-fit"]


# ESI: wrappings ----------------------------------------------------------------------------------


def test_remarks_within_values_and_names_in_character_data() -> None:
    text = (
        esi(device(BASE))
        .decode()
        .replace("<Index>#x6040</Index>", "<Index>#x<!-- was 6000 -->6040</Index>")
        .replace(
            "<Name>ES4</Name>",
            '<Name LcId="1031"><![CDATA[Antrieb <4>]]></Name><Name LcId="2052">驱动器</Name>'
            '<Name LcId="1033"><![CDATA[Drive <4> & co]]></Name>',
        )
    )
    found = usable(text.encode())
    assert found.profile.identity.model == "Drive <4> & co"
    assert parameter(found, "6040:00").name == "Controlword"


@pytest.mark.parametrize("declared", [True, False])
def test_a_prefix_at_every_tag(declared: bool) -> None:
    text = re.sub(r"<(/?)(?=[A-Z])", r"<\1esi:", esi(device(BASE)).decode())
    space = ' xmlns:esi="http://www.example.org/esi"' if declared else ""
    text = text.replace("<esi:EtherCATInfo>", f'<esi:EtherCATInfo{space} Version="1.6">')
    found = usable(text.encode())
    assert found.profile.identity.product_code == 0x190
    assert {"6040:00", "6064:00"} <= keys(found)
    assert ("description.xml-repaired" in codes(found)) is not declared


@pytest.mark.parametrize(
    ("mark", "encoding"),
    [(b"\xff\xfe", "utf-16-le"), (b"\xfe\xff", "utf-16-be"), (b"", "utf-16-le")],
)
def test_two_bytes_a_character(mark: bytes, encoding: str) -> None:
    text = esi(device(BASE.replace("Controlword", "Größe 增益"))).decode()
    found = usable(mark + text.replace("UTF-8", "UTF-16").encode(encoding))
    assert parameter(found, "6040:00").name == "Größe 增益"


# EDS, DCF, XDD -----------------------------------------------------------------------------------

EDS_HEAD = """[FileInfo]
FileName=x.eds
[DeviceInfo]
VendorName=Ex
VendorNumber=0xA2B
ProductName=ES4
ProductNumber=0x190
"""


def described(index: str, name: str, kind: int, access: str = "rw", **more: str) -> str:
    lines = [f"[{index}]", f"ParameterName={name}", "ObjectType=0x7", f"DataType=0x{kind:X}"]
    lines += [f"AccessType={access}", *(f"{key}={value}" for key, value in more.items()), ""]
    return "\n".join(lines)


EDS_BASE = (
    described("6040", "Controlword", 6, "rww", PDOMapping="1")
    + described("6041", "Statusword", 6, "ro", PDOMapping="1")
    + described("607A", "Target position", 4, "rww", PDOMapping="1")
    + described("6064", "Position", 4, "ro", PDOMapping="1")
)
COMPACT = """[2100]
ParameterName=Table
ObjectType=0x8
DataType=0x0003
AccessType=rw
DefaultValue=7
CompactSubObj=0x04
[2100Name]
NrOfEntries=2
1=First
3=Third
[2100Value]
NrOfEntries=2
2=-5
4=0xFFFE
"""


def test_an_array_in_compact_storage() -> None:
    found = usable((EDS_HEAD + EDS_BASE + COMPACT).encode(), "x.eds")
    elements = [parameter(found, f"2100:0{n}") for n in (1, 2, 3, 4)]
    assert [p.name for p in elements] == ["Table: First", "Table2", "Table: Third", "Table4"]
    # FFFEh of an INTEGER16 is -2.
    assert [p.default_raw for p in elements] == [7, -5, 7, -2]


def test_values_of_one_machine_in_a_dcf_are_no_defaults() -> None:
    text = (
        EDS_HEAD
        + "[DeviceComissioning]\nNodeID=0x05\n"
        + EDS_BASE
        + described("6083", "Acc", 7, DefaultValue="1000", ParameterValue="250")
        + described("2001", "Off", 3, DefaultValue="0", ParameterValue="$NODEID+0x10")
        + COMPACT
    )
    found = usable(text.encode(), "x.dcf")
    assert parameter(found, "6083:00").default_raw == 1000
    assert [parameter(found, f"2100:0{n}").default_raw for n in (1, 2, 3, 4)] == [7, 7, 7, 7]
    assert codes(found) == ["description.configured-values"]
    values = read_dcf_values(text.encode(), "x.dcf", ImportReport())
    assert [(v.index, v.subindex, v.text) for v in values] == [
        (0x6083, 0, "250"),
        (0x2001, 0, "0x15"),
        (0x2100, 2, "-5"),
        (0x2100, 4, "0xFFFE"),
    ]


@pytest.mark.parametrize(
    ("formula", "cob_id", "of_node"),
    [
        ("$NODEID+0x200", 0x200, True),
        ("$nodeid + 0x200", 0x200, True),
        ("0x300+$NodeId", 0x300, True),
        ("$NODEID+640", 640, True),
        ("$NODEID+0x80000400", 0x400, True),
        ("0x1FF", 0x1FF, False),
    ],
)
def test_identifiers_that_follow_the_node(formula: str, cob_id: int, of_node: bool) -> None:
    """Bit 31 says that the PDO is not in use as delivered (CiA 301 clause 7.5.2.35)."""
    mapped = ""
    for mapping, communication, words in (
        ("1600", "1400", ("0x60400010", "0x607A0020")),
        ("1A00", "1800", ("0x60410010", "0x60640020")),
    ):
        mapped += (
            f"[{mapping}]\nParameterName=m\nObjectType=9\nDataType=7\nAccessType=rw\n"
            f"CompactSubObj=2\n[{mapping}Value]\nNrOfEntries=2\n1={words[0]}\n2={words[1]}\n"
            f"[{communication}]\nParameterName=c\nObjectType=9\nSubNumber=2\n"
            + described(f"{communication}sub0", "n", 5, "ro", DefaultValue="1")
            + described(f"{communication}sub1", "COB", 7, DefaultValue=formula)
        )
    found = usable((EDS_HEAD + EDS_BASE + mapped).encode(), "x.eds")
    assert sets(found) == {0x1600: ("6040:00", "607A:00"), 0x1A00: ("6041:00", "6064:00")}
    assert found.profile.pdo is not None
    identifier = found.profile.pdo.sets[0].identifier
    assert identifier is not None
    assert (identifier.cob_id, identifier.of_node) == (cob_id, of_node)


def test_of_two_sections_of_one_object_the_first_counts_alone() -> None:
    text = (
        EDS_HEAD
        + EDS_BASE
        + described("2300", "A", 6, DefaultValue="1")
        + described("2300", "B", 5, "ro", DefaultValue="2", HighLimit="9")
    )
    found = usable(text.encode(), "x.eds")
    held = parameter(found, "2300:00")
    assert (held.name, held.type, held.access, held.default_raw) == ("A", "UINT16", "rw", 1)
    assert held.max_raw is None, "the second one's limit is of another description"
    assert codes(found) == ["description.section-twice"]


@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"])
def test_remarks_behind_values_and_no_line_end_at_the_end(line_end: str) -> None:
    text = (
        EDS_HEAD
        + EDS_BASE
        + "; header\n[2400] ; remark\nParameterName=Gain\nObjectType=0x7 ; VAR\n"
        "DataType=0x0006 ;U16\nAccessType=rw;\nDefaultValue=12 ; twelve\nLowLimit=1;low\n"
        "HighLimit=0x64 ; 100\nObjFlags=0x1"
    )
    held = parameter(usable(text.replace("\n", line_end).encode(), "x.eds"), "2400:00")
    assert (held.type, held.access) == ("UINT16", "rw")
    assert (held.default_raw, held.min_raw, held.max_raw) == (12, 1, 100)


@pytest.mark.parametrize(
    ("encoding", "name"),
    [
        ("cp850", "Verstärkung Größe"),
        ("cp1252", "Verstärkung Größe 5 °C"),
        ("shift_jis", "速度ゲイン"),
        ("shift_jis", "いちゲイン"),
        ("gbk", "速度增益"),
    ],
)
def test_names_in_the_code_page_of_the_editor(encoding: str, name: str) -> None:
    text = EDS_HEAD + EDS_BASE + described("2500", name, 6)
    found = usable(text.encode(encoding), "x.eds")
    assert parameter(found, "2500:00").name == name
    assert codes(found) == ["description.not-utf8"]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
@pytest.mark.parametrize("prefix", ["", "c:"])
def test_an_xdd_gets_one_clear_error(encoding: str, prefix: str) -> None:
    space = "xmlns:c" if prefix else "xmlns"
    text = (
        f"<!--{'x' * 900}-->\n<{prefix}ISO15745ProfileContainer"
        f' {space}="http://www.canopen.org/xml/1.0"></{prefix}ISO15745ProfileContainer>'
    )
    with pytest.raises(ImportFailed) as refused:
        import_file(text.encode(encoding), "x.xdd")
    assert refused.value.code == "description.xdd"
