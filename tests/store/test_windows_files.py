"""Backup, restore and the list of values to restore under Windows' rules for open files."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from backend.axes.restore import store as restore_store
from backend.foundation.store.files import StorageFailed, write_atomically
from backend.records.library.backup import restore as restoring
from backend.records.library.backup.backup import BackupFailed, make_backup
from backend.records.library.backup.restore import restore
from profiles.replacing import move_into_place
from tests.store.test_backup import Station, reopened
from tests.support.windows_files import ignore_case, keep_rules


@pytest.fixture
def windows(monkeypatch: pytest.MonkeyPatch) -> None:
    keep_rules(monkeypatch)
    monkeypatch.setattr(restoring, "FOLDERS_MOVE_WHILE_OPEN", False)


@pytest.fixture
def station(tmp_path: Path) -> Iterator[Station]:
    made = Station(tmp_path / "old")
    made.fill()
    yield made
    made.store.close()


def test_the_rules_are_kept(windows: None, tmp_path: Path) -> None:
    """Else the tests below would show nothing."""
    folder = tmp_path / "folder"
    folder.mkdir()
    with (folder / "file").open("wb"):
        for refused in (
            lambda: folder.rename(tmp_path / "other"),
            (folder / "file").unlink,
            lambda: (folder / "file").replace(folder / "name"),
        ):
            with pytest.raises(PermissionError):
                refused()
    with (folder / "file").open("rb") as file, pytest.raises(OSError, match="Bad file"):
        os.fsync(file.fileno())
    folder.rename(tmp_path / "other")


def test_a_station_is_saved_and_put_back(windows: None, station: Station, tmp_path: Path) -> None:
    make_backup(station.store, tmp_path / "b.zip")
    assert restore(tmp_path / "b.zip", tmp_path / "new").aside is None
    for again in reopened(tmp_path / "new"):
        again.check()
    replaced = restore(tmp_path / "b.zip", tmp_path / "new", replace=True)
    assert replaced.aside is not None
    assert (replaced.aside / "bench.json").exists()
    for again in reopened(tmp_path / "new"):
        again.check()


def test_two_files_that_the_disk_takes_for_one_are_named_and_nothing_is_lost(
    station: Station, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From a station on Linux that an older servodeck ran, to a laptop."""
    scope = station.store.folder / "scope/setups"
    scope.mkdir(parents=True)
    for name in ("Speed.json", "speed.json"):
        (scope / name).write_text("{}")
    make_backup(station.store, tmp_path / "b.zip")
    (tmp_path / "new").mkdir()
    with monkeypatch.context() as inside:
        ignore_case(inside)
        with pytest.raises(
            BackupFailed, match=r"takes \S*[Ss]peed.json and [Ss]peed.json"
        ) as caught:
            restore(tmp_path / "b.zip", tmp_path / "new")
    assert "nothing was changed" in str(caught.value)
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["servodeck.lock"]
    restore(tmp_path / "b.zip", tmp_path / "new")
    assert len(list((tmp_path / "new/scope/setups").iterdir())) == 2


def test_a_folder_that_a_program_has_open_is_left_as_it_was(
    windows: None, station: Station, tmp_path: Path
) -> None:
    make_backup(station.store, tmp_path / "b.zip")
    restore(tmp_path / "b.zip", tmp_path / "new")
    held = tmp_path / "new" / "bench.json"
    with held.open("rb"), pytest.raises(StorageFailed, match="could not be restored"):
        restore(tmp_path / "b.zip", tmp_path / "new", replace=True)
    assert held.read_text() == '{"drives": []}'
    assert [path.name for path in tmp_path.iterdir() if ".before-" in path.name] == []


def test_the_list_of_values_to_restore_reaches_the_disk(
    windows: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flushed: list[str] = []
    strict = os.fsync

    def noted(descriptor: int) -> None:
        strict(descriptor)
        flushed.append(str(Path(f"/proc/self/fd/{descriptor}").readlink()))

    monkeypatch.setattr(os, "fsync", noted)
    monkeypatch.setattr(restore_store, "FLUSH_S", 60.0)
    file = tmp_path / "pending.json"
    file.write_text("{}")
    restore_store._flush(file)
    assert flushed == [str(file)]


def test_a_file_that_a_scanner_holds_for_a_moment_is_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = tmp_path / "bench.json"
    target.write_text("old")
    attempts: list[int] = []
    replace = os.replace

    def held(source: str, goal: str) -> None:
        attempts.append(1)
        if len(attempts) < 4:
            raise PermissionError(13, "The process cannot access the file", str(goal))
        replace(source, goal)

    monkeypatch.setattr(os, "replace", held)
    write_atomically(target, b"new")
    assert target.read_text() == "new"
    assert len(attempts) == 4


def test_a_file_that_stays_open_elsewhere_is_a_clear_error_and_unharmed(
    windows: None, tmp_path: Path
) -> None:
    target = tmp_path / "bench.json"
    target.write_text("old")
    with target.open("rb"), pytest.raises(StorageFailed) as caught:
        write_atomically(target, b"new")
    assert caught.value.code == "store.held-open"
    assert "OneDrive" in (caught.value.remedy or "")
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_a_folder_without_permission_is_an_error_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The caller can be the event loop of a server: it must not wait where that changes nothing."""
    attempts: list[str] = []

    def refused(source: str, goal: str) -> None:
        attempts.append(goal)
        raise PermissionError(13, "Permission denied", str(goal))

    monkeypatch.setattr(os, "replace", refused)
    monkeypatch.setattr(os, "access", lambda _path, _mode: False)
    with pytest.raises(PermissionError):
        move_into_place(tmp_path / "new", tmp_path / "bench.json")
    assert len(attempts) == 1
