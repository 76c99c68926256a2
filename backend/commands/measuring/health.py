"""``servodeck health``: measure, sign a baseline, repeat, compare, and the trend over time.

``measure`` and ``repeat`` move the axis. ``compare`` and ``trend`` read, from a running server or
from the station's database; ``baseline`` and ``repeat`` need the server that has the axis.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from typing import Annotated

import typer

from backend.api.health.models import AxisHealth, HealthFinding
from backend.api.health.routes import info_of
from backend.api.station.models import DriveSummary
from backend.commands.base.options import DEFAULT_SERVER, Json, Server
from backend.commands.base.printing import words_of
from backend.commands.base.remote import Remote, remote
from backend.commands.base.session import run
from backend.commands.measuring import health_permission
from backend.commands.measuring.tools import command_of, lines_of
from backend.commands.server.keep import Config, Database, station_records
from backend.tools.registry import BY_KIND
from backend.tools.thresholds import trend_compare
from backend.tools.watching.health.result import UNITS, HealthResult, Quantity
from backend.tools.watching.trend.records import HealthRecords
from backend.tools.wire_message import MessageInfo
from drivers.errors import NotAllowed
from drivers.texts.message import Text, language, text

app = typer.Typer(
    help="The condition of an axis: measure, sign a baseline, repeat, compare, trend. "
    "Measuring moves it.",
    no_args_is_help=True,
)

Axis = Annotated[str, typer.Option("--axis", help="name of the axis")]
_TOOL = BY_KIND["health"]

app.add_typer(health_permission.app)
app.command("measure", help=_TOOL.text("help"))(command_of(_TOOL))


@app.command("baseline")
def baseline(
    axis: Axis,
    person: Annotated[str, typer.Option(help="who signs, where the server has no accounts")] = "",
    notes: Annotated[str, typer.Option(help="what is to be known of it")] = "",
    runs: Annotated[
        str, typer.Option(help="numbers of rounds, by commas; else the newest of equal settings")
    ] = "",
    server: Server = None,
    as_json: Json = False,
) -> None:
    """Sign measured rounds as the baseline of an axis. Nothing moves."""

    async def work() -> None:
        async with remote(server or DEFAULT_SERVER) as at:
            drive = await _drive(at, axis)
            chosen = _numbers(runs) if runs else await _newest(at, drive)
            body = {"runs": chosen, "person": person, "notes": notes}
            path = f"/drives/{drive.id}/health/baseline"
            _show([await at.ask("POST", path, AxisHealth, body=body)], _baseline_lines, as_json)

    run(work)


@app.command("repeat")
def repeat(
    axis: Axis,
    consent: Annotated[
        bool, typer.Option("--consent", help="for a drive without watchdog, as when measuring")
    ] = False,
    server: Server = None,
    as_json: Json = False,
) -> None:
    """Repeat the measurements of the baseline with its settings, and compare. The axis moves."""

    async def work() -> None:
        async with remote(server or DEFAULT_SERVER) as at:
            drive = await _drive(at, axis)
            known = await at.ask("GET", f"/drives/{drive.id}/health", AxisHealth)
            if known.baseline is None:
                raise NotAllowed("health.no-baseline", axis=axis)
            # Consent is given for one motion only, so that of the baseline does not count.
            body = {**known.baseline.settings, "rounds": trend_compare.CHECKS, "consent": consent}
            found = await at.result(f"/drives/{drive.id}/jobs/health", body)
            now = await at.ask("GET", f"/drives/{drive.id}/health", AxisHealth)
            if not as_json:
                for line in lines_of(_TOOL, HealthResult.model_validate(found)):
                    print(line)
            _show([now], _finding_lines, as_json)

    run(work)


@app.command("compare")
def compare(
    axis: Annotated[str, typer.Option("--axis", help="name of the axis; else all")] = "",
    server: Server = None,
    config: Config = None,
    database: Database = None,
    as_json: Json = False,
) -> None:
    """The newest checks against the baseline. Exit code 3 where something has changed."""
    found = _read(axis, None, server, config, database)
    _show(found, _finding_lines, as_json)
    if any(each.changed for each in found):
        raise typer.Exit(3)


@app.command("trend")
def trend(
    axis: Annotated[str, typer.Option("--axis", help="name of the axis; else all")] = "",
    since: Annotated[datetime | None, typer.Option(help="earliest round")] = None,
    server: Server = None,
    config: Config = None,
    database: Database = None,
    as_json: Json = False,
) -> None:
    """Quantities over time: a table of dates and values."""
    earliest = None if since is None else since.replace(tzinfo=since.tzinfo or UTC)
    _show(_read(axis, earliest, server, config, database), _trend_lines, as_json)


def _read(
    axis: str, since: datetime | None, server: str | None, config: Config, database: Database
) -> list[AxisHealth]:
    found: list[AxisHealth] = []

    async def work() -> None:
        if server is not None:
            query = {"axis": axis} if axis else {}
            if since is not None:
                query["since"] = since.isoformat()
            async with remote(server) as at:
                found.extend(await at.ask("GET", "/health/trend", list[AxisHealth], query=query))
            return
        records = station_records(config, database)
        file = records.store.sqlite_file
        if file is not None and not file.exists():
            raise NotAllowed("command.no-database", value=str(file), file=str(file))
        health = HealthRecords(records.store, records.station)
        found.extend(info_of(each) for each in health.trend(since, axis))
        records.store.close()

    run(work)
    if axis and not found:
        run(lambda: _none(axis))
    return found


async def _none(axis: str) -> None:
    raise NotAllowed("health.no-rounds", axis=axis)


async def _drive(at: Remote, name: str) -> DriveSummary:
    drives = await at.drives()
    for each in drives:
        if each.name == name:
            return each
    names = ", ".join(each.name for each in drives) or "-"
    raise NotAllowed("health.axis-not-on-bench", name=name, names=names)


async def _newest(at: Remote, drive: DriveSummary) -> list[int]:
    """Ids of the newest rounds: those of the last health check, but at least `LEAST_REPEATS`."""
    known = await at.ask("GET", f"/drives/{drive.id}/health", AxisHealth)
    return [each.id for each in known.runs][-max(trend_compare.LEAST_REPEATS, _last_check(known)) :]


def _last_check(known: AxisHealth) -> int:
    """Number of rounds of the newest health check, which share the same raw data."""
    if not known.runs:
        return 0
    newest = known.runs[-1].measurements
    return sum(each.measurements == newest for each in known.runs)


def _numbers(runs: str) -> list[int]:
    try:
        return [int(each) for each in runs.split(",")]
    except ValueError as error:
        raise typer.BadParameter(
            words_of("printed.numbers-by-commas"), param_hint="--runs"
        ) from error


def _show(
    found: Sequence[AxisHealth], lines: Callable[[AxisHealth], list[str]], as_json: bool
) -> None:
    if as_json:
        rows = [each.model_dump(mode="json") for each in found]
        print(json.dumps(rows, indent=1, ensure_ascii=False))
        return
    for each in found:
        for line in lines(each):
            print(line)


def _words(message: MessageInfo) -> str:
    return Text.from_wire(message.model_dump()).words(language())


def _baseline_lines(found: AxisHealth) -> list[str]:
    signed = found.baseline
    if signed is None:
        return [_no_baseline(found)]
    when = f"{signed.signed:%Y-%m-%d %H:%M} UTC"
    return [
        words_of(
            "printed.baseline-signed",
            axis=found.axis,
            rounds=str(len(signed.runs)),
            when=when,
            person=signed.person,
        ),
        f"sha256: {signed.sha256}",
    ]


def _no_baseline(found: AxisHealth) -> str:
    return text("health.no-baseline", axis=found.axis).words(language())


def _finding_lines(found: AxisHealth) -> list[str]:
    if found.baseline is None:
        return [_no_baseline(found)]
    if not found.baseline.intact:
        return [text("health.baseline-changed", axis=found.axis).words(language())]
    lines = [f"{found.axis}:"]
    for each in found.findings:
        lines += _finding(each)
    return lines


def _finding(each: HealthFinding) -> list[str]:
    mark = "!" if each.code == "changed" else "?" if each.code in ("suspected", "not_seen") else " "
    lines = [f"{mark} {_words(each.message)}"]
    if each.next_step is not None:
        lines.append(f"    -> {_words(each.next_step)}")
    return lines


def _quantity(quantity: Quantity) -> str:
    return text(f"health.{quantity.replace('_', '-')}").words(language())


def _trend_lines(found: AxisHealth) -> list[str]:
    serial = ""
    if found.serial is not None:
        serial = f"  {words_of('printed.serial', serial=str(found.serial))}"
    lines = [f"{found.axis}  {found.profile}{serial}"]
    for row in found.runs:
        values = "  ".join(
            f"{_quantity(each.quantity)} {each.number}: {each.value:.4g} {UNITS[each.quantity]}"
            for each in row.values
        )
        lines.append(f"  {row.taken:%Y-%m-%d %H:%M}  #{row.id:<6} {values}")
    return lines
