"""Options that several commands have, and the drive that they denote."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import typer

from drivers.urls import parse_url

#: Default address of `servodeck demo` and `servodeck serve`.
DEFAULT_SERVER = "http://127.0.0.1:8420"

Url = Annotated[str, typer.Argument(metavar="BUS_URL")]
Station = Annotated[int, typer.Option(help="station address on the bus")]
Profile = Annotated[str | None, typer.Option(help="drive family; recognised where possible")]
Json = Annotated[bool, typer.Option("--json", help="for scripts")]
Server = Annotated[
    str | None,
    typer.Option(
        envvar="SERVODECK_SERVER",
        help=f"ask this running server, as {DEFAULT_SERVER}, which is asked for virtual buses",
    ),
]


class Place(NamedTuple):
    """A drive on a bus; ``server``: address of the server to use, None to open the bus here."""

    url: str
    station: int
    profile: str | None
    server: str | None


def place(url: str, station: int, profile: str | None, server: str | None) -> Place:
    """The drive that a command's options denote.

    Raises:
        OutOfRange: not a bus URL.
    """
    return Place(url, station, profile, server_for(url, server))


def server_for(url: str, server: str | None) -> str | None:
    """Address of the server to use for a bus; None where the bus is opened here.

    Raises:
        OutOfRange: not a bus URL.
    """
    virtual = parse_url(url).is_virtual
    return server or (DEFAULT_SERVER if virtual else None)
