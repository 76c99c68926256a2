"""``servodeck sweep``, and what all measurements without the page have in common."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from contextlib import asynccontextmanager
from enum import StrEnum
from pathlib import Path
from typing import Annotated, NamedTuple

import typer

from backend.api.station.models import DriveSummary
from backend.axis.axis import Axis, Envelope
from backend.axis.cyclic import CyclicSession
from backend.commands.options import Json, Server, server_for
from backend.commands.printing import print_text
from backend.commands.remote import Remote, remote
from backend.commands.restoring import restore_first
from backend.commands.session import drive_and_pending, progress, run_in_order
from backend.store.files import write_atomically
from drivers.errors import NotAllowed

Answer = Mapping[str, object]
Url = Annotated[str | None, typer.Argument(metavar="[BUS_URL]")]
Station = Annotated[int, typer.Option(help="station address on the bus")]
Profile = Annotated[str | None, typer.Option(help="drive family; recognised where possible")]
AxisName = Annotated[str | None, typer.Option("--axis", help="the server's name of the drive")]
Out = Annotated[Path | None, typer.Option(help="JSON file to write")]
Cycle = Annotated[float, typer.Option(help="cycle time in ms")]
Travel = Annotated[float, typer.Option(help="longest way from the start, in revolutions")]
Speed = Annotated[float, typer.Option(help="highest speed, in rpm")]
Torque = Annotated[float, typer.Option(help="highest torque, in % of rated")]
Rated = Annotated[float | None, typer.Option(help="rated torque in Nm, if not the drive's")]
Consent = Annotated[
    bool,
    typer.Option(
        "--consent",
        help="measure although nothing in the drive ends a speed when this computer falls silent "
        "(DS_C): its travel limits are active and a hand is on the emergency stop",
    ),
]


class KindName(StrEnum):
    """What is measured."""

    mechanics = "mechanics"
    speed_loop = "speed_loop"
    position_loop = "position_loop"


class LoopName(StrEnum):
    """Which loop is closed meanwhile."""

    auto = "auto"
    none = "none"
    speed = "speed"
    position = "position"


class WaveformName(StrEnum):
    """What the axis is moved with."""

    multisine = "multisine"
    chirp = "chirp"
    prbs = "prbs"
    stepped = "stepped"


def sweep(
    url: Url = None,
    station: Station = 1,
    profile: Profile = None,
    server: Server = None,
    axis: AxisName = None,
    kind: KindName = KindName.mechanics,
    loop: LoopName = LoopName.auto,
    cycle_ms: Cycle = 1.0,
    travel_rev: Travel = 3.0,
    speed_rpm: Speed = 1200.0,
    torque_percent: Torque = 80.0,
    f_min_hz: Annotated[float, typer.Option(help="lowest line")] = 5.0,
    f_max_hz: Annotated[float | None, typer.Option(help="highest line")] = None,
    share: Annotated[float, typer.Option(help="excitation's share of the torque")] = 0.35,
    realisations: Annotated[int, typer.Option(help="pairs of realisations")] = 2,
    excitation: Annotated[WaveformName, typer.Option(help="signal")] = WaveformName.multisine,
    odd_lines: Annotated[
        bool,
        typer.Option(
            "--odd-lines", help="excite odd lines alone; tells noise, even and odd distortion apart"
        ),
    ] = False,
    rated_torque_nm: Rated = None,
    consent: Consent = False,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Measure a frequency response and write it as JSON. The axis moves."""
    limits = {
        "travel_limit": travel_rev, "speed_limit": speed_rpm, "torque_limit": torque_percent,
        "time_limit_s": 60.0, "consent": consent, "cycle_ms": cycle_ms,
    }  # fmt: skip
    more: dict[str, object] = {
        "kind": kind.value, "loop": loop.value, "f_min_hz": f_min_hz, "f_max_hz": f_max_hz,
        "share": share, "realisations": realisations, "rated_torque_nm": rated_torque_nm,
        "excitation": excitation.value, "odd_lines": odd_lines,
    }  # fmt: skip

    async def here() -> dict[str, object]:
        # The analysis takes seconds to import; no other command shall wait for it.
        from backend.tools.sweep import evaluation as sweep_evaluation
        from backend.tools.sweep import run as sweep_tool

        settings = sweep_evaluation.SweepSettings(
            Envelope(travel_rev, speed_rpm, torque_percent, 60.0), kind.value, loop.value,
            f_min_hz, f_max_hz, share, realisations, rated_torque_nm=rated_torque_nm,
            excitation=excitation.value, odd_lines=odd_lines,
        )  # fmt: skip
        async with exchanging(url, station, profile, cycle_ms, settings.envelope, consent) as (
            found,
            session,
        ):
            return sweep_evaluation.as_json(
                await sweep_tool.sweep(found, session, settings, progress())
            )

    where = Where(url, station, profile, server, axis)
    measure(where, "sweep", here, limits | more, out, _reported, as_json=as_json)


