"""Names, versions, tags, search and contents; the same on SQLite and PostgreSQL."""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from sqlalchemy import text

from backend.foundation.store.blobs import BlobFailed, Blobs
from backend.foundation.store.database import Store
from backend.records.audit import Fact
from backend.records.library import Library, LibrarySets, NotInLibrary
from backend.records.library.catalogue import INLINE
from backend.records.library.entries import Addition, AxisIdentity, Query
from drivers.errors import NotAllowed

X = AxisIdentity("mms7", "X", vendor_id=0x4000_0001, serial=4_000_000_000, firmware="1.2")
Y = AxisIdentity("r6l", "Y", serial=12)


@pytest.fixture
def reported() -> list[Fact]:
    return []


@pytest.fixture
def library(store: Store, tmp_path: Path, reported: list[Fact]) -> Library:
    return Library(store, Blobs(str(tmp_path / "blobs")), reported.append)


def names(library: Library, **wanted: object) -> list[str]:
    return [entry.name for entry in library.search(Query(**wanted))[0]]


@pytest.mark.long(keep=1)
def test_every_save_is_a_version_that_stays(library: Library, reported: list[Fact]) -> None:
    first = library.add("set", "x.sdset", b"one", Addition(X, author="Anna"))
    second = library.add("set", "x.sdset", b"two", Addition(X, author="Bert", notes="stiffer"))
    assert (first.id, first.versions, second.versions) == (second.id, 1, 2)
    assert [v.number for v in library.versions(first.id)] == [2, 1]
    assert [v.author for v in library.versions(first.id)] == ["Bert", "Anna"]
    assert library.content(first.id) == b"two"
    assert library.content(first.id, 1) == b"one"
    assert second.latest.sha256 == hashlib.sha256(b"two").hexdigest()
    assert second.latest.axis == X
    assert [(f.action, f.target, f.detail["version"]) for f in reported] == [
        ("saved", "x.sdset", 1),
        ("saved", "x.sdset", 2),
    ]


def test_the_same_contents_make_no_version(library: Library) -> None:
    library.add("set", "x.sdset", b"one", Addition(X))
    assert library.add("set", "x.sdset", b"one", Addition(X)).versions == 1
    library.add("set", "x.sdset", b"two", Addition(X))
    assert library.add("set", "x.sdset", b"one", Addition(X)).versions == 3, "gone back"


def test_what_is_not_there_is_said(library: Library) -> None:
    entry = library.add("set", "x.sdset", b"one", Addition(X))
    with pytest.raises(NotInLibrary, match="no version 2"):
        library.content(entry.id, 2)
    with pytest.raises(NotInLibrary, match="no entry 99"):
        library.entry(99)


def test_search(library: Library) -> None:
    library.add("set", "Achse X.sdset", b"1", Addition(X, author="Änne", notes="weich"))
    library.add("set", "y_1.sdset", b"2", Addition(Y, tags=("golden",)))
    entry = library.add("report", "x report.html", b"3", Addition(X))
    library.annotate(entry.id, notes="after the 100% test", tags=(" machine  7 ", "golden"))
    assert names(library) == ["x report.html", "y_1.sdset", "Achse X.sdset"]
    assert names(library, words="ACHSE weich") == ["Achse X.sdset"]
    assert names(library, words="änne") == ["Achse X.sdset"]
    assert names(library, words="100%") == ["x report.html"]
    assert names(library, words="y_") == ["y_1.sdset"]
    assert names(library, words="4000000000", kinds=("set",)) == ["Achse X.sdset"]
    assert names(library, tag="golden") == ["x report.html", "y_1.sdset"]
    assert names(library, without="golden") == ["Achse X.sdset"]
    assert names(library, tag="machine 7") == ["x report.html"]
    assert names(library, axis="X", kinds=("set",)) == ["Achse X.sdset"]
    assert names(library, serial=12) == ["y_1.sdset"]
    assert names(library, profile="mms7", limit=1) == ["x report.html"]
    assert names(library, since=datetime.now(UTC) + timedelta(hours=1)) == []
    assert library.search(Query(limit=1, offset=1))[1] == 3
    assert library.tags() == {"golden": 2, "machine 7": 1}


