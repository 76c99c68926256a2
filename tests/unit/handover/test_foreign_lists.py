"""Start-up lists as other tools and hands write them, next to those that are exported here."""

from __future__ import annotations

import struct

import pytest

from backend.handover.conflicts import diagnose
from backend.handover.read import read_list
from backend.parameters.set_file import BadSet
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
        command(0x1C13, "0000", "1"), command(0x1C12, "020000160116", "1"),
        command(0x1601, "010020007a60", "1"),
    )  # fmt: skip
    assert writes(f"<EtherCATMailbox>{text}</EtherCATMailbox>") == [
        ("1C13:00", "00"), ("1C12:01", "0016"), ("1C12:02", "0116"), ("1601:01", "20007a60"),
    ]  # fmt: skip


def test_a_list_of_pdos_that_is_emptied_filled_and_counted_is_no_defect() -> None:
    text = mailbox(
        command(0x1C12, "00"), command(0x1C12, "0016").replace("<SubIndex>0", "<SubIndex>1"),
        command(0x1C12, "01"),
    )  # fmt: skip
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
    ],
)
def test_scripts_by_hand(line: str) -> None:
    """`ethercat` reads a number that begins with 0 as octal: 01750 is 1000."""
    assert writes(f"#!/bin/sh\nset -e\n{line}\n") == TAKEN


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
        DCF + parameter("1400sub1", "0x0007", "$NODEID+0x200") + parameter("3001", "3", "-5")
        + parameter("3002", "9", "some text") + parameter("6081", "7", "1000 ; speed")
    )  # fmt: skip
    assert writes(text, canopen=True) == [
        ("1400:01", "05020000"), ("3001:00", "fbff"), ("6081:00", "e8030000"),
    ]  # fmt: skip


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
