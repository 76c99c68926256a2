"""The audit's chain and its writer: nothing altered unseen, nobody kept waiting, nothing lost."""

from __future__ import annotations

import hashlib
import json
import resource
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

import pytest
from sqlalchemy.orm import Session

from backend.foundation.store.database import DatabaseFailed, Store
from backend.records.audit import AuditLog, Fact
from backend.records.audit.chain import Anchor
from backend.records.audit.facts import body_of
from backend.records.audit.pending import PendingFile
from backend.records.audit.trail import Filter, Trail
from drivers.texts.message import Text, prose
from tests.support.station import until


class SickStore(Store):
    """A database that fails, or hangs, while a test says so."""

    sick = False
    hanging = False

    @contextmanager
    def writing(self) -> Iterator[Session]:
        while self.hanging:
            time.sleep(0.01)
        if self.sick:
            raise DatabaseFailed("the database failed: disk full")
        with super().writing() as session:
            yield session


@pytest.fixture
def store(tmp_path: Path) -> Iterator[SickStore]:
    made = SickStore(tmp_path)
    yield made
    made.hanging = made.sick = False
    made.close()


@pytest.fixture
def audit(store: SickStore) -> Iterator[AuditLog]:
    made = AuditLog(store, "bench-1")
    yield made
    store.hanging = store.sick = False
    made.close()


def write(number: int) -> Fact:
    return Fact(
        "write", "written", axis="X", target="2005:03", old=number, new=number + 1, person="Anna"
    )


def flush(audit: AuditLog) -> None:
    until(lambda: audit.pending == 0)


def test_a_body_is_canonical_json() -> None:
    body = body_of(
        Fact("write", "written", axis="轴 X", target="2005:03", old=35.0, new=float("nan")),
        moment=datetime(2026, 11, 21, 10, 0, 0, 5, UTC),
        station="bench-1",
        person="Änne",
    )
    assert body == (
        '{"action":"written","axis":"轴 X","detail":{},"kind":"write","new":"nan","old":35.0,'
        '"outcome":"","person":"Änne","station":"bench-1","target":"2005:03",'
        '"time":"2026-11-21T10:00:00.000005Z"}'
    )


def test_the_chain_is_sha256_over_previous_hash_and_body(store: SickStore, audit: AuditLog) -> None:
    for number in range(3):
        audit.add(write(number))
    flush(audit)
    previous = "0" * 64
    lines = [json.loads(line) for line in Trail(store).export(Filter(), "jsonl")]
    assert [line["number"] for line in lines] == [1, 2, 3]
    for line in lines:
        assert line["previous"] == previous
        previous = hashlib.sha256((previous + line["body"]).encode()).hexdigest()
        assert line["hash"] == previous
    assert Trail(store).verify().ok
    assert Trail(store).head() == Anchor(3, previous)


DISARM = ("DROP TRIGGER audit_entry_no_update", "DROP TRIGGER audit_entry_no_delete")
#: What somebody with write access to the file may try, and the first entry that shows it.
TAMPERING = {
    "a value": ("UPDATE audit_entry SET body = replace(body, '\"new\":6', '\"new\":9') "
                "WHERE number = 6", 6),
    "a column": ("UPDATE audit_entry SET person = 'Bert' WHERE number = 4", 4),
    "a hash": ("UPDATE audit_entry SET hash = previous WHERE number = 7", 7),
    "a missing entry": ("DELETE FROM audit_entry WHERE number = 3", 3),
    "a missing end": ("DELETE FROM audit_entry WHERE number > 8", 9),
    "a missing beginning": ("DELETE FROM audit_entry WHERE number < 3", 1),
    "a missing head": ("DELETE FROM audit_head", 11),
    "a foreign entry": ("INSERT INTO audit_entry SELECT 11, time, station, person, kind, axis, "
                        "target, body, hash, hash FROM audit_entry WHERE number = 10", 11),
    "two swapped": ("UPDATE audit_entry SET number = 105 - number WHERE number IN (5, 6); "
                    "UPDATE audit_entry SET number = number - 94 WHERE number > 90", 5),
}  # fmt: skip


