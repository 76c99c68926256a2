"""Searching the audit; the same on SQLite and PostgreSQL."""

from __future__ import annotations

from datetime import UTC, datetime

from backend.foundation.store.database import Store
from backend.records.audit import AuditLog, Fact
from backend.records.audit.trail import Filter, Trail


def test_search(store: Store) -> None:
    audit = AuditLog(store, "bench-1")
    audit.add(Fact("login", "logged in", person="Änne"))
    audit.add(Fact("write", "written", "X", "2005:03", 35.0, 40.0, person="Anna"))
    audit.add(Fact("file", "saved", "轴 Y", "100%_done\\x", person='a"b'))
    audit.close()
    trail = Trail(store)

    def numbers(**wanted: object) -> list[int]:
        return [event.number for event in trail.search(Filter(**wanted))]

    assert numbers() == [3, 2, 1]
    assert numbers(words='A"B') == [3]
    assert numbers(words="100%_") == [3]
    assert numbers(words="100_") == []
    assert numbers(words="\\x") == [3]
    assert numbers(words="轴") == [3]
    assert numbers(words="ANNA 35.0") == [2]
    assert numbers(kinds=("write", "login"), since=datetime(2020, 1, 1, tzinfo=UTC)) == [2, 1]
    assert [event.number for event in trail.search(Filter(), before=3, limit=1)] == [2]
    assert sorted(trail.names()["person"]) == ["Anna", 'a"b', "Änne"]
    assert len(list(trail.export(Filter(kinds=("write",)), "jsonl"))) == 1
    assert trail.verify(trail.head()).ok
