"""``servodeck report`` and ``servodeck recompute``: files from stored measurements."""

from __future__ import annotations

import json
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from backend.api.report.models import ReportInfo
from backend.commands.base.options import Json, Server
from backend.commands.base.printing import print_text, words_of
from backend.commands.base.remote import remote
from backend.commands.base.session import run
from backend.commands.measuring.measure import AxisName, Profile, Station, Where
from backend.foundation.store.files import write_atomically
from backend.records.library.measurements import (
    SUFFIX,
    BadMeasurement,
    Head,
    MeasurementStore,
    unpack,
)
from backend.report.gather import About, choose, facts_of_files, measured_from
from backend.report.store import FORMATS, Format, render
from drivers.errors import NotAllowed

if TYPE_CHECKING:
    from backend.station.evaluation import Evaluation

Files = Annotated[list[str] | None, typer.Argument(metavar="[BUS_URL | FILE.sdmeas...]")]
Out = Annotated[Path, typer.Option(help="report to write; .html or .pdf")]


class LanguageName(StrEnum):
    """Language of a report."""

    en = "en"
    zh = "zh"


def report(
    out: Out,
    files: Files = None,
    station: Station = 1,
    profile: Profile = None,
    server: Server = None,
    axis: AxisName = None,
    language: Annotated[LanguageName, typer.Option()] = LanguageName.en,
    person: Annotated[str, typer.Option(help="who commissioned")] = "",
    machine: Annotated[str, typer.Option(help="name of the machine")] = "",
    notes: Annotated[str, typer.Option(help="free text")] = "",
    as_json: Json = False,
) -> None:
    """Write the commissioning report of an axis, from measurement files or a running server."""
    about = About(person, machine, notes)

    async def work() -> None:
        form = _format(out)
        given = files or []
        urls = [each for each in given if "://" in each]
        named = axis is not None or bool(urls)
        if named == (len(given) > len(urls)) or len(urls) > 1:
            raise NotAllowed("command.give-either-measurement-files-bus")
        if named:
            where = Where(urls[0] if urls else None, station, profile, server, axis)
            data = await _from_server(where, form, language.value, about)
        else:
            data = _from_files([Path(each) for each in given], form, language, about)
        write_atomically(out, data)
        print(
            json.dumps({"written": str(out)})
            if as_json
            else words_of("printed.written", file=str(out))
        )

    run(work)


def _format(out: Path) -> Format:
    for form in FORMATS:
        if out.suffix == f".{form}":
            return form
    raise NotAllowed("command.neither-html-nor-pdf", value=out.name, limit=".html, .pdf")


def _from_files(files: list[Path], form: Format, language: LanguageName, about: About) -> bytes:
    """A report from files; of several files of a kind, the newest and the one before it."""
    folders = {file.resolve().parent for file in files}
    if len(folders) != 1:
        raise NotAllowed("command.measurements-lie-different-folders")
    store = MeasurementStore(folders.pop())
    heads: dict[str, Head] = {file.name: store.head(file.name) for file in files}
    facts = facts_of_files(heads, about)
    measured, unusable = measured_from(
        store, choose(heads, max(head.saved for head in heads.values()))
    )
    whole = replace(facts, measured=measured, unusable=unusable)
    return render(whole, "zh" if language is LanguageName.zh else "en", form)


async def _from_server(where: Where, form: Format, language: str, about: About) -> bytes:
    server = where.asked
    if server is None:
        raise NotAllowed("command.report-drive-bus-made", value=where.url)
    body = {
        "format": form,
        "language": language,
        "person": about.person,
        "machine": about.machine,
        "notes": about.notes,
    }
    async with remote(server) as at:
        drive = await where.drive(at)
        made = await at.ask("POST", f"/drives/{drive.id}/reports", ReportInfo, body=body)
        return (await at.raw("GET", f"/reports/{made.file}")).content


def recompute(
    file: Annotated[Path, typer.Argument(metavar=f"FILE{SUFFIX}")],
    out: Annotated[Path | None, typer.Option(help="JSON file for the result")] = None,
) -> None:
    """Evaluate a stored measurement again from its raw signals. Nothing moves."""

    async def work() -> None:
        try:
            data = file.read_bytes()
        except OSError as error:
            raise BadMeasurement(
                "command.cannot-read", value=str(file), file=str(file), strerror=error.strerror
            ) from error
        found = unpack(data, file.name)
        # Importing the analysis takes seconds, which other commands do not need.
        from backend.station.evaluation import evaluate

        made = evaluate(found)
        head = found.head
        print_text(
            "printed.measurement-of",
            kind=head.kind,
            drive=head.drive,
            saved=f"{head.saved:%Y-%m-%d %H:%M:%S %Z}",
        )
        print(_agreement(made))
        if out is not None:
            write_atomically(out, json.dumps(made.result, indent=1).encode())
            print_text("printed.written", file=str(out))

    run(work)


def _agreement(made: Evaluation) -> str:
    if made.agrees is None:
        return words_of("printed.evaluated")
    if made.agrees:
        return words_of("printed.evaluated-same")
    return words_of("printed.evaluated-other", differences=", ".join(made.differences))
