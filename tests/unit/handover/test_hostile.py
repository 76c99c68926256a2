"""Files that no controller wrote in good order: one clear error each."""

from __future__ import annotations

import pytest

from backend.axes.parameters.set_file import BadSet
from backend.records.handover.read import MAX_BYTES, read_list
from profiles import load_profile

BOMB = b"""<?xml version="1.0"?><!DOCTYPE b [<!ENTITY a "aaaaaaaaaa"><!ENTITY c "&a;&a;&a;&a;">]>
<EtherCATMailbox>&c;</EtherCATMailbox>"""
COMMAND = (
    b"<EtherCATMailbox><CoE><InitCmds><InitCmd><Transition>PS</Transition><Index>%s</Index>"
    b"<SubIndex>0</SubIndex><Data>%s</Data></InitCmd></InitCmds></CoE></EtherCATMailbox>"
)


@pytest.mark.parametrize(
    "data",
    [
        BOMB,
        b"",
        b"\xff\xff\xfe\x00 no text",
        b"hello",
        b"<html><body/></html>",
        b"<EtherCATMailbox><CoE>",
        b"<EtherCATMailbox/>",
        b'<?xml version="1.0" encoding="klingon"?><masters/>',
        b'<?xml version="1.0" encoding="utf-16"?><masters/>',
        "<EtherCATMailbox><Name>\xe4</Name></EtherCATMailbox>".encode("latin-1"),
        COMMAND % (b"24698", b"4"),
        COMMAND % (b"24698", b""),
        COMMAND % (b"999999", b"00"),
        COMMAND % (b"#xzz", b"00"),
        b"<EtherCATConfig><Config><Slave/><Slave/></Config></EtherCATConfig>",
        b"sdo: [{index: 0x6072, sub_index: 0, type: uint16, value: high}]",
        b"sdo: [{index: 0x6072, sub_index: 0, type: uint16, value: 70000}]",
        b"a: &a [1]\nsdo: [*a, *a]",
        b"sdo: " + b"[" * 5000,
        b"sdo: !!python/object/apply:os.system ['true']",
        b"#!/bin/sh\nethercat download -p 0 -t uint16 0x6072 0 $(reboot)\n",
        b"Line;Index:Subindex;Name;Value;Bit length\n1;16#6072:16#00;x;16#0BB8;9\n",
        b"key,index,subindex,data\n6072:00,0x6072\n",
        b"[FileInfo]\n[6072]\nParameterName=x\n",
        b" " * (MAX_BYTES + 1),
    ],
)
def test_each_is_refused_with_one_error(data: bytes) -> None:
    with pytest.raises(BadSet) as reported:
        read_list(data, load_profile("mms7"), "list.xml")
    assert "list.xml" in reported.value.message
    assert reported.value.remedy
    assert "\n" not in reported.value.message


@pytest.mark.parametrize("cut", [0.2, 0.5, 0.9, 0.99])
def test_a_truncated_xml_list_is_refused(cut: float) -> None:
    data = COMMAND % (b"24690", b"b80b")
    with pytest.raises(BadSet):
        read_list(data[: int(len(data) * cut)], load_profile("mms7"))
