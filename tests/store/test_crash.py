"""kill -9 at random moments: nothing corrupt, nothing lost that was said to be stored."""

from __future__ import annotations

import hashlib
import json
import os
import random
import signal
import sqlite3
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import event, select

from backend.foundation.store.database import DatabaseFailed, Store
from backend.foundation.store.library_tables import Version
from backend.foundation.work.journal import Journal
from backend.records.audit import AuditLog, Fact
from backend.records.audit.trail import Filter, Trail
from backend.records.library.entries import Addition
from backend.records.recording.reader import RecordingReader
from backend.station.records import Records
from tests.support.postgres import Postgres
from tests.support.station import until

ROOT = Path(__file__).resolve().parents[2]
SEED = 20261121
LIVES = 6


class Nursery:
    """Forks stations and kills them."""

    def __init__(self, folder: Path, database: str) -> None:
        self.folder = folder
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tests.support.crash_child", str(folder), database],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=ROOT,
        )

    def live(self, seed: int, deeds: int, rest_s: float) -> None:
        """A life that ends ``rest_s`` after so many deeds were reported."""
        assert self._process.stdin is not None
        before = len(self.reported())
        self._process.stdin.write(f"{seed}\n")
        self._process.stdin.flush()
        child = int(self._line().removeprefix("pid "))
        try:
            until(lambda: len(self.reported()) >= before + deeds, 40, f"{deeds} deeds")
            time.sleep(rest_s)
        finally:
            os.kill(child, signal.SIGKILL)
        assert self._line() == "dead"

    def cut(self, seed: int, act: str, step: int) -> bool:
        """One deed that ends itself before this step; True when it came to its end instead."""
        assert self._process.stdin is not None
        self._process.stdin.write(f"{seed} {act} {step}\n")
        self._process.stdin.flush()
        self._line()
        assert self._line() == "dead"
        return any(deed["act"] == "end" for deed in self.reported()[-3:])

    def reported(self) -> list[dict[str, Any]]:
        return json_lines(self.folder / "reported")

    def _line(self) -> str:
        assert self._process.stdout is not None
        return self._process.stdout.readline().strip()

    def close(self) -> None:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        self._process.wait(10)
        self._process.stdout.close()


def json_lines(path: Path) -> list[dict[str, Any]]:
    try:
        lines = path.read_bytes().split(b"\n")
    except FileNotFoundError:
        return []
    return [json.loads(line) for line in lines[:-1]]


@contextmanager
def nursery(folder: Path, database: str) -> Iterator[Nursery]:
    made = Nursery(folder, database)
    try:
        yield made
    finally:
        made.close()


def check(folder: Path, database: str, reported: list[dict[str, Any]]) -> None:
    """Everything that was reported is there, and everything that is there is whole."""
    records = Records(folder / "state", Journal(), database)
    library, file = records.library, records.store.sqlite_file
    try:
        records.audit.start()
        records.audit.add(Fact("station", "started"))
        until(lambda: records.audit.pending == 0)
        verdict = records.trail.verify()
        assert verdict.ok, verdict.why
        events = Counter(
            str(e.new) for e in records.trail.search(Filter(kinds=("write",)), limit=100_000)
        )
        assert not [token for token, count in events.items() if count > 1]
        assert {d["token"] for d in reported if d["act"] == "event"} <= set(events)
        for deed in (d for d in reported if d["act"] == "save"):
            data = library.content(deed["entry"], deed["number"])
            assert hashlib.sha256(data).hexdigest() == deed["sha256"]
        with records.store.reading() as session:
            rows = [(v.item_id, v.number) for v in session.scalars(select(Version))]
        for entry, number in rows:
            if library.entry(entry).station == "":
                library.content(entry, number)  # compared with its SHA-256
        for entry in {e for e, _ in rows}:
            numbers = sorted(n for e, n in rows if e == entry)
            assert numbers == list(range(1, len(numbers) + 1))
        assert records.sets.take_in() == {}
        for deed in (d for d in reported if d["act"] == "file"):
            data = records.sets.read(deed["name"])
            assert hashlib.sha256(data).hexdigest() == deed["sha256"]
        records.index.refresh()
        for path in (folder / "state" / "recordings").glob("*.sdrec"):
            with RecordingReader(path) as reader:
                assert sum(1 for _ in reader.blocks()) >= 0
                assert reader.summary().state == "interrupted"
    finally:
        records.audit.close()
        records.store.close()
    if file is not None:
        with closing(sqlite3.connect(file)) as raw:
            assert raw.execute("PRAGMA integrity_check").fetchone() == ("ok",)
            assert raw.execute("PRAGMA foreign_key_check").fetchall() == []


