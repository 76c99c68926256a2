"""``servodeck friction``: the friction map, and a table that compensates the torque ripple."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from backend.api.station.models import DriveSummary
from backend.axes.axis.axis import Axis
from backend.commands.base.printing import words_of
from backend.commands.base.remote import Remote
from backend.commands.measuring.measure import Answer
from backend.commands.measuring.tools import CommandExtras, command_of
from backend.foundation.store.files import write_atomically
from backend.tools.mechanics.friction.result import FrictionResult
from backend.tools.registry import BY_KIND

_OPTIONS: dict[str, tuple[Any, object]] = {
    "table": (
        Annotated[
            Path | None,
            typer.Option(
                "--table",
                help="CSV file for the torque of the ripple over one motor revolution, for a "
                "controller that compensates it",
            ),
        ],
        None,
    ),
}


def _settled(given: dict[str, Any]) -> dict[str, Any]:
    return given


def _write(found: FrictionResult, given: dict[str, Any]) -> None:
    table = found.compensation_csv()
    if given["table"] is not None and table is not None:
        write_atomically(given["table"], table.encode())


async def _here(axis: Axis, found: FrictionResult, given: dict[str, Any]) -> None:
    del axis
    _write(found, given)


async def _there(at: Remote, drive: DriveSummary, found: Answer, given: dict[str, Any]) -> None:
    del at, drive
    _write(FrictionResult.model_validate(found), given)


def _lines(found: FrictionResult, given: dict[str, Any]) -> list[str]:
    if given["table"] is None:
        return []
    if not found.compensation_percent:
        return [words_of("printed.no-compensation-table", file=str(given["table"]))]
    return [words_of("printed.written", file=str(given["table"]))]


friction = command_of(BY_KIND["friction"], CommandExtras(_OPTIONS, _settled, _here, _there, _lines))
