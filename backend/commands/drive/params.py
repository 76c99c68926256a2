"""``servodeck params``: read, write, dump, compare, load parameters, direct or by a server."""

from __future__ import annotations

import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Protocol

import typer

from backend.axes.parameters.lists import export_list, import_list
from backend.axes.parameters.set_file import SUFFIX, parse
from backend.commands.base.options import Json, Place, Profile, Server, Station, Url, place
from backend.commands.base.printing import note, print_text
from backend.commands.base.session import run
from backend.commands.drive import local_params, remote_params
from backend.commands.drive.values import bytes_of
from backend.foundation.store.files import write_atomically
from drivers.errors import NotAllowed
from drivers.texts.message import language
from profiles import load_profile

app = typer.Typer(help="Read and write parameters on a bus, or by a running server.")


class _Params(Protocol):
    """Interface of `local_params` and `remote_params`."""

    async def get(self, place: Place, keys: list[str], *, as_json: bool) -> bool: ...

    async def put(self, place: Place, assignments: list[str], *, raw: bool) -> None: ...

    async def dump(
        self, place: Place, out: Path | None, *, author: str, notes: str, motor_individual: bool
    ) -> None: ...

    async def save(self, place: Place) -> None: ...

    async def restore(self, place: Place, *, keep: bool) -> None: ...

    async def diff(self, place: Place, file: Path, *, as_json: bool) -> bool: ...

    async def load(self, place: Place, file: Path, *, yes: bool, other_drive: bool) -> bool: ...


def _by(where: Place) -> _Params:
    """The functions for a bus opened here, or those for a server."""
    return local_params if where.server is None else remote_params


@app.command("get")
def get(
    url: Url,
    keys: list[str],
    station: Station = 1,
    profile: Profile = None,
    server: Server = None,
    as_json: Json = False,
) -> None:
    """Read parameters and print them; exit code 1 when one could not be read."""

    async def work() -> bool:
        where = place(url, station, profile, server)
        return await _by(where).get(where, keys, as_json=as_json)

    if not run(work):
        raise typer.Exit(1)


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
        where = place(url, station, profile, server)
        await _by(where).put(where, assignments, raw=raw)

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
        where = place(url, station, profile, server)
        await _by(where).dump(
            where, out, author=author, notes=notes, motor_individual=motor_individual
        )

    run(work)


@app.command("save")
def save(url: Url, station: Station = 1, profile: Profile = None, server: Server = None) -> None:
    """Store the drive's settings in its own memory, which wears with every storing."""

    async def work() -> None:
        where = place(url, station, profile, server)
        await _by(where).save(where)

    run(work)


@app.command("restore")
def restore(
    url: Url,
    station: Station = 1,
    profile: Profile = None,
    keep: Annotated[
        bool, typer.Option("--keep", help="write nothing: the values shall stay as they are")
    ] = False,
    server: Server = None,
) -> None:
    """Restore what a motion changed and left, because its command or server was cut off."""

    async def work() -> None:
        where = place(url, station, profile, server)
        await _by(where).restore(where, keep=keep)

    run(work)


@app.command("diff")
def diff(
    url: Url,
    file: Path,
    station: Station = 1,
    profile: Profile = None,
    server: Server = None,
    as_json: Json = False,
) -> None:
    """Compare a parameter set with the drive; exit code 1 when they differ, 2 on an error."""

    async def work() -> bool:
        where = place(url, station, profile, server)
        return await _by(where).diff(where, file, as_json=as_json)

    # A script must be able to distinguish a bus without answer from a drive that differs.
    if run(work, error_code=2):
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
    server: Server = None,
) -> None:
    """Write what differs, each value read back. What was there before is kept as a set."""

    async def work() -> bool:
        where = place(url, station, profile, server)
        return await _by(where).load(where, file, yes=yes, other_drive=other_drive)

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
            raise NotAllowed("command.neither-csv-nor-dcf", out=out.name)
        content = parse(bytes_of(file), file.name)
        profile_of = load_profile(content.profile)
        data, left_out = export_list(content, profile_of, out.name, datetime.now())
        write_atomically(out, data)
        for each in left_out:
            note("printed.left-out", place="", key=each.key, reason=each.why)
        count = len(content.rows) - len(left_out)
        print_text("printed.parameters-in-file", file=str(out), count=count)
        if left_out:
            note("printed.rows-not-in-list", file=str(out), count=len(left_out))

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
            bytes_of(file), load_profile(profile), file.name, datetime.now(UTC)
        )
        for problem in found.problems:
            print(problem.words(language()), file=sys.stderr)
        write_atomically(out, data)
        print_text(
            "printed.parameters-of-list",
            file=str(out),
            count=len(found.readings),
            unused=len(found.problems),
        )

    run(work)
