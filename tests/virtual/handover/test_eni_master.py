"""A segment is brought up from its ENI alone, by a master that has nothing else."""

from __future__ import annotations

import json
import struct
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from xml.etree.ElementTree import Element

import pytest
from defusedxml.ElementTree import fromstring

from backend.axes.parameters.set_file import BadSet
from backend.records.handover.eni import eni
from backend.records.handover.esi import controller_of
from backend.records.handover.model import hand_over
from drivers.errors import NotAllowed
from drivers.virtual.wires.ethercat.launch import VirtualSegment
from drivers.virtual.wires.netns import Namespace, unavailable
from tests.support.controllers.segment import Rig, with_esi
from tests.support.eni_master import EniMaster, Refused
from tests.support.handed_over import (
    MAKERS,
    profile_of,
    set_of_device,
    tuned_device,
)

FAMILIES = ("mms7", "m6l", "r6l", "ep3e", "maker_a.xml", "maker_c.xml")


@pytest.mark.long(keep=5)
@pytest.mark.parametrize("family", FAMILIES)
def test_every_family_runs_from_its_eni(family: str) -> None:
    axis = with_esi(family)
    rig = Rig(axis.profile)
    master = EniMaster(fromstring(eni([axis])), rig.exchange)
    master.start()
    master.wkc.clear()
    for _ in range(20):
        master.cycle("OP")
    assert master.states() == [8]
    assert all(came == expected for came, expected in master.wkc)
    rig.check([axis])


def test_a_segment_of_three_makers_runs_from_one_eni() -> None:
    axes = [with_esi(family) for family in ("mms7", "maker_a.xml", "m6l")]
    rig = Rig(*(axis.profile for axis in axes))
    root = fromstring(eni(axes))
    master = EniMaster(root, rig.exchange)
    master.start()
    master.wkc.clear()
    for _ in range(20):
        master.cycle("OP")
    assert master.states() == [8, 8, 8]
    assert set(master.wkc) == {(9, 9), (3, 3)}
    rig.check(axes)
    addresses = [int(e.text or 0) for e in root.iterfind("Config/Slave/Info/AutoIncAddr")]
    assert addresses == [0, 65535, 65534]


def test_a_drive_of_another_maker_is_refused() -> None:
    axis = with_esi("mms7")
    rig = Rig(profile_of("maker_a.xml"))
    master = EniMaster(fromstring(eni([axis])), rig.exchange)
    with pytest.raises(Refused, match="vendor id"):
        master.start()


@pytest.mark.long
def test_the_segment_comes_up_over_a_real_wire(tmp_path: Path) -> None:
    why = unavailable()
    if why is not None:
        pytest.skip(why)
    axes = [with_esi(family) for family in ("mms7", "r6l")]
    path = tmp_path / "segment.xml"
    path.write_bytes(eni(axes))
    names = [axis.profile.drive for axis in axes]
    namespace = Namespace.create()
    segment = None
    try:
        arguments = ["--sdo-ms", "0.3", *(f"--drive={name}" for name in names)]
        segment = VirtualSegment.start("ec0s", arguments, namespace)
        command = [sys.executable, "-m", "tests.support.eni_master", str(path), "ec0m"]
        process = namespace.popen(command, stdout=subprocess.PIPE)
        said, _ = process.communicate(timeout=60)
        seen = json.loads(said)
        assert seen["states"] == [8, 8], seen
        assert {tuple(each) for each in seen["wkc"]} == {(6, 6), (2, 2)}
        for slave, axis in enumerate(axes):
            for write in axis.writes[::7]:
                reported = segment.command(
                    "read", slave=slave, index=write.index, subindex=write.subindex
                )
                assert bytes.fromhex(str(reported)) == write.data, write.key
    finally:
        if segment is not None:
            segment.close()
        namespace.close()


