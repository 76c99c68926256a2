"""Start-up lists as other tools and hands write them, next to those that are exported here."""

from __future__ import annotations

import struct

import pytest

from backend.axes.parameters.set_file import BadSet
from backend.records.handover.conflicts import diagnose
from backend.records.handover.read import read_list
from profiles import load_profile

MMS7, DS_C = load_profile("mms7"), load_profile("ds_c")
Writes = list[tuple[str, str]]


def writes(data: str | bytes, slave: int | None = None, *, canopen: bool = False) -> Writes:
    content = data.encode() if isinstance(data, str) else data
    found = read_list(content, DS_C if canopen else MMS7, "list", slave)
    return [(write.key, write.data.hex()) for write in found.writes]


def command(index: int, data: str, complete: str = "0") -> str:
    return (
        f'<InitCmd CompleteAccess="{complete}"><Transition>PS</Transition><Comment>n</Comment>'
        f"<Ccs>1</Ccs><Index>{index}</Index><SubIndex>0</SubIndex><Data>{data}</Data></InitCmd>"
    )


def mailbox(*commands: str) -> str:
    return f"<CoE><InitCmds>{''.join(commands)}</InitCmds></CoE>"


LIMIT = command(0x6072, "e803")
TAKEN = [("6072:00", "e803")]


@pytest.mark.parametrize(
    ("encoding", "comment"), [("gb2312", "电机"), ("windows-1252", "für"), ("shift-jis", "サーボ")]
)
def test_lists_in_the_encoding_of_their_country(encoding: str, comment: str) -> None:
    text = f"<EtherCATMailbox>{mailbox(LIMIT)}</EtherCATMailbox>".replace(">n<", f">{comment}<")
    declared = f'<?xml version="1.0" encoding="{encoding}"?>{text}'
    assert writes(declared.encode(encoding)) == TAKEN


def test_a_transition_as_twincat_shows_a_command_of_the_file() -> None:
    text = mailbox(LIMIT).replace(">PS<", ">&lt;PS&gt;<")
    (write,) = read_list(f"<EtherCATMailbox>{text}</EtherCATMailbox>".encode(), MMS7).writes
    assert (write.key, write.transition) == ("6072:00", "PS")


def test_a_namespace_changes_nothing() -> None:
    assert writes(f'<EtherCATMailbox xmlns="urn:x">{mailbox(LIMIT)}</EtherCATMailbox>') == TAKEN


def test_the_only_drive_of_an_eni_needs_no_number() -> None:
    """Couplers have no mailbox; two drives have to be distinguished."""
    coupler, drive = "<Slave/>", f"<Slave><Mailbox>{mailbox(LIMIT)}</Mailbox></Slave>"
    assert writes(f"<EtherCATConfig><Config>{coupler}{drive}</Config></EtherCATConfig>") == TAKEN
    two = f"<EtherCATConfig><Config>{coupler}{drive}{drive}</Config></EtherCATConfig>"
    with pytest.raises(BadSet, match="2 slaves"):
        writes(two)
    assert writes(two, slave=3) == TAKEN


def test_lists_of_pdos_are_taken_apart_without_a_profile_of_them() -> None:
    """ETG.1000.6 clause 5.6.7: numbers of PDOs on 16 bits, objects on 32; the count on 16."""
    text = mailbox(
        command(0x1C13, "0000", "1"),
        command(0x1C12, "020000160116", "1"),
        command(0x1601, "010020007a60", "1"),
    )
    assert writes(f"<EtherCATMailbox>{text}</EtherCATMailbox>") == [
        ("1C13:00", "00"),
        ("1C12:01", "0016"),
        ("1C12:02", "0116"),
        ("1601:01", "20007a60"),
    ]


def test_a_list_of_pdos_that_is_emptied_filled_and_counted_is_no_defect() -> None:
    text = mailbox(
        command(0x1C12, "00"),
        command(0x1C12, "0016").replace("<SubIndex>0", "<SubIndex>1"),
        command(0x1C12, "01"),
    )
    listed = read_list(f"<EtherCATMailbox>{text}</EtherCATMailbox>".encode(), MMS7)
    assert [f.kind for f in diagnose(MMS7, listed) if f.kind in ("twice", "unknown")] == []


