"""``servodeck lss``: node numbers and bit rates of CANopen nodes (CiA 305)."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from backend.commands.base.options import Json, Url
from backend.commands.base.printing import print_text, words_of
from backend.commands.base.session import opened, run, show_progress
from drivers.canopen.link import CanopenLink, can_bus_of
from drivers.canopen.lss.access import LssNode
from drivers.canopen.lss.codes import LssIdentity
from drivers.errors import NotAllowed, OutOfRange
from drivers.link import Link

app = typer.Typer(
    no_args_is_help=True,
    help="Node number and bit rate of a CANopen node that has none, or by its identity (CiA 305).",
)

Meant = Annotated[
    str | None,
    typer.Option("--identity", help="VENDOR:PRODUCT:REVISION:SERIAL, as `search` prints it"),
]
Store = Annotated[bool, typer.Option(help="keep it in the node over a power cycle")]
Yes = Annotated[bool, typer.Option("--yes", help="do not ask")]


@app.command()
def search(url: Url, as_json: Json = False) -> None:
    """Find a node without number, else the only node with these services. Changes nothing."""

    async def work() -> bool:
        async with opened(url) as link:
            found = await _can(link).lss.search(show_progress)
        if as_json:
            print(json.dumps(None if found is None else found.identity._asdict() | _number(found)))
        elif found is None:
            print_text("printed.no-lss-node")
        else:
            print(_named(found))
        return found is not None

    if not run(work):
        raise typer.Exit(1)


@app.command()
def node(
    url: Url,
    number: Annotated[int, typer.Argument(min=1, max=127, help="the number that it gets")],
    identity: Annotated[
        str | None, typer.Option(help="VENDOR:PRODUCT:REVISION:SERIAL, as `search` prints it")
    ] = None,
    store: Store = True,
    yes: Yes = False,
) -> None:
    """Give a node its number. One that had none starts at once, another at its next reset."""

    async def work() -> None:
        async with opened(url) as link:
            can = _can(link)
            meant = await _meant(can, identity)
            _confirm(words_of("printed.give-number", node=_text(meant), number=number), yes)
            await can.lss.set_node(meant, number, store=store)
        print_text(
            "printed.has-stored-number" if store else "printed.has-number",
            node=_text(meant),
            number=number,
        )

    run(work)


@app.command("bit-rate")
def bit_rate(
    url: Url,
    kbit: Annotated[int, typer.Argument(help="1000, 800, 500, 250, 125, 50, 20 or 10 kbit/s")],
    identity: Annotated[
        str | None, typer.Option(help="VENDOR:PRODUCT:REVISION:SERIAL, as `search` prints it")
    ] = None,
    yes: Yes = False,
) -> None:
    """Set a node's bit rate and store it. It counts after the node was switched off and on."""

    async def work() -> None:
        async with opened(url) as link:
            can = _can(link)
            meant = await _meant(can, identity)
            _confirm(words_of("printed.set-bit-rate", node=_text(meant), kbit=kbit), yes)
            await can.lss.set_bit_rate(meant, kbit, store=True)
        print_text("printed.bit-rate-set", node=_text(meant), kbit=kbit)

    run(work)


async def _meant(link: CanopenLink, identity: str | None) -> LssIdentity:
    """The identity that was given, otherwise that of the node that a search finds.

    Raises:
        OutOfRange: not four numbers.
        NotAllowed: no node answers, or several do.
    """
    if identity is not None:
        try:
            numbers = [int(part, 0) for part in identity.split(":")]
        except ValueError:
            numbers = []
        if len(numbers) != len(LssIdentity._fields) or not all(0 <= n < 1 << 32 for n in numbers):
            raise OutOfRange("command.lss-no-identity", value=identity)
        return LssIdentity(*numbers)
    found = await link.lss.search(show_progress)
    if found is None:
        raise NotAllowed("command.lss-nobody")
    return found.identity


def _can(link: Link) -> CanopenLink:
    bus = can_bus_of(link)
    if bus is None:
        raise NotAllowed("command.lss-canopen-only", value=link.url)
    return bus


def _confirm(question: str, yes: bool) -> None:
    if not yes and not typer.confirm(question):
        raise NotAllowed("command.lss-not-confirmed")


def _text(identity: LssIdentity) -> str:
    return ":".join(f"{number:#x}" for number in identity)


def _named(found: LssNode) -> str:
    if found.node is None:
        number = words_of("printed.no-number")
    else:
        number = words_of("printed.number", number=found.node)
    return f"{_text(found.identity)}  {number}"


def _number(found: LssNode) -> dict[str, int | None]:
    return {"node": found.node}
