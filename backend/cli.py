"""The command line: ``servodeck …``."""

from __future__ import annotations

import asyncio
import contextlib
import io
import json
import os
import signal
import sys
import tempfile
from collections.abc import Awaitable, Callable
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from backend.commands import (
    functions,
    keep,
    live,
    measure,
    params,
    people,
    profile,
    remote_params,
    report,
)
from backend.commands.remote import Server, server_for
from backend.commands.session import opened, run, show_progress
from backend.commands.state import state_folder
from backend.demo import DemoBench
from backend.matching import match_profiles
from drivers.errors import NotAllowed
from drivers.urls import parse_url
from drivers.virtual.mechanics.spec import load_mechanics, standard_mechanics

app = typer.Typer(
    help="Servo-drive commissioning in a browser.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
app.add_typer(params.app, name="params")
app.add_typer(profile.app, name="profile")
app.add_typer(keep.audit, name="audit")
app.add_typer(keep.library, name="library")
app.command("backup")(keep.backup)
app.command("restore")(keep.restore)
app.add_typer(people.app, name="people")
app.command("jog")(live.jog)
app.command("scope")(live.scope)
app.command("sweep")(measure.sweep)
app.command("inertia")(measure.inertia)
app.command("report")(report.report)
app.command("recompute")(report.recompute)
app.command("io")(functions.io)
app.command("faults")(functions.faults)
app.command("gear")(functions.gear_command)
app.command("braking")(functions.braking)

Host = Annotated[
    str,
    typer.Option(
        "--host",
        "--bind",
        help="address to listen on; any but loopback needs accounts and uses HTTPS",
    ),
]
Port = Annotated[int, typer.Option(help="port to listen on; 0 takes a free one", min=0, max=65535)]
Config = Annotated[Path | None, typer.Option(help="folder of drives and parameter sets")]
Open = Annotated[bool, typer.Option("--open", help="open the page in a browser")]

Accounts = Annotated[
    bool | None,
    typer.Option(
        "--accounts/--single-user",
        help="log in, or be the one user of this machine; by default accounts are asked for "
        "where there are some",
        show_default=False,
    ),
]
CertificateFile = Annotated[
    Path | None, typer.Option("--certificate", help="own certificate with its chain (PEM)")
]
KeyFile = Annotated[Path | None, typer.Option("--key", help="key of that certificate (PEM)")]
AllowHost = Annotated[
    list[str] | None,
    typer.Option("--allow-host", help="name of a proxy or tunnel in front; asks for accounts"),
]


@app.command()
def serve(
    host: Host = "127.0.0.1",
    port: Port = 8420,
    config: Config = None,
    open_: Open = False,
    database: keep.Database = None,
    blobs: keep.BlobPlace = None,
    accounts: Accounts = None,
    certificate: CertificateFile = None,
    key: KeyFile = None,
    allow_host: AllowHost = None,
) -> None:
    """Start the server and the web page."""
    # The server takes longer to import than every other command takes to run.
    from backend.bench import Bench
    from backend.commands.serve import Serving
    from backend.commands.serve import serve as run_server

    serving = Serving(
        host, port, accounts, certificate, key, frozenset(allow_host or ()), open_page=open_
    )

    async def work() -> None:
        await run_server(Bench(state_folder(config), database=database, blobs=blobs), serving)

    _until_interrupted(work)


@app.command()
def demo(
    host: Host = "127.0.0.1",
    port: Port = 8420,
    bench: Annotated[Path | None, typer.Option(help="bench file (TOML)")] = None,
    config: Config = None,
    open_: Open = False,
    database: keep.Database = None,
    blobs: keep.BlobPlace = None,
    accounts: Accounts = None,
    certificate: CertificateFile = None,
    key: KeyFile = None,
    allow_host: AllowHost = None,
) -> None:
    """Start the server on a bench of virtual drives: no hardware, no root."""
    from backend.bench import Bench
    from backend.commands.serve import Serving
    from backend.commands.serve import serve as run_server

    serving = Serving(
        host, port, accounts, certificate, key, frozenset(allow_host or ()), open_page=open_
    )

    async def work() -> None:
        with tempfile.TemporaryDirectory(prefix="servodeck-") as folder:
            state = config or Path(folder) / "state"
            print("starting the virtual drives …", flush=True)
            with DemoBench(bench, Path(folder) / "wires", state / "nvm", steady=True) as drives:
                for url, real in drives.addresses.items():
                    print(f"  {url}  is  {real}")
                for problem in drives.problems:
                    print(f"  note: {problem}")
                server_bench = Bench(state, drives.wires, database=database, blobs=blobs)
                await run_server(server_bench, serving)

    _until_interrupted(work)


def _until_interrupted(work: Callable[[], Awaitable[None]]) -> None:
    def end(_number: int, _frame: object) -> None:
        # A service manager's end is as orderly as Ctrl+C: virtual drives and folders are let go.
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, end)
    # uvicorn has already shut down in order when the interrupt arrives here.
    with contextlib.suppress(KeyboardInterrupt):
        run(work)