#: Elements with their children in their order, as TwinCAT writes them: compare
#: github.com/UMich-BipedLab/Cassie_FlatGround_Controller, Cassie/Core/EtherCAT/cassie-v3-eni.xml.
ORDER = {
    "Config": ["Master", "Slave", "Cyclic", "ProcessImage"],
    "Master": ["Info", "InitCmds"],
    "Slave": ["Info", "ProcessData", "Mailbox", "InitCmds", "DC"],
    "ProcessData": ["Send", "Recv", "Sm2", "Sm3", "TxPdo", "RxPdo"],
    "Send": ["BitStart", "BitLength", "Start", "Length"],
    "Recv": ["BitStart", "BitLength", "Start", "Length", "PollTime"],
    "Sm2": ["Type", "StartAddress", "ControlByte", "Enable", "Pdo"],
    "Sm3": ["Type", "StartAddress", "ControlByte", "Enable", "Pdo"],
    "TxPdo": ["Index", "Name", "Entry"],
    "RxPdo": ["Index", "Name", "Entry"],
    "Entry": ["Index", "SubIndex", "BitLen", "Name", "DataType"],
    "Mailbox": ["Send", "Recv", "Protocol", "CoE"],
    "CoE": ["InitCmds"],
    "InitCmds": ["InitCmd"],
    "InitCmd": [
        "Transition", "BeforeSlave", "Comment", "Requires", "Cmd", "Adp", "Ado", "Timeout", "Ccs",
        "Index", "SubIndex", "Data", "Cnt", "Retries", "Validate",
    ],
    "Validate": ["Data", "DataMask", "Timeout"],
    "DC": ["PotentialReferenceClock", "ReferenceClock", "CycleTime0", "CycleTime1", "ShiftTime"],
    "Cyclic": ["Comment", "CycleTime", "Priority", "TaskId", "Frame"],
    "Frame": ["Cmd"],
    "Cmd": [
        "State", "Comment", "Cmd", "Addr", "Adp", "Ado", "DataLength", "Cnt", "InputOffs",
        "OutputOffs",
    ],
    "ProcessImage": ["Inputs", "Outputs"],
    "Inputs": ["ByteSize", "Variable"],
    "Outputs": ["ByteSize", "Variable"],
    "Variable": ["Name", "DataType", "BitSize", "BitOffs"],
}  # fmt: skip
NUMBERS = {
    "PhysAddr", "AutoIncAddr", "VendorId", "ProductCode", "RevisionNo", "SerialNo", "BitStart",
    "BitLength", "StartAddress", "ControlByte", "Enable", "Pdo", "SubIndex", "BitLen", "Start",
    "Length", "PollTime", "Adp", "Ado", "Addr", "Timeout", "Ccs", "Cnt", "Retries", "CycleTime",
    "DataLength", "InputOffs", "OutputOffs", "ByteSize", "BitSize", "BitOffs",
}  # fmt: skip


def check_schema(element: Element) -> None:
    wanted = ORDER.get(element.tag)
    tags = [child.tag for child in element if isinstance(child.tag, str)]
    if wanted is not None and tags:
        assert set(tags) <= set(wanted), element.tag
        places = [wanted.index(tag) for tag in tags]
        assert places == sorted(places), (element.tag, tags)
    if element.tag in NUMBERS and not tags:
        assert int(element.text or "") >= 0, element.tag
    if element.tag == "Data":
        bytes.fromhex(element.text or "")
    for each in element:
        check_schema(each)


@pytest.mark.parametrize("family", FAMILIES)
def test_elements_and_their_order_are_those_of_etg_2100(family: str) -> None:
    root = fromstring(eni([with_esi(family)]))
    check_schema(root)
    assert [e.tag for e in root.findall("Config/*")] == [
        "Master",
        "Slave",
        "Cyclic",
        "ProcessImage",
    ]


def test_mailboxes_come_from_the_esi_file_and_process_data_lie_in_the_frame() -> None:
    data = (MAKERS / "maker_a.xml").read_bytes()
    profile = profile_of("maker_a.xml")
    found = controller_of(data, "maker_a.xml", 0x0B95, 0xA001, None)
    assert (found.assign_activate, found.shift_ns) == (0x0300, 250_000)
    axis = replace(
        hand_over(set_of_device(profile, tuned_device(profile)), profile), controller=found
    )
    root = fromstring(eni([axis]))
    assert root.findtext(".//Mailbox/Send/Start") == str(0x1000)
    assert root.findtext(".//DC/ShiftTime") == "250000"
    # 16 bytes of header, a clock datagram of 10 + 8 + 2, a datagram header of 10.
    assert root.findtext(".//ProcessData/Send/BitStart") == str(8 * (16 + 20 + 10))
    # Padding counts: 2 + 1 + 1 + 4 + 4 bytes.
    assert root.findtext(".//ProcessData/Send/BitLength") == "96"
    manager = next(
        c
        for c in root.iterfind(".//InitCmd")
        if (c.findtext("Comment") or "").startswith("set sm 2")
    )
    assert manager.findtext("Data") == struct.pack("<HHBBBB", 0x1200, 12, 0x64, 0, 1, 0).hex()


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"no xml",
        b"<EtherCATConfig/>",
        b"<EtherCATInfo/>",
        b'<!DOCTYPE a [<!ENTITY b "c">]><EtherCATInfo>&b;</EtherCATInfo>',
        (MAKERS / "maker_a.xml").read_bytes()[:3000],
        (MAKERS / "maker_a.xml").read_bytes().replace(b"#x1000", b"#x0010"),
        (MAKERS / "maker_a.xml").read_bytes().replace(b'DefaultSize="256"', b'DefaultSize="1"'),
    ],
)
def test_a_file_that_is_no_esi_gets_one_error(data: bytes) -> None:
    with pytest.raises(BadSet, match=r"e\.xml") as refused:
        controller_of(data, "e.xml", 0x0B95, 0xA001, None)
    assert refused.value.remedy


def test_an_esi_file_of_another_drive_is_refused() -> None:
    data = (MAKERS / "maker_a.xml").read_bytes()
    with pytest.raises(NotAllowed, match="no device"):
        controller_of(data, "e.xml", 1, 2, None)
    with pytest.raises(NotAllowed, match="no mailboxes"):
        controller_of(data, "e.xml", 0x0B95, 0xA000, None)