def test_a_list_that_lies_in_another_file_is_not_compared_in_part() -> None:
    text = (
        "<masters><master><slave idx='0'><initCmds filename='axis1.xml'/>"
        "<sdoConfig idx='6072' subIdx='0'><sdoDataRaw data='e8 03'/></sdoConfig></slave></master>"
        "</masters>"
    )
    with pytest.raises(BadSet, match=r"axis1\.xml"):
        writes(text)
    assert writes(text.replace("<initCmds filename='axis1.xml'/>", "")) == TAKEN


@pytest.mark.parametrize(
    "line",
    [
        "ethercat download -p0 -t uint16 0x6072 0 1000",
        "sudo ethercat -m 0 download --position=0 --type uint16 0x6072 0 0x3e8 # limit",
        "/usr/local/bin/ethercat download -p $AXIS -t uint16 -- 0x6072 0 01750\r",
        "ethercat download -p 0 -t uint16 \\\n  0x6072 0 1000",
        "ethercat download -p0 0x6072 0 1000",
        "if ! sudo -n ethercat download -p0 0x6072 0 1000 >/dev/null 2>&1; then exit 1; fi",
        "for i in 0; do ethercat download -p $i -t uint16 0x6072 0 1000; done",
        "sleep 1 && E=1 ethercat download -p0 -tuint16 0x6072 0 1000 || exit 1",
        "OUT=$(ethercat -p0 download -t uint16 0x6072 0 1000)",
        "TOOL=/opt/etherlab/bin/ethercat\n$TOOL download -p0 -t uint16 0x6072 0 1000",
        'echo "step #1"; ethercat download -p0 -t uint16 0x6072 0 1000 # torque',
        "# the drive's own: ethercat download -p0 0x1 0 1\nethercat download -p0 0x6072 0 1000",
        "echo ethercat download 1\nethercat download -p0 -t uint16 0x6072 0 1000",
    ],
)
def test_scripts_by_hand(line: str) -> None:
    """`ethercat` reads a number that begins with 0 as octal: 01750 is 1000."""
    assert writes(f"#!/bin/sh\nset -e\n{line}\n") == TAKEN


def test_a_script_writes_real_numbers_as_their_bits() -> None:
    """IEEE 754: 0.5 is 3F000000h as float and 3FE0000000000000h as double."""
    line = "ethercat download -p0 -t %s 0x2001 1 %s\n"
    assert writes(line % ("float", "0.5")) == [("2001:01", "0000003f")]
    assert writes(line % ("double", "5e-1")) == [("2001:01", "000000000000e03f")]


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("ethercat download -p0 0x5FFF 0 1", "5FFF:00 has no type"),
        ("ethercat download -p0 -t sm16 0x6072 0 1", "download of index"),
        ("ethercat download -p0 -t float 0x6072 0 nan", "not a number"),
        ("ethercat download -p0 -t string 0x6072 0 abc", "download of index"),
        ("find . | xargs ethercat download -p0 -t uint16 0x6072 0", "download of index"),
        ('X="$(ethercat download -p0 -t uint16 0x6072 0 5)"', "download of index"),
    ],
)
def test_no_download_of_a_script_is_passed_over(line: str, words: str) -> None:
    with pytest.raises(BadSet, match=f"line 2: .*{words}"):
        writes(f"ethercat download -p0 -t uint16 0x6072 0 1000\n{line}\n")


def test_a_remark_about_the_command_makes_no_script() -> None:
    row = (
        "  - {index: 0x6072, sub_index: 0, type: uint16, value: 1000} # drive's: ethercat download"
    )
    assert writes(f"vendor_id: 1\nsdo:\n{row}\n") == TAKEN


def test_slaves_of_two_masters_are_two() -> None:
    line = "ethercat download -m{} -p0 -t uint16 0x6072 0 1000\n"
    with pytest.raises(BadSet, match="2 slaves"):
        writes(line.format(0) + line.format(1))


@pytest.mark.parametrize("kind", ["float", "bool", "sm8", "string"])
def test_types_that_the_driver_of_ros_2_does_not_write_are_refused(kind: str) -> None:
    row = f"vendor_id: 1\nsdo:\n  - {{index: 0x6072, sub_index: 0, type: {kind}, value: 1}}\n"
    with pytest.raises(BadSet, match="is not known"):
        writes(row)


