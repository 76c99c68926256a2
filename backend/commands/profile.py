"""``servodeck profile``: show and check drive profiles."""

from __future__ import annotations

import asyncio
import json
from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer

from backend.commands.session import opened, show_progress
from backend.description import profile_of_drive
from drivers.errors import DriveError, NotAllowed
from profiles import drive_names, load_profile
from profiles.check import check as check_profile
from profiles.check import coverage
from profiles.export import show as shown
from profiles.importer import (
    ImportedProfile,
    ImportFailed,
    export_eds,
    import_file,
    write_profile,
)
from profiles.loader import ProfileError, user_folder

app = typer.Typer(help="Drive profiles: show, check, import.")


@app.command("show")
def show(
    drive: str, as_json: Annotated[bool, typer.Option("--json", help="one stable form")] = False
) -> None:
    """Print a whole profile."""
    try:
        profile = load_profile(drive)
    except ProfileError as error:
        raise typer.BadParameter(str(error)) from error
    if as_json:
        print(json.dumps(shown(profile), indent=1, ensure_ascii=False))
        return
    print(f"{profile.title} ({profile.drive}), manual {profile.manual}")
    for parameter in profile.parameters:
        number = f" {parameter.number}" if parameter.number else ""
        print(
            f"{parameter.key}{number}  {parameter.name}  [{parameter.type} {parameter.access}"
            f"{' ' + parameter.unit if parameter.unit else ''}]  {parameter.source}"
        )


@app.command("import")
def import_description(
    file: Annotated[Path, typer.Argument(help="ESI (.xml), EDS or DCF file", exists=True)],
    name: Annotated[str | None, typer.Option(help="name of the new profile")] = None,
    product_code: Annotated[
        str | None, typer.Option(help="which device of an ESI file, e.g. 0x190")
    ] = None,
    folder: Annotated[
        Path | None, typer.Option(help="where profiles lie; your own folder if left out")
    ] = None,
) -> None:
    """Make a generic profile from a maker's description file."""
    try:
        code = None if product_code is None else int(product_code, 0)
        imported = import_file(file.read_bytes(), file.name, drive=name, product_code=code)
    except (ImportFailed, OSError, ValueError) as error:
        raise typer.BadParameter(str(error)) from error
    if folder is None and imported.profile.drive in drive_names():
        raise typer.BadParameter(
            f"there is a profile {imported.profile.drive!r} already: choose another with --name"
        )
    try:
        target = write_profile(imported.profile, folder or user_folder())
    except (ImportFailed, OSError) as error:
        raise typer.BadParameter(str(error)) from error
    for finding in imported.report.findings:
        print(f"  {finding}")
    print(f"{imported.profile.title}: {len(imported.profile.parameters)} parameters, "
          f"{imported.report.summary()}")  # fmt: skip
    print(f"written to {target}; use it as {imported.profile.drive}")


@app.command("from-drive")
def import_from_drive(
    url: Annotated[str, typer.Argument(metavar="BUS_URL")],
    name: Annotated[str, typer.Option(help="name of the new profile")],
    station: Annotated[int, typer.Option(help="station address on the bus")] = 1,
) -> None:
    """Make a generic profile from a drive's own dictionary (EtherCAT, SDO information)."""
    if name in drive_names():
        raise typer.BadParameter(f"there is a profile {name!r} already: choose another --name")

    async def read() -> ImportedProfile:
        async with opened(url) as link:
            seen = await link.scan(show_progress, [station])
            found = next((f for f in seen if f.station == station), None)
            if found is None:
                raise NotAllowed(f"nothing answers at station {station} of {url}")
            return await profile_of_drive(link, found, name, show_progress)

    try:
        imported = asyncio.run(read())
        target = write_profile(imported.profile, user_folder())
    except (DriveError, ImportFailed, OSError) as error:
        raise typer.BadParameter(str(error)) from error
    for finding in imported.report.findings:
        print(f"  {finding}")
    print(f"{len(imported.profile.parameters)} parameters written to {target}; use it as {name}")


@app.command("export-eds")
def export_description(
    drive: str, out: Annotated[Path, typer.Argument(help="the EDS file to write")]
) -> None:
    """Write a profile's objects as a CANopen EDS file."""
    try:
        profile = load_profile(drive)
    except ProfileError as error:
        raise typer.BadParameter(str(error)) from error
    out.write_bytes(export_eds(profile, datetime.now(), out.name).encode("utf-8"))
    print(f"{out} written")


@app.command("check")
def check(drive: Annotated[str | None, typer.Argument()] = None) -> None:
    """Validate profiles and print how much of each manual chapter they cover."""
    failed = False
    for name in [drive] if drive else drive_names():
        try:
            profile = load_profile(name)
        except ProfileError as error:
            print(error)
            failed = True
            continue
        findings = check_profile(profile)
        print(f"{name}: {len(profile.parameters)} parameters, {len(profile.faults)} faults, "
              f"{len(findings)} findings")  # fmt: skip
        for finding in findings:
            print(f"  {finding}")
        for line in coverage(profile):
            print(f"  {line}")
        failed = failed or bool(findings)
    if failed:
        raise typer.Exit(1)
