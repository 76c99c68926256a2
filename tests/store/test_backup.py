"""Backup and restore: whole or not at all, from one kind of database to the other."""

from __future__ import annotations

import json
import os
import sqlite3
import stat
import threading
import warnings
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner

from backend.cli import app
from backend.foundation.store.blobs import Blobs
from backend.foundation.store.database import Store
from backend.foundation.store.lock import FolderLock
from backend.records.audit import AuditLog, Fact
from backend.records.audit.trail import Trail
from backend.records.library import Library
from backend.records.library.backup.backup import BackupFailed, make_backup
from backend.records.library.backup.restore import restore
from backend.records.library.catalogue import INLINE
from backend.records.library.entries import Addition, AxisIdentity, Query
from drivers.errors import NotAllowed
from tests.support.postgres import Postgres

LARGE = b"l" * (INLINE + 1)


class Station:
    """A state folder with a library, an audit and files."""

    def __init__(self, folder: Path, database: str | None = None) -> None:
        self.store = Store(folder, database)
        self.library = Library(self.store, Blobs(str(folder / "blobs")))
        self.trail = Trail(self.store)

    def fill(self) -> None:
        axis = AxisIdentity("mms7", "X", serial=7)
        self.library.add("set", "x.sdset", b"one", Addition(axis))
        self.library.add("set", "x.sdset", b"two", Addition(axis, tags=("golden",)))
        self.library.add("recording", "r.sdrec", LARGE, Addition(axis))
        audit = AuditLog(self.store, "bench-1")
        for number in range(20):
            audit.add(Fact("write", "written", "X", "2005:03", number, number + 1, person="Anna"))
        audit.close()
        (self.store.folder / "sets").mkdir(exist_ok=True)
        (self.store.folder / "sets" / "hand.sdset").write_text("by hand")
        (self.store.folder / "bench.json").write_text('{"drives": []}')
        (self.store.folder / ".bench.json.tmp").write_text("being written")

    def check(self) -> None:
        entry = self.library.named("set", "x.sdset")
        assert entry is not None
        assert (entry.versions, entry.tags) == (2, ("golden",))
        assert self.library.content(entry.id, 1) == b"one"
        large = self.library.named("recording", "r.sdrec")
        assert large is not None
        assert self.library.content(large.id) == LARGE
        verdict = self.trail.verify()
        assert (verdict.ok, verdict.entries) == (True, 20)
        assert (self.store.folder / "sets" / "hand.sdset").read_text() == "by hand"
        assert not (self.store.folder / ".bench.json.tmp").exists()


@pytest.fixture
def station(tmp_path: Path) -> Iterator[Station]:
    made = Station(tmp_path / "old")
    made.fill()
    yield made
    made.store.close()


def reopened(folder: Path, database: str | None = None) -> Iterator[Station]:
    made = Station(folder, database)
    try:
        yield made
    finally:
        made.store.close()


def test_round_trip_while_others_write(station: Station, tmp_path: Path) -> None:
    running = threading.Event()

    def write() -> None:
        number = 0
        while not running.is_set():
            number += 1
            station.library.add("report", f"{number}.html", os.urandom(2000), Addition())

    thread = threading.Thread(target=write)
    thread.start()
    try:
        make_backup(station.store, tmp_path / "b.zip")
    finally:
        running.set()
        thread.join()
    assert stat.S_IMODE((tmp_path / "b.zip").stat().st_mode) == 0o600
    done = restore(tmp_path / "b.zip", tmp_path / "new")
    assert done.aside is None
    for again in reopened(tmp_path / "new"):
        again.check()
        for entry in again.library.search(Query(kinds=("report",)))[0]:
            again.library.content(entry.id)
    assert [p.name for p in tmp_path.iterdir() if p.name.startswith(".")] == []


