"""``servodeck health permit|permission|withdraw|trigger``: runs without a person.

All are requests to the server that has the axis; only ``trigger`` moves it, where permitted.
"""

from __future__ import annotations

import json
from datetime import UTC, datetime, time, timedelta
from typing import Annotated

import typer

from backend.api.health.models import HealthAttempt, HealthPermissionInfo
from backend.api.messages.models import JobInfo
from backend.commands.base.options import DEFAULT_SERVER, Json, Server
from backend.commands.base.remote import Remote, remote
from backend.commands.base.session import run
from backend.tools.watching.trend.permission import Cause, Outcome
from drivers.errors import NotAllowed
from drivers.texts.message import Text, language, text

app = typer.Typer()
_DAYS = ("mon", "tue", "wed", "thu", "fri", "sat", "sun")
_OUTCOMES: dict[Outcome, Text] = {
    "running": text("health.outcome-running"),
    "done": text("health.outcome-done"),
    "not_made": text("health.outcome-not-made"),
    "missed": text("health.outcome-missed"),
    "cancelled": text("health.outcome-cancelled"),
    "failed": text("health.outcome-failed"),
}
_CAUSES: dict[Cause, Text] = {
    "schedule": text("health.cause-schedule"),
    "trigger": text("health.cause-trigger"),
}
Axis = Annotated[str, typer.Option("--axis", help="name of the axis")]


@app.command("permit")
def permit(
    axis: Axis,
    secured: Annotated[
        bool,
        typer.Option(
            "--secured",
            help="you state that nobody can be in the danger zone at these times, and that the "
            "axis may move within the limits of the baseline",
        ),
    ] = False,
    days: Annotated[
        str, typer.Option(help="days of the schedule by commas: mon,tue,…; empty: no schedule")
    ] = "",
    at: Annotated[str, typer.Option(help="time of day by the station's clock, HH:MM")] = "02:00",
    trigger: Annotated[
        bool, typer.Option("--trigger", help="a controller may ask for a run")
    ] = False,
    for_days: Annotated[int, typer.Option(help="how long it is permitted, in days")] = 90,
    pause_min: Annotated[float, typer.Option(help="least time between two runs, in min")] = 60.0,
    person: Annotated[
        str, typer.Option(help="who permits it, where the server has no accounts")
    ] = "",
    server: Server = None,
    as_json: Json = False,
) -> None:
    """Permit the baseline's measurements without a person. The axis moves later."""
    body = {
        "until": _end(for_days).isoformat(),
        "days": _days(days),
        "at": _time(at).isoformat(),
        "trigger": trigger,
        "pause_min": pause_min,
        "person": person,
        "secured": secured,
    }

    async def work() -> None:
        async with remote(server or DEFAULT_SERVER) as at_server:
            path = f"{await _place(at_server, axis)}/permission"
            _show(axis, await at_server.ask("PUT", path, HealthPermissionInfo, body=body), as_json)

    run(work)


@app.command("permission")
def permission(axis: Axis, server: Server = None, as_json: Json = False) -> None:
    """Who permits runs without a person, when the next one is, and what became of the last."""

    async def work() -> None:
        async with remote(server or DEFAULT_SERVER) as at:
            answer = await at.raw("GET", f"{await _place(at, axis)}/permission")
            given = answer.content != b"null"
            found = HealthPermissionInfo.model_validate_json(answer.content) if given else None
            _show(axis, found, as_json)

    run(work)


@app.command("withdraw")
def withdraw(axis: Axis, server: Server = None) -> None:
    """Withdraw the permission, and end a run that goes on by it."""

    async def work() -> None:
        async with remote(server or DEFAULT_SERVER) as at:
            await at.raw("DELETE", f"{await _place(at, axis)}/permission")

    run(work)


@app.command("trigger")
def trigger(axis: Axis, server: Server = None, as_json: Json = False) -> None:
    """Ask for a run as a controller does, and do not wait for it. The axis moves if permitted."""

    async def work() -> None:
        async with remote(server or DEFAULT_SERVER) as at:
            job = await at.ask("POST", f"{await _place(at, axis)}/trigger", JobInfo)
            print(job.model_dump_json(indent=1) if as_json else f"{job.id}: {job.title}")

    run(work)


async def _place(at: Remote, axis: str) -> str:
    drives = await at.drives()
    for each in drives:
        if each.name == axis:
            return f"/drives/{each.id}/health"
    names = ", ".join(each.name for each in drives) or "-"
    raise NotAllowed("health.axis-not-on-bench", name=axis, names=names)


def _days(names: str) -> list[int]:
    try:
        return [_DAYS.index(each.strip().lower()[:3]) for each in names.split(",") if each.strip()]
    except ValueError as error:
        raise typer.BadParameter(", ".join(_DAYS), param_hint="--days") from error


def _end(days: int) -> datetime:
    try:
        return datetime.now(UTC) + timedelta(days=days)
    except OverflowError as error:
        raise typer.BadParameter(str(days), param_hint="--for-days") from error


def _time(at: str) -> time:
    try:
        return time.fromisoformat(at)
    except ValueError as error:
        raise typer.BadParameter("HH:MM", param_hint="--at") from error


def _show(axis: str, found: HealthPermissionInfo | None, as_json: bool) -> None:
    if as_json:
        print("null" if found is None else json.dumps(found.model_dump(mode="json"), indent=1))
        return
    for line in lines_of(axis, found):
        print(line)


def lines_of(axis: str, found: HealthPermissionInfo | None) -> list[str]:
    """A permission and its newest attempts, as lines of text."""
    if found is None:
        return [text("health.permission-none", axis=axis).words(language())]
    until = f"{found.until:%Y-%m-%d %H:%M} UTC"
    lines = [
        text("health.permission-line", axis=axis, person=found.person, until=until).words(
            language()
        )
    ]
    if found.ended is not None:
        lines.append(Text.from_wire(found.ended.model_dump()).words(language()))
    elif found.next_due is not None:
        when = f"{found.next_due.astimezone():%Y-%m-%d %H:%M %Z}"
        lines.append(text("health.permission-next", when=when).words(language()))
    return lines + [_attempt(each) for each in found.attempts[:10]]


def _attempt(each: HealthAttempt) -> str:
    why = "" if each.why is None else f": {Text.from_wire(each.why.model_dump()).words(language())}"
    outcome, cause = (
        found.words(language()) for found in (_OUTCOMES[each.outcome], _CAUSES[each.cause])
    )
    return f"  {each.at.astimezone(UTC):%Y-%m-%d %H:%M}  {cause}, {outcome}{why}"
