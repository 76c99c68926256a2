"""``servodeck scales``: the scales of a drive's positions and speeds: show, state, teach."""

from __future__ import annotations

import contextlib
import json
import math
import re
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Annotated

import typer
from pydantic import ValidationError

from backend.api.drive.models_scales import ScalesInfo, SmallMoveResult
from backend.axes.axis import teaching
from backend.axes.axis.axis import Axis
from backend.axes.drive.drive import Drive
from backend.axes.drive.identity import place_of, read_serial
from backend.axes.scales.scale import Scale, what_to_do
from backend.axes.scales.taught import Taught, TaughtDrive
from backend.commands.base.options import Json, Place, Profile, Server, Station, Url, place
from backend.commands.base.printing import words_of
from backend.commands.base.session import drive_at, progress, run, run_in_order
from backend.commands.base.state import state_folder
from backend.commands.drive.remote_params import remote_drive
from backend.foundation.store.files import write_atomically
from drivers.texts.message import language

app = typer.Typer(
    help="What a raw position and speed mean: show, state, or teach by a small move (moves).",
    no_args_is_help=True,
)

State = Annotated[Path | None, typer.Option(help="folder of what is kept of axes")]
_UNITS = {"position": "rev", "velocity": "rpm", "acceleration": "rpm/s"}


async def taught_file(drive: Drive, state: Path | None = None) -> Path:
    """File with the stated scales of a drive, for commands without a server.

    Its name contains bus, station and serial number, so that another drive at the station does not
    use it.
    """
    port = drive.ports[0]
    serial = await read_serial(drive)
    name = re.sub(r"[^a-z0-9]+", "_", f"{port.link.url}_{port.station}_{serial or 0}".lower())
    return state_folder(state) / "scales" / f"{name}.json"


async def take_taught(axis: Axis, state: Path | None = None) -> None:
    """Set the scales of the axis that were stated earlier."""
    path = await taught_file(axis.drive, state)
    try:
        taught = Taught.model_validate_json(path.read_text("utf-8"))
    except (OSError, ValidationError):
        # There is no readable file: the drive, its description file and its manual count.
        axis.teach(None)
        return
    here = await _drive_here(axis.drive)
    # A file of an earlier version does not name the family; its name has the serial number.
    same = here.serial is not None if taught.drive is None else taught.drive.is_same(here)
    if same:
        axis.teach(taught)
    else:
        axis.teach(None, taught.not_used)


async def _drive_here(drive: Drive) -> TaughtDrive:
    port = drive.ports[0]
    return TaughtDrive(
        profile=drive.profile.drive,
        serial=await read_serial(drive),
        places=(place_of(port.link.url, port.station),),
    )


async def _keep(axis: Axis, taught: Taught | None, state: Path | None) -> None:
    path = await taught_file(axis.drive, state)
    if taught is not None:
        taught = taught.model_copy(update={"drive": await _drive_here(axis.drive)})
    axis.teach(taught)
    if taught is None:
        path.unlink(missing_ok=True)
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, taught.model_dump_json(indent=1).encode())


@asynccontextmanager
async def _axis_at(where: Place, state: Path | None) -> AsyncIterator[Axis]:
    async with drive_at(where.url, where.station, where.profile) as drive:
        axis = Axis(drive)
        await take_taught(axis, state)
        yield axis


@app.command()
def show(
    url: Url,
    station: Station = 1,
    profile: Profile = None,
    as_json: Json = False,
    server: Server = None,
    state: State = None,
) -> None:
    """Show the scales with their origins. Nothing moves."""

    async def work() -> None:
        where = place(url, station, profile, server)
        if where.server is not None:
            async with remote_drive(where) as (at, drive):
                _print_info(
                    await at.ask("GET", f"/drives/{drive.id}/scales", ScalesInfo), as_json=as_json
                )
            return
        async with _axis_at(where, state) as axis:
            _print((await axis.units()).scales.all, as_json=as_json)

    run(work)


@app.command("set")
def state_scales(
    url: Url,
    station: Station = 1,
    profile: Profile = None,
    counts_per_rev: Annotated[float | None, typer.Option(help="increments of a turn")] = None,
    raw_per_rpm: Annotated[float | None, typer.Option(help="raw speed of one rpm")] = None,
    raw_per_rpm_s: Annotated[float | None, typer.Option(help="raw ramp of one rpm/s")] = None,
    server: Server = None,
    state: State = None,
) -> None:
    """State scales from a data sheet. Nothing is written to the drive, and nothing moves."""

    async def work() -> None:
        where = place(url, station, profile, server)
        if where.server is not None:
            body = {
                "counts_per_rev": counts_per_rev,
                "raw_per_rpm": raw_per_rpm,
                "raw_per_rpm_s": raw_per_rpm_s,
            }
            async with remote_drive(where) as (at, drive):
                path = f"/drives/{drive.id}/scales"
                _print_info(await at.ask("PUT", path, ScalesInfo, body=body))
            return
        async with _axis_at(where, state) as axis:
            said = await teaching.stated(axis, counts_per_rev, raw_per_rpm, raw_per_rpm_s)
            await _keep(axis, said, state)
            _print((await axis.units()).scales.all)

    run(work)


