"""Entries of the audit keep codes and facts; their words are made for whoever reads them."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import get_args

import httpx
import pytest
from sqlalchemy import select

from backend.axes.drive.readings import Refusal, WriteRecord
from backend.foundation.store.audit_tables import AuditEntry
from backend.foundation.store.database import Store
from backend.foundation.work.jobs import Job, Progress
from backend.records.audit import AuditLog, Fact
from backend.records.audit.chain import append
from backend.records.audit.facts import Action, body_of
from backend.records.audit.recorder import AuditRecorder
from backend.records.audit.trail import Filter, Trail
from backend.station.bench import Bench
from drivers.errors import OutOfRange
from drivers.texts.message import Text, prose, text
from tests.support.station import until

ROOT = Path(__file__).parents[4]
BEYOND = {"name": "rpm", "highest": 5000.0, "travelled_rev": 1.0, "speed_rpm": 300.0}


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    made = Store(tmp_path)
    yield made
    made.close()


@pytest.fixture
def audit(store: Store) -> Iterator[AuditLog]:
    made = AuditLog(store, "bench-1")
    yield made
    made.close()


def flush(audit: AuditLog) -> None:
    until(lambda: audit.pending == 0)


def test_a_failed_job_is_kept_as_code_and_facts(store: Store, audit: AuditLog) -> None:
    title = text("work.of-drive", title=text("step.title"), drive="X")
    job = Job("step-1", "step", title, "x", True, Progress(lambda: None))
    recorder = AuditRecorder(audit, lambda _drive: "X")
    recorder.job_changed(job)
    job.state = "failed"
    job.error = OutOfRange("step.step-needs-rev-more", value=5000.0, travel_rev=3.0, **BEYOND)
    recorder.job_changed(job)
    flush(audit)
    ended, began = Trail(store).search(Filter())
    for event in (began, ended):
        assert event.title is not None
        assert "阶跃响应" in event.title.words("zh")
        assert "Step response" in str(event.detail["title"]), "found by its English words, too"
    assert ended.outcome is not None
    assert ended.outcome.code == "step.step-needs-rev-more"
    assert ended.outcome.params["highest"] == 5000.0
    assert "限值 300 rpm" in ended.outcome.words("zh")
    assert [e.number for e in Trail(store).search(Filter(words="Step needs"))] == [ended.number]
    assert Trail(store).verify().ok


def test_writes_keep_why_they_were_refused(store: Store, audit: AuditLog) -> None:
    recorder = AuditRecorder(audit, lambda _drive: "X")
    recorder.wrote(WriteRecord("x", "X", "2005:03", "Gain", 1, 2, 3))
    recorder.refused(Refusal("x", "X", "6040:00", 15, text("motion.stop-was-pressed")))
    flush(audit)
    refused, wrote = (event.outcome for event in Trail(store).search(Filter()))
    assert wrote == text("audit.another-value-kept", wanted=2, kept=3)
    assert refused == text("motion.stop-was-pressed")


def test_a_table_is_exported_in_the_language_of_its_reader(store: Store, audit: AuditLog) -> None:
    why = text("audit.entry-missing", number=7)
    audit.add(Fact("job", "failed", "X", outcome=why, title=text("friction.title")))
    flush(audit)
    english, chinese = (list(Trail(store).export(Filter(), "csv", to))[1] for to in ("en", "zh"))
    assert "entry 7 is missing" in english
    assert "Friction map" in english
    assert "第 7 条缺失" in chinese
    assert "摩擦图谱" in chinese


#: As servodeck 0.2.0 wrote them.
OLD = (
    '{"action":"failed","axis":"X","detail":{"drive":"x","title":"Move X"},"kind":"motion",'
    '"new":null,"old":null,"outcome":"too fast","person":"Anna","station":"s","target":"move-1",'
    '"time":"2026-11-21T10:00:00.000005Z"}'
)


def test_entries_of_older_versions_stay_readable(store: Store) -> None:
    with store.writing() as session:
        append(session, [OLD])
    (event,) = Trail(store).search(Filter())
    assert event.outcome == prose("too fast")
    assert event.title == prose("Move X")
    assert Trail(store).verify().ok
    assert ",too fast," in list(Trail(store).export(Filter(), "csv", "zh"))[1]


def test_an_entry_without_messages_has_the_body_that_it_always_had() -> None:
    made = body_of(
        Fact("motion", "failed", "X", "move-1", outcome=prose("too fast"),
             detail={"drive": "x"}, title=prose("Move X")),
        moment=datetime(2026, 11, 21, 10, 0, 0, 5, UTC), station="s", person="Anna",
    )  # fmt: skip
    assert json.loads(made) == json.loads(OLD)


async def test_the_interface_answers_in_the_language_that_is_asked_for(
    bench: Bench, http: httpx.AsyncClient
) -> None:
    bench.audit.add(Fact("job", "failed", "X", outcome=text("drive.interrupted")))
    assert await bench.audit.settled(60.0)
    for language, words in (("en", "interrupted"), ("zh", "已中断")):
        answer = await http.get("/audit", headers={"Accept-Language": language})
        event = answer.json()["events"][0]
        assert words in event["outcome"]
        assert Text.from_wire(event["outcome_message"]) == text("drive.interrupted")


def test_a_broken_chain_says_why_in_both_languages(store: Store, audit: AuditLog) -> None:
    for _ in range(3):
        audit.add(Fact("login", "logged in", person="Anna"))
    flush(audit)
    with store.writing() as session:
        for each in ("update", "delete"):
            session.connection().exec_driver_sql(f"DROP TRIGGER audit_entry_no_{each}")
        session.delete(session.scalars(select(AuditEntry).where(AuditEntry.number == 2)).one())
    assert Trail(store).verify().why == text("audit.entry-missing", number=2)


def test_the_page_has_words_for_every_action() -> None:
    source = (ROOT / "webui/src/i18n/texts/records/library.ts").read_text("utf-8")
    shown = set(re.findall(r"'audit\.action\.([^']+)'", source))
    assert set(get_args(Action)) <= shown
