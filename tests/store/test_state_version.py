"""The state folder: what 0.1.0 kept is migrated, what a newer servodeck wrote is refused."""

from __future__ import annotations

import json
import sqlite3
from pathlib import Path

import pytest
from alembic import command
from sqlalchemy import create_engine
from typer.testing import CliRunner

import backend
from backend.axes.restore.identity import DriveIdentity
from backend.axes.restore.store import RestoreStore
from backend.cli import app
from backend.foundation.store import migrate, state_version
from backend.foundation.store.blobs import Blobs
from backend.foundation.store.database import Store
from backend.foundation.store.state_version import FILE, VERSION, StateRefused
from backend.foundation.work.journal import Journal
from backend.records.library import Library
from backend.records.library.backup.backup import make_backup
from backend.records.library.backup.restore import restore
from backend.records.library.entries import Addition, Query
from backend.station.drives.drive_list import DriveList
from backend.station.records import Records
from drivers.errors import Busy

#: As 0.1.0 wrote it: a list of drives, a restore list by the server's name of the drive, a record
#: of an axis without scales, a parameter set as a file, and a database before there were accounts.
BENCH = {
    "version": 1,
    "drives": [
        {
            "name": "X axis",
            "notes": "left",
            "profile": "MMS7",
            "ports": [{"url": "ethercat:eth1", "station": 1}],
            "serial": 7,
        }
    ],
}
PENDING = {
    "serial": 7,
    "in_motion": False,
    "debts": [{"key": "2005:03", "raw": 400, "left": [900], "unapplied": False}],
}
DRIVE = DriveIdentity(0x1, 0x2, 7, (("ethercat:eth1", 1),))


@pytest.fixture
def first(tmp_path: Path) -> Path:
    """A small state folder of 0.1.0."""
    folder = tmp_path / "state"
    for name, text in {
        "bench.json": json.dumps(BENCH),
        "owed/x-axis.json": json.dumps(PENDING),
        "axes/x-axis.json": json.dumps({"mechanics": None, "watch": ["2005:03"]}),
        "sets/hand.sdset": "by hand",
    }.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    engine = create_engine(f"sqlite:///{folder / 'servodeck.db'}")
    with engine.begin() as connection:
        config = migrate._config()
        config.attributes["connection"] = connection
        for revision in ("library_0001", "audit_0001"):
            command.upgrade(config, revision)
    engine.dispose()
    return folder


