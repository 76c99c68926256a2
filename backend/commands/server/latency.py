"""``servodeck latency``: the latency timer of a serial adapter."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from backend.commands.base.printing import print_text
from backend.commands.base.session import reporting_errors
from backend.commands.base.state import state_folder
from backend.foundation.preflight.adapters import LOWERED_MS, Adapters, Timer, most_reads
from drivers.adapters import require_serial_form
from drivers.computer.serial_ports.latency_timer import InForce


@reporting_errors
def latency_command(
    device: Annotated[str, typer.Argument(help="Serial port, as COM3 or /dev/ttyUSB0.")],
    ms: Annotated[
        int | None,
        typer.Option(
            "--set",
            help="Set it to this many ms, 1 to 255. Needs the administrator of the computer.",
        ),
    ] = None,
    undo: Annotated[
        bool, typer.Option("--undo", help="Restore the value before the first --set.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
    config: Annotated[Path | None, typer.Option(help="state folder of the station")] = None,
) -> None:
    """For how long a serial adapter holds answers back; lower it with --set.

    On Windows a change restarts the adapter: end every program that uses the port first.
    """
    require_serial_form(device)
    adapters = Adapters(state_folder(config))
    in_force: InForce | None = None
    if undo:
        in_force = adapters.restore(device)
    elif ms is not None:
        in_force = adapters.set(device, ms)
    found = adapters.look(device)
    if as_json:
        print(json.dumps(_as_data(found, in_force), indent=2))
    else:
        _show(device, found, in_force, undo=undo)


def _as_data(found: Timer, in_force: InForce | None) -> dict[str, object]:
    return {
        "timer": asdict(found.timer) if found.timer else None,
        "reads_at_most": most_reads(found.timer.ms) if found.timer else None,
        "changed": asdict(found.changed) if found.changed else None,
        "in_force": in_force,
    }


def _show(device: str, found: Timer, in_force: InForce | None, *, undo: bool) -> None:
    if found.timer is None:
        print_text("printed.no-latency-timer", device=device)
        return
    now = found.timer.ms
    print_text("printed.latency-timer", device=device, ms=now, reads=most_reads(now))
    if found.changed is not None:
        print_text("printed.latency-before", ms=found.changed.before_ms)
    if in_force is InForce.AFTER_REPLUG:
        print_text("printed.latency-replug", device=device)
    elif undo and in_force is None:
        print_text("printed.setting-left", setting=device)
    elif in_force is None and now > LOWERED_MS:
        print_text(
            "printed.latency-lower", device=device, ms=LOWERED_MS, reads=most_reads(LOWERED_MS)
        )
