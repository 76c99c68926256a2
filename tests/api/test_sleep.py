"""A computer that sleeps while an axis moves: it is stopped on waking, whatever was going on.

A process that is stopped (SIGSTOP) runs as little as in a computer that sleeps; only its monotonic
clock goes on, which the unit tests hold still.
"""

from __future__ import annotations

import contextlib
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from backend.foundation.work.sleep_watch import LONGEST_S
from backend.station.demo import DemoBench
from tests.api.test_kill import ServerProcess, add_drive, drives
from tests.api.test_kill_command import MODE, RAMP, Bench, canopen
from tests.support.station import HANG_S, until

__all__ = ["canopen", "drives"]
SLEEP_S = LONGEST_S + 0.5


@contextlib.contextmanager
def asleep(process: subprocess.Popen[str]) -> Iterator[None]:
    process.send_signal(signal.SIGSTOP)
    try:
        yield
    finally:
        process.send_signal(signal.SIGCONT)


@pytest.mark.long
def test_an_axis_that_moved_meanwhile_is_stopped(drives: DemoBench, tmp_path: Path) -> None:
    server = ServerProcess(tmp_path / "state")
    try:
        x = add_drive(server, drives.addresses["mlink://virtual0"])
        body = {"mode": "PV", "target": 60, "acceleration": 3000, "deceleration": 3000,
                "travel_limit": 30, "torque_limit": 150, "timeout_s": 60,
                "consent": True}  # fmt: skip
        began = server.http.post(f"/drives/{x}/jobs/move", json=body).raise_for_status().json()
        until(lambda: server.http.get(f"/drives/{x}/state").json()["velocity"] > 50, HANG_S)
        with asleep(server.process):
            time.sleep(SLEEP_S)
        path = f"/jobs/{began['id']}"
        until(lambda: server.http.get(path).json()["state"] == "cancelled", HANG_S)
        cause = server.http.get(path).json()["cancellation"]["cause_message"]
        assert cause["code"] == "station.computer-slept"
        assert cause["params"]["gap_s"] >= SLEEP_S - 0.5
        until(lambda: abs(server.http.get(f"/drives/{x}/state").json()["velocity"]) < 1, HANG_S)
    finally:
        server.end()


@pytest.mark.long
def test_a_command_that_moves_restores_and_reports_it(canopen: Bench) -> None:
    before, _ = canopen.held(MODE, RAMP)
    sweep = canopen.start(
        "sweep", canopen.url, "--station", "1", "--out", str(canopen.folder / "never.json"),
        "--consent", "--cycle-ms", "4",
    )  # fmt: skip
    until(lambda: bool(canopen.noted().get(RAMP, {}).get("left")), HANG_S, "it has begun")
    with asleep(sweep):
        time.sleep(SLEEP_S)
    _, reported = sweep.communicate(timeout=HANG_S)
    assert sweep.returncode == 1, reported
    assert "the computer slept, or the server did not run" in reported
    after, quiet = canopen.held(MODE, RAMP)
    assert after == before
    assert "temporary values" not in quiet
