"""``servodeck handover``: start-up lists for the machine's controller, and comparison with them."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, get_args

import typer

from backend.axes.parameters.set_file import ParameterSet, parse
from backend.commands.base.options import Json, Profile, Server, Station, Url, place
from backend.commands.base.printing import note, print_text, words_of
from backend.commands.base.session import run
from backend.commands.drive.drive_values import Now, values_now
from backend.commands.drive.values import bytes_of
from backend.foundation.store.files import write_atomically
from backend.records.handover.conflicts import Conflict, Verdict, changed_since
from backend.records.handover.conflicts import compare as compared
from backend.records.handover.esi import controllers_of
from backend.records.handover.files import (
    FORMATS,
    Format,
    digest,
    files_of,
    fitting,
    remarks,
    wanted_of,
    with_controllers,
)
from backend.records.handover.model import AxisHandover, Choice, hand_over
from backend.records.handover.read import read_list
from drivers.errors import NotAllowed
from drivers.texts.message import joined, language
from profiles import load_profile
from profiles.schema import Raw

app = typer.Typer(
    help="Start-up lists for a machine's controller: write, compare, watch. Writes to no drive."
)


def _raws(content: ParameterSet) -> dict[str, Raw]:
    return {row.key: row.raw for row in content.rows if row.raw is not None}


def set_of(file: Path) -> ParameterSet:
    """The parameter set of a file."""
    return parse(bytes_of(file), file.name)


@app.command("export")
def export(
    sets: Annotated[
        list[Path],
        typer.Argument(metavar="SET...", help="parameter set; several are a segment, by cable"),
    ],
    form: Annotated[str, typer.Option("--format", help="|".join(get_args(Format)))],
    out: Annotated[Path, typer.Option(help="file to write; what belongs to it lies next to it")],
    only: Annotated[str, typer.Option(help="keys, separated by commas")] = "",
    tuned: Annotated[bool, typer.Option("--tuned", help="gains, filters and notches")] = False,
    not_default: Annotated[
        bool, typer.Option("--not-default", help="values that differ from the manual's default")
    ] = False,
    motor_individual: Annotated[
        bool, typer.Option(help="include values that belong to one motor")
    ] = False,
    esi: Annotated[
        list[Path] | None,
        typer.Option(help="the drives' ESI files, for an ENI that a master can run"),
    ] = None,
) -> None:
    """Write a start-up list, with a sheet of the scaling next to it."""

    async def work() -> None:
        chosen = _format(form)
        if bool(only) + tuned + not_default > 1:
            raise NotAllowed("command.tuned-not-default-exclude")
        choice: Choice = "tuned" if tuned else "not_default" if not_default else "all"
        keys = [key.strip().upper() for key in only.split(",") if key.strip()]
        contents = [set_of(file) for file in sets]
        axes = [
            fitting(
                hand_over(
                    content,
                    load_profile(content.profile),
                    choice=choice,
                    only=keys,
                    motor_individual=motor_individual,
                ),
                chosen,
            )
            for content in contents
        ]
        sources = [(bytes_of(file), file.name) for file in esi or []]
        if sources:
            axes = with_controllers(axes, controllers_of(sources, wanted_of(axes)))
        files = files_of(axes, chosen, out.name, contents[0].saved)
        for name, data in files.items():
            write_atomically(out.with_name(name), data)
        _show_export(out, axes, chosen, files)

    run(work)


def _format(form: str) -> Format:
    if form not in FORMATS:
        raise NotAllowed("command.no-format", value=form, formats=", ".join(FORMATS))
    return next(each for each in get_args(Format) if each == form)


def _show_export(
    out: Path, axes: list[AxisHandover], form: Format, files: dict[str, bytes]
) -> None:
    writes = sum(len(axis.writes) for axis in axes)
    left = sum(len(axis.left_out) for axis in axes)
    print_text("printed.handover-written", file=str(out), writes=writes, left=left)
    for name in list(files)[1:]:
        print_text("printed.beside-it", name=name)
    for axis in axes:
        place = f"{axis.name}: " if len(axes) > 1 else ""
        for each in axis.left_out:
            print_text("printed.left-out", place=place, key=each.key, reason=each.reason)
        for heeded in axis.notes:
            print_text("printed.note", words=joined([place, heeded], "") if place else heeded)
    for remark in remarks(axes, form):
        print_text("printed.note", words=remark)
    print(f"sha256: {digest(files[out.name])}")


@app.command("compare")
def compare(
    file: Annotated[Path, typer.Argument(help="the controller's list")],
    url: Annotated[str | None, typer.Argument(metavar="[BUS_URL]")] = None,
    set_file: Annotated[Path | None, typer.Option("--set", help="our parameter set")] = None,
    station: Station = 1,
    slave: Annotated[
        int | None, typer.Option(help="of a file with several slaves, counted from 1")
    ] = None,
    profile: Profile = None,
    server: Server = None,
    as_json: Json = False,
) -> None:
    """Say what the controller will overwrite; exit code 0 where it could be compared."""

    async def work() -> None:
        if url is None and set_file is None:
            raise NotAllowed("command.compared-set-drive", file=file.name)
        content = None if set_file is None else set_of(set_file)
        now: Now | None = None
        data = bytes_of(file)
        if url is None:
            assert content is not None
            known = load_profile(content.profile)
            listed = read_list(data, known, file.name, slave)
        else:
            family = profile or (content.profile if content is not None else None)
            where = place(url, station, family, server)
            now = await values_now(where)
            known = now.profile
            _same_family(content, now)
            listed = read_list(data, known, file.name, slave)
            now = await values_now(where, {write.key for write in listed.writes})
        verdict = compared(
            known, listed, None if content is None else _raws(content), now and now.raws
        )
        _show(verdict, listed.format, as_json=as_json)

    run(work)


def _same_family(content: ParameterSet | None, now: Now) -> None:
    if content is not None and content.profile != now.profile.drive:
        raise NotAllowed(
            "command.set-drive",
            drive=now.name,
            profile=content.profile,
            profile_drive=now.profile.drive,
        )


def _conflict(conflict: Conflict) -> dict[str, object]:
    return asdict(conflict) | {"sentence": conflict.sentence.words(language())}


def _show(verdict: Verdict, form: str, *, as_json: bool) -> None:
    if as_json:
        found = {"format": form, **asdict(verdict)}
        found["conflicts"] = [_conflict(each) for each in verdict.conflicts]
        found["findings"] = [
            asdict(each) | {"text": each.text.words(language())} for each in verdict.findings
        ]
        print(json.dumps(found, indent=1))
        return
    for conflict in verdict.conflicts:
        both = ""
        if conflict.drive is not None:
            both = f" {words_of('printed.drive-now', value=str(conflict.drive))}"
        print(f"{conflict.consequence}: {conflict.sentence.words(language())}{both}")
    for finding in verdict.findings:
        print(f"{finding.kind}: {finding.text.words(language())}")
    if verdict.unknown_here:
        keys = ", ".join(verdict.unknown_here)
        print_text("printed.not-compared", keys=keys)
    if verdict.not_read:
        print_text("printed.not-read-compare-again", keys=", ".join(verdict.not_read))
    print_text(
        "printed.handover-verdict",
        form=form,
        conflicts=len(verdict.conflicts),
        same=verdict.same,
        restored=len(verdict.restored),
        defects=len(verdict.findings),
        not_written=len(verdict.not_written),
        not_read=len(verdict.not_read),
    )


@app.command("watch")
def watch(
    file: Annotated[Path, typer.Argument(metavar="SET", help="set that was handed over")],
    url: Url,
    station: Station = 1,
    profile: Profile = None,
    server: Server = None,
    as_json: Json = False,
) -> None:
    """Read again after a controller ran: which values have changed since the hand-over."""

    async def work() -> None:
        content = set_of(file)
        ours = _raws(content)
        now = await values_now(place(url, station, profile or content.profile, server), ours)
        _same_family(content, now)
        changes = changed_since(now.profile, ours, now.raws)
        unread = sorted(key for key in ours if now.raws.get(key) is None)
        if as_json:
            found = {"changed": [_conflict(each) for each in changes], "not_read": unread}
            print(json.dumps(found, indent=1))
            return
        for each in changes:
            print(f"{each.consequence}: {each.sentence.words(language())}")
        _show_unread(unread)
        print_text("printed.changed-since", name=now.name, changed=len(changes), count=len(ours))

    run(work)


def _show_unread(keys: Iterable[str]) -> None:
    for key in keys:
        note("printed.key-not-read", key=key)
