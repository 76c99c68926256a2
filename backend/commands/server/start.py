"""``servodeck serve`` and ``servodeck demo``."""

from __future__ import annotations

import tempfile
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from backend.commands.base.printing import print_text
from backend.commands.base.session import until_interrupted
from backend.commands.base.state import state_folder
from backend.commands.server.keep import BlobPlace, Database
from backend.commands.server.serve import Serving
from backend.commands.server.serve import serve as run_server
from backend.station.bench import Bench
from backend.station.demo import DemoBench, connect_axes

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


def serve(
    host: Host = "127.0.0.1",
    port: Port = 8420,
    config: Config = None,
    open_: Open = False,
    database: Database = None,
    blobs: BlobPlace = None,
    accounts: Accounts = None,
    certificate: CertificateFile = None,
    key: KeyFile = None,
    allow_host: AllowHost = None,
) -> None:
    """Start the server and the web page."""
    serving = Serving(
        host, port, accounts, certificate, key, frozenset(allow_host or ()), open_page=open_
    )

    async def work() -> None:
        await run_server(Bench(state_folder(config), database=database, blobs=blobs), serving)

    until_interrupted(work)


def demo(
    host: Host = "127.0.0.1",
    port: Port = 8420,
    bench: Annotated[Path | None, typer.Option(help="bench file (TOML), or gantry")] = None,
    defect: Annotated[
        list[str] | None,
        typer.Option(help='plant a defect, as "Feed screw=coupling_loose"; may be repeated'),
    ] = None,
    config: Config = None,
    open_: Open = False,
    database: Database = None,
    blobs: BlobPlace = None,
    accounts: Accounts = None,
    certificate: CertificateFile = None,
    key: KeyFile = None,
    allow_host: AllowHost = None,
) -> None:
    """Start the server on a bench of virtual drives: no hardware, no root."""
    serving = Serving(
        host, port, accounts, certificate, key, frozenset(allow_host or ()), open_page=open_
    )

    async def work() -> None:
        with tempfile.TemporaryDirectory(prefix="servodeck-") as folder:
            state = state_folder(config) if config else Path(folder) / "state"
            print_text("printed.starting-virtual")
            wires = Path(folder) / "wires"
            with DemoBench(
                bench, wires, state / "nvm", steady=True, defects=defect or ()
            ) as drives:
                for axis, what in drives.planted:
                    print_text("printed.planted-defect", axis=axis, defect=what)
                for url, real in drives.addresses.items():
                    print_text("printed.wire-is", url=url, real=real)
                for problem in drives.problems:
                    print_text("printed.note-beside", words=problem)
                server_bench = Bench(
                    state, drives.wires, database=database, blobs=blobs, names=drives.names
                )
                server_bench.buses.cause_fault = drives.cause_fault
                await run_server(
                    server_bench, serving, partial(connect_axes, server_bench, drives.spec)
                )

    until_interrupted(work)
