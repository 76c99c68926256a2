"""Imports run in a process of their own, which never outlives whoever asked."""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path
from typing import Any

import pytest
from importer_samples import GOOD_EDS, GOOD_ESI

from backend.axes.parameters.set_file import BadSet
from backend.records.handover.esi import controller_of, reported_controllers
from backend.station.drives.description import BadDescription, Work, import_in_process
from drivers.errors import NotAllowed
from profiles.importer.esi.controller import ControllersTask
from profiles.importer.process import DevicesTask, FileTask
from profiles.loader import ProfileError, broken_profiles, load_all, load_profile


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("SERVODECK_PROFILES", str(tmp_path / "mine"))
    monkeypatch.setenv("SERVODECK_CACHE", str(tmp_path / "cache"))
    return tmp_path / "mine"


def run(task: Work, limit_s: float = 60.0, limit_mib: int = 768) -> dict[str, Any]:
    return asyncio.run(import_in_process(task, limit_s, limit_mib))


def greedy(elements: int = 400_000) -> bytes:
    """An ESI file of 3.6 MB whose elements take more than 150 MiB."""
    device = b"".join(
        [
            b'<Type ProductCode="#x1" RevisionNo="#x1">A</Type>',
            b'<a b=""/>' * elements,
        ]
    )
    return (
        b"<EtherCATInfo><Vendor><Id>1</Id></Vendor><Descriptions><Devices><Device>"
        + device
        + b"</Device></Devices></Descriptions></EtherCATInfo>"
    )


MAILBOXES = (
    b'<EtherCATInfo><Vendor><Id>#x0B95</Id></Vendor><Descriptions><Devices><Device Physics="YY">'
    b'<Type ProductCode="#xA001" RevisionNo="#x2">A</Type>'
    b'<Sm StartAddress="#x1000" ControlByte="#x26" DefaultSize="256">MBoxOut</Sm>'
    b'<Sm StartAddress="#x1400" ControlByte="#x22" DefaultSize="256">MBoxIn</Sm>'
    b"<Dc><OpMode><Name>DC</Name><AssignActivate>#x0330</AssignActivate>"
    b"<ShiftTimeSync0>250000</ShiftTimeSync0></OpMode></Dc>"
    b"</Device></Devices></Descriptions></EtherCATInfo>"
)
DRIVE = (0x0B95, 0xA001, 2)


def test_a_file_becomes_a_profile(folder: Path) -> None:
    made = run(FileTask(GOOD_EDS.encode(), "good.eds", folder, "good"))
    assert made["profile"] == "good"
    assert made["product_code"] == 0x190
    assert load_profile("good").by_key["2010:00"].max_raw == 2000
    with pytest.raises(BadDescription, match="already"):
        run(FileTask(GOOD_EDS.encode(), "good.eds", folder, "good"))


def test_no_import_hides_a_family_that_servodeck_brings(folder: Path) -> None:
    with pytest.raises(BadDescription, match="'mms7' already"):
        run(FileTask(GOOD_EDS.encode(), "good.eds", folder, "mms7"))
    assert not folder.exists()


def test_devices_of_a_series(folder: Path) -> None:
    reported = run(DevicesTask(GOOD_ESI.encode(), "good.xml"))
    assert 0x191 in {device["product_code"] for device in reported["devices"]}
    assert run(DevicesTask(GOOD_EDS.encode(), "a.eds")) == {"devices": []}


def test_an_import_that_takes_too_long_is_ended(folder: Path) -> None:
    with pytest.raises(BadDescription, match=r"ended after 0\.001 s"):
        run(FileTask(GOOD_EDS.encode(), "a.eds", folder, "slow"), 0.001)
    assert not folder.exists()


def test_a_cancelled_import_leaves_nothing(folder: Path) -> None:
    async def cancelled() -> None:
        started = import_in_process(FileTask(GOOD_EDS.encode(), "a.eds", folder, "gone"))
        task = asyncio.ensure_future(started)
        await asyncio.sleep(0.05)  # an interpreter alone takes longer to start
        task.cancel()
        await task

    with pytest.raises(asyncio.CancelledError):
        asyncio.run(cancelled())
    assert not folder.exists()


def test_edits_count_at_once_and_slips_spoil_one_profile_only(folder: Path) -> None:
    made = run(FileTask(GOOD_EDS.encode(), "good.eds", folder, "good"))
    path = Path(str(made["path"]))
    text = path.read_text("utf-8")
    path.write_text(text.replace("Servo 400", "Servo 401"), "utf-8")
    assert load_profile("good").identity.model == "Servo 401"
    path.write_text(text.replace("parameters:", "parametres:"), "utf-8")
    with pytest.raises(ProfileError, match="parametres"):
        load_profile("good")
    assert list(broken_profiles()) == ["good"]
    known = load_all()
    assert "mms7" in known
    assert "good" not in known


@pytest.mark.long(keep=1)
@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no limit of a process' memory")
@pytest.mark.parametrize(
    "task",
    [DevicesTask(greedy(), "greedy.xml"), ControllersTask(((greedy(), "greedy.xml"),), (DRIVE,))],
    ids=["devices", "controllers"],
)
def test_a_file_that_takes_more_memory_than_it_may_is_refused(task: Work) -> None:
    with pytest.raises(BadDescription, match="more than the 128 MiB of memory"):
        run(task, limit_mib=128)


def test_controllers_come_out_of_the_process_as_they_went_in() -> None:
    other = MAILBOXES.replace(b"#xA001", b"#xA002")
    sources = ((other, "b.xml"), (MAILBOXES, "a.xml"))
    found = reported_controllers(run(ControllersTask(sources, (DRIVE, (0x0B95, 0xA002, None)))))
    assert found == (
        controller_of(MAILBOXES, "a.xml", *DRIVE),
        controller_of(other, "b.xml", 0x0B95, 0xA002, None),
    )
    assert [(each.assign_activate, each.shift_ns) for each in found] == [(0x330, 250_000)] * 2


@pytest.mark.long
def test_refusals_of_the_process_are_those_of_the_reader() -> None:
    def refused(data: bytes, product: int) -> tuple[NotAllowed, NotAllowed]:
        with pytest.raises(NotAllowed) as here:
            controller_of(data, "a.xml", 0x0B95, product, None)
        task = ControllersTask(((data, "a.xml"),), ((0x0B95, product, None),))
        with pytest.raises(NotAllowed) as there:
            reported_controllers(run(task))
        return here.value, there.value

    for data, product, kind in ((MAILBOXES, 0xA009, NotAllowed), (b"<a/>", 0xA001, BadSet)):
        here, there = refused(data, product)
        assert type(here) is type(there) is kind
        assert (here.message, here.remedy) == (there.message, there.remedy)