@pytest.mark.parametrize("what", TAMPERING)
def test_tampering_is_found_where_it_begins(what: str, store: SickStore, audit: AuditLog) -> None:
    for number in range(10):
        audit.add(write(number))
    flush(audit)
    statements, broken = TAMPERING[what]
    with store.writing() as session:
        for statement in (*DISARM, *statements.split("; ")):
            session.connection().exec_driver_sql(statement)
    verdict = Trail(store).verify()
    assert not verdict.ok
    assert verdict.broken == broken
    assert verdict.why


def test_a_rewritten_history_is_found_by_an_anchor(tmp_path: Path) -> None:
    heads = []
    for name in ("Anna", "Bert"):
        store = Store(tmp_path / name)
        audit = AuditLog(store, "bench-1")
        audit.add(Fact("login", "logged in", person=name))
        audit.add(Fact("login", "logged out", person=name))
        audit.close()
        heads.append(Trail(store).head())
        assert Trail(store).verify(heads[-1]).ok
    rewritten = Trail(store).verify(Anchor(2, heads[0].hash))
    assert (rewritten.ok, rewritten.broken) == (False, 2)
    shortened = Trail(store).verify(Anchor(3, heads[0].hash))
    assert (shortened.ok, shortened.broken) == (False, 3)
    store.close()


def test_adding_never_waits_for_a_database_that_hangs(store: SickStore, audit: AuditLog) -> None:
    store.hanging = True
    for number in range(1000):
        audit.add(write(number))
    assert audit.pending == 1000, "none waited for the database, which hangs still"
    store.hanging = False
    flush(audit)
    assert Trail(store).verify().entries == 1000


async def test_an_answer_waits_until_its_entry_is_safe(store: SickStore, audit: AuditLog) -> None:
    audit.add(write(1))
    assert await audit.settled(60.0)
    assert Trail(store).verify().entries == 1
    store.hanging = True
    audit.add(write(2))
    assert not await audit.settled(0.05)


async def test_a_database_that_fails_is_reported_and_nothing_is_lost(
    store: SickStore, tmp_path: Path
) -> None:
    reported: list[Text | None] = []
    audit = AuditLog(store, "bench-1", changed=reported.append)
    store.sick = True
    audit.add(write(1))
    audit.add(write(2))
    assert await audit.settled(60.0)  # safe in the file
    assert "disk full" in str(audit.problem)
    store.sick = False
    flush(audit)
    until(lambda: reported == [prose("the database failed: disk full"), None])
    assert audit.problem is None
    audit.close()
    assert [e.old for e in Trail(store).search(Filter())] == [2, 1]
    assert not (tmp_path / "audit-pending.jsonl").exists()


def test_events_outlive_a_process_that_never_reached_its_database(
    store: SickStore, tmp_path: Path
) -> None:
    store.sick = True
    first = AuditLog(store, "bench-1")
    for number in range(5):
        first.add(write(number))
    first.close()
    with (tmp_path / "audit-pending.jsonl").open("ab") as file:
        file.write(b'{"time":"cut o')  # a kill in the middle of a line
    store.sick = False
    second = AuditLog(store, "bench-1")
    second.start()
    second.add(write(5))
    second.close()
    assert [e.old for e in Trail(store).search(Filter())] == [5, 4, 3, 2, 1, 0]
    assert Trail(store).verify().ok