def contents(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def claimed(folder: Path) -> Records:
    records = Records(folder, Journal())
    records.claim()
    return records


def test_the_state_of_0_1_0_is_migrated_with_everything_in_it(first: Path) -> None:
    before = contents(first)
    records = claimed(first)
    try:
        assert state_version.read(first) == state_version.StateVersion(
            VERSION, backend.__version__, migrate.known_revisions()
        )
        assert {name: contents(first)[name] for name in before} == before
        drives, problems = DriveList(first / "bench.json").load()
        assert ([drive.name for drive in drives], problems) == (["X axis"], [])
        pending = RestoreStore(first, "a test").list_of(DRIVE, "x-axis").pending
        assert [(value.key, value.raw) for value in pending.values] == [("2005:03", 400)]
        with records.store.writing():
            pass
        library = Library(records.store, Blobs(str(first / "blobs")))
        library.add("set", "hand.sdset", b"by hand", Addition())
        assert len(library.search(Query())[0]) == 1
        with sqlite3.connect(first / "servodeck.db") as database:
            heads = {row[0] for row in database.execute("SELECT version_num FROM alembic_version")}
        assert heads == set(migrate.script().get_heads())
    finally:
        records.store.close()
        records.release()
    assert state_version.bring_up_to_date(first) is False


def test_a_fresh_folder_is_of_this_version_and_says_so_once(tmp_path: Path) -> None:
    claimed(tmp_path / "new").release()
    assert state_version.read(tmp_path / "new") is not None
    noted = (tmp_path / "new" / FILE).stat().st_mtime_ns
    claimed(tmp_path / "new").release()
    assert (tmp_path / "new" / FILE).stat().st_mtime_ns == noted


def test_a_step_that_was_interrupted_is_done_again(
    first: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done: list[int] = []

    def third(folder: Path) -> None:
        done.append(1)
        if len(done) == 1:
            raise KeyboardInterrupt

    monkeypatch.setattr(state_version, "VERSION", 3)
    monkeypatch.setattr(state_version, "_STEPS", {1: lambda folder: None, 2: third})
    with pytest.raises(KeyboardInterrupt):
        state_version.bring_up_to_date(first)
    interrupted = state_version.read(first)
    assert interrupted is not None
    assert interrupted.version == 2
    assert state_version.bring_up_to_date(first)
    assert len(done) == 2


def newer(folder: Path, **changed: object) -> None:
    """Let the folder be that of a servodeck 9.0."""
    content = {
        "format": "servodeck state",
        "version": VERSION,
        "program": "9.0",
        "revisions": sorted(migrate.known_revisions()),
    }
    (folder / FILE).write_text(json.dumps(content | changed))


NEWER = [{"version": VERSION + 1}, {"revisions": ["library_0001", "spindle_0007"]}]


@pytest.mark.parametrize("changed", NEWER)
@pytest.mark.parametrize(
    "arguments",
    [
        ["serve", "--port", "0"],
        ["demo", "--port", "0"],
        ["people", "list"],
        ["backup", "kept.zip"],
        ["audit", "verify"],
    ],
    ids=lambda each: each[0],
)
def test_every_command_refuses_the_state_of_a_newer_one_and_writes_nothing(
    first: Path, changed: dict[str, object], arguments: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    newer(first, **changed)
    monkeypatch.chdir(first.parent)
    before = contents(first.parent)
    result = CliRunner().invoke(app, [*arguments, "--config", str(first)])
    assert result.exit_code == 1
    said = result.stderr.replace("\n", " ")
    assert "servodeck 9.0 has written the state" in said
    assert "install servodeck 9.0 or newer; or restore a backup" in said
    assert contents(first.parent) == before


def test_a_damaged_note_is_refused_too(first: Path) -> None:
    (first / FILE).write_text('{"format": "servodeck state", "version": ')
    before = contents(first)
    with pytest.raises(StateRefused) as refused:
        claimed(first)
    assert refused.value.code == "store.state-version-unreadable"
    assert contents(first) == before


def test_the_backup_of_the_older_one_takes_the_place_of_the_newer_state(
    first: Path, tmp_path: Path
) -> None:
    archive = tmp_path / "old.zip"
    store = Store(first)
    make_backup(store, archive)
    store.close()
    newer(first, version=VERSION + 1)
    result = CliRunner().invoke(app, ["restore", str(archive), "--replace", "--config", str(first)])
    assert result.exit_code == 0, result.output
    claimed(first).release()
    assert json.loads((first / FILE).read_text())["program"] == backend.__version__


def test_the_backup_of_a_newer_one_is_refused(first: Path, tmp_path: Path) -> None:
    newer(first, version=VERSION + 1)
    store = Store(first)
    make_backup(store, tmp_path / "new.zip")
    store.close()
    with pytest.raises(StateRefused, match=r"servodeck 9\.0 has written"):
        restore(tmp_path / "new.zip", tmp_path / "target")
    assert not (tmp_path / "target").exists()


def test_a_folder_in_use_is_not_migrated(first: Path) -> None:
    other = Records(first, Journal())
    assert other._lock.take()
    try:
        with pytest.raises(Busy):
            claimed(first)
        assert not (first / FILE).exists()
    finally:
        other.release()


def test_names_of_files_are_those_of_the_revisions() -> None:
    assert migrate.known_revisions() == {
        each.revision for each in migrate.script().walk_revisions()
    }
