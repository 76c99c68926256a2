"""``servodeck params`` on a bus that the command opens."""

from __future__ import annotations

import sys
from datetime import UTC, datetime
from pathlib import Path

from backend.axes.axis.axis import Axis
from backend.axes.drive.drive import Drive
from backend.axes.parameters import set_file as parameter_set
from backend.axes.parameters.set_file import ParameterSet
from backend.commands.base.options import Place
from backend.commands.base.printing import print_text
from backend.commands.base.restoring import require_own_values, show_restored, stop_what_was_moved
from backend.commands.base.session import drive_and_pending, drive_at, progress, show_progress
from backend.commands.drive import values
from backend.commands.drive.values import Compared
from backend.foundation.store.files import write_atomically
from backend.records.library import SetLibrary
from backend.tools import parameters
from backend.tools.measuring.restore import settle
from backend.tools.moving.moves import procedures
from drivers.errors import NotAllowed
from drivers.texts.message import language
from profiles.schema import Raw


async def get(place: Place, keys: list[str], *, as_json: bool) -> bool:
    """Read parameters and print them; return whether all could be read."""
    async with drive_at(place.url, place.station, place.profile) as drive:
        readings = await drive.read_many(keys)
        wanted = [drive.parameter(key) for key in keys]
    return values.show_readings(
        [(p, readings[p.key]) for p in wanted], drive.profile.drive, as_json=as_json
    )


async def put(place: Place, assignments: list[str], *, raw: bool) -> None:
    """Write parameters; each is read back and printed."""
    async with drive_at(place.url, place.station, place.profile) as drive:
        wanted = [values.assignment(drive.parameter, text) for text in assignments]
        for parameter, value in wanted:
            # All values are checked before the first one is written.
            drive.check_write(parameter.key, value, raw=raw)
        for parameter, value in wanted:
            reading = await drive.write(parameter.key, value, raw=raw)
            print(values.line(parameter, reading, drive.profile.drive))


async def dump(
    place: Place, out: Path | None, *, author: str, notes: str, motor_individual: bool
) -> None:
    """Read all settings and write them as a parameter set."""
    async with drive_at(place.url, place.station, place.profile) as drive:
        readings = await parameters.read_settings(
            drive, motor_individual=motor_individual, progress=show_progress
        )
        data = parameter_set.dump(
            drive, readings.values(), author=author, notes=notes, saved=datetime.now(UTC)
        )
    if out is None:
        sys.stdout.write(data.decode())
    else:
        write_atomically(out, data)
        count = sum(r.raw is not None for r in readings.values())
        print_text("printed.parameters-in-file", file=str(out), count=count)
    values.print_missing(data)


async def save(place: Place) -> None:
    """Store the drive's settings in its own memory."""
    async with drive_at(place.url, place.station, place.profile) as drive:
        known = drive.profile.procedure("save")
        if known is None:
            raise NotAllowed("command.no-procedure-saves-keeps", drive=drive.name)
        require_own_values(drive)
        await procedures.run_procedure(Axis(drive), known, True, progress())
        print_text("printed.saved-in-drive", drive=drive.name)


async def restore(place: Place, *, keep: bool) -> None:
    """Restore values left by an interrupted motion or, with ``keep``, accept them."""
    async with drive_and_pending(place.url, place.station, place.profile) as (drive, pending):
        listed = drive.pending_restores.entries
        if not listed:
            print_text("printed.nothing-pending", drive=drive.name)
            return
        if keep:
            drive.pending_restores.settle([value.key for value in listed])
            for value in listed:
                print_text(
                    "printed.value-stays", drive=drive.name, key=value.key, was=str(value.raw)
                )
            return
        axis = Axis(drive)
        await stop_what_was_moved(axis, pending)
        show_restored(drive.name, await settle(axis, asked=True))


async def diff(place: Place, file: Path, *, as_json: bool) -> bool:
    """Print the differences; return whether there are any."""
    content = _content(file)
    async with drive_at(place.url, place.station, place.profile) as drive:
        rows = await _differences(drive, content, file)
    values.show(rows, content.profile, as_json=as_json)
    return any(row.differs for row in rows)


async def load(place: Place, file: Path, *, yes: bool, other_drive: bool) -> bool:
    """Show the differences and write them; return whether the drive kept every value."""
    content = _content(file)
    async with drive_at(place.url, place.station, place.profile) as drive:
        keys = values.chosen(await _differences(drive, content, file), drive.profile.drive, yes=yes)
        if not keys:
            return True
        result = await parameters.load_set(
            drive,
            content,
            keys,
            show_progress,
            library=SetLibrary(file.resolve().parent),
            accept_other_identity=other_drive,
        )
        return values.loaded(result)


def _content(file: Path) -> ParameterSet:
    return parameter_set.parse(values.bytes_of(file), file.name)


async def _differences(drive: Drive, content: ParameterSet, file: Path) -> list[Compared]:
    if content.profile != drive.profile.drive:
        raise values.other_family(file.name, content.profile, drive.name, drive.profile.drive)
    keys = [row.key for row in content.rows if row.key in drive.profile.by_key]
    reachable = [k for k in keys if not drive.unreachable_why(drive.parameter(k))]
    ours = await drive.read_many(reachable, show_progress)
    rows = parameter_set.compare(drive, content.rows, ours)
    return [_compared(row) for row in rows if row.status != "same"]


def _compared(row: parameter_set.Difference) -> Compared:
    def value(raw: Raw | None) -> Raw | None:
        return raw if raw is None or row.parameter is None else row.parameter.to_value(raw)

    name, unit = (row.parameter.name, row.parameter.unit) if row.parameter else ("?", "")
    problem = "" if row.problem is None else row.problem.words(language())
    return Compared(
        row.key, name, unit, row.ours, value(row.ours), row.theirs, value(row.theirs),
        row.status, problem, row.selected,
    )  # fmt: skip
