"""``servodeck params`` and ``scan`` on the buses of a running server."""

from __future__ import annotations

import sys
from datetime import UTC, datetime
from pathlib import Path
from urllib.parse import quote

from backend.api.models import DriveSummary, FoundDrive, ParameterRow, ParameterValue
from backend.api.models_library import StoredSet
from backend.commands.remote import Remote, remote
from backend.commands.typed import finite
from backend.files import write_atomically
from drivers.errors import NotAllowed
from profiles.schema import Raw


async def get(server: str, url: str, keys: list[str], station: int, profile: str | None) -> None:
    """Read parameters and print them."""
    async with remote(server) as at:
        drive = await at.drive(url, station, profile)
        await at.result(f"/drives/{drive.id}/jobs/read_all", {"keys": keys})
        rows = await _rows(at, drive)
        for key in keys:
            row = _named(rows, drive, key)
            print(line(row, row.reading))


async def set_(
    server: str, url: str, assignments: list[str], station: int, profile: str | None, *, raw: bool
) -> None:
    """Write parameters one after the other; each is read back and printed."""
    async with remote(server) as at:
        drive = await at.drive(url, station, profile)
        rows = await _rows(at, drive)
        wanted = [_assignment(rows, drive, text) for text in assignments]
        for row, value in wanted:
            body = {"raw" if raw or isinstance(value, str) else "value": value}
            path = f"/drives/{drive.id}/parameters/{quote(row.key)}"
            print(line(row, await at.ask("PUT", path, ParameterValue, body=body)))


async def save(server: str, url: str, station: int, profile: str | None) -> None:
    """Store the drive's settings in its own memory."""
    async with remote(server) as at:
        drive = await at.drive(url, station, profile)
        await at.result(f"/drives/{drive.id}/procedures/save", {"confirmed": True})
        print(f"{drive.name}: saved in the drive's memory")


async def dump(
    server: str, url: str, station: int, profile: str | None, out: Path | None, *,
    author: str, notes: str, motor_individual: bool,
) -> None:  # fmt: skip
    """Read all settings; the set is kept in the server's library as well."""
    async with remote(server) as at:
        drive = await at.drive(url, station, profile)
        name = f"{drive.id} {datetime.now(UTC):%Y-%m-%d %H.%M.%S}"
        body = {
            "file": name, "author": author, "notes": notes,
            "include_motor_individual": motor_individual,
        }  # fmt: skip
        kept = await at.ask("POST", f"/drives/{drive.id}/sets", StoredSet, body=body)
        data = (await at.raw("GET", f"/sets/{quote(kept.file)}")).content
    if out is None:
        sys.stdout.write(data.decode())
        return
    write_atomically(out, data)
    print(f"{out}: also kept by the server as {kept.file}")


async def scan(server: str, url: str) -> list[FoundDrive]:
    """What answers on a bus of the server."""
    async with remote(server) as at:
        return await at.scan(url)


async def _rows(at: Remote, drive: DriveSummary) -> dict[str, ParameterRow]:
    """By key and by the maker's number."""
    rows = await at.ask("GET", f"/drives/{drive.id}/parameters", list[ParameterRow])
    return {row.number: row for row in rows if row.number} | {row.key: row for row in rows}


def _named(rows: dict[str, ParameterRow], drive: DriveSummary, key: str) -> ParameterRow:
    row = rows.get(key) or rows.get(key.upper())
    if row is None:
        raise NotAllowed(f"{drive.name} has no parameter {key}", parameter=key,
                         remedy="keys look like 6040:00")  # fmt: skip
    return row


def _assignment(
    rows: dict[str, ParameterRow], drive: DriveSummary, text: str
) -> tuple[ParameterRow, Raw]:
    key, separator, value = text.partition("=")
    if not separator:
        raise NotAllowed(f"{text!r} is no assignment", remedy="write KEY=VALUE, as 6081:00=1000")
    row = _named(rows, drive, key)
    if row.type in ("STRING", "OCTETS"):
        return row, value
    try:
        return row, int(value, 0)
    except ValueError:
        return row, finite(row.key, row.name, value)


def line(row: ParameterRow, reading: ParameterValue) -> str:
    """One parameter as `servodeck params get` prints it."""
    if reading.raw is None:
        return f"{row.key}  {row.name}: {reading.error}"
    label = row.enum.get(reading.raw, "") if isinstance(reading.raw, int) else ""
    shown = f"{reading.value} {row.unit}".rstrip() + (f" ({label})" if label else "")
    raw = f"  [raw {reading.raw}]" if reading.raw != reading.value else ""
    return f"{row.key}  {row.name} = {shown}{raw}"
