"""``servodeck profile``: show and check drive profiles."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from profiles import drive_names, load_profile
from profiles.check import check as check_profile
from profiles.check import coverage
from profiles.export import show as shown
from profiles.loader import ProfileError

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
