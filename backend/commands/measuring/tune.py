"""``servodeck autotune``: measurement, design and verification of gains, without the page."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from backend.api.station.models import DriveSummary
from backend.axes.axis.axis import Axis
from backend.commands.base.printing import words_of
from backend.commands.base.remote import Remote
from backend.commands.measuring.measure import Answer
from backend.commands.measuring.tools import CommandExtras, command_of
from backend.tools.registry import BY_KIND
from backend.tools.tuning.autotune.apply import take_back
from backend.tools.tuning.autotune.result import AutotuneAnswer

_OPTIONS: dict[str, tuple[Any, object]] = {
    "apply": (
        Annotated[
            bool,
            typer.Option("--apply", help="write the design, verify it, and undo it"),
        ],
        False,
    ),
    "keep": (
        Annotated[
            bool,
            typer.Option(
                "--keep",
                help="as --apply, but leave it in force; `servodeck params save` stores it",
            ),
        ],
        False,
    ),
}


def _settled(given: dict[str, Any]) -> dict[str, Any]:
    return given | {"apply": given["apply"] or given["keep"]}


async def _here(axis: Axis, found: AutotuneAnswer, given: dict[str, Any]) -> None:
    if not given["keep"]:
        await take_back(axis, found.before)


async def _there(at: Remote, drive: DriveSummary, found: Answer, given: dict[str, Any]) -> None:
    if not given["keep"] and found["before"]:
        body = {"before": found["before"]}
        await at.raw("POST", f"/drives/{drive.id}/tune/undo", body=body)


def _lines(found: AutotuneAnswer, given: dict[str, Any]) -> list[str]:
    if not _settled(given)["apply"]:
        return ["", words_of("printed.tuning-not-applied")]
    if not found.before:
        return []
    if given["keep"]:
        return ["", words_of("printed.tuning-in-force", count=len(found.before))]
    return ["", words_of("printed.tuning-taken-back")]


autotune = command_of(BY_KIND["autotune"], CommandExtras(_OPTIONS, _settled, _here, _there, _lines))
