"""``servodeck station``: what a computer needs that runs servodeck as a service."""

from __future__ import annotations

import typer

from backend.station.service import systemd_unit

app = typer.Typer(help="A station as a service.", no_args_is_help=True)


@app.callback()
def station() -> None:
    """What a computer needs that runs servodeck as a service."""


@app.command("unit")
def unit() -> None:
    """Print the systemd unit, with the capabilities that EtherCAT needs."""
    print(systemd_unit(), end="")
