"""Routes of the commissioning report."""

from __future__ import annotations

import asyncio
import contextlib
from dataclasses import replace
from datetime import UTC, datetime

from fastapi import APIRouter, Response

from backend.api.health.kept import records_of
from backend.api.messages.disposition import disposition
from backend.api.messages.errors import NotFound
from backend.api.records.handover.routes import handover_log
from backend.api.report.models import ReportInfo, ReportRequest
from backend.api.requests.context import TheBench, TheDrive
from backend.api.tuning.measurements import change_log, measurement_head
from backend.foundation.store.database import DatabaseFailed
from backend.records.library.measurements import BadMeasurement, Head
from backend.report.gather import (
    About,
    belongs,
    choose,
    handed_over_facts,
    kind_of,
    live_facts,
    measured_from,
)
from backend.report.store import Format, ReportStore, render
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from backend.tools.watching.trend.records import axis_of
from drivers.errors import NotAllowed
from drivers.texts.message import text

router = APIRouter()
_TYPES: dict[Format, str] = {"html": "text/html; charset=utf-8", "pdf": "application/pdf"}


def _store(bench: Bench) -> ReportStore:
    return ReportStore(bench.state_folder / "reports")


@router.post("/drives/{drive_id}/reports", status_code=201)
async def make_report(bench: TheBench, connected: TheDrive, request: ReportRequest) -> ReportInfo:
    """Evaluate the measurements of an axis again and write its report. Nothing moves."""
    changes = change_log(bench).read(connected.drive.id)
    first = changes[0].time if changes else None
    chosen = await asyncio.to_thread(_chosen, bench, connected, request.measurements, first)
    facts = await live_facts(
        bench,
        connected,
        changes,
        About(request.person, request.machine, request.notes),
        request.language,
    )
    measured, unusable = await asyncio.to_thread(measured_from, bench.measurements, chosen)
    made = await asyncio.to_thread(handover_log(bench).read, connected.drive.id)
    handed = await handed_over_facts(connected.drive, made, request.language)
    whole = replace(facts, measured=measured, unusable=unusable, handed_over=handed)
    try:
        axis = axis_of(connected.drive, bench.records.station)
        condition = await bench.records.store.call(records_of(bench).condition, axis)
        whole = replace(whole, condition=condition)
    except DatabaseFailed as error:
        # All else in the report comes from files: it is made without the database, and states that.
        whole = replace(whole, trouble=(*whole.trouble, error.text))
    data = await asyncio.to_thread(render, whole, request.language, request.format)
    file = await asyncio.to_thread(_store(bench).save, connected.drive.name, request.format, data)
    line = text("journal.report", drive=connected.drive.name, file=file)
    bench.journal.add(line, drive=connected.drive.id)
    return _info(bench, file)


def _chosen(
    bench: Bench, connected: ConnectedDrive, asked: list[str] | None, first: datetime | None
) -> list[tuple[str, str]]:
    """Files of the report, each with the one that it is compared with.

    Raises:
        NotFound: there is no such file.
        NotAllowed: it is of another drive.
    """
    heads: dict[str, Head] = {}
    for name in bench.measurements.names() if asked is None else asked:
        try:
            head = measurement_head(bench, name)
        except (BadMeasurement, NotFound):
            # Also a file that another person has just deleted.
            if asked is not None:
                raise
            continue
        if belongs(head, connected.drive):
            heads[name] = head
        elif asked is not None:
            raise NotAllowed("api-report.not-measured", drive=connected.drive.name, value=name)
    if asked is None or len({kind_of(head) for head in heads.values()}) == len(heads):
        return choose(heads, first)
    # Chosen by a person: of two of a kind, the newer is compared with the older.
    return choose(heads, max(head.saved for head in heads.values()))


def _info(bench: Bench, file: str) -> ReportInfo:
    status = (_store(bench).folder / file).stat()
    form: Format = "html" if file.endswith(".html") else "pdf"
    made = datetime.fromtimestamp(status.st_mtime, UTC)
    return ReportInfo(file=file, format=form, made=made, size_bytes=status.st_size)


@router.get("/reports")
async def list_reports(bench: TheBench) -> list[ReportInfo]:
    """List stored reports, newest first."""
    found = []
    for name in _store(bench).names():
        with contextlib.suppress(FileNotFoundError):  # deleted at this moment
            found.append(_info(bench, name))
    return found


@router.get("/reports/{name}", response_class=Response)
async def read_report(bench: TheBench, name: str) -> Response:
    """Read a report, for display in the browser."""
    try:
        data = await asyncio.to_thread(_store(bench).read, name)
    except NotAllowed as error:
        raise NotFound(error.text, value=name) from error
    form: Format = "html" if name.endswith(".html") else "pdf"
    headers = disposition("inline", name)
    if form == "html":
        # A file of this folder, whatever it contains, must run nothing and belong to no origin.
        headers["Content-Security-Policy"] = (
            "default-src 'none'; style-src 'unsafe-inline'; sandbox allow-modals"
        )
    return Response(data, media_type=_TYPES[form], headers=headers)


@router.delete("/reports/{name}", status_code=204)
async def delete_report(bench: TheBench, name: str) -> None:
    """Delete a report."""
    try:
        _store(bench).delete(name)
    except NotAllowed as error:
        raise NotFound(error.text, value=name) from error