def _one_drive(file: Path, folder: Path, nvm: Path | None) -> DemoBench:
    """The bench of `virtual`; its errors are about the command line, not about a file."""
    try:
        return DemoBench(file, folder, nvm)
    except NotAllowed as error:
        error.message = error.message.removeprefix(f"bench file {file}: ")
        raise


async def _told_to_end() -> None:
    """Wait for Ctrl+C or for the end that a service is given (SIGTERM)."""
    over, loop = asyncio.Event(), asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, over.set)
    await over.wait()


@app.command()
def virtual(
    drive: str,
    on: Annotated[str, typer.Option(help="bus URL; serial ones create the pty at that path")],
    station: Annotated[int, typer.Option()] = 1,
    mechanics: Annotated[Path | None, typer.Option(help="mechanics (TOML)")] = None,
    nvm: Annotated[Path | None, typer.Option(help="folder of the drive's memory")] = None,
) -> None:
    """Run one virtual drive on a real wire, for any client."""

    async def work() -> None:
        bus = parse_url(on)
        if bus.scheme == "ethercat" and not bus.is_virtual:
            raise NotAllowed(
                f"a virtual drive does not go on {on} by itself: it would answer on your network",
                value=on,
                limit="ethercat://virtual0",
                remedy="write ethercat://virtual0, or see docs/virtual-drives.md for an interface",
            )
        try:
            spec = load_mechanics(mechanics) if mechanics else standard_mechanics()
        except (OSError, ValueError) as error:
            raise NotAllowed(f"{mechanics}: {error}", remedy="correct the file") from error
        with tempfile.TemporaryDirectory(prefix="servodeck-") as folder:
            file = Path(folder) / "bench.json"
            axis = {
                "name": drive,
                "drive": drive,
                "on": on,
                "station": station,
                "mechanics": spec.model_dump(exclude_defaults=True),
            }
            file.write_text(json.dumps({"axis": [axis]}), "utf-8")
            with _one_drive(file, Path(folder), nvm) as drives:
                for real in drives.addresses.values():
                    print(f"{drive} answers at {real} station {station}  (Ctrl+C ends it)")
                sys.stdout.flush()
                await _told_to_end()

    _until_interrupted(work)


@app.command()
def scan(
    url: Annotated[str, typer.Argument(metavar="BUS_URL")],
    as_json: Annotated[bool, typer.Option("--json")] = False,
    server: Server = None,
) -> None:
    """Look for drives on a bus."""

    async def work() -> None:
        rows = await _found(url, server)
        if as_json:
            print(json.dumps([row | {"profiles": list(fits)} for row, fits in rows], indent=1))
            return
        for row, fits in rows:
            which = ", ".join(f"{name} ({sure})" for name, sure in fits.items())
            name = row["name"] or "no name"
            print(f"station {row['station']}: {name}  serial {row['serial']}  {which}")
        if not rows:
            print(f"no drive answers: check {_LOOK_AT[parse_url(url).scheme]}")

    run(work)


_SERIAL = "power, cable, baud rate, parity and address"
_LOOK_AT = {
    "mlink": _SERIAL,
    "modbus": _SERIAL,
    "canopen": "power, cable, both terminating resistors, bit rate and node number",
    "ethercat": "power, cable (computer to IN of the first drive) and the interface's name",
}
_FOUND = {
    "station", "vendor_id", "product_code", "revision", "serial", "name", "alias", "firmware",
    "state", "notes",
}  # fmt: skip


async def _found(url: str, server: str | None) -> list[tuple[dict[str, object], dict[str, str]]]:
    """What answers, and the profiles that fit with how sure that is."""
    if at := server_for(url, server):
        return [
            (f.model_dump(include=_FOUND), {m.profile: m.confidence for m in f.matches})
            for f in await remote_params.scan(at, url)
        ]
    async with opened(url) as link:
        return [
            (
                {name: value for name, value in asdict(f).items() if name in _FOUND},
                {m.profile.drive: m.confidence for m in match_profiles(link.kind, f)},
            )
            for f in await link.scan(show_progress, None)
        ]


def _speak_any_letter() -> None:
    """Terminals of other code pages get a ? for what they lack; files and pipes get UTF-8."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(encoding=None if stream.isatty() else "utf-8", errors="replace")


def main() -> None:
    """Entry point. A defect of the program itself ends it with exit code 70, in one sentence."""
    _speak_any_letter()
    try:
        app()
    except Exception as error:
        if os.environ.get("SERVODECK_TRACEBACK"):
            raise
        print(f"error: this is a defect of servodeck: {error!r}", file=sys.stderr)
        print("try:   run it again with SERVODECK_TRACEBACK=1 and report what it prints",
              file=sys.stderr)  # fmt: skip
        raise SystemExit(70) from error
