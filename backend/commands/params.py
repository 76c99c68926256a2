"""``servodeck params``: read, write, dump, compare and load parameters, here or by a server."""

from __future__ import annotations

import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from backend import parameter_set
from backend.axis import Axis
from backend.commands import remote_params
from backend.commands.remote import Server, server_for
from backend.commands.session import drive_at, progress, run, show_progress
from backend.commands.typed import finite
from backend.drive import Drive, Reading
from backend.files import write_atomically
from backend.library import SetLibrary
from backend.parameter_list import export_list, import_list
from backend.parameter_set import SUFFIX, Difference
from backend.tools import parameters, procedures
from drivers.errors import NotAllowed
from profiles import load_profile
from profiles.schema import Parameter, Raw

app = typer.Typer(help="Read and write parameters on a bus, or by a running server.")

Url = Annotated[str, typer.Argument(metavar="BUS_URL")]
Station = Annotated[int, typer.Option(help="station address on the bus")]
Profile = Annotated[str | None, typer.Option(help="drive family; recognised where possible")]


@app.command("get")
def get(
    url: Url, keys: list[str], station: Station = 1, profile: Profile = None,
    server: Server = None,
) -> None:  # fmt: skip
    """Read parameters and print them."""

    async def work() -> None:
        if at := server_for(url, server):
            await remote_params.get(at, url, keys, station, profile)
            return
        async with drive_at(url, station, profile) as drive:
            readings = await drive.read_many(keys)
            for key in keys:
                parameter = drive.parameter(key)
                print(_line(parameter, readings[parameter.key]))

    run(work)


@app.command("set")
def set_(
    url: Url,
    assignments: Annotated[list[str], typer.Argument(metavar="KEY=VALUE")],
    station: Station = 1,
    profile: Profile = None,
    raw: Annotated[bool, typer.Option(help="values are raw, not in the parameter's unit")] = False,
    server: Server = None,
) -> None:
    """Write parameters; each is read back and printed."""

    async def work() -> None:
        if at := server_for(url, server):
            await remote_params.set_(at, url, assignments, station, profile, raw=raw)
            return
        async with drive_at(url, station, profile) as drive:
            wanted = [_assignment(drive, text) for text in assignments]
            for parameter, value in wanted:
                # Everything is checked before the first byte is written.
                known = value if raw or isinstance(value, str) else parameter.to_raw(value)
                drive.check(parameter, known)
            for parameter, value in wanted:
                reading = await drive.write(parameter.key, value, raw=raw)
                print(_line(parameter, reading))

    run(work)


@app.command("dump")
def dump(
    url: Url,
    station: Station = 1,
    profile: Profile = None,
    out: Annotated[Path | None, typer.Option(help="file to write; standard output without")] = None,
    author: Annotated[str, typer.Option()] = "",
    notes: Annotated[str, typer.Option()] = "",
    motor_individual: Annotated[
        bool, typer.Option(help="include values that belong to one motor")
    ] = False,
    server: Server = None,
) -> None:
    """Read all settings and write them as a parameter set."""

    async def work() -> None:
        if at := server_for(url, server):
            await remote_params.dump(
                at, url, station, profile, out,
                author=author, notes=notes, motor_individual=motor_individual,
            )  # fmt: skip
            return
        async with drive_at(url, station, profile) as drive:
            wanted = parameter_set.storable(drive.profile, motor_individual=motor_individual)
            keys = [p.key for p in wanted if not drive.unreachable_why(p)]
            readings = await drive.read_many(keys, show_progress)
            data = parameter_set.dump(
                drive, readings.values(), author=author, notes=notes, saved=datetime.now(UTC)
            )
            if out is None:
                sys.stdout.write(data.decode())
            else:
                write_atomically(out, data)
                print(f"{out}: {sum(r.raw is not None for r in readings.values())} parameters")

    run(work)


@app.command("save")
def save(
    url: Url, station: Station = 1, profile: Profile = None, server: Server = None
) -> None:  # fmt: skip
    """Store the drive's settings in its own memory, which wears with every storing."""

    async def work() -> None:
        if at := server_for(url, server):
            await remote_params.save(at, url, station, profile)
            return
        async with drive_at(url, station, profile) as drive:
            known = drive.profile.procedure("save")
            if known is None:
                raise NotAllowed(
                    f"{drive.name} has no procedure that saves: it keeps what is written",
                    drive=drive.name,
                    remedy="nothing needs to be done",
                )
            await procedures.run_procedure(Axis(drive), known, True, progress())
            print(f"{drive.name}: saved in the drive's memory")

    run(work)


@app.command("diff")
def diff(url: Url, file: Path, station: Station = 1, profile: Profile = None) -> None:
    """Compare a parameter set with the drive; exit code 1 when they differ."""

    async def work() -> bool:
        async with drive_at(url, station, profile) as drive:
            rows = await _differences(drive, file)
            for row in rows:
                print(_difference_line(row))
            return any(row.status == "differs" for row in rows)

    if run(work):
        raise typer.Exit(1)


