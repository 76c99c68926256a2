"""Commands killed in a measurement (SIGKILL): what they changed is known and restored later."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from backend.station.demo import DemoBench
from drivers.virtual.wires.netns import child_environment, unavailable
from tests.api.test_kill import ServerProcess
from tests.support.station import HANG_S, until

BENCH = """
[[axis]]
name = "X"
drive = "{drive}"
on = "{url}"
station = 1
"""
#: Mode of operation, quick-stop deceleration and the profile ramps: what a sweep changes.
MODE, QUICK_STOP, RAMP = "6060:00", "6085:00", "6083:00"


@dataclass
class Bench:
    """A virtual drive, and commands as a user starts them, all with one state folder."""

    folder: Path
    url: str
    drives: DemoBench
    command: Callable[[list[str]], list[str]]

    @property
    def state(self) -> Path:
        return self.folder / "state"

    def start(self, *arguments: str) -> subprocess.Popen[str]:
        environment = child_environment() | {"SERVODECK_CONFIG": str(self.state)}
        return subprocess.Popen(
            self.command([sys.executable, "-m", "backend", *arguments]),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=environment,
        )

    def run(self, *arguments: str) -> tuple[str, str]:
        process = self.start(*arguments)
        out, reported = process.communicate(timeout=HANG_S)
        assert process.returncode == 0, reported
        return out, reported

    def held(self, *keys: str) -> tuple[dict[str, int], str]:
        """Raw values in the drive, and what the command says besides."""
        out, reported = self.run("params", "get", self.url, *keys, "--station", "1", "--json")
        return {row["key"]: row["raw"] for row in json.loads(out)}, reported

    def noted(self) -> dict[str, dict[str, object]]:
        """Values of the one restore list, by key."""
        for file in (self.state / "restore").glob("*.json"):
            return {each["key"]: each for each in json.loads(file.read_text())["values"]}
        return {}

    def sweep_killed(self, key: str, *more: str) -> None:
        """A sweep that is killed once ``key`` is changed in the drive."""
        sweep = self.start(
            "sweep", self.url, "--station", "1", "--out", str(self.folder / "never.json"), *more
        )

        def changed() -> bool:
            if sweep.poll() is not None:
                raise AssertionError(sweep.communicate()[1])
            return bool(self.noted().get(key, {}).get("left")) and MODE in self.noted()

        try:
            until(changed, HANG_S, "the sweep changes what it changes")
        finally:
            os.kill(sweep.pid, signal.SIGKILL)
            sweep.communicate()
        assert self.noted(), "the list outlives who wrote it"


@pytest.fixture
def ethercat(tmp_path: Path) -> Iterator[Bench]:
    if reason := unavailable():
        pytest.skip(f"no private network here: {reason}")
    file = tmp_path / "bench.toml"
    file.write_text(BENCH.format(drive="r6l", url="ethercat://virtual0"))
    with DemoBench(file, tmp_path / "wires", steady=True) as drives:
        namespace = drives._namespaces[0]
        yield Bench(tmp_path, "ethercat://ec0m", drives, namespace.command)


@pytest.fixture
def canopen(tmp_path: Path) -> Iterator[Bench]:
    file = tmp_path / "bench.toml"
    file.write_text(BENCH.format(drive="ds_c", url="canopen://virtual0"))
    with DemoBench(file, tmp_path / "wires") as drives:
        yield Bench(tmp_path, drives.addresses["canopen://virtual0"], drives, list)


@pytest.mark.long
def test_a_sweep_killed_on_ethercat_is_reported_and_restored_by_a_command(ethercat: Bench) -> None:
    before, quiet = ethercat.held(MODE, QUICK_STOP)
    assert "temporary values" not in quiet
    ethercat.sweep_killed(QUICK_STOP)
    noted = ethercat.noted()
    assert {key: noted[key]["raw"] for key in before} == before, "noted before the first write"
    left, reported = ethercat.held(MODE, QUICK_STOP)
    assert left[QUICK_STOP] != before[QUICK_STOP]
    assert "`servodeck sweep` was cut off" in reported
    assert "temporary values" in reported
    assert f"{QUICK_STOP} (was {before[QUICK_STOP]})" in reported
    assert "servodeck params restore ethercat://ec0m --station 1" in reported
    _, restored = ethercat.run("params", "restore", ethercat.url, "--station", "1")
    assert f"restored: {QUICK_STOP} = {before[QUICK_STOP]}" in restored
    after, quiet = ethercat.held(MODE, QUICK_STOP)
    assert after == before
    assert "temporary values" not in quiet
    assert not list((ethercat.state / "restore").glob("*.json"))


@pytest.mark.long
def test_a_sweep_killed_on_canopen_is_restored_by_the_next_server(canopen: Bench) -> None:
    before, _ = canopen.held(MODE, RAMP)
    canopen.sweep_killed(RAMP, "--consent", "--cycle-ms", "4")
    left, reported = canopen.held(MODE, RAMP)
    assert left != before
    assert f"{RAMP} (was {before[RAMP]})" in reported
    server = ServerProcess(canopen.state)
    try:
        body = {"url": canopen.url, "station": 1, "profile": "ds_c"}
        answer = server.http.post("/drives", json=body)
        assert answer.is_success, answer.text
        x = answer.json()["id"]

        def restored() -> bool:
            """On one press, again where the server was just about it by itself."""
            pending = {
                o["key"]: o["raw"]
                for o in server.http.get(f"/drives/{x}").json()["pending_restores"]
            }
            if not pending:
                return True
            assert pending.get(RAMP, before[RAMP]) == before[RAMP]
            assert server.http.post(f"/drives/{x}/jobs/put-back").status_code in (202, 409)
            return False

        until(restored, HANG_S)
    finally:
        server.end()
    after, quiet = canopen.held(MODE, RAMP)
    assert after == before
    assert "temporary values" not in quiet