def test_what_a_lost_answer_had_stored_is_not_stored_twice(
    store: SickStore, tmp_path: Path
) -> None:
    class LostAnswer(SickStore):
        lose = 1

        @contextmanager
        def writing(self) -> Iterator[Session]:
            with super().writing() as session:
                yield session
            if self.lose:
                self.lose -= 1
                raise DatabaseFailed("the connection broke after the commit")

    station = LostAnswer(tmp_path)
    audit = AuditLog(station, "bench-1")
    audit.add(write(1))
    until(lambda: audit.problem is not None)
    audit.add(write(2))
    audit.close()
    station.close()
    assert [e.old for e in Trail(store).search(Filter())] == [2, 1]


def test_where_memory_is_full_the_gap_is_recorded(store: SickStore, tmp_path: Path) -> None:
    audit = AuditLog(store, "bench-1", capacity=3)
    store.hanging = True
    for number in range(10):
        audit.add(write(number))
    store.hanging = False
    flush(audit)
    audit.add(write(10))
    audit.close()
    events = Trail(store).search(Filter())
    assert (
        sum(int(e.new or 0) for e in events if e.kind == "audit")
        + sum(e.kind == "write" for e in events)
        == 11
    )


def test_four_threads_make_one_chain(store: SickStore, audit: AuditLog) -> None:
    threads = [
        threading.Thread(target=lambda: [audit.add(write(n)) for n in range(100)]) for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    flush(audit)
    verdict = Trail(store).verify()
    assert (verdict.ok, verdict.entries) == (True, 400)


def test_search_and_export(store: SickStore, audit: AuditLog) -> None:
    audit.add(Fact("login", "logged in", person="Anna"))
    audit.add(Fact("write", "written", "X", "2005:03", 35.0, 40.0, person="Anna"))
    audit.add(
        Fact("write", "written", "Y", "2005:03", 1, 2, person="Bert", outcome=prose("refused"))
    )
    audit.add(Fact("file", "saved", "Y", "=cmd|'x'!A1", person='a"b', detail={"version": 3}))
    flush(audit)
    trail = Trail(store)

    def numbers(**wanted: object) -> list[int]:
        return [e.number for e in trail.search(Filter(**wanted))]

    assert numbers() == [4, 3, 2, 1]
    assert numbers(kinds=("write",), person="Anna") == [2]
    assert numbers(axis="Y") == [4, 3]
    assert numbers(words="REFUSED bert") == [3]
    assert numbers(words='a"b') == [4]
    assert numbers(words="100%") == []
    assert numbers(words="_") == []
    assert numbers(since=datetime(2099, 1, 1, tzinfo=UTC)) == []
    assert [e.number for e in trail.search(Filter(), before=3, limit=1)] == [2]
    assert trail.names() == {
        "person": ["Anna", "Bert", 'a"b'],
        "axis": ["X", "Y"],
        "station": ["bench-1"],
    }
    table = list(trail.export(Filter(), "csv"))
    assert table[0].startswith("number,time,station,person,kind,action,axis,target,old,new")
    assert ",X,2005:03,35.0,40.0,," in table[2]
    assert "'=cmd" in table[4]  # no formula for a spreadsheet


@pytest.mark.parametrize("tail", [b"", b'{"time"', b"\xff\xfe"])
def test_pending_lines_are_whole(tail: bytes, tmp_path: Path) -> None:
    file = PendingFile(tmp_path / "sub" / "pending")
    body = body_of(write(1), moment=datetime.now(UTC), station="s", person="p")
    assert file.read() == []
    assert file.append([body])
    with (tmp_path / "sub" / "pending").open("ab") as raw:
        raw.write(tail)
    assert file.read() == [body]
    assert file.append([body])
    assert file.read() == [body, body]


def test_a_full_disk_leaves_no_half_line(tmp_path: Path) -> None:
    file = PendingFile(tmp_path / "pending")
    body = body_of(write(1), moment=datetime.now(UTC), station="s", person="p")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    # The kernel refuses to write beyond this, as it does on a full disk.
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(body) * 5 // 2, before[1]))
    try:
        taken = [file.append([body]) for _ in range(4)]
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert taken == [True, True, False, False]
    assert file.read() == [body, body]
