"""``servodeck profile``: show and check drive profiles."""

from __future__ import annotations

import asyncio
import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import Annotated, cast, get_args

import typer

from backend.commands.base.printing import print_text
from backend.commands.base.session import opened, reporting_errors, show_progress
from backend.commands.server.keep import station_records
from backend.foundation.store.files import write_atomically
from backend.records.audit import Fact
from backend.records.audit.facts import Value
from backend.station.drives.description import profile_of_drive
from drivers.errors import NotAllowed
from drivers.texts.checks import check_line
from drivers.texts.imports import failure_text, finding_line, summary_text
from drivers.texts.message import language, reason_of, text
from drivers.texts.motion_classes import refusal_text
from drivers.texts.profile_errors import profile_error_text
from drivers.texts.profile_words import ProfileWords
from profiles import drive_names, load_profile
from profiles.check import check as check_profile
from profiles.check import coverage, motion_counts, unclassified
from profiles.export import show as shown
from profiles.importer import (
    ImportedProfile,
    ImportFailed,
    ImportReport,
    export_eds,
    export_esi,
    import_file,
    write_profile,
)
from profiles.language.overlay import LANGUAGES, load_overlay
from profiles.language.texts import check_overlay, overlay_coverage
from profiles.loader import ProfileError, user_folder
from profiles.motion import decisions
from profiles.motion.rule import Motion

app = typer.Typer(help="Drive profiles: show, check, import.")


@app.command("show")
@reporting_errors
def show(
    drive: str, as_json: Annotated[bool, typer.Option("--json", help="one stable form")] = False
) -> None:
    """Print a whole profile."""
    profile = load_profile(drive)
    if as_json:
        print(json.dumps(shown(profile), indent=1, ensure_ascii=False))
        return
    print_text(
        "printed.profile-head", title=profile.title, drive=profile.drive, manual=profile.manual
    )
    say = ProfileWords(drive, language())
    for parameter in profile.parameters:
        number = f" {parameter.number}" if parameter.number else ""
        print(
            f"{parameter.key}{number}  {say(parameter.name)}  [{parameter.type} {parameter.access}"
            f"{' ' + parameter.unit if parameter.unit else ''}]  {parameter.source}"
        )


@contextmanager
def _importing() -> Iterator[None]:
    """Convert errors of an unusable description file to NotAllowed."""
    try:
        yield
    except ImportFailed as error:
        raise NotAllowed(failure_text(error), remedy="command.see-not-listed") from error
    except ValueError as error:
        raise NotAllowed(reason_of(error), remedy="command.see-not-listed") from error


def _print_findings(report: ImportReport) -> None:
    for finding in report.findings:
        print(f"  {finding_line(finding).words(language())}")


def _number(option: str, text: str | None) -> int | None:
    try:
        return None if text is None else int(text, 0)
    except ValueError as error:
        raise NotAllowed("command.no-number", value=text, option=option) from error


def _check_name(name: str | None) -> None:
    if name is None:
        return
    if not re.fullmatch("[a-z][a-z0-9_]*", name):
        raise NotAllowed(
            "command.cannot-name-profile",
            value=name,
            limit=text("limit.profile-name"),
        )
    if name in drive_names():
        raise NotAllowed("command.profile-already", value=name)


@app.command("import")
@reporting_errors
def import_description(
    file: Annotated[Path, typer.Argument(help="ESI (.xml), EDS or DCF file")],
    name: Annotated[str | None, typer.Option(help="name of the new profile")] = None,
    product_code: Annotated[
        str | None, typer.Option(help="which device of an ESI file, e.g. 0x190")
    ] = None,
    revision: Annotated[
        str | None, typer.Option(help="which revision of it, e.g. 0x10001; else the newest")
    ] = None,
    folder: Annotated[
        Path | None, typer.Option(help="where profiles lie; your own folder if left out")
    ] = None,
) -> None:
    """Make a generic profile from a maker's description file."""
    if folder is None:
        _check_name(name)
    with _importing():
        imported = import_file(
            file.read_bytes(),
            file.name,
            drive=name,
            product_code=_number("--product-code", product_code),
            revision=_number("--revision", revision),
        )
        if folder is None:
            _check_name(imported.profile.drive)
        target = write_profile(imported.profile, folder or user_folder())
    _print_findings(imported.report)
    print_text(
        "printed.profile-imported",
        title=imported.profile.title,
        count=len(imported.profile.parameters),
        summary=summary_text(
            (each.outcome for each in imported.report.findings), imported.report.not_listed
        ),
    )
    for device in imported.others:
        print_text(
            "printed.also-in-file" if device.has_control_word else "printed.also-in-file-no-drive",
            name=device.name,
            options=f"--product-code {device.product_code or 0:#x}"
            f" --revision {device.revision or 0:#x}",
        )
    print_text("printed.profile-written", file=str(target), name=imported.profile.drive)


