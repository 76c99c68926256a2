"""servodeck as if on Windows: without the modules and names that POSIX alone has."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]


def other(*arguments: str) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "tests.support.other_system", *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=110,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_every_module_is_imported() -> None:
    assert int(other("import").split()[0]) > 500


def test_the_commands_are_listed() -> None:
    assert "Servo-drive commissioning" in other("command", "--help")


def test_profiles_are_checked() -> None:
    assert "Homing" in other("command", "profile", "check")


def test_the_server_starts_and_answers() -> None:
    assert other("serve").splitlines()[-1].startswith("drives 200")


@pytest.mark.long
def test_ethercat_without_npcap_is_refused_with_the_way_to_it() -> None:
    said = other("ethercat")
    assert "EtherCAT on Windows needs Npcap" in said
    assert "install Npcap from npcap.com" in said


def test_one_process_at_a_time_has_a_state_folder() -> None:
    assert other("locks").split() == ["first", "True", "second", "0", "third", "1"]


@pytest.mark.long(keep=6)
@pytest.mark.parametrize("module", ["fcntl", "termios", "pty", "resource", "pwd", "grp", "tty"])
def test_the_stand_in_really_lacks_what_is_absent(module: str) -> None:
    """Else the tests above would show nothing."""
    done = subprocess.run(
        [sys.executable, "-c",
         "from tests.support import other_system as other\n"
         "other.become_other()\n"
         f"exec('import {module}', {{'__name__': 'drivers.any'}})"],
        cwd=ROOT, capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert f"No module named '{module}'" in done.stderr
