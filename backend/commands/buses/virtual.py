"""``servodeck virtual``: one virtual drive on a real wire."""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path
from typing import Annotated

import typer

from backend.commands.base.printing import print_text
from backend.commands.base.session import until_interrupted
from backend.station.demo import DemoBench
from drivers.computer.signals import until_asked_to_end
from drivers.errors import NotAllowed
from drivers.texts.message import Param, Text, as_text, joined
from drivers.urls import parse_url
from drivers.virtual.mechanics.spec import load_mechanics, standard_mechanics


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
            raise NotAllowed("command.virtual-drive-not-go", value=on, limit="ethercat://virtual0")
        try:
            spec = load_mechanics(mechanics) if mechanics else standard_mechanics()
        except (OSError, ValueError) as error:
            raise NotAllowed(
                "command.mechanics-file", file=str(mechanics), cause=str(error)
            ) from error
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
                    print_text(
                        "printed.virtual-answers", drive=drive, url=str(real), station=station
                    )
                sys.stdout.flush()
                await until_asked_to_end()

    until_interrupted(work)


def _one_drive(file: Path, folder: Path, nvm: Path | None) -> DemoBench:
    """The bench of `virtual`; its errors do not name the temporary bench file."""
    try:
        return DemoBench(file, folder, nvm)
    except NotAllowed as error:
        facts = error.text.params
        if error.code == "virtual.bench-file":
            error.own_remedy, error.text = error.remedy_text, as_text(_fact(facts["why"]))
        elif error.code == "virtual.bench-file-see-docs":
            found = joined((_fact(facts["place"]), _fact(facts["first"])), ": ")
            error.own_remedy, error.text = error.remedy_text, found
        raise


def _fact(fact: Param) -> Text | str:
    return fact if isinstance(fact, Text) else str(fact)