def test_tags_have_limits(library: Library) -> None:
    entry = library.add("set", "x.sdset", b"1", Addition(X))
    for tags in (tuple(str(n) for n in range(21)), ("x" * 61,)):
        with pytest.raises(NotAllowed, match="tags"):
            library.annotate(entry.id, tags=tags)
    with pytest.raises(NotAllowed, match="notes"):
        library.annotate(entry.id, notes="x" * 4001)


def test_deleting_puts_aside_until_purged(library: Library) -> None:
    gone = library.add("set", "x.sdset", b"1", Addition(X))
    library.add("set", "y.sdset", b"1", Addition(Y))
    library.delete(gone.id)
    assert names(library) == ["y.sdset"]
    assert names(library, deleted=True) == ["x.sdset"]
    assert library.named("set", "x.sdset") is None
    assert library.undelete(gone.id).deleted is None
    library.delete(gone.id)
    again = library.add("set", "x.sdset", b"2", Addition(X))
    assert (again.id, again.versions) == (gone.id, 2), "its history came back"
    library.delete(gone.id)
    assert library.purge(datetime.now(UTC) - timedelta(days=1)) == []
    assert [e.name for e in library.purge(datetime.now(UTC) + timedelta(seconds=1))] == ["x.sdset"]
    with pytest.raises(NotInLibrary):
        library.entry(gone.id)
    assert library.content(library.search(Query())[0][0].id) == b"1", "shared contents stay"