@pytest.mark.parametrize("kind", ["sqlite to postgresql", "postgresql to sqlite"])
def test_from_one_kind_of_database_to_the_other(
    kind: str, tmp_path: Path, postgres: Postgres
) -> None:
    url = postgres.new_database()
    source, target = (None, url) if kind.startswith("sqlite") else (url, None)
    for old in reopened(tmp_path / "old", source):
        old.fill()
        make_backup(old.store, tmp_path / "b.zip")
    into = target or f"sqlite:///{tmp_path / 'other.db'}"
    assert restore(tmp_path / "b.zip", tmp_path / "new", database=into).copied_rows > 20
    for again in reopened(tmp_path / "new", into):
        again.check()
        # PostgreSQL's counters go on behind the rows that were copied.
        again.library.add("set", "later.sdset", b"three", Addition())
        assert again.library.search(Query())[1] == 3
        with pytest.raises(NotAllowed, match="has a library or an audit already"):
            restore(tmp_path / "b.zip", tmp_path / "third", database=into)
    assert not (tmp_path / "third").exists()


def rewrite(archive: Path, change: dict[str, bytes | None], **manifest: object) -> None:
    """Change parts (None leaves them out) and fields of the manifest, as damage would."""
    with zipfile.ZipFile(archive) as old:
        parts = {info.filename: old.read(info) for info in old.infolist()}
    content = json.loads(parts["manifest.json"])
    content.update(manifest)
    parts["manifest.json"] = json.dumps(content).encode()
    parts.update({name: data for name, data in change.items() if data is not None})
    for name in [name for name, data in change.items() if data is None]:
        del parts[name]
    with warnings.catch_warnings(), zipfile.ZipFile(archive, "w") as new:
        warnings.simplefilter("ignore")
        for name, data in parts.items():
            new.writestr(name, data)


def listed(archive: Path, name: str, data: bytes) -> dict[str, object]:
    """The manifest's parts with one more, as somebody would forge it."""
    import hashlib

    with zipfile.ZipFile(archive) as file:
        parts = json.loads(file.read("manifest.json"))["parts"]
    return parts | {name: {"sha256": hashlib.sha256(data).hexdigest(), "bytes": len(data)}}


EVIL = (
    "state/../../evil", "../evil", "/etc/evil", "state//evil", "state/a\\..\\evil", "C:/evil",
    "state/./evil", "evil",
)  # fmt: skip


@pytest.mark.parametrize("name", EVIL)
def test_no_name_leads_out_of_the_folder(name: str, station: Station, tmp_path: Path) -> None:
    archive = tmp_path / "b.zip"
    make_backup(station.store, archive)
    rewrite(archive, {name: b"evil"}, parts=listed(archive, name, b"evil"))
    with pytest.raises(BackupFailed, match="no name that a backup contains"):
        restore(archive, tmp_path / "new")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["b.zip", "old"]


def test_a_link_in_the_archive_is_refused(station: Station, tmp_path: Path) -> None:
    archive = tmp_path / "b.zip"
    make_backup(station.store, archive)
    rewrite(archive, {}, parts=listed(archive, "state/link", b"/etc/passwd"))
    info = zipfile.ZipInfo("state/link")
    info.external_attr = (stat.S_IFLNK | 0o777) << 16
    with zipfile.ZipFile(archive, "a") as file:
        file.writestr(info, b"/etc/passwd")
    with pytest.raises(BackupFailed, match="no name that a backup contains"):
        restore(archive, tmp_path / "new")


