"""``servodeck station``: set-up of a computer that runs servodeck as a service."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated
from urllib.parse import quote

import typer

from backend.commands.base.options import DEFAULT_SERVER, Server
from backend.commands.base.printing import print_text
from backend.commands.base.remote import remote
from backend.commands.base.session import run
from backend.commands.base.state import state_folder
from backend.foundation.store.files import write_atomically
from backend.station.install.box.kept import Box, keep, read
from backend.station.install.box.roles import addresses_of, checked
from backend.station.install.service import systemd_unit
from backend.station.install.windows_task import windows_task
from drivers.computer.network.interfaces import network_interfaces

app = typer.Typer(help="A station as a service.", no_args_is_help=True)


@app.callback()
def station() -> None:
    """What a computer needs that runs servodeck as a service."""


@app.command("unit")
def unit() -> None:
    """Print the systemd unit, with the capabilities that EtherCAT needs."""
    print(systemd_unit(), end="")


@app.command("task")
def task(
    out: Annotated[Path, typer.Argument(help="file to write, as servodeck-task.xml")],
    config: Annotated[Path | None, typer.Option(help="folder of drives and parameter sets")] = None,
) -> None:
    """Write the task that starts servodeck on Windows when its user logs in; for schtasks."""
    arguments = ["-m", "backend", "serve"]
    if config is not None:
        arguments += ["--config", str(config.resolve())]

    async def work() -> None:
        # The form of Windows' own files of tasks: UTF-16 with its mark.
        written = windows_task(sys.executable, arguments).replace("\n", "\r\n")
        write_atomically(out, written.encode("utf-16"))
        print_text("printed.task-written", file=str(out))

    run(work)


Config = Annotated[Path | None, typer.Option(help="folder of drives and parameter sets")]


@app.command("set-up")
def set_up(
    name: Annotated[str, typer.Option(prompt=True, help="name in the network, such as cabinet-3")],
    ethercat: Annotated[str, typer.Option(help="port of the drives")] = "",
    office: Annotated[str, typer.Option(help="port of people; no EtherCAT there")] = "",
    config: Config = None,
) -> None:
    """Name the station and say which network port is for what; also while the server runs."""

    async def work() -> None:
        made = checked(Box(name, ethercat, office), network_interfaces(), "")
        keep(state_folder(config), made)
        _print(made)

    run(work)


@app.command("show")
def show(config: Config = None) -> None:
    """Name and network ports of the station."""

    async def work() -> None:
        known = read(state_folder(config))
        if known is None:
            print_text("printed.box-none")
        else:
            _print(known)
        for one in network_interfaces():
            found = addresses_of(one.name)
            print_text("printed.box-port", name=one.name, addresses=", ".join(found) or "-")

    run(work)


@app.command("forget")
def forget(
    drive: Annotated[str, typer.Argument(help="its id, as the station's log names it")],
    server: Server = None,
) -> None:
    """Remove a drive from the list of a running server, also one that it could not connect."""

    async def work() -> None:
        async with remote(server or DEFAULT_SERVER) as at:
            await at.raw("DELETE", f"/drives/{quote(drive, safe='')}")

    run(work)


def _print(box: Box) -> None:
    print_text(
        "printed.box-kept", name=box.name, ethercat=box.ethercat or "-", office=box.office or "-"
    )