def test_large_contents_are_blobs(library: Library, tmp_path: Path) -> None:
    data = bytes(range(256)) * (INLINE // 256 + 1)
    entry = library.add("recording", "r.sdrec", data, Addition(X))
    assert entry.latest.place == "blob"
    file = tmp_path / "blobs" / entry.latest.sha256[:2] / entry.latest.sha256
    assert file.read_bytes() == data
    assert library.content(entry.id) == data
    library.blobs.put(b"left by a crash" * 1000)
    later = datetime.now(UTC) + timedelta(minutes=1)
    assert library.sweep_blobs(later - timedelta(hours=1)) == 0, "its row may be on its way"
    assert library.sweep_blobs(later) == 1
    library.delete(entry.id)
    library.purge(later)
    assert library.sweep_blobs(later) == 1
    assert not file.exists()


def test_damage_is_noticed(library: Library, store: Store, tmp_path: Path) -> None:
    small = library.add("set", "x.sdset", b"one", Addition(X))
    large = library.add("recording", "r.sdrec", b"x" * (INLINE + 1), Addition(X))
    with store.writing() as session:
        session.execute(text("UPDATE library_content SET data = :data"), {"data": b"two"})
    with pytest.raises(BlobFailed, match="damaged"):
        library.content(small.id)
    file = tmp_path / "blobs" / large.latest.sha256[:2] / large.latest.sha256
    file.write_bytes(b"y" * (INLINE + 1))
    with pytest.raises(BlobFailed, match="damaged"):
        library.content(large.id)
    file.unlink()
    with pytest.raises(BlobFailed, match="missing"):
        library.content(large.id)


def test_stations_share_it_and_save_at_once(
    make_store: Callable[[], Store], tmp_path: Path
) -> None:
    stations = [Library(make_store(), Blobs(str(tmp_path / "blobs"))) for _ in range(4)]
    failures: list[Exception] = []

    def work(number: int) -> None:
        try:
            for turn in range(5):
                stations[number].add("set", "x.sdset", f"{number} {turn}".encode(), Addition(X))
        except Exception as error:
            failures.append(error)

    threads = [threading.Thread(target=work, args=(n,)) for n in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert failures == []
    entry = stations[0].named("set", "x.sdset")
    assert entry is not None
    assert [v.number for v in stations[1].versions(entry.id)] == list(range(20, 0, -1))
    contents = {stations[2].content(entry.id, n) for n in range(1, 21)}
    assert contents == {f"{n} {t}".encode() for n in range(4) for t in range(5)}


@pytest.mark.long
def test_purging_takes_no_contents_away_that_are_being_used(
    make_store: Callable[[], Store], tmp_path: Path
) -> None:
    """Two stations: one stores and deletes the same contents, the other purges all the time."""
    stations = [Library(make_store(), Blobs(str(tmp_path / "blobs"))) for _ in range(2)]
    failures: list[Exception] = []
    done = threading.Event()

    def purge() -> None:
        try:
            while not done.is_set():
                stations[1].purge(datetime.now(UTC) + timedelta(minutes=1))
        except Exception as error:
            failures.append(error)

    thread = threading.Thread(target=purge)
    thread.start()
    try:
        for turn in range(30):
            gone = stations[0].add("set", f"gone {turn}", b"same", Addition(X))
            stations[0].delete(gone.id)
            kept = stations[0].add("set", f"kept {turn}", b"same", Addition(X))
            assert stations[0].content(kept.id) == b"same"
            if turn % 2:
                stations[0].delete(kept.id)
    finally:
        done.set()
        thread.join()
    assert failures == []


# --- parameter sets by name ------------------------------------------------------------

SET = b"""format = "servodeck parameter set"
version = 1
[identity]
profile = "mms7"
drive = "X"
vendor_id = 1
serial = 4711
[about]
saved = 2026-11-21T10:15:00Z
author = "Anna"
notes = "as found"
[[parameter]]
key = "2005:03"
raw = 350
[end]
parameters = 1
"""


@pytest.fixture
def sets(library: Library, tmp_path: Path) -> LibrarySets:
    return LibrarySets(library, tmp_path / "sets")


def test_files_of_an_earlier_version_are_taken_in_once(sets: LibrarySets, tmp_path: Path) -> None:
    folder = tmp_path / "sets"
    folder.mkdir()
    (folder / "old.sdset").write_bytes(SET)
    (folder / "cut.sdset").write_bytes(SET[:200])
    assert sets.names() == ["old.sdset", "cut.sdset"]
    entry = sets.entry("old")
    assert entry.latest.axis == AxisIdentity("mms7", "X", vendor_id=1, serial=4711)
    assert (entry.latest.author, entry.latest.notes) == ("Anna", "as found")
    assert entry.latest.saved == datetime(2026, 11, 21, 10, 15, tzinfo=UTC)
    assert sets.read("old") == SET
    assert sorted(p.name for p in folder.rglob("*.sdset")) == ["cut.sdset", "old.sdset"]
    assert (folder / "imported" / "old.sdset").read_bytes() == SET
    # A crash after storing and before moving: the file is still there at the next start.
    (folder / "old.sdset").write_bytes(SET)
    assert sets.names() == ["old.sdset", "cut.sdset"]
    assert sets.entry("old").versions == 1
    sets.delete("old")
    assert sets.names() == ["cut.sdset"]
    sets.delete("cut")
    assert sets.names() == []


def test_a_new_version_must_be_wanted(sets: LibrarySets) -> None:
    sets.store("a", SET)
    with pytest.raises(NotAllowed, match="exists already"):
        sets.store("a", SET.replace(b"350", b"400"))
    sets.store("a", SET.replace(b"350", b"400"), overwrite=True)
    assert [row.raw for row in sets.load("a").rows] == [400]
    assert [row.raw for row in sets.load("a", 1).rows] == [350]


@pytest.mark.parametrize("name", ["../x", "a/b", ".hidden", "", "a\0b", "x" * 200, "..", "a..b"])
def test_names_are_plain(sets: LibrarySets, name: str) -> None:
    for use in (sets.read, sets.delete, lambda n: sets.store(n, SET)):
        with pytest.raises(NotAllowed, match="file name"):
            use(name)


def test_contents_in_an_object_store(store: Store) -> None:
    # fsspec's store in memory stands for S3: no folders, no renaming, its own errors.
    library = Library(store, Blobs("memory://bucket/prefix"))
    data = b"z" * (INLINE + 1)
    entry = library.add("recording", "r.sdrec", data, Addition(X))
    assert library.content(entry.id) == data
    assert list(library.blobs.names()) == [entry.latest.sha256]
    assert library.sweep_blobs(datetime.now(UTC) + timedelta(minutes=1)) == 0
    library.blobs.delete(entry.latest.sha256)
    with pytest.raises(BlobFailed, match="missing"):
        library.content(entry.id)
