"""``servodeck params`` and ``scan`` on the buses of a running server."""

from __future__ import annotations

import sys
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from datetime import UTC, datetime
from pathlib import Path
from urllib.parse import quote

from backend.api.drive.models_parameters import ParameterRow, ParameterValue
from backend.api.records.library.models import StoredSet
from backend.api.records.sets.models import Diff
from backend.api.station.models import DriveSummary, FoundDrive
from backend.axes.parameters.set_file import parse
from backend.commands.base.options import Place
from backend.commands.base.printing import note, print_text
from backend.commands.base.remote import Remote, remote
from backend.commands.base.restoring import show_restored
from backend.commands.drive import values
from backend.commands.drive.values import Compared
from backend.foundation.store.files import write_atomically
from drivers.errors import NotAllowed


async def get(place: Place, keys: list[str], *, as_json: bool) -> bool:
    """Read parameters and print them; return whether all could be read."""
    async with remote_drive(place) as (at, drive):
        await at.result(f"/drives/{drive.id}/jobs/read_all", {"keys": keys})
        find = await _rows(at, drive)
        rows = [find(key) for key in keys]
    return values.show_readings(
        [(row, row.reading) for row in rows], drive.profile, as_json=as_json
    )


async def put(place: Place, assignments: list[str], *, raw: bool) -> None:
    """Write parameters one after the other; each is read back and printed."""
    async with remote_drive(place) as (at, drive):
        find = await _rows(at, drive)
        for row, value in [values.assignment(find, text) for text in assignments]:
            body = {"raw" if raw or isinstance(value, str) else "value": value}
            path = f"/drives/{drive.id}/parameters/{quote(row.key)}"
            reading = await at.ask("PUT", path, ParameterValue, body=body)
            print(values.line(row, reading, drive.profile))


async def save(place: Place) -> None:
    """Store the drive's settings in its own memory."""
    async with remote_drive(place) as (at, drive):
        await at.result(f"/drives/{drive.id}/procedures/save", {"confirmed": True})
        print_text("printed.saved-in-drive", drive=drive.name)


async def restore(place: Place, *, keep: bool) -> None:
    """Restore values left by an interrupted motion or, with ``keep``, accept them."""
    async with remote_drive(place) as (at, drive):
        if not drive.pending_restores:
            print_text("printed.nothing-pending", drive=drive.name)
            return
        if keep:
            await at.ask("DELETE", f"/drives/{drive.id}/pending-restores", DriveSummary)
            for value in drive.pending_restores:
                print_text(
                    "printed.value-stays", drive=drive.name, key=value.key, was=str(value.raw)
                )
            return
        found = await at.result(f"/drives/{drive.id}/jobs/put-back", {})
        show_restored(drive.name, found)


async def dump(
    place: Place, out: Path | None, *, author: str, notes: str, motor_individual: bool
) -> None:
    """Read all settings; the set is stored in the server's library as well."""
    async with remote_drive(place) as (at, drive):
        name = f"{drive.id} {datetime.now(UTC):%Y-%m-%d %H.%M.%S}"
        body = {
            "file": name,
            "author": author,
            "notes": notes,
            "include_motor_individual": motor_individual,
        }
        kept = await at.ask("POST", f"/drives/{drive.id}/sets", StoredSet, body=body)
        data = (await at.raw("GET", f"/sets/{quote(kept.file)}")).content
    if out is None:
        sys.stdout.write(data.decode())
    else:
        write_atomically(out, data)
        print_text("printed.also-kept", file=str(out), name=kept.file)
    values.print_missing(data)


async def diff(place: Place, file: Path, *, as_json: bool) -> bool:
    """Print the differences; return whether there are any."""
    async with remote_drive(place) as (at, drive):
        _, rows = await _differences(at, drive, file)
    values.show(rows, drive.profile, as_json=as_json)
    return any(row.differs for row in rows)


async def load(place: Place, file: Path, *, yes: bool, other_drive: bool) -> bool:
    """Show the differences and write them; return whether the drive kept every value."""
    async with remote_drive(place) as (at, drive):
        kept, rows = await _differences(at, drive, file)
        keys = values.chosen(rows, drive.profile, yes=yes)
        if not keys:
            return True
        body = {
            "file": kept.file,
            "version": kept.version,
            "keys": keys,
            "accept_other_identity": other_drive,
        }
        return values.loaded(await at.result(f"/drives/{drive.id}/jobs/load_set", body))


async def scan(server: str, url: str) -> list[FoundDrive]:
    """Drives that answer on a bus of the server."""
    async with remote(server) as at:
        return await at.scan(url)


@asynccontextmanager
async def remote_drive(place: Place) -> AsyncIterator[tuple[Remote, DriveSummary]]:
    """The server, and its drive at this station."""
    assert place.server is not None
    async with remote(place.server) as at:
        yield at, await at.drive(place.url, place.station, place.profile)


async def _differences(
    at: Remote, drive: DriveSummary, file: Path
) -> tuple[StoredSet, list[Compared]]:
    """Store the set on the server, and compare it with the drive; both results."""
    data = values.bytes_of(file)
    content = parse(data, file.name)
    if content.profile != drive.profile:
        raise values.other_family(file.name, content.profile, drive.name, drive.profile)
    kept = await at.ask(
        "PUT", f"/sets/{quote(file.name)}", StoredSet, content=data, query={"overwrite": "true"}
    )
    query = {"file": kept.file, "version": str(kept.version)}
    reported = await at.ask("GET", f"/drives/{drive.id}/diff", Diff, query=query)
    for warning in reported.warnings:
        note("printed.note", words=str(warning))
    rows = [row for row in reported.rows if row.status not in ("same", "not_in_file")]
    return kept, [
        Compared(
            row.key, row.name or "?", row.unit, row.drive_raw, row.drive_value, row.file_raw,
            row.file_value, row.status, row.problem, row.selected,
        )
        for row in rows
    ]  # fmt: skip


async def _rows(at: Remote, drive: DriveSummary) -> Callable[[str], ParameterRow]:
    """A function that finds a parameter by key or by the maker's number."""
    rows = await at.ask("GET", f"/drives/{drive.id}/parameters", list[ParameterRow])
    known = {row.number: row for row in rows if row.number} | {row.key: row for row in rows}

    def find(key: str) -> ParameterRow:
        row = known.get(key) or known.get(key.upper())
        if row is None:
            raise NotAllowed("command.no-parameter", parameter=key, drive_name=drive.name)
        return row

    return find
