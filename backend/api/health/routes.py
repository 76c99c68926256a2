"""Routes of axis condition. Nothing moves here; the tool ``health`` measures."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter, Depends, Query, Request, Response
from pydantic import TypeAdapter

from backend.api.health.kept import records_of
from backend.api.health.models import (
    AxisHealth,
    BaselineRequest,
    HealthAttempt,
    HealthBaselineInfo,
    HealthFinding,
    HealthPermissionInfo,
    HealthPermissionRequest,
    HealthRunInfo,
)
from backend.api.health.unattended import Unattended
from backend.api.messages import convert
from backend.api.messages.errors import message_of as as_info
from backend.api.messages.errors import message_or_none
from backend.api.messages.models import JobInfo
from backend.api.requests.context import Controlled, Me, TheBench, TheDrive, ThePeople
from backend.tools.watching.health.result import UNITS
from backend.tools.watching.trend.compare import Finding
from backend.tools.watching.trend.permission import Attempt, Permission, next_due
from backend.tools.watching.trend.records import Baseline, Condition, HealthRow, axis_of
from backend.tools.watching.trend.words import message_of
from drivers.errors import NotAllowed
from drivers.texts.message import Text, text

router = APIRouter()


async def unattended_of(request: Request) -> Unattended:
    """The scheduler of unattended health checks on this server."""
    found = request.app.state.unattended
    if not isinstance(found, Unattended):
        raise TypeError("the application was made without a schedule")
    return found


TheSchedule = Annotated[Unattended, Depends(unattended_of)]
_TREND = TypeAdapter(list[AxisHealth])


@router.get("/health/trend", response_model=list[AxisHealth])
async def health_trend(
    bench: TheBench,
    since: Annotated[datetime | None, Query(description="earliest round that is shown")] = None,
    axis: Annotated[str, Query(max_length=200, description="name; all without it")] = "",
) -> Response:
    """Read every axis of the database, of all its stations, with rounds and comparison."""
    if since is not None and since.tzinfo is None:
        since = since.replace(tzinfo=UTC)

    def made() -> bytes:
        # On the store's thread up to the last byte, so that the event loop of
        # the buses does not wait.
        found = [info_of(each) for each in records_of(bench).trend(since, axis)]
        return _TREND.dump_json(found)

    return Response(await bench.records.store.call(made), media_type="application/json")


@router.get("/drives/{drive_id}/health")
async def read_health(bench: TheBench, connected: TheDrive) -> AxisHealth:
    """Read baseline, comparison and rounds of one axis."""
    axis = axis_of(connected.drive, bench.records.station)
    return info_of(await bench.records.store.call(records_of(bench).condition, axis))


@router.post("/drives/{drive_id}/health/baseline", status_code=201)
async def sign_baseline(
    bench: TheBench, connected: TheDrive, me: Me, request: BaselineRequest
) -> AxisHealth:
    """Sign rounds as the baseline of the axis. The previous one is kept, but no longer used.

    A person who is logged in signs by that name; ``person`` is used on stations without accounts.
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


@router.get("/drives/{drive_id}/health/permission")
async def read_health_permission(
    connected: TheDrive, schedule: TheSchedule
) -> HealthPermissionInfo | None:
    """Read the permission for unattended runs, with schedule and attempts; null without one."""
    return _permission(schedule, connected.drive.id)


@router.put("/drives/{drive_id}/health/permission")
async def permit_health(
    bench: TheBench,
    connected: Controlled,
    me: Me,
    people: ThePeople,
    schedule: TheSchedule,
    request: HealthPermissionRequest,
) -> HealthPermissionInfo:
    """Permit unattended runs of the baseline's measurements. It replaces an earlier permission."""
    if not request.secured:
        raise NotAllowed("health.permission-secured", drive=connected.drive.name)
    baseline = await schedule.baseline(connected)
    given = datetime.now(UTC)
    account = people.accounts.directory.account_of(me.session)
    person = request.person if me.kind == "local" else me.person
    until = request.until if request.until.tzinfo else request.until.replace(tzinfo=UTC)
    made = Permission(
        drive=connected.drive.id, axis_key=baseline.axis.key, person=person.strip(),
        account=None if account is None else account.id, given=given, until=until,
        baseline=baseline.id, days=tuple(sorted(set(request.days))),
        at=request.at.replace(second=0, microsecond=0, tzinfo=None),
        trigger=request.trigger, pause_s=request.pause_min * 60.0, handled=given,
    )  # fmt: skip
    await schedule.permit(connected, me, made)
    line = text(
        "journal.health-permitted",
        drive=connected.drive.name,
        person=made.person,
        until=until.isoformat(sep=" ", timespec="minutes"),
    )
    bench.journal.add(line, drive=connected.drive.id)
    found = _permission(schedule, connected.drive.id)
    assert found is not None, "it was given just now"
    return found


@router.delete("/drives/{drive_id}/health/permission", status_code=204)
async def withdraw_health_permission(
    bench: TheBench, connected: TheDrive, schedule: TheSchedule
) -> None:
    """End the permission, and a run that it started."""
    gone = await schedule.withdraw(connected.drive.id)
    if gone is not None:
        line = text("journal.health-withdrawn", drive=connected.drive.name, person=gone.person)
        bench.journal.add(line, drive=connected.drive.id)


@router.post("/drives/{drive_id}/health/trigger", status_code=202)
async def trigger_health(connected: Controlled, schedule: TheSchedule) -> JobInfo:
    """Start a run for a controller. Without a standing permission for it nothing moves.

    ``GET /jobs/{id}`` returns its progress, ``GET /drives/{id}/health`` what has changed.
    """
    return convert.job(await schedule.triggered(connected))


def _permission(schedule: Unattended, drive: str) -> HealthPermissionInfo | None:
    known = schedule.permissions.of(drive)
    if known is None:
        return None
    now = datetime.now(UTC)
    ended = schedule.ended(known)
    return HealthPermissionInfo(
        person=known.person, given=known.given, until=known.until, ended=message_or_none(ended),
        baseline=known.baseline, days=list(known.days), at=known.at,
        next_due=None if ended is not None else next_due(known, now), trigger=known.trigger,
        pause_min=known.pause_s / 60.0,
        attempts=[_attempt(each) for each in reversed(known.attempts)],
    )  # fmt: skip


def _attempt(each: Attempt) -> HealthAttempt:
    why = None if each.why is None else Text.from_wire(each.why)
    return HealthAttempt(
        at=each.at,
        cause=each.cause,
        outcome=each.outcome,
        why=message_or_none(why),
        remedy=None if why is None else message_or_none(why.remedy()),
    )


def info_of(found: Condition) -> AxisHealth:
    """The condition of one axis as a message."""
    baseline = found.baseline
    sha256 = None if baseline is None else baseline.settings_sha256
    return AxisHealth(
        key=found.axis.key,
        axis=found.axis.name,
        profile=found.axis.profile,
        serial=found.axis.serial,
        baseline=None if baseline is None else _baseline(baseline),
        findings=[_finding(each) for each in found.findings],
        changed=sum(each.code == "changed" for each in found.findings),
        suspected=sum(each.code in ("suspected", "not_seen") for each in found.findings),
        other_settings=found.other_settings,
        runs=[_run(row, comparable=row.settings_sha256 == sha256) for row in found.rows],
    )


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
        id=row.id,
        station=row.station,
        taken=row.taken,
        person=row.person,
        comparable=comparable,
        measurements=list(row.measurements),
        values=list(row.round.values),
        missing=list(row.round.missing),
    )
