"""``servodeck jog`` and ``servodeck scope``: through a running server, like a page.

A jog lasts as long as the command: its signs of life end with it for whatever reason, and the axis
is braked 200 ms later. Samples are written as they arrive; lost samples are counted.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import math
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Annotated

import typer
from pydantic import TypeAdapter, ValidationError
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import WebSocketException

from backend.api.live.messages import Hello, JogEnded, Refused, ScopeInfo
from backend.commands.base.options import Profile, Server, Station, Url, server_for
from backend.commands.base.printing import print_text, words_of
from backend.commands.base.remote import authorisation, remote
from backend.commands.base.session import run
from backend.commands.drive.samples import Samples, decode
from drivers.errors import DriveError, LinkLost, NotAllowed
from drivers.texts.message import Text, language, prose

_RENEW_S, _END_S, _OPEN_S = 0.04, 20.0, 10.0
_LONGEST_JOG_S, _MERGE_S = 60.0, 2.0

Cycle = Annotated[
    int | None,
    typer.Option(help="exchange process data with this cycle in µs; as it is, where not given"),
]

_News = TypeAdapter[Hello | JogEnded | ScopeInfo | Refused](Hello | JogEnded | ScopeInfo | Refused)


def jog(
    url: Url,
    seconds: Annotated[float, typer.Option(help="how long the button is held")],
    speed: Annotated[float, typer.Option(help="in rpm")],
    station: Station = 1,
    profile: Profile = None,
    server: Server = None,
    backwards: Annotated[bool, typer.Option("--backwards", help="the other direction")] = False,
    acceleration: Annotated[float, typer.Option(help="in rpm/s")] = 1000.0,
    travel: Annotated[float, typer.Option(help="longest way, in revolutions")] = 1.0,
    torque: Annotated[float, typer.Option(help="highest torque, in % of rated")] = 100.0,
    cycle_us: Cycle = None,
) -> None:
    """Turn an axis for as long as this command runs. It moves; Ctrl+C stops it."""
    if not 0 < seconds <= _LONGEST_JOG_S:
        raise typer.BadParameter(words_of("command.seconds", most=_LONGEST_JOG_S))

    async def work() -> None:
        at = _needed(url, server)
        async with remote(at) as bench:
            drive = await bench.drive(url, station, profile)
            request: dict[str, object] = {
                "type": "jog_start",
                "drive": drive.id,
                "direction": -1 if backwards else 1,
                "speed": speed,
                "acceleration": acceleration,
                "travel_limit": travel,
                "torque_limit": torque,
            }
            async with bench.exchange(url, cycle_us), _page(at) as page:
                print_text("printed.axis-moves", drive=drive.name)
                ended = await _hold(page, request, seconds)
        if ended.problem is not None:
            raise NotAllowed(ended.problem.detail, remedy=ended.problem.remedy)
        print_text("printed.jog-ended", reason=_why(ended))

    run(work)


def scope(
    url: Url,
    keys: Annotated[list[str], typer.Argument(metavar="KEY…")],
    seconds: Annotated[float, typer.Option(help="how long to record")],
    out: Annotated[Path, typer.Option(help="CSV file to write")],
    station: Annotated[list[int] | None, typer.Option(help="once for every drive; 1")] = None,
    profile: Profile = None,
    server: Server = None,
    cycle_us: Cycle = None,
) -> None:
    """Record signals of one drive or several into a CSV file. Nothing moves."""

    async def work() -> None:
        at = _needed(url, server)
        async with remote(at) as bench:
            drives = [await bench.drive(url, number, profile) for number in station or [1]]
            channels = [{"drive": d.id, "key": key} for d in drives for key in keys]
            async with bench.exchange(url, cycle_us), _page(at) as page:
                with out.open("w", encoding="utf-8", newline="") as file:
                    recorded = Recording(file, {d.id: d.name for d in drives})
                    await _record(page, channels, seconds, recorded)
        print_text("printed.samples", file=str(out), samples=recorded.rows, lost=recorded.dropped)

    run(work)


def _why(ended: JogEnded) -> Text:
    """Why a jog ended, as a text in the language of this command."""
    if (message := ended.reason_message) is None:
        return prose(ended.reason)
    return Text.from_wire(message.model_dump())


def _needed(url: str, server: str | None) -> str:
    at = server_for(url, server)
    if at is None:
        raise NotAllowed("command.needs-running-server-whose")
    return at


@asynccontextmanager
async def _page(server: str) -> AsyncIterator[ClientConnection]:
    """A live connection like that of a page, after the server's greeting."""
    address = server.rstrip("/").replace("http", "ws", 1) + "/api/v1/live"
    headers = {**authorisation(), "Accept-Language": language()}
    async with contextlib.AsyncExitStack() as opened:
        try:
            page = await opened.enter_async_context(
                connect(address, additional_headers=headers, open_timeout=_OPEN_S, max_size=None)
            )
            await _next(page, Hello)
        except (WebSocketException, TimeoutError, OSError) as error:
            raise _failed(server, error) from error
        try:
            yield page
        # Not an OSError: the file that samples are written to may have failed.
        except (WebSocketException, TimeoutError) as error:
            raise _failed(server, error) from error


