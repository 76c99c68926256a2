"""``servodeck report`` and ``servodeck recompute``: what stored measurements tell, as files."""

from __future__ import annotations

import json
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import httpx
import typer

from backend.commands.session import run
from backend.library.measurements import SUFFIX, BadMeasurement, Head, MeasurementStore, unpack
from backend.report.gather import About, choose, facts_of_files, measured_from
from backend.report.store import FORMATS, Format, render
from backend.store.files import write_atomically
from drivers.errors import DriveError, LinkLost, NotAllowed

if TYPE_CHECKING:
    from backend.station.evaluation import Evaluation

Files = Annotated[list[Path] | None, typer.Argument(metavar="[FILE.sdmeas]...")]
Out = Annotated[Path, typer.Option(help="report to write; .html or .pdf")]


class LanguageName(StrEnum):
    """Language of a report."""

    en = "en"
    zh = "zh"


def report(
    out: Out,
    files: Files = None,
    server: Annotated[str | None, typer.Option(help="ask this running server")] = None,
    axis: Annotated[str | None, typer.Option(help="the server's name of the drive")] = None,
    language: Annotated[LanguageName, typer.Option()] = LanguageName.en,
    person: Annotated[str, typer.Option(help="who commissioned")] = "",
    machine: Annotated[str, typer.Option(help="name of the machine")] = "",
    notes: Annotated[str, typer.Option(help="free text")] = "",
) -> None:
    """Write the commissioning report of an axis, from measurement files or a running server."""
    about = About(person, machine, notes)

    async def work() -> None:
        form = _format(out)
        if (server is None) == (not files):
            raise NotAllowed("command.give-either-measurement-files")
        if server is not None:
            data = await _from_server(server, axis, form, language.value, about)
        else:
            data = _from_files(files or [], form, language, about)
        write_atomically(out, data)
        print(f"written: {out}")

    run(work)


def _format(out: Path) -> Format:
    for form in FORMATS:
        if out.suffix == f".{form}":
            return form
    raise NotAllowed("command.neither-html-nor-pdf", value=out.name, limit=".html, .pdf")


def _from_files(files: list[Path], form: Format, language: LanguageName, about: About) -> bytes:
    """Of several files of a kind, the newest with the one before it."""
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


async def _from_server(
    server: str, axis: str | None, form: Format, language: str, about: About
) -> bytes:
    base = server.rstrip("/") + "/api/v1"
    try:
        async with httpx.AsyncClient(base_url=base, timeout=120.0) as http:
            drives = _ok(await http.get("/drives")).json()
            drive = next((d for d in drives if axis in (d["name"], d["id"])), None)
            if drive is None:
                names = ", ".join(str(d["name"]) for d in drives) or "none"
                raise NotAllowed(
                    "command.no-drive-give-name", value=axis, limit=names, server=server
                )
            body = {"format": form, "language": language, "person": about.person,
                    "machine": about.machine, "notes": about.notes}  # fmt: skip
            made = _ok(await http.post(f"/drives/{drive['id']}/reports", json=body)).json()
            return _ok(await http.get(f"/reports/{made['file']}")).content
    except httpx.HTTPError as error:
        raise LinkLost("command.cannot-reached", server=server, cause=str(error)) from error


def _ok(answer: httpx.Response) -> httpx.Response:
    if answer.is_success:
        return answer
    try:
        problem = answer.json()
    except ValueError:
        problem = {}
    detail = problem.get("detail") or f"the server says {answer.status_code}"
    raise DriveError(str(detail), remedy=problem.get("remedy"))


def recompute(
    file: Annotated[Path, typer.Argument(metavar=f"FILE{SUFFIX}")],
    out: Annotated[Path | None, typer.Option(help="JSON file for the result")] = None,
) -> None:
    """Evaluate a stored measurement anew from its raw signals. Nothing moves."""

    async def work() -> None:
        try:
            data = file.read_bytes()
        except OSError as error:
            raise BadMeasurement(
                "command.cannot-read", value=str(file), file=str(file), strerror=error.strerror
            ) from error
        found = unpack(data, file.name)
        # The analysis takes seconds to import; no other command shall wait for it.
        from backend.station.evaluation import evaluate

        made = evaluate(found)
        head = found.head
        print(f"{head.kind} of {head.drive}, {head.saved:%Y-%m-%d %H:%M:%S %Z}")
        print(_agreement(made))
        if out is not None:
            write_atomically(out, json.dumps(made.result, indent=1).encode())
            print(f"written: {out}")

    run(work)


def _agreement(made: Evaluation) -> str:
    if made.agrees is None:
        return "evaluated; the file tells no earlier result to compare with"
    if made.agrees:
        return "evaluated; the result is the one of that time"
    return f"evaluated; the result is another than at that time: {', '.join(made.differences)}"
