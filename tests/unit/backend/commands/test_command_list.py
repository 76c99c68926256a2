"""The list of commands, and what each of them takes to start."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest
from typer.testing import CliRunner

from backend import cli

HEAVY = ("scipy", "fastapi", "uvicorn", "sqlalchemy", "pysoem", "can")
"""Server, analysis and stores, and masters of buses: seconds to import."""


def imported_by(code: str) -> set[str]:
    """Modules that are there after `code` in a fresh interpreter."""
    reported = subprocess.run(
        [sys.executable, "-c", f"{code}\nimport json, sys\nprint(json.dumps(list(sys.modules)))"],
        capture_output=True,
        text=True,
        check=True,
    )
    return set(json.loads(reported.stdout.splitlines()[-1]))


def test_the_list_of_commands_imports_none_of_them() -> None:
    there = imported_by(
        "from typer.testing import CliRunner\n"
        "from backend.cli import app\n"
        "assert CliRunner().invoke(app, ['--help']).exit_code == 0"
    )
    assert "backend.cli" in there
    assert not there & {*HEAVY, "numpy", "pydantic", "httpx"}
    assert not any(name.startswith("backend.commands.") for name in there)


@pytest.mark.long
def test_scanning_and_moving_import_neither_server_nor_analysis() -> None:
    there = imported_by("import backend.commands.buses.scan, backend.commands.drive.live")
    assert not there & set(HEAVY)


@pytest.mark.parametrize("name", cli.COMMANDS)
def test_the_list_says_what_the_command_says(name: str) -> None:
    where, said = cli.COMMANDS[name]
    reported = cli.imported(name, where).help
    assert reported is not None
    assert reported.splitlines()[0] == said


def test_a_command_that_is_not_there_is_reported() -> None:
    done = CliRunner().invoke(cli.app, ["scam"])
    assert done.exit_code == 2
    assert "No such command 'scam'" in done.output
    assert "scan" in done.output