@app.command("from-drive")
@reporting_errors
def import_from_drive(
    url: Annotated[str, typer.Argument(metavar="BUS_URL")],
    name: Annotated[str, typer.Option(help="name of the new profile")],
    station: Annotated[int, typer.Option(help="station address on the bus")] = 1,
) -> None:
    """Make a generic profile from a drive's own dictionary (EtherCAT, SDO information)."""
    _check_name(name)

    async def read() -> ImportedProfile:
        async with opened(url) as link:
            seen = await link.scan(show_progress, [station])
            found = next((f for f in seen if f.station == station), None)
            if found is None:
                raise NotAllowed("command.nothing-answers-station", station=station, url=url)
            return await profile_of_drive(link, found, name, show_progress)

    with _importing():
        imported = asyncio.run(read())
        target = write_profile(imported.profile, user_folder())
    _print_findings(imported.report)
    print_text(
        "printed.profile-of-drive-written",
        count=len(imported.profile.parameters),
        file=str(target),
        name=name,
    )


@app.command("classify")
@reporting_errors
def classify_object(
    drive: Annotated[str, typer.Argument(help="an imported profile")],
    key: Annotated[str, typer.Argument(help="key of the object, for example 2005:01")],
    motion: Annotated[str, typer.Argument(help="none, at_enable or energises; or forget")],
    reason: Annotated[
        str, typer.Option(help="how you know: the manual's page, a test; needed for a class")
    ] = "",
    safe_in_motion: Annotated[
        bool, typer.Option("--safe-in-motion", help="at_enable, and may be changed while enabled")
    ] = False,
    config: Annotated[Path | None, typer.Option(help="state folder of the station")] = None,
    database: Annotated[
        str | None, typer.Option(envvar="SERVODECK_DATABASE", help="database of the station")
    ] = None,
) -> None:
    """Say whether writing an object of an imported profile can cause motion.

    Nobody has said so of a maker's objects in an imported file, and so each counts as one that
    can. The decision is kept next to the profile and written down in the station's audit.
    """
    if motion not in (*get_args(Motion), "forget"):
        raise NotAllowed(
            "command.no-motion-class", value=motion, limit="none, at_enable, energises, forget"
        )
    known = load_profile(drive).parameter(key)
    before = None if known is None else known.motion
    try:
        if motion == "forget":
            now = decisions.forget(drive, key)
        else:
            now = decisions.classify(
                drive, key, cast(Motion, motion), reason=reason, safe_in_motion=safe_in_motion
            )
    except decisions.CannotClassify as error:
        raise NotAllowed(
            refusal_text(error), parameter=key, remedy="command.see-not-listed"
        ) from error
    except ValueError as error:
        raise NotAllowed(
            reason_of(error), parameter=key, remedy="command.see-not-listed"
        ) from error
    records = station_records(config, database)
    reported_as: dict[str, Value] = {
        "reason": now.motion_reason,
        "safe_in_motion": now.safe_in_motion,
    }
    target = f"/profiles/{drive}/parameters/{now.key}/motion"
    records.audit.add(
        Fact("station", "changed", target=target, old=before, new=now.motion, detail=reported_as)
    )
    records.audit.close()
    records.store.close()
    print_text(
        "printed.motion-class-safe" if now.safe_in_motion else "printed.motion-class",
        key=now.key,
        name=now.name,
        motion=now.motion,
    )


@app.command("export-eds")
@reporting_errors
def export_description(
    drive: str, out: Annotated[Path, typer.Argument(help="the EDS file to write")]
) -> None:
    """Write a profile's objects as a CANopen EDS file."""
    profile = load_profile(drive)
    write_atomically(out, export_eds(profile, datetime.now(), out.name).encode("utf-8"))
    print_text("printed.written", file=str(out))


@app.command("export-esi")
@reporting_errors
def export_slave_information(
    drive: str, out: Annotated[Path, typer.Argument(help="the ESI file to write")]
) -> None:
    """Write a profile's objects and bring-up as an EtherCAT ESI file."""
    profile = load_profile(drive)
    if profile.link("ethercat") is None:
        raise NotAllowed("command.no-ethercat-profile", value=drive)
    write_atomically(out, export_esi(profile))
    print_text("printed.written", file=str(out))


@app.command("check")
def check(drive: Annotated[str | None, typer.Argument()] = None) -> None:
    """Validate profiles and print how much of each manual chapter they cover."""
    failed = False
    for name in [drive] if drive else drive_names():
        try:
            profile = load_profile(name)
            overlays = {language: load_overlay(name, language) for language in LANGUAGES}
        except ProfileError as error:
            print(profile_error_text(error).words(language()))
            failed = True
            continue
        findings = check_profile(profile)
        for overlay in overlays.values():
            findings += check_overlay(profile, overlay)
        print_text(
            "printed.profile-checked",
            name=name,
            parameters=len(profile.parameters),
            faults=len(profile.faults),
            findings=len(findings),
        )
        counts = ", ".join(f"{count} {motion}" for motion, count in motion_counts(profile).items())
        print_text("printed.motion-classes", counts=counts, unclassified=len(unclassified(profile)))
        for translated, overlay in overlays.items():
            covered = ", ".join(overlay_coverage(profile, overlay))
            print_text("printed.overlay", language=translated, covered=covered)
        for finding in findings:
            print(f"  {check_line(finding).words(language())}")
        for line in coverage(profile):
            print(f"  {line}")
        failed = failed or bool(findings)
    if failed:
        raise typer.Exit(1)