@asynccontextmanager
async def exchanging(
    url: str | None, station: int, profile: str | None, cycle_ms: float, envelope: Envelope,
    consent: bool, *, closes_loops: bool = True,
) -> AsyncIterator[tuple[Axis, CyclicSession]]:  # fmt: skip
    """The drive with its bus exchanging process data, all of it ended afterwards.

    ``closes_loops`` as in `Tool`.
    """
    from backend.axis.cyclic_mode import keeping_mode
    from backend.commands.scales import take_taught
    from backend.tools.sweep import profile_speed

    assert url is not None, "Where.asked says so"
    async with drive_and_pending(url, station, profile) as (drive, pending):
        axis = Axis(drive)
        await restore_first(axis, pending)
        await take_taught(axis)
        link = drive.ports[0].link
        by_speed = {drive.id} if profile_speed.needed(drive, link) else set[str]()
        session = CyclicSession(link, [drive], by_speed)
        await session.start(cycle_ms / 1e3)
        axis.session = session
        try:
            with axis.granted("measurement from the command line", envelope):
                async with (
                    profile_speed.prepared(axis, session, envelope, consent)
                    if closes_loops
                    else keeping_mode(axis, session)
                ):
                    yield axis, session
        finally:
            axis.session = None
            await session.stop()


@asynccontextmanager
async def reading(url: str | None, station: int, profile: str | None) -> AsyncIterator[Axis]:
    """The drive for a tool that reads alone: no exchange, no grant, and nothing is written."""
    from backend.commands.scales import take_taught

    assert url is not None, "Where.asked says so"
    async with drive_and_pending(url, station, profile) as (drive, _pending):
        axis = Axis(drive)
        await take_taught(axis)
        yield axis


class Where(NamedTuple):
    """A drive by bus URL and station, or by the name that a server gives it."""

    url: str | None
    station: int
    profile: str | None
    server: str | None
    axis: str | None

    @property
    def asked(self) -> str | None:
        """The server to ask; None where the bus is opened here.

        Raises:
            NotAllowed: neither a bus nor a drive of a server is named. OutOfRange: no bus URL.
        """
        if self.url is None:
            if self.server is None or self.axis is None:
                raise NotAllowed("command.give-bus-url-station")
            return self.server
        return server_for(self.url, self.server)

    async def drive(self, at: Remote) -> DriveSummary:
        """The server's drive; one at a bus URL is put on its bench where it is not.

        Raises:
            NotAllowed: there is none, or several families would fit.
        """
        if self.url is not None:
            return await at.drive(self.url, self.station, self.profile)
        drives = await at.drives()
        drive = next((d for d in drives if self.axis in (d.name, d.id)), None)
        if drive is None:
            names = ", ".join(d.name for d in drives) or "none"
            raise NotAllowed(
                "command.no-drive-give-name-2", value=self.axis, limit=names, address=at.address
            )
        return drive


def measure(
    where: Where, kind: str, here: Callable[[], Awaitable[Answer]], request: Answer,
    out: Path | None, reported: Callable[[Answer], list[str]], *, as_json: bool,
) -> None:  # fmt: skip
    """Measure by a server or ``here``, write and show the result.

    Ctrl+C ends the motion first: see `run_in_order`.
    """

    async def work() -> None:
        server = where.asked
        if server is None:
            answer = await here()
        else:
            async with remote(server) as at:
                drive = await where.drive(at)
                answer = await at.result(f"/drives/{drive.id}/jobs/{kind}", request)
        show(answer, out, reported, as_json=as_json)

    run_in_order(work)


def show(
    answer: Answer, out: Path | None, reported: Callable[[Answer], list[str]], *, as_json: bool
) -> None:
    """Write a result to ``out``, and print it as JSON or in words."""
    if out is not None:
        write_atomically(out, json.dumps(answer, indent=1).encode())
    if as_json:
        print(json.dumps(answer, indent=1))
        return
    for line in reported(answer):
        print(line)
    if out is not None:
        print_text("printed.written", file=str(out))


def _reported(answer: Answer) -> list[str]:
    rows, warnings = answer["resonances"], answer["warnings"]
    lines = [
        f"{row['kind']:14} {row['frequency_hz']:8.1f} Hz  damping {row['damping']:.3f}"
        for row in (rows if isinstance(rows, list) else [])
    ]
    return lines + [f"note: {w}" for w in (warnings if isinstance(warnings, list) else [])]