@pytest.mark.long
def test_killed_at_any_moment(database: str, tmp_path: Path) -> None:
    dice = random.Random(SEED)
    with nursery(tmp_path, database) as lives:
        for life in range(LIVES):
            # The first lives end while the database is being made.
            deeds = 0 if life < 3 else dice.randrange(1, 30)
            lives.live(dice.randrange(10**6), deeds, dice.uniform(0, 0.15 if life < 3 else 0.03))
            check(tmp_path, database, lives.reported())
        acts = Counter(deed["act"] for deed in lives.reported())
    assert set(acts) == {"save", "event", "file", "change"}, "every kind of writing was hit"


@pytest.mark.long
@pytest.mark.parametrize(
    ("act", "database"),
    [
        *((act, "sqlite") for act in ("save_large", "event", "drop_file", "change")),
        # The files are the same there, and the other statements are of the same kind.
        *((act, "postgresql") for act in ("save_large", "event")),
    ],
    indirect=["database"],
)
def test_cut_off_at_every_step_to_the_disk(act: str, database: str, tmp_path: Path) -> None:
    with nursery(tmp_path, database) as lives:
        assert lives.cut(1, "save", 10_000), "something is there already"
        for step in range(1, 60):
            (tmp_path / "reported").rename(tmp_path / f"reported-{step}")
            ended = lives.cut(step + 1, act, step)
            deeds = [*json_lines(tmp_path / f"reported-{step}"), *lives.reported()]
            (tmp_path / "reported").write_text(
                "".join(json.dumps(d) + "\n" for d in deeds if d["act"] != "end")
            )
            check(tmp_path, database, lives.reported())
            if ended:
                break
        assert ended
    assert step > 3, "there are steps at which it can be cut off"


@pytest.mark.long
def test_two_stations_killed_in_turn_leave_one_chain(postgres: Postgres, tmp_path: Path) -> None:
    dice, url = random.Random(SEED), postgres.new_database()
    folders = [tmp_path / "a", tmp_path / "b"]
    for folder in folders:
        folder.mkdir()
    with nursery(folders[0], url) as first, nursery(folders[1], url) as second:
        for life in range(3):
            for lives, folder in ((first, folders[0]), (second, folders[1])):
                lives.live(
                    2 * life + 10 * dice.randrange(10**5) + (folder.name == "b"),
                    dice.randrange(3, 12),
                    0,
                )
        reported = [*first.reported(), *second.reported()]
    store = Store(folders[0], url)
    for folder in folders:  # what waits in their files goes into the chain when they start again
        audit = AuditLog(Store(folder / "state", url), "again")
        audit.start()
        audit.close()
    verdict = Trail(store).verify()
    events = Trail(store).search(Filter(kinds=("write",)), limit=100_000)
    store.close()
    assert verdict.ok, verdict.why
    assert {d["token"] for d in reported if d["act"] == "event"} <= {str(e.new) for e in events}


@pytest.mark.long
def test_the_server_of_the_database_may_go_and_come_back(
    postgres: Postgres, tmp_path: Path
) -> None:
    store = Store(tmp_path, postgres.new_database())
    audit = AuditLog(store, "bench-1")
    for number in range(30):
        if number == 10:
            postgres.stop("immediate")  # as a crash: no farewell, no checkpoint
        if number == 20:
            postgres.start()
        audit.add(Fact("write", "written", "X", "2005:03", new=number))
        if number in (9, 19):
            until(lambda: audit.pending == 0 or audit.problem, 20)
    until(lambda: audit.pending == 0, 30)
    audit.close()
    trail = Trail(store)
    assert trail.verify().ok
    assert [e.new for e in trail.search(Filter())] == list(range(29, -1, -1))
    store.close()


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("full", ["library", "audit"])
def test_a_full_disk_is_reported_and_leaves_everything_whole(full: str, tmp_path: Path) -> None:
    """SQLite's own limit of pages answers SQLITE_FULL, as a full disk does."""
    records = Records(tmp_path, Journal())
    saved = records.library.add("set", "x.sdset", b"one", Addition())
    engine = records.store.open()
    with engine.connect() as connection:
        pages = connection.exec_driver_sql("PRAGMA page_count").scalar_one()

    def limit(count: int) -> None:
        engine.dispose()

        @event.listens_for(engine, "connect")
        def _limit(connection: sqlite3.Connection, _record: object) -> None:
            connection.execute(f"PRAGMA max_page_count={count}").close()

    limit(pages)
    if full == "library":
        with pytest.raises(DatabaseFailed, match="full"):
            records.library.add("set", "x.sdset", os.urandom(500_000), Addition())
        assert records.library.content(saved.id) == b"one"
    else:
        for number in range(3000):
            records.audit.add(Fact("write", "written", "X", "2005:03", new=number))
        until(lambda: "full" in str(records.audit.problem), 20)
        records.audit.add(Fact("stop", "pressed"))
        limit(1 << 30)
        until(lambda: records.audit.pending == 0, 20)
        assert records.trail.verify().entries == 3002  # with the set's own
    assert records.trail.verify().ok
    records.audit.close()
    records.store.close()
