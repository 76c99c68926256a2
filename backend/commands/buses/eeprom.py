"""``servodeck eeprom``: save, compare and restore the EEPROM of an EtherCAT drive."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import typer

from backend.commands.base.options import Json, Server, Station, Url, server_for
from backend.commands.base.printing import print_text, words_of
from backend.commands.base.session import opened, run, show_progress
from backend.foundation.store.files import write_atomically
from drivers.errors import NotAllowed
from drivers.ethercat.eeprom.expected import against_profile
from drivers.ethercat.eeprom.image import Difference, Image, differences
from drivers.ethercat.eeprom.plan import Plan
from drivers.ethercat.link import EthercatLink, segment_of
from drivers.link import Link
from drivers.texts.imports import failure_text
from profiles.importer import ImportFailed, import_file
from profiles.importer.files import is_xml
from profiles.schema import Profile

app = typer.Typer(
    no_args_is_help=True,
    help="The EEPROM of an EtherCAT drive: save, compare, restore, alias, identity.",
)

Size = Annotated[int | None, typer.Option(help="bytes, where a damaged EEPROM does not say")]
Digest = Annotated[
    str | None, typer.Option("--confirm", help="the digest that was shown; else it is asked for")
]
Yes = Annotated[bool, typer.Option("--yes", help="second confirmation; else it is asked for")]


class _Shown(NamedTuple):
    """A plan as it is printed, made by the command or by a server."""

    digest: str
    words: int
    keeps_serial: bool
    changes: list[dict[str, Any]]


@app.command()
def read(
    url: Url,
    out: Annotated[Path, typer.Option(help="file to write")],
    station: Station = 1,
    size: Size = None,
    server: Server = None,
) -> None:
    """Save the whole EEPROM to a file. Writes nothing to the drive."""

    async def work() -> None:
        image = Image(await _contents(url, station, size, server))
        write_atomically(out, image.data)
        print_text("printed.file-bytes", file=str(out), size=len(image.data))
        problem = image.problem()
        if problem is not None:
            print_text("printed.attention", problem=problem)

    run(work)


@app.command()
def compare(
    url: Url,
    file: Annotated[Path, typer.Argument(help="a saved EEPROM, or the maker's ESI file (.xml)")],
    station: Station = 1,
    product_code: Annotated[
        str | None, typer.Option(help="which device of the ESI file, e.g. 0x190")
    ] = None,
    as_json: Json = False,
    server: Server = None,
) -> None:
    """Show in which fields the EEPROM and a file differ. Ends with 1 where they do."""

    async def work() -> bool:
        data = file.read_bytes()
        if is_xml(data):
            profile = _profile_of(data, file.name, _number(product_code))
            image = Image(await _contents(url, station, None, server))
            found = against_profile(image, profile)
        else:
            image = Image(await _contents(url, station, max(len(data) // 128 * 128, 128), server))
            found = differences(image, Image(data))
        rows = [_row(each) for each in found]
        if as_json:
            print(json.dumps(rows, indent=1))
        else:
            _print_changes(rows, words_of("printed.drive"), words_of("printed.file"))
            if not rows:
                print_text("printed.eeprom-as-file")
        return not rows

    if not run(work):
        raise typer.Exit(1)


@app.command()
def restore(
    url: Url,
    file: Annotated[Path, typer.Argument(help="the EEPROM as it was saved from this drive")],
    station: Station = 1,
    confirm: Digest = None,
    yes: Yes = False,
    accept_unknown: Annotated[
        bool,
        typer.Option(help="the file is of this drive although the drive cannot say what it is"),
    ] = False,
    server: Server = None,
) -> None:
    """Write a saved EEPROM back, after showing what changes and asking twice.

    Refused in Safe-Op and Op, for a file of another drive, and for a damaged file. The drive keeps
    its serial number. Everything is read back. It counts after a power cycle.
    """
    _change(url, station, "restore", file.read_bytes(), accept_unknown, confirm, yes, server)


@app.command("repair-identity")
def repair_identity(
    url: Url, station: Station = 1, confirm: Digest = None, yes: Yes = False, server: Server = None
) -> None:
    """Write vendor, product and revision as the drive's firmware says them (1018h)."""
    _change(url, station, "identity", b"", False, confirm, yes, server)


@app.command()
def alias(
    url: Url,
    value: Annotated[int, typer.Argument(min=0, max=65535, help="the station alias; 0 is none")],
    station: Station = 1,
    yes: Yes = False,
    server: Server = None,
) -> None:
    """Write the station alias with its checksum. It counts after a power cycle."""

    async def work() -> None:
        question = words_of("printed.confirm-alias", alias=str(value), station=str(station))
        if not yes and not typer.confirm(question):
            raise NotAllowed("command.eeprom-not-confirmed")
        if at := server_for(url, server):
            from backend.commands.base.remote import remote

            body = {"url": url, "station": station, "alias": value, "confirmed": True}
            async with remote(at) as asked:
                await asked.raw("POST", "/ethercat/alias", body=body)
        else:
            async with opened(url) as link:
                segment = _segment(link)
                await segment.scan(show_progress)
                await segment.set_alias(station, value)
        print_text("printed.alias-written", alias=value, station=station)

    run(work)


