"""The three scripts of the scripting guide run against a server, and do what they say."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from backend.axes.parameters import set_file
from tests.docs.pages import DOCS
from tests.support.station import Station


def run(station: Station, *words: str, code: int = 0) -> str:
    """What a script of the guide prints."""
    done = subprocess.run(
        [sys.executable, "-W", "error", str(DOCS / "scripts" / words[0]), *words[1:]],
        env=os.environ | {"SERVODECK_SERVER": station.url, "PYTHONIOENCODING": "utf-8"},
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout + done.stderr


@pytest.mark.long
def test_settings_of_every_drive_are_stored(station: Station, tmp_path: Path) -> None:
    drive = station.add(1, name="X")
    printed = run(station, "backup_all.py", str(tmp_path))
    stored = set_file.parse((tmp_path / f"{drive}.sdset").read_bytes())
    assert f"X: {len(stored.rows)} settings" in printed
    assert len(stored.rows) > 50
    station.remove(drive)


@pytest.mark.long
def test_inertia(station: Station) -> None:
    drive = station.add(1, "ethercat://virtual0", name="G")
    printed = run(station, "inertia.py", drive, "3", "1200", "80")
    # Motor 5e-5 and load 1e-4 kg·m² of the bench file.
    value = float(printed.split("inertia ")[1].split()[0])
    assert abs(value / 1.5e-4 - 1) < 0.03
    refused = run(station, "inertia.py", drive, "-3", "1200", "80", code=1)
    assert "travel" in refused
    station.remove(drive)


@pytest.mark.long
def test_move(station: Station) -> None:
    drive = station.add(1, name="X")
    before = station.state(drive)["position"]
    first, second = run(station, "move.py", drive, "0.5", "300").splitlines()
    assert abs(float(first.split(" rev")[0]) - before - 0.5) < 0.01
    assert abs(float(second.split(" rev")[0]) - before) < 0.01
    assert second.endswith("Switch on disabled")
    station.remove(drive)
