"""Routes of the axes' condition. Nothing moves; measuring is the job of the tool ``health``."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter, Query, Response
from pydantic import TypeAdapter

from backend.api.context import Me, TheBench, TheDrive
from backend.api.errors import message_of as as_info
from backend.api.health.kept import records_of
from backend.api.health.models import (
    AxisHealth,
    BaselineRequest,
    HealthBaselineInfo,
    HealthFinding,
    HealthRunInfo,
)
from backend.health.compare import Finding
from backend.health.records import Baseline, Condition, HealthRow, axis_of
from backend.health.words import message_of
from backend.tools.health.result import UNITS
from drivers.texts.message import text

router = APIRouter()
_TREND = TypeAdapter(list[AxisHealth])


@router.get("/health/trend", response_model=list[AxisHealth])
async def health_trend(
    bench: TheBench,
    since: Annotated[datetime | None, Query(description="earliest round that is shown")] = None,
    axis: Annotated[str, Query(max_length=200, description="name; all without it")] = "",
) -> Response:
    """Every axis of the database with its rounds and its comparison, of all stations of it."""
    if since is not None and since.tzinfo is None:
        since = since.replace(tzinfo=UTC)

    def made() -> bytes:
        # On the store's thread to the last byte: the loop of the buses does not wait for it.
        found = [info_of(each) for each in records_of(bench).trend(since, axis)]
        return _TREND.dump_json(found)

    return Response(await bench.records.store.call(made), media_type="application/json")


@router.get("/drives/{drive_id}/health")
async def read_health(bench: TheBench, connected: TheDrive) -> AxisHealth:
    """Baseline, comparison and rounds of one axis."""
    axis = axis_of(connected.drive, bench.records.station)
    return info_of(await bench.records.store.call(records_of(bench).condition, axis))


@router.post("/drives/{drive_id}/health/baseline", status_code=201)
async def sign_baseline(
    bench: TheBench, connected: TheDrive, me: Me, request: BaselineRequest
) -> AxisHealth:
    """Sign rounds as the baseline of the axis. The one before is kept, and counts no longer.

    Who is logged in signs by that name; ``person`` counts where the page is used without accounts.
    """
    axis = axis_of(connected.drive, bench.records.station)
    person = request.person if me.kind == "local" else me.person
    records = records_of(bench)
    signed = await bench.records.store.call(
        records.sign, axis.key, request.runs, person, request.notes
    )
    bench.journal.add(
        text(
            "journal.baseline-signed",
            drive=connected.drive.name,
            id=str(signed.id),
            person=signed.person,
            sha256=signed.sha256,
        ),
        drive=connected.drive.id,
    )
    return info_of(await bench.records.store.call(records.condition, axis))


def info_of(found: Condition) -> AxisHealth:
    """One axis as it is sent."""
    baseline = found.baseline
    sha256 = None if baseline is None else baseline.settings_sha256
    return AxisHealth(
        key=found.axis.key, axis=found.axis.name, profile=found.axis.profile,
        serial=found.axis.serial,
        baseline=None if baseline is None else _baseline(baseline),
        findings=[_finding(each) for each in found.findings],
        changed=sum(each.code == "changed" for each in found.findings),
        suspected=sum(each.code in ("suspected", "not_seen") for each in found.findings),
        other_settings=found.other_settings,
        runs=[_run(row, comparable=row.settings_sha256 == sha256) for row in found.rows],
    )  # fmt: skip


def _baseline(baseline: Baseline) -> HealthBaselineInfo:
    return HealthBaselineInfo(
        id=baseline.id, signed=baseline.signed, person=baseline.person, notes=baseline.notes,
        sha256=baseline.sha256, intact=baseline.intact, settings=dict(baseline.settings),
        runs=list(baseline.runs), measurements=list(baseline.measurements),
    )  # fmt: skip


def _finding(each: Finding) -> HealthFinding:
    message = message_of(each)
    remedy = message.remedy()
    return HealthFinding(
        quantity=each.quantity, number=each.number, unit=UNITS[each.quantity], code=each.code,
        direction=each.direction, before=each.before, now=each.now, change=each.change,
        low=each.low, high=each.high, looked_for=each.looked_for,
        message=as_info(message),
        next_step=None if remedy is None else as_info(remedy),
    )  # fmt: skip


def _run(row: HealthRow, *, comparable: bool) -> HealthRunInfo:
    return HealthRunInfo(
        id=row.id, station=row.station, taken=row.taken, person=row.person, comparable=comparable,
        measurements=list(row.measurements), values=list(row.round.values),
        missing=list(row.round.missing),
    )  # fmt: skip
