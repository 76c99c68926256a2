"""Routes of the audit: search, export, check."""

from __future__ import annotations

from collections.abc import AsyncIterator
from datetime import UTC, datetime
from typing import Annotated, Literal

from fastapi import APIRouter, Query
from fastapi.responses import StreamingResponse

from backend.api.messages.errors import message_or_none, words_of
from backend.api.records.audit.models import (
    AuditEvent,
    AuditKind,
    AuditNames,
    AuditPage,
    AuditStatus,
    AuditVerdict,
)
from backend.api.requests.context import TheBench
from backend.api.requests.times import in_utc
from backend.records.audit.chain import Anchor
from backend.records.audit.facts import KINDS
from backend.records.audit.trail import Event, Filter
from drivers.errors import OutOfRange
from drivers.texts.message import language

router = APIRouter(prefix="/audit")

Kinds = Annotated[list[AuditKind] | None, Query()]
Name = Annotated[str, Query(max_length=200)]
_CHUNK = 200


def _filter(
    kind: list[AuditKind] | None,
    person: str,
    axis: str,
    station: str,
    words: str,
    since: datetime | None,
    until: datetime | None,
) -> Filter:
    return Filter(
        kinds=tuple(kind or ()),
        person=person,
        axis=axis,
        station=station,
        words=words,
        since=in_utc(since),
        until=in_utc(until),
    )


def _message(event: Event) -> AuditEvent:
    return AuditEvent(
        number=event.number, time=event.time, station=event.station, person=event.person,
        kind=event.kind, action=event.action, axis=event.axis, target=event.target,
        old=event.old, new=event.new, outcome=words_of(event.outcome),
        outcome_message=message_or_none(event.outcome),
        title_message=message_or_none(event.title), detail=event.detail_in(language()),
        hash=event.hash,
    )  # fmt: skip


@router.get("")
async def search_audit(
    bench: TheBench,
    kind: Kinds = None,
    person: Name = "",
    axis: Name = "",
    station: Name = "",
    words: Annotated[str, Query(max_length=200, description="all must occur")] = "",
    since: datetime | None = None,
    until: datetime | None = None,
    before: Annotated[int | None, Query(ge=1, lt=1 << 63)] = None,
    limit: Annotated[int, Query(ge=1, le=500)] = 100,
) -> AuditPage:
    """List entries, newest first."""
    wanted = _filter(kind, person, axis, station, words, since, until)
    records = bench.records
    found = await records.store.call(records.trail.search, wanted, before=before, limit=limit)
    last = found[-1].number if len(found) == limit else None
    return AuditPage(events=[_message(event) for event in found], next=last)


@router.get("/names")
async def audit_names(bench: TheBench) -> AuditNames:
    """List the values that can be chosen in a filter."""
    found = await bench.records.store.call(bench.records.trail.names)
    return AuditNames(
        persons=found["person"], axes=found["axis"], stations=found["station"], kinds=list(KINDS)
    )


@router.get("/status")
async def audit_status(bench: TheBench) -> AuditStatus:
    """Whether events reach the database."""
    # Data written to a file that was removed are lost, perhaps before any event could report it.
    problem = bench.audit.problem or bench.records.store.missing()
    return AuditStatus(
        problem=words_of(problem),
        problem_message=message_or_none(problem),
        pending=bench.audit.pending,
        database=bench.records.store.shown,
    )


@router.get("/verify")
async def verify_audit(
    bench: TheBench,
    anchor: Annotated[
        str, Query(pattern=r"^(\d{1,18}:[0-9a-f]{64})?$", description="number:hash noted earlier")
    ] = "",
) -> AuditVerdict:
    """Check the whole chain, and that an entry noted earlier is still in it."""
    number, _, digest = anchor.partition(":")
    known = Anchor(int(number), digest) if anchor else None
    verdict = await bench.records.store.call(bench.records.trail.verify, known)
    return AuditVerdict(
        ok=verdict.ok,
        entries=verdict.entries,
        head=str(verdict.head),
        broken=verdict.broken,
        why=words_of(verdict.why),
        why_message=message_or_none(verdict.why),
    )


@router.get("/export", response_class=StreamingResponse)
async def export_audit(
    bench: TheBench,
    form: Annotated[Literal["csv", "jsonl"], Query(alias="format")] = "csv",
    kind: Kinds = None,
    person: Name = "",
    axis: Name = "",
    station: Name = "",
    words: Annotated[str, Query(max_length=200)] = "",
    since: datetime | None = None,
    until: datetime | None = None,
) -> StreamingResponse:
    """Export entries as a table, or as JSON lines with hashes, oldest first."""
    wanted = _filter(kind, person, axis, station, words, since, until)
    if wanted.since and wanted.until and wanted.since >= wanted.until:
        raise OutOfRange("api-audit.since-must-before-until")
    lines = bench.records.trail.export(wanted, form, language())
    store = bench.records.store

    def some() -> str:
        """Several lines at once: each call on another thread costs time."""
        part = []
        for line in lines:
            part.append(line)
            if len(part) >= _CHUNK:
                break
        return "".join(part)

    first = await store.call(some)  # an error of the database can still be answered as an error

    async def body() -> AsyncIterator[str]:
        part = first
        while part:
            yield part
            part = await store.call(some)

    name = f"audit-{datetime.now(UTC):%Y%m%d-%H%M%S}.{form}"
    return StreamingResponse(
        body(),
        media_type="text/csv; charset=utf-8" if form == "csv" else "application/x-ndjson",
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )
