"""Common parts of all measurements from the command line."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path
from typing import Annotated, NamedTuple

import typer

from backend.api.station.models import DriveSummary
from backend.axes.axis.axis import Axis, Envelope
from backend.axes.axis.cyclic import CyclicSession
from backend.commands.base.options import server_for
from backend.commands.base.printing import print_text
from backend.commands.base.remote import Remote, remote
from backend.commands.base.restoring import restore_first
from backend.commands.base.session import drive_and_pending, drive_on, opened, run_in_order
from backend.foundation.store.files import StorageFailed, require_writable, write_atomically
from backend.tools.tool import ToolSettings
from drivers.errors import NotAllowed
from drivers.texts.message import text

Answer = Mapping[str, object]
Url = Annotated[str | None, typer.Argument(metavar="[BUS_URL]")]
Station = Annotated[int, typer.Option(help="station address on the bus")]
Profile = Annotated[str | None, typer.Option(help="drive family; recognised where possible")]
AxisName = Annotated[str | None, typer.Option("--axis", help="the server's name of the drive")]
Out = Annotated[Path | None, typer.Option(help="JSON file to write")]
There = Callable[[Remote, DriveSummary, Answer], Awaitable[None]]


@asynccontextmanager
async def exchanging(
    url: str | None, station: int, profile: str | None, cycle_ms: float, envelope: Envelope,
    consent: bool, *, closes_loops: bool = True,
) -> AsyncIterator[tuple[Axis, CyclicSession]]:  # fmt: skip
    """The axis of a drive and its running cyclic exchange; both are ended afterwards.

    ``closes_loops`` as in `Tool`.
    """
    from backend.axes.axis.cyclic_mode import keeping_mode
    from backend.commands.drive.scales import take_taught
    from backend.tools.tuning.sweep import profile_speed

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
            with axis.granted(text("motion.purpose-command-line"), envelope):
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
async def exchanging_pair(
    url: str | None, stations: tuple[int, str], profile: str | None, settings: ToolSettings
) -> AsyncIterator[tuple[Axis, Axis, CyclicSession]]:
    """As `exchanging`, with two drives on one bus; the second station is a string as typed.

    Raises:
        NotAllowed: the second station is not a number, or equals the first.
    """
    from backend.commands.drive.scales import take_taught
    from backend.tools.tuning.sweep import profile_speed

    assert url is not None, "Where.asked says so"
    first, other = stations
    if not other.isdecimal() or int(other) == first:
        raise NotAllowed("command.partner-no-station", value=other)
    async with opened(url) as link, AsyncExitStack() as held:
        axes = []
        for station in (first, int(other)):
            drive, pending = await drive_on(link, url, station, profile)
            axis = Axis(drive)
            await restore_first(axis, pending)
            await take_taught(axis)
            axes.append(axis)
        session = CyclicSession(link, [axis.drive for axis in axes])
        await session.start(settings.cycle_ms / 1e3)
        held.push_async_callback(session.stop)
        for axis in axes:
            axis.session = session
            held.enter_context(axis.granted(text("motion.purpose-command-line"), settings.envelope))
            await held.enter_async_context(
                profile_speed.prepared(axis, session, settings.envelope, settings.consent)
            )
        yield axes[0], axes[1], session


@asynccontextmanager
async def reading(url: str | None, station: int, profile: str | None) -> AsyncIterator[Axis]:
    """The axis for a tool that only reads: no exchange, no grant, and nothing is written."""
    from backend.commands.drive.scales import take_taught

    assert url is not None, "Where.asked says so"
    async with drive_and_pending(url, station, profile) as (drive, _pending):
        axis = Axis(drive)
        await take_taught(axis)
        yield axis


class Where(NamedTuple):
    """A drive by bus URL and station, or by its name on a server."""

    url: str | None
    station: int
    profile: str | None
    server: str | None
    axis: str | None

    @property
    def asked(self) -> str | None:
        """Address of the server to use; None where the bus is opened here.

        Raises:
            NotAllowed: neither a bus nor a drive of a server is given.
            OutOfRange: not a bus URL.
        """
        if self.url is None:
            if self.server is None or self.axis is None:
                raise NotAllowed("command.give-bus-url-station")
            return self.server
        return server_for(self.url, self.server)

    async def drive(self, at: Remote) -> DriveSummary:
        """The drive on the server; a drive at a bus URL is connected there if it is not yet.

        Raises:
            NotAllowed: there is none, or several families match.
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
    there: There | None = None, files: Sequence[Path | None] = (),
    failed: Sequence[StorageFailed] = (),
) -> None:  # fmt: skip
    """Measure by a server or by ``here``, then write and show the result.

    ``there`` is called after a measurement by a server, with its result. ``files`` are further
    files that ``here`` and ``there`` write. All are tried before anything moves; what could not be
    written all the same is in ``failed``, and reported after the result. Ctrl+C ends the motion
    first: see `run_in_order`.
    """

    async def work() -> None:
        server = where.asked
        for file in (out, *files):
            if file is not None:
                require_writable(file)
        if server is None:
            answer = await here()
        else:
            async with remote(server) as at:
                drive = await where.drive(at)
                answer = await at.result(f"/drives/{drive.id}/jobs/{kind}", request)
                if there is not None:
                    await there(at, drive, answer)
        show(answer, out, reported, as_json=as_json)
        for error in failed:
            raise error

    run_in_order(work)


def show(
    answer: Answer, out: Path | None, reported: Callable[[Answer], list[str]], *, as_json: bool
) -> None:
    """Write a result to ``out``, and print it as JSON or as text.

    Raises:
        StorageFailed: it could not be written; it was printed as JSON, so that it is not lost.
    """
    failed: StorageFailed | None = None
    if out is not None:
        try:
            write_atomically(out, json.dumps(answer, indent=1).encode())
        except StorageFailed as error:
            failed = error
    if not as_json:
        for line in reported(answer):
            print(line)
    if as_json or failed is not None:
        print(json.dumps(answer, indent=1))
    if failed is not None:
        raise failed
    if out is not None and not as_json:
        print_text("printed.written", file=str(out))