@app.command("load")
def load(
    url: Url,
    file: Path,
    station: Station = 1,
    profile: Profile = None,
    yes: Annotated[bool, typer.Option("--yes", help="write without asking")] = False,
    other_drive: Annotated[
        bool, typer.Option(help="the file may be of a drive with another serial number")
    ] = False,
) -> None:
    """Write what differs; each value is read back. The values before are kept beside the file."""

    async def work() -> bool:
        async with drive_at(url, station, profile) as drive:
            rows = [row for row in await _differences(drive, file) if row.status != "not_in_file"]
            for row in rows:
                print(_difference_line(row))
            chosen = [row.key for row in rows if row.selected]
            if not chosen:
                print("nothing to write")
                return True
            if not yes and not typer.confirm(f"Write these {len(chosen)} values?"):
                raise NotAllowed("nothing was written", remedy="run it again to write")
            result = await parameters.load_set(
                drive,
                parameter_set.parse(_bytes_of(file), file.name),
                chosen,
                show_progress,
                library=SetLibrary(file.resolve().parent),
                accept_other_identity=other_drive,
            )
            print(f"written {result['written']}, failed {result['failed']}")
            print(f"the values before are in {result['backup']}")
            return result["failed"] == 0

    if not run(work):
        raise typer.Exit(1)


@app.command("export")
def export(
    file: Annotated[Path, typer.Argument(help="parameter set")],
    out: Annotated[Path, typer.Argument(help="file to write: .csv or .dcf")],
) -> None:
    """Turn a parameter set into a CSV list or a CiA 306 device configuration file."""

    async def work() -> None:
        if out.suffix.lower() not in (".csv", ".dcf"):
            raise NotAllowed(
                f"{out.name} is neither CSV nor DCF", remedy="name the file .csv or .dcf"
            )
        content = parameter_set.parse(_bytes_of(file), file.name)
        data = export_list(content, load_profile(content.profile), out.name, datetime.now())
        write_atomically(out, data)
        print(f"{out}: {len(content.rows)} parameters")

    run(work)


@app.command("import")
def import_(
    file: Annotated[Path, typer.Argument(help="CSV list or DCF")],
    out: Annotated[Path, typer.Argument(help=f"parameter set to write ({SUFFIX})")],
    profile: Annotated[str, typer.Option(help="drive family that the list is of")],
) -> None:
    """Turn a CSV list or a DCF into a parameter set; nothing is written to a drive."""

    async def work() -> None:
        data, found = import_list(
            _bytes_of(file), load_profile(profile), file.name, datetime.now(UTC)
        )
        for problem in found.problems:
            print(problem, file=sys.stderr)
        write_atomically(out, data)
        print(f"{out}: {len(found.readings)} parameters, {len(found.problems)} lines not used")

    run(work)


def _bytes_of(file: Path) -> bytes:
    try:
        return file.read_bytes()
    except OSError as error:
        raise NotAllowed(
            f"{file} cannot be read: {error.strerror}", remedy="name a file that can be read"
        ) from error


async def _differences(drive: Drive, file: Path) -> list[Difference]:
    content = parameter_set.parse(_bytes_of(file), file.name)
    if content.profile != drive.profile.drive:
        raise NotAllowed(
            f"{file.name} is of a {content.profile} drive, this is a {drive.profile.drive}",
            drive=drive.name,
            remedy="choose a file of the same drive family",
        )
    keys = [row.key for row in content.rows if row.key in drive.profile.by_key]
    reachable = [k for k in keys if not drive.unreachable_why(drive.parameter(k))]
    ours = await drive.read_many(reachable, show_progress)
    compared = parameter_set.compare(drive, content.rows, ours)
    return [row for row in compared if row.status != "same"]


def _assignment(drive: Drive, text: str) -> tuple[Parameter, Raw]:
    key, separator, value = text.partition("=")
    if not separator:
        raise NotAllowed(f"{text!r} is no assignment", remedy="write KEY=VALUE, as 6081:00=1000")
    parameter = drive.parameter(key)
    if not parameter.is_integer and parameter.type != "REAL32":
        return parameter, value
    try:
        number: Raw = int(value, 0)
    except ValueError:
        number = finite(parameter.key, parameter.name, value)
    return parameter, number


def _line(parameter: Parameter, reading: Reading) -> str:
    if reading.raw is None:
        return f"{parameter.key}  {parameter.name}: {reading.error}"
    label = parameter.enum.get(reading.raw, "") if isinstance(reading.raw, int) else ""
    shown = f"{reading.value} {parameter.unit}".rstrip() + (f" ({label})" if label else "")
    raw = f"  [raw {reading.raw}]" if reading.raw != reading.value else ""
    return f"{parameter.key}  {parameter.name} = {shown}{raw}"


def _difference_line(row: Difference) -> str:
    name = row.parameter.name if row.parameter else "?"
    match row.status:
        case "differs":
            return f"{row.key}  {name}: drive {row.ours} → file {row.theirs}"
        case "not_in_file":
            return f"{row.key}  {name}: only in the drive ({row.ours})"
        case _:
            return f"{row.key}  {name}: {row.status.replace('_', ' ')} {row.problem}".rstrip()