@app.command()
def forget(
    url: Url,
    station: Station = 1,
    profile: Profile = None,
    server: Server = None,
    state: State = None,
) -> None:
    """Forget what was said; the drive, its file and its manual count again."""

    async def work() -> None:
        where = place(url, station, profile, server)
        if where.server is not None:
            async with remote_drive(where) as (at, drive):
                _print_info(await at.ask("DELETE", f"/drives/{drive.id}/scales", ScalesInfo))
            return
        async with _axis_at(where, state) as axis:
            await _keep(axis, None, state)
            _print((await axis.units()).scales.all)

    run(work)


@app.command()
def teach(
    url: Url,
    station: Station = 1,
    profile: Profile = None,
    increments: Annotated[int, typer.Option(help="of the first small move")] = 500,
    torque_percent: Annotated[float, typer.Option(help="% of rated, at most")] = 20.0,
    cycle_ms: Annotated[float, typer.Option(help="cycle time in ms")] = 1.0,
    server: Server = None,
    state: State = None,
) -> None:
    """Teach the scales by small moves: look how far the shaft turns. The axis moves."""

    async def work() -> None:
        where = place(url, station, profile, server)
        if where.server is not None:
            await _teach_there(where, increments, torque_percent, cycle_ms)
            return
        await _teach_here(where, increments, torque_percent, cycle_ms, state)

    run_in_order(work)


async def _teach_there(where: Place, increments: int, torque: float, cycle_ms: float) -> None:
    async with remote_drive(where) as (at, drive):
        path, ask = f"/drives/{drive.id}", increments
        while True:
            body = {"increments": ask, "torque_limit": torque, "cycle_ms": cycle_ms}
            found = SmallMoveResult.model_validate(await at.result(f"{path}/jobs/small_move", body))
            if (turned := _turned(found.moved_increments)) is not None:
                break
            ask = _farther(ask, found.next_most)
        said = {"turned_rev": turned}
        _print_info(await at.ask("POST", f"{path}/scales/confirm", ScalesInfo, body=said))


async def _teach_here(
    where: Place, increments: int, torque: float, cycle_ms: float, state: Path | None
) -> None:
    from backend.axes.axis.cyclic import CyclicSession
    from backend.tools.moving.moves.small_move import SmallMoveSettings, small_move

    async with _axis_at(where, state) as axis:
        session = CyclicSession(axis.drive.ports[0].link, [axis.drive])
        await session.start(cycle_ms / 1e3)
        axis.session = session
        ask = increments
        try:
            while True:
                settings = SmallMoveSettings(ask, torque)
                found = SmallMoveResult.model_validate(
                    await small_move(axis, session, settings, progress())
                )
                if (turned := _turned(found.moved_increments)) is not None:
                    break
                ask = _farther(ask, found.next_most)
        finally:
            axis.session = None
            await session.stop()
        await _keep(axis, await teaching.confirmed(axis, turned), state)
        _print((await axis.units()).scales.all)


def _farther(increments: int, most: int) -> int:
    """Increments of the next move: ten times as far in the same direction, at most ``most``."""
    return int(math.copysign(min(10 * abs(increments), most), increments))


def _turned(increments: int) -> float | None:
    """Revolutions of the shaft as a person saw them; None: too few to decide, move further."""
    question = words_of("printed.how-far", increments=increments)
    while True:
        answer = str(typer.prompt(question, default="", show_default=False)).strip()
        if not answer:
            return None
        # The axis has moved already: a slip of the keyboard must not make it move again.
        with contextlib.suppress(ValueError):
            if math.isfinite(turned := float(answer.replace(",", "."))):
                return turned


def _print(scales: tuple[Scale, ...], *, as_json: bool = False) -> None:
    if as_json:
        rows = [
            {
                "quantity": scale.quantity.value,
                "raw_per_unit": scale.raw_per_unit,
                "raw_unit": scale.raw_unit,
                "origin": scale.origin.value,
                "source": scale.source,
                "uncertainty": scale.uncertainty and scale.uncertainty.value,
            }
            for scale in scales
        ]
        print(json.dumps(rows, indent=1))
        return
    for scale in scales:
        unit, source = _UNITS[scale.quantity], f"  {scale.source}" if scale.source else ""
        if scale.raw_per_unit is None:
            why = words_of("printed.scale-not-certain", why=scale.why)
            print(f"{scale.quantity.value:12} {why}{source}")
            print(f"{'':12} {what_to_do(scale).words(language())}")
        else:
            per_unit = words_of(
                "printed.raw-per-unit",
                raw=f"{scale.raw_per_unit:.9g}",
                unit=unit,
                origin=scale.origin.value,
            )
            print(f"{scale.quantity.value:12} {per_unit}{source}")


def _print_info(info: ScalesInfo, *, as_json: bool = False) -> None:
    scales = tuple(
        Scale(s.quantity, s.raw_per_unit, s.raw_unit, s.origin, s.source, s.uncertainty)
        for s in info.scales
    )
    _print(scales, as_json=as_json)
