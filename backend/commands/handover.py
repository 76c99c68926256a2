"""``servodeck handover``: lists for the machine's controller, and what its lists overwrite."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, get_args

import typer

from backend.commands.session import run
from backend.commands.values import bytes_of
from backend.handover.files import FORMATS, Format, files_of
from backend.handover.model import Choice, hand_over
from backend.parameters.set_file import ParameterSet, parse
from backend.store.files import write_atomically
from drivers.errors import NotAllowed
from profiles import load_profile

app = typer.Typer(help="Hand values over to a machine's controller. Nothing is written to a drive.")


def set_of(file: Path) -> ParameterSet:
    """The parameter set of a file."""
    return parse(bytes_of(file), file.name)


@app.command("export")
def export(
    file: Annotated[Path, typer.Argument(metavar="SET", help="parameter set")],
    form: Annotated[str, typer.Option("--format", help="|".join(get_args(Format)))],
    out: Annotated[Path, typer.Option(help="file to write; what belongs to it lies beside it")],
    only: Annotated[str, typer.Option(help="keys, separated by commas")] = "",
    tuned: Annotated[bool, typer.Option("--tuned", help="gains, filters and notches")] = False,
    not_default: Annotated[
        bool, typer.Option("--not-default", help="values that differ from the manual's default")
    ] = False,
    motor_individual: Annotated[
        bool, typer.Option(help="include values that belong to one motor")
    ] = False,
) -> None:
    """Write a start-up list, with a sheet of the scaling beside it."""

    async def work() -> None:
        if form not in FORMATS:
            raise NotAllowed(
                f"{form!r} is no format", value=form, remedy=f"choose one of {', '.join(FORMATS)}"
            )
        if bool(only) + tuned + not_default > 1:
            raise NotAllowed(
                "--only, --tuned and --not-default exclude each other", remedy="give one of them"
            )
        content = set_of(file)
        choice: Choice = "tuned" if tuned else "not_default" if not_default else "all"
        keys = [key.strip().upper() for key in only.split(",") if key.strip()]
        axis = hand_over(
            content, load_profile(content.profile), choice=choice, only=keys,
            motor_individual=motor_individual,
        )  # fmt: skip
        chosen: Format = next(each for each in get_args(Format) if each == form)
        files = files_of(axis, chosen, out.name, content.saved)
        for name, data in files.items():
            write_atomically(out.with_name(name), data)
        print(f"{out}: {len(axis.writes)} writes, {len(axis.left_out)} rows left out")
        for name in list(files)[1:]:
            print(f"beside it: {name}")
        for each in axis.left_out:
            print(f"left out: {each.key}: {each.reason}")
        for note in axis.notes:
            print(f"note: {note}")

    run(work)