def _change(
    url: str,
    station: int,
    what: str,
    data: bytes,
    unknown: bool,
    confirm: str | None,
    yes: bool,
    server: str | None,
) -> None:
    async def work() -> None:
        if at := server_for(url, server):
            await _by_server(at, url, station, what, data, unknown, confirm, yes)
            return
        async with opened(url) as link:
            segment = _segment(link)
            await segment.scan(show_progress)
            plan = await _planned(segment, station, what, data, unknown)
            rows = [_row(each) for each in plan.changes]
            shown = _Shown(plan.digest, plan.words, plan.keeps_serial, rows)
            if _confirmed(shown, confirm, yes):
                await segment.eeprom.carry_out(station, plan, plan.digest, show_progress)
                _print_done(shown)

    run(work)


async def _by_server(
    at: str,
    url: str,
    station: int,
    what: str,
    data: bytes,
    unknown: bool,
    confirm: str | None,
    yes: bool,
) -> None:
    from backend.commands.base.remote import remote

    query = {
        "url": url,
        "station": str(station),
        "what": what,
        "unknown_accepted": str(unknown).lower(),
    }
    async with remote(at) as asked:
        answer = await asked.raw("POST", "/ethercat/eeprom/plan", content=data, query=query)
        reported = answer.json()
        shown = _Shown(
            reported["digest"], reported["words"], reported["keeps_serial"], reported["changes"]
        )
        if _confirmed(shown, confirm, yes):
            query |= {"digest": shown.digest, "confirmed": "true"}
            await asked.raw("POST", "/ethercat/eeprom/restore", content=data, query=query)
            _print_done(shown)


async def _planned(link: EthercatLink, station: int, what: str, data: bytes, unknown: bool) -> Plan:
    if what == "identity":
        return await link.eeprom.plan_identity(station, show_progress)
    return await link.eeprom.plan_restore(station, data, show_progress, unknown_accepted=unknown)


def _confirmed(shown: _Shown, confirm: str | None, yes: bool) -> bool:
    """Show the plan and ask for both confirmations; False where there is nothing to write.

    Raises:
        NotAllowed: a confirmation is missing, or the digest belongs to another plan.
    """
    if not shown.changes:
        print_text("printed.eeprom-like-this")
        return False
    _print_changes(shown.changes, words_of("printed.now"), words_of("printed.then"))
    if shown.keeps_serial:
        print_text("printed.keeps-serial")
    print_text("printed.words-to-write", count=shown.words, digest=shown.digest)
    given = confirm or typer.prompt(words_of("printed.type-digest")).strip()
    if given != shown.digest:
        raise NotAllowed("ethercat.eeprom-plan-changed", digest=shown.digest)
    if not yes and not typer.confirm(words_of("printed.confirm-eeprom")):
        raise NotAllowed("command.eeprom-not-confirmed")
    return True


async def _contents(url: str, station: int, size: int | None, server: str | None) -> bytes:
    if at := server_for(url, server):
        from backend.commands.base.remote import remote

        query = {"url": url, "station": str(station)}
        query |= {} if size is None else {"size": str(size)}
        async with remote(at) as asked:
            return (await asked.raw("GET", "/ethercat/eeprom", query=query)).content
    async with opened(url) as link:
        segment = _segment(link)
        await segment.scan(show_progress)
        return (await segment.eeprom.read(station, show_progress, size)).data


def _number(product_code: str | None) -> int | None:
    try:
        return None if product_code is None else int(product_code, 0)
    except ValueError as error:
        raise NotAllowed(
            "command.no-number", value=product_code, option="--product-code"
        ) from error


def _profile_of(data: bytes, name: str, product_code: int | None) -> Profile:
    try:
        return import_file(data, name, product_code=product_code).profile
    except ImportFailed as error:
        raise NotAllowed(failure_text(error), remedy="command.see-not-listed") from error


def _segment(link: Link) -> EthercatLink:
    segment = segment_of(link)
    if segment is None:
        raise NotAllowed("command.eeprom-ethercat-only", value=link.url)
    return segment


def _row(each: Difference) -> dict[str, Any]:
    return {"field": each.field, "word": each.word, "first": each.first, "second": each.second}


def _print_changes(rows: list[dict[str, Any]], first: str, second: str) -> None:
    for row in rows:
        print(f"{row['word']:#06x} {row['field']}")
        print(f"    {first}: {_short(row['first'])}")
        print(f"    {second}: {_short(row['second'])}")


def _short(data: str | None) -> str:
    if data is None:
        return words_of("printed.missing")
    if len(data) <= 64:
        return data
    return words_of("printed.part-of-bytes", part=data[:64], count=str(len(data) // 2))


def _print_done(shown: _Shown) -> None:
    print_text("printed.words-written", count=shown.words)