def test_half_and_damaged_archives_are_refused(station: Station, tmp_path: Path) -> None:
    archive, good = tmp_path / "b.zip", tmp_path / "good.zip"
    make_backup(station.store, good)
    data = good.read_bytes()
    with zipfile.ZipFile(good) as file:
        middle = file.getinfo("station.db").header_offset + 500
    damages = {
        "half": data[: len(data) // 2],
        "empty": b"",
        "no zip": b"x" * 1000,
        "a flipped bit": data[:middle] + bytes([data[middle] ^ 1]) + data[middle + 1 :],
    }
    for what, contents in damages.items():
        archive.write_bytes(contents)
        with pytest.raises(BackupFailed):
            restore(archive, tmp_path / "new")
        assert not (tmp_path / "new").exists(), what
    changes: list[tuple[dict[str, bytes | None], dict[str, object]]] = [
        ({"state/bench.json": b"{}"}, {}),
        ({"state/bench.json": None}, {}),
        ({"state/more": b"1"}, {}),
        ({}, {"format": "something else"}),
        ({}, {"version": 2}),
        ({}, {"parts": {"station.db": {"sha256": "", "bytes": 10**15}}}),
    ]
    for change, manifest in changes:
        archive.write_bytes(data)
        rewrite(archive, change, **manifest)
        with pytest.raises(NotAllowed):
            restore(archive, tmp_path / "new")
        assert not (tmp_path / "new").exists(), change


def test_what_is_there_is_kept(station: Station, tmp_path: Path) -> None:
    make_backup(station.store, tmp_path / "b.zip")
    with pytest.raises(BackupFailed, match="exists already"):
        make_backup(station.store, tmp_path / "b.zip")
    new = tmp_path / "new"
    new.mkdir()
    (new / "precious").write_text("1")
    with pytest.raises(BackupFailed, match="not empty"):
        restore(tmp_path / "b.zip", new)
    lock = FolderLock(new)
    assert lock.take()
    with pytest.raises(BackupFailed, match="running servodeck"):
        restore(tmp_path / "b.zip", new, replace=True)
    lock.give()
    aside = restore(tmp_path / "b.zip", new, replace=True).aside
    assert aside is not None
    assert (aside / "precious").read_text() == "1"
    for again in reopened(new):
        again.check()


def test_a_broken_audit_is_not_backed_up_as_if_it_were_whole(
    station: Station, tmp_path: Path
) -> None:
    with sqlite3.connect(tmp_path / "old" / "servodeck.db") as database:
        database.execute("DROP TRIGGER audit_entry_no_delete")
        database.execute("DELETE FROM audit_entry WHERE number = 7")
    database.close()
    with pytest.raises(BackupFailed, match="broken at entry 7"):
        make_backup(station.store, tmp_path / "b.zip")
    assert not (tmp_path / "b.zip").exists()


def test_a_damaged_database_is_not_backed_up(station: Station, tmp_path: Path) -> None:
    station.store.close()
    file = tmp_path / "old" / "servodeck.db"
    data = bytearray(file.read_bytes())
    data[5 * 4096 : 9 * 4096] = b"\xff" * 4 * 4096
    file.write_bytes(data)
    with pytest.raises(NotAllowed, match=r"damaged|malformed"):
        make_backup(station.store, tmp_path / "b.zip")
    assert not (tmp_path / "b.zip").exists()


def test_commands(station: Station, tmp_path: Path) -> None:
    station.store.close()
    config = ["--config", str(tmp_path / "old")]
    archive = str(tmp_path / "b.zip")
    run = CliRunner().invoke
    found = run(app, ["audit", "verify", *config])
    assert "20 entries, the chain is whole" in found.output
    anchor = found.output.split("anchor: ")[1].strip()
    assert run(app, ["audit", "verify", "--anchor", anchor, *config]).exit_code == 0
    export = tmp_path / "a.jsonl"
    run(app, ["audit", "export", "--format", "jsonl", "--out", str(export), *config])
    assert run(app, ["audit", "verify", "--file", str(export), "--anchor", anchor]).exit_code == 0
    lines = export.read_text("utf-8").splitlines(keepends=True)
    export.write_text("".join([*lines[:4], lines[4].replace("Anna", "Bert"), *lines[5:]]))
    broken = run(app, ["audit", "verify", "--file", str(export)])
    assert broken.exit_code == 1
    assert "BROKEN at entry 5" in broken.output
    assert "golden" in run(app, ["library", "list", *config]).output
    one = run(app, ["library", "export", "x.sdset", "--version", "1", *config])
    assert one.stdout_bytes == b"one"
    assert run(app, ["backup", archive, *config]).exit_code == 0
    again = run(app, ["restore", archive, "--config", str(tmp_path / "new")])
    assert "audit of 20 entries is whole" in again.output
    missing = run(app, ["audit", "verify", "--config", str(tmp_path / "nothing")])
    assert missing.exit_code == 1
    assert "there is no database" in missing.output
