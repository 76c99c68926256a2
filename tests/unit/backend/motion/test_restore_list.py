"""Restore lists on the disk: found again by the drive's identity, whoever asks."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from backend.axes.drive.notes.pending_restore import PendingRestore
from backend.axes.restore import store as store_module
from backend.axes.restore.identity import DriveIdentity, identity_of
from backend.axes.restore.process import lives, this_process
from backend.axes.restore.store import RestoreStore
from backend.commands.base import restoring
from backend.commands.base.state import STATE_FOLDER_VARIABLE, state_folder
from backend.station.drives.connected_drive import ConnectedDrive
from drivers.errors import Busy, NotAllowed
from tests.support.servo import Servo

TORQUE = "6072:00"
HERE = DriveIdentity(0x748, 7, 1234, (("ethercat://eth0", 1),))
VALUES = (
    PendingRestore(TORQUE, 3000, frozenset({800})),
    PendingRestore("6060:00", 8, frozenset({9, 10})),
)


@pytest.mark.parametrize(
    ("other", "same"),
    [
        (replace(HERE, places=(("ethercat://eth1", 3),)), True),
        (replace(HERE, serial=None), True),
        (replace(HERE, vendor_id=None, product_code=None, serial=None), True),
        (replace(HERE, serial=None, places=(("ethercat://eth1", 1),)), False),
        (replace(HERE, serial=1235), False),
        (replace(HERE, product_code=8), False),
        (DriveIdentity(None, None, None, ()), False),
    ],
)
def test_the_same_drive_is_found_by_its_number_or_its_place(
    other: DriveIdentity, same: bool, tmp_path: Path
) -> None:
    RestoreStore(tmp_path, "a command").list_of(HERE, "x").write(VALUES, in_motion=True)
    pending = RestoreStore(tmp_path, "a server").list_of(other, "y").pending
    here = other.places == HERE.places
    values = {replace(v, left=v.left if here else frozenset()) for v in VALUES}
    assert set(pending.values) == (values if same else set())
    assert pending.moved is same


def test_two_axes_with_one_serial_number_do_not_restore_each_others_values(tmp_path: Path) -> None:
    """Some makers give all drives one number: the values of station 1 are only offered at 2."""
    lists = RestoreStore(tmp_path, "a server")
    lists.list_of(HERE, "x").write(VALUES, in_motion=False)
    second = lists.list_of(replace(HERE, places=(("ethercat://eth0", 2),)), "y")
    assert [v.left for v in second.pending.values] == [frozenset(), frozenset()]
    assert lists.list_of(HERE, "x").pending.values == VALUES


@pytest.mark.parametrize(
    "content", [b"", b"\0" * 200, b'{"values": [', b'{"values": [{"key": 1}]}']
)
def test_a_damaged_list_is_reported_at_every_start_and_replaced_by_none(
    tmp_path: Path, content: bytes
) -> None:
    """As after a power failure: what it held is not known, and that is said."""
    lists = RestoreStore(tmp_path, "a server")
    lists.list_of(HERE, "x").write(VALUES, in_motion=True)
    (file,) = (tmp_path / "restore").iterdir()
    file.write_bytes(content)
    for earlier in ((), VALUES[:1]):
        known = lists.list_of(HERE, "x")
        (aside,) = known.pending.unreadable
        assert known.pending.values == earlier
        known.write(VALUES[:1], in_motion=False)
        assert aside.read_bytes() == content
        assert lists.list_of(HERE, "x").pending.values == VALUES[:1]
        assert (
            lists.list_of(replace(HERE, places=(("ethercat://eth0", 2),)), "y").pending.unreadable
            == ()
        )
    aside.unlink()
    assert lists.list_of(HERE, "x").pending.unreadable == ()


def test_two_drives_of_one_place_keep_apart_lists(tmp_path: Path) -> None:
    """The drive was swapped: what was changed from the one is no matter of the other."""
    other = replace(HERE, serial=1235)
    lists = RestoreStore(tmp_path, "a server")
    lists.list_of(HERE, "x").write(VALUES, in_motion=False)
    lists.list_of(other, "x").write(VALUES[:1], in_motion=False)
    assert lists.list_of(HERE, "x").pending.values == VALUES
    assert lists.list_of(other, "x").pending.values == VALUES[:1]


def test_a_list_goes_with_its_last_value_and_takes_older_ones_along(tmp_path: Path) -> None:
    lists = RestoreStore(tmp_path, "a server")
    elsewhere = replace(HERE, places=(("ethercat://eth1", 3),))
    lists.list_of(HERE, "x").write(VALUES, in_motion=False)
    known = lists.list_of(elsewhere, "x")
    known.write(VALUES[:1], in_motion=False)
    assert [file.name[:13] for file in (tmp_path / "restore").iterdir()] == ["ethercat-eth1"]
    known.write((), in_motion=False)
    assert not list((tmp_path / "restore").iterdir())


def test_a_list_of_an_earlier_version_is_read_and_replaced(tmp_path: Path) -> None:
    earlier = tmp_path / "owed" / "mms7-1.json"
    earlier.parent.mkdir()
    earlier.write_text(
        '{"serial": 1234, "debts": [{"key": "6072:00", "raw": 3000, "left": [800],'
        ' "unapplied": false}], "in_motion": false}'
    )
    lists = RestoreStore(tmp_path, "a server")
    assert not lists.list_of(replace(HERE, serial=99), "mms7-1").pending.values
    known = lists.list_of(HERE, "mms7-1")
    assert known.pending.values == VALUES[:1]
    known.write((), in_motion=False)
    assert not earlier.exists()


def test_a_process_is_known_by_more_than_its_number() -> None:
    assert lives(this_process())
    child = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    number, start, boot = this_process().split()
    assert int(number) == os.getpid()
    assert not lives(f"{child.pid} {start} {boot}"), "another one with this number"
    assert not lives(f"{number} {start} another-boot")
    child.communicate()
    assert not lives(f"{child.pid} {start} {boot}")
    assert not lives("")


def test_another_process_that_moves_the_drive_is_left_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lists = RestoreStore(tmp_path, "`servodeck sweep`")
    with monkeypatch.context() as other:
        other.setattr(store_module, "this_process", lambda: "the other one")
        lists.list_of(HERE, "x").write(VALUES, in_motion=True)
    monkeypatch.setattr(store_module, "lives", lambda mark: mark == "the other one")
    known = lists.list_of(HERE, "x")
    assert known.pending.held_by == "`servodeck sweep`"
    assert not known.pending.values
    known.write(VALUES[:1], in_motion=True)
    known.write((), in_motion=False)
    assert len(list((tmp_path / "restore").iterdir())) == 1, "the other one's list stays"


def test_the_disk_is_waited_for_before_a_value_changes_but_not_for_long(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flushed: list[int] = []
    monkeypatch.setattr(os, "fsync", flushed.append)
    known = RestoreStore(tmp_path, "a command").list_of(HERE, "x")
    known.write(VALUES, in_motion=True)
    assert not flushed
    known.write(VALUES, in_motion=True, durable=True)
    assert len(flushed) == 2, "the file and its name"
    monkeypatch.setattr(os, "fsync", lambda _handle: time.sleep(0.5))
    began = time.monotonic()
    known.write(VALUES, in_motion=True, durable=True)
    assert time.monotonic() - began < 0.4


async def test_the_list_is_on_the_disk_before_the_first_write(
    x: ConnectedDrive, servo: Servo, tmp_path: Path
) -> None:
    seen: list[int] = []
    servo.set((0x6072, 0), 3000)
    async with x.axis.restoring(TORQUE):
        pending = RestoreStore(tmp_path, "a command").list_of(identity_of(x.drive), "x").pending
        seen = [int(value.raw) for value in pending.values]
        await x.drive.write(TORQUE, 800)
    assert seen == [3000]
    assert not list((tmp_path / "restore").iterdir())


# --- commands -------------------------------------------------------------------------------


@pytest.fixture
def left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, x: ConnectedDrive, servo: Servo) -> Path:
    """A folder in which a command that was killed has left a torque limit of 80 %, was 300 %."""
    folder = tmp_path / "of the commands"
    monkeypatch.setenv(STATE_FOLDER_VARIABLE, str(folder))
    known = RestoreStore(folder, "`servodeck sweep`").list_of(identity_of(x.drive), "x")
    known.write(VALUES[:1], in_motion=True)
    servo.set((0x6072, 0), 800)
    return folder


async def test_a_command_says_what_is_pending_and_stores_nothing_of_it(
    x: ConnectedDrive, left: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    restoring.recall(x.drive, "ethercat://eth0", 1)
    reported = capsys.readouterr().err
    assert "`servodeck sweep` was cut off" in reported
    assert f"{TORQUE} (was 3000)" in reported
    assert "servodeck params restore ethercat://eth0 --station 1" in reported
    with pytest.raises(NotAllowed, match=f"would be saved: {TORQUE} .was 3000"):
        restoring.require_own_values(x.drive)
    assert list((left / "restore").iterdir())


async def test_a_motion_of_a_command_begins_with_the_drives_own_values(
    x: ConnectedDrive, servo: Servo, left: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pending = restoring.recall(x.drive, "ethercat://eth0", 1)
    await restoring.restore_first(x.axis, pending)
    assert servo.number((0x6072, 0)) == 3000
    assert servo.words() == [2], "what was moving a moment ago is stopped first"
    assert f"restored: {TORQUE} = 3000" in capsys.readouterr().err
    assert not list((left / "restore").iterdir())
    restoring.require_own_values(x.drive)


async def test_a_value_that_somebody_changed_since_is_offered_not_restored(
    x: ConnectedDrive, servo: Servo, left: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    servo.set((0x6072, 0), 1234)
    await restoring.restore_first(x.axis, restoring.recall(x.drive, "ethercat://eth0", 1))
    assert servo.number((0x6072, 0)) == 1234
    assert f"not restored: {TORQUE}" in capsys.readouterr().err
    assert list((left / "restore").iterdir()), "still on offer"


async def test_no_motion_begins_while_another_process_moves_the_drive(
    x: ConnectedDrive, left: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(store_module, "this_process", lambda: "this one")
    monkeypatch.setattr(store_module, "lives", lambda _mark: True)
    with pytest.raises(Busy, match="`servodeck sweep` moves it now"):
        await restoring.restore_first(x.axis, restoring.recall(x.drive, "ethercat://eth0", 1))
    assert list((left / "restore").iterdir())


def test_commands_and_server_share_the_folder_that_the_environment_names(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv(STATE_FOLDER_VARIABLE, "/some/where")
    assert state_folder(None) == Path("/some/where")
    assert state_folder(Path("/else")) == Path("/else")