MOTOR = '<sdoConfig idx="6072" subIdx="0"><sdoDataRaw data="E8 03"/></sdoConfig>'


def lcec_slave(kind: str, content: str) -> str:
    return f'<masters><master><slave type="{kind}">{content}</slave></master></masters>'


def test_what_the_driver_of_an_lcec_slave_writes_is_not_called_unchanged() -> None:
    """lcec_class_cia402.c writes 6091h of `gearRatio`; what sets its pins alone writes nothing."""
    pins = '<modParam name="ciaChannels" value="1"/><modParam name="enableTorque" value="1"/>'
    assert writes(lcec_slave("basic_cia402", pins + MOTOR)) == TAKEN
    gear = '<modParam name="gearRatio" value="3:1"/>'
    for content in (gear + MOTOR, gear):
        with pytest.raises(BadSet, match=r"the driver basic_cia402 writes .* gearRatio"):
            writes(lcec_slave("basic_cia402", pins + content))


def test_complete_access_of_lcec_in_any_letters() -> None:
    config = '<sdoConfig idx="1C12" subIdx="Complete"><sdoDataRaw data="01 00 00 16"/></sdoConfig>'
    assert writes(lcec_slave("generic", config)) == [("1C12:01", "0016")]


def test_a_script_for_two_slaves_is_read_for_one() -> None:
    text = "".join(
        f"ethercat download -p {place} -t uint16 0x6072 0 {value}\n"
        for place, value in ((3, 1000), (1, 2000), (3, 1001))
    )
    with pytest.raises(BadSet, match="2 slaves"):
        writes(text)
    assert writes(text, slave=1) == [("6072:00", "e803"), ("6072:00", "e903")]
    assert writes(text, slave=2) == [("6072:00", "d007")]


def test_a_bus_of_two_nodes_is_read_for_one() -> None:
    row = "\n  sdo: [{index: 0x6081, sub_index: 0, value: %s}]\n"
    text = "master: {node_id: 1}\na:" + row % 1 + "b:" + row % '"0x2"'
    with pytest.raises(BadSet, match="2 slaves"):
        writes(text, canopen=True)
    assert writes(text, 2, canopen=True) == [("6081:00", "02000000")]


DCF = "[FileInfo]\nFileName=a\n[DeviceComissioning]\nNodeID=5\n"


def parameter(title: str, kind: str, value: str) -> str:
    return f"[{title}]\nParameterName=x\nDataType={kind}\nAccessType=rw\nParameterValue={value}\n"


def test_a_dcf_with_its_node_and_with_objects_that_nobody_knows_here() -> None:
    text = (
        DCF
        + parameter("1400sub1", "0x0007", "$NODEID+0x200")
        + parameter("3001", "3", "-5")
        + parameter("3002", "9", "some text")
        + parameter("6081", "7", "1000 ; speed")
    )
    assert writes(text, canopen=True) == [
        ("1400:01", "05020000"),
        ("3001:00", "fbff"),
        ("6081:00", "e8030000"),
    ]


def test_a_concise_dcf() -> None:
    """CiA 302-2: the number of entries, then index, subindex, size and data of each."""
    rows = struct.pack("<IHBIIHBIb", 2, 0x6081, 0, 4, 1000, 0x6060, 0, 1, -3)
    assert writes(rows, canopen=True) == [("6081:00", "e8030000"), ("6060:00", "fd")]
    for damaged in (rows[:-1], rows + b"\0", b"\3" + rows[1:]):
        with pytest.raises(BadSet):
            writes(damaged, canopen=True)


@pytest.mark.parametrize("separator", [";", ",", "\t"])
@pytest.mark.parametrize("quote", ["", '"'])
def test_tables_that_a_spreadsheet_has_saved(separator: str, quote: str) -> None:
    rows = (("key", "index", "subindex", "name", "data"), ("x", "0x6072", "0", "Größe", "E803"))
    text = "".join(separator.join(f"{quote}{w}{quote}" for w in row) + "\r\n" for row in rows)
    assert writes(text.encode("cp1252")) == TAKEN
