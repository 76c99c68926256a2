"""``servodeck bus``: recording the frames of a bus."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Annotated

import typer

from backend.commands.base.options import Server, Url, server_for
from backend.commands.base.printing import print_text
from backend.commands.base.session import opened, run, show_progress
from backend.foundation.store.files import write_atomically
from drivers.errors import NotAllowed

app = typer.Typer(no_args_is_help=True, help="What goes over the wires of a bus.")


@app.callback()
def main() -> None:
    """What goes over the wires of a bus."""


@app.command()
def record(
    url: Url,
    out: Annotated[Path, typer.Option(help="pcapng file to write, for Wireshark")],
    station: Annotated[int | None, typer.Option(help="only what has to do with it")] = None,
    seconds: Annotated[
        float, typer.Option(min=0.0, max=60.0, help="how long, where the bus is opened here")
    ] = 10.0,
    server: Server = None,
) -> None:
    """Write the frames of a bus into a file: a running server's last minute, or those of a search.

    Where no server has the bus it is opened here, searched for drives and listened to. Nothing
    moves.
    """

    async def work() -> None:
        data = await _recorded(url, station, seconds, server)
        write_atomically(out, data)
        print_text("printed.file-bytes", file=str(out), size=len(data))

    run(work)


async def _recorded(url: str, station: int | None, seconds: float, server: str | None) -> bytes:
    if at := server_for(url, server):
        from backend.commands.base.remote import remote

        query = {"url": url} | ({} if station is None else {"station": str(station)})
        async with remote(at) as asked:
            answer = await asked.raw("GET", "/buses/flight", query=query)
            return answer.content
    async with opened(url) as link:
        if link.frames is None:
            raise NotAllowed("command.frames-not-recorded", value=url)
        await link.scan(show_progress, None)
        await asyncio.sleep(seconds)
        return await link.frames.flight(station)