def _failed(server: str, error: Exception) -> LinkLost:
    return LinkLost("command.live-connection-failed", server=server, cause=str(error))


def _reported(message: str) -> Hello | JogEnded | ScopeInfo | None:
    """The content of a message; None for other kinds of messages.

    Raises:
        NotAllowed: the message is a refusal.
    """
    try:
        news = _News.validate_json(message)
    except ValidationError:
        return None
    if isinstance(news, Refused):
        raise NotAllowed(news.problem.detail, remedy=news.problem.remedy)
    return news


async def _next(page: ClientConnection, kind: type[Hello | JogEnded]) -> Hello | JogEnded:
    """The next message of this kind.

    Raises:
        NotAllowed: the server refuses.
        LinkLost: the server has ended the connection.
    """
    async for message in page:
        if not isinstance(message, bytes) and isinstance(news := _reported(message), kind):
            return news
    raise LinkLost("command.server-ended-live-connection")


async def _hold(page: ClientConnection, request: dict[str, object], seconds: float) -> JogEnded:
    """Hold the button until the time is over, Ctrl+C is pressed, or the jog has ended by itself."""
    about = {"drive": request["drive"]}
    await page.send(json.dumps(request))
    end = asyncio.ensure_future(_next(page, JogEnded))
    try:
        until = time.monotonic() + seconds
        while not end.done() and time.monotonic() < until:
            await page.send(json.dumps({"type": "jog_renew"} | about))
            await asyncio.wait({end}, timeout=_RENEW_S)
        await page.send(json.dumps({"type": "jog_stop"} | about))
        async with asyncio.timeout(_END_S):
            ended = await end
    finally:
        if not end.done():
            end.cancel()
            # Where the connection is lost the server brakes by itself, without signs of life.
            with contextlib.suppress(WebSocketException, OSError):
                await page.send(json.dumps({"type": "jog_stop"} | about))
    assert isinstance(ended, JogEnded)
    return ended


@dataclass
class Recording:
    """A CSV file of samples: time [s], then one column per channel; empty without a sample.

    Every drive is a separate stream. Samples of the same instant become one row; a row is written
    once samples `_MERGE_S` later have arrived.
    """

    file: IO[str]
    names: dict[str, str]
    rows: int = 0
    dropped: int = 0
    _head: str = ""
    _start_s: float | None = field(default=None)
    _waiting: dict[int, list[float]] = field(default_factory=dict)

    def head(self, info: ScopeInfo) -> None:
        """Write the heading, once the server has reported the channels."""
        if self._head:
            return
        titles = [
            f'"{self.names[c.drive]} {c.key} {c.name} [{c.unit}]"'.replace(" []", "")
            for c in info.channels
        ]
        self._head = ",".join(["time [s]", *titles])
        self.file.write(self._head + "\n")

    def add(self, samples: Samples) -> None:
        """Add a block of samples."""
        self.dropped += samples.dropped
        for moment, row in zip(samples.times_s, samples.values, strict=True):
            place = round(float(moment) * 1e6)
            known = self._waiting.get(place)
            if known is None:
                self._waiting[place] = row.tolist()
                continue
            for column, value in enumerate(row.tolist()):
                if not math.isnan(value):
                    known[column] = value
        if self._waiting and self._head:
            self._write(max(self._waiting) - round(_MERGE_S * 1e6))

    def end(self) -> None:
        """Write the remaining rows."""
        if self._waiting:
            self._write(max(self._waiting))

    def _write(self, until: int) -> None:
        """Write the rows up to this time [µs], in order."""
        for place in sorted(p for p in self._waiting if p <= until):
            row = self._waiting.pop(place)
            moment = place / 1e6
            self._start_s = moment if self._start_s is None else self._start_s
            cells = ("" if math.isnan(value) else f"{value:.9g}" for value in row)
            self.file.write(",".join([f"{moment - self._start_s:.6f}", *cells]) + "\n")
            self.rows += 1


async def _record(
    page: ClientConnection, channels: list[dict[str, str]], seconds: float, into: Recording
) -> None:
    await page.send(json.dumps({"type": "scope_start", "subscription": 1, "channels": channels}))
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(seconds) as clock:
            async for message in page:
                if isinstance(message, bytes):
                    for block in decode(message):
                        into.add(block)
                    continue
                if isinstance(news := _reported(message), ScopeInfo):
                    if news.problem is not None:
                        raise NotAllowed(news.problem.detail, remedy=news.problem.remedy)
                    into.head(news)
                    clock.reschedule(asyncio.get_running_loop().time() + seconds)
    into.end()
    if not into.rows:
        raise DriveError("command.no-sample-came")
