"""A server killed while it records: the next one lists the file, with all but the last moment."""

from __future__ import annotations

import csv
import io
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from backend.station.demo import DemoBench
from tests.api.test_kill import ServerProcess, add_drive
from tests.support.station import until


@pytest.fixture
def drives(tmp_path: Path) -> Iterator[DemoBench]:
    with DemoBench(None, tmp_path / "wires", tmp_path / "nvm") as running:
        yield running


def listed(server: ServerProcess) -> dict[str, Any]:
    rows = server.http.get("/recordings").raise_for_status().json()["recordings"]
    return dict(rows[0])


@pytest.mark.long
def test_killed_server_leaves_a_recording_up_to_the_last_second(
    drives: DemoBench, tmp_path: Path
) -> None:
    server = ServerProcess(tmp_path / "state")
    x = add_drive(server, drives.addresses["mlink://virtual0"])
    body = {"name": "cut", "notes": "night run", "channels": [{"drive": x, "key": "6064:00"}]}
    server.http.post("/recordings", json=body).raise_for_status()
    until(lambda: listed(server)["samples"] > 500, 30, "samples are recorded")
    time.sleep(1)  # the second that must be on the disk when the next one is lost
    seen = listed(server)
    time.sleep(1)  # the last one, of which nothing is asked
    server.kill()

    again = ServerProcess(tmp_path / "state")
    try:
        row = listed(again)
        assert row["name"] == "cut.sdrec"
        assert row["state"] == "interrupted", "said to be cut off, and good up to there"
        assert row["samples"] >= seen["samples"], "all that was there a second before"
        assert row["notes"] == "night run"
        job = again.http.post("/recordings/cut.sdrec/exports/csv").raise_for_status().json()

        def ended() -> bool:
            now = again.http.get(f"/jobs/{job['id']}").raise_for_status().json()
            assert now["state"] in ("running", "done"), now
            return bool(now["state"] == "done")

        until(ended, 30, "the export")
        text = again.http.get("/recordings/cut.sdrec/exports/csv").raise_for_status().text
        assert len(list(csv.reader(io.StringIO(text)))) == 1 + row["samples"]
        again.http.post("/recordings", json=body).raise_for_status()
        until(lambda: listed(again)["samples"] > 50, 30, "and it records again")
        assert listed(again)["name"] == "cut 2.sdrec"
    finally:
        again.end()
