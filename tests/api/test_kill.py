"""Processes killed in the middle of motion: the axis stops by itself, and a restart goes on."""

from __future__ import annotations

import asyncio
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from backend.station.demo import DemoBench
from drivers.link import Address
from drivers.urls import link_for
from profiles.schema import DataType
from tests.support.jogging import fast, jogged
from tests.support.machine import within
from tests.support.station import HANG_S, Live, until

SPEED_RPM, RAMP_RPM_S = 300.0, 3000.0
#: v·T + v²/2a with T = 0.2 s, in increments of 65536 to the revolution (004: default).
LEAD_INC = 65536 * (SPEED_RPM / 60 * 0.2 + (SPEED_RPM / 60) ** 2 / (2 * RAMP_RPM_S / 60))


@pytest.fixture
def drives(tmp_path: Path) -> Iterator[DemoBench]:
    with DemoBench(None, tmp_path / "wires", tmp_path / "nvm") as running:
        yield running


class ServerProcess:
    """`servodeck serve` as a user starts it."""

    def __init__(self, folder: Path) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "backend", "serve", "--port", "0", "--config", str(folder)],
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        found = re.search(r"http://localhost:(\d+)/", line)
        assert found, line
        self.port = int(found[1])
        self.http = httpx.Client(base_url=f"http://127.0.0.1:{self.port}/api/v1", timeout=20)

    def live(self) -> Live:
        return Live(f"ws://127.0.0.1:{self.port}/api/v1/live")

    def kill(self) -> None:
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()
        self._close()

    def _close(self) -> None:
        assert self.process.stdout is not None
        self.process.stdout.close()
        self.http.close()

    def end(self) -> None:
        self.process.send_signal(signal.SIGINT)
        assert self.process.wait(15) == 0
        self._close()


async def positions(url: str, seconds: float) -> list[tuple[float, int]]:
    """Time and position, read from the wire by another client."""
    link = link_for(url)
    await link.open()
    result = []
    end = time.monotonic() + seconds
    try:
        while time.monotonic() < end:
            data = await link.read(1, Address(0x6064, 0, "INT32"))
            result.append((time.monotonic(), int.from_bytes(data, "little", signed=True)))
    finally:
        await link.close()
    return result


def add_drive(server: ServerProcess, url: str) -> str:
    body = {"url": url, "station": 1, "profile": "mms7", "name": "X"}
    answer = server.http.post("/drives", json=body)
    assert answer.status_code == 201, answer.text
    return str(answer.json()["id"])


def test_killed_server_leaves_an_axis_that_stops_by_itself(
    drives: DemoBench, tmp_path: Path
) -> None:
    url = drives.addresses["mlink://virtual0"]
    server = ServerProcess(tmp_path / "state")
    x = add_drive(server, url)
    page = server.live()
    limits = {
        "speed": SPEED_RPM,
        "acceleration": RAMP_RPM_S,
        "travel_limit": 30,
        "torque_limit": 150,
    }
    with jogged(
        server.http, page, x, lambda now, _: abs(now["velocity"] - SPEED_RPM) < 30, **limits
    ):
        server.kill()
    page.close()
    seen = asyncio.run(positions(url, 1.5))
    (_, first), (_, last) = seen[0], seen[-1]
    still = [t for t, p in seen if abs(p - last) > 65536 * 0.002]
    assert last - first <= LEAD_INC * 1.02, "no further than v·T + v²/2a"
    assert (max(still, default=seen[0][0]) - seen[0][0]) < 0.6, "and it stands soon"


@pytest.mark.long
def test_server_finds_its_drives_again_after_a_kill(drives: DemoBench, tmp_path: Path) -> None:
    url = drives.addresses["mlink://virtual0"]
    server = ServerProcess(tmp_path / "state")
    x = add_drive(server, url)
    server.kill()
    again = ServerProcess(tmp_path / "state")
    try:
        assert [drive["id"] for drive in again.http.get("/drives").json()] == [x]
        within(5, lambda: again.http.get(f"/drives/{x}/state").json()["fresh"], "it is back")
    finally:
        again.end()


@pytest.mark.long
def test_what_a_killed_server_left_in_the_drive_is_put_back(
    drives: DemoBench, tmp_path: Path
) -> None:
    """The ramps of its jog: by itself once the axis stands still, the rest on one press."""
    url = drives.addresses["mlink://virtual0"]
    before = asyncio.run(number(url, 0x6083, "UINT32"))
    server = ServerProcess(tmp_path / "state")
    x = add_drive(server, url)
    page = server.live()
    limits = {"speed": SPEED_RPM, "acceleration": 1500.0, "travel_limit": 30, "torque_limit": 150}
    with jogged(server.http, page, x, fast, **limits):
        server.kill()
    page.close()
    changed = asyncio.run(number(url, 0x6083, "UINT32"))
    assert changed != before
    again = ServerProcess(tmp_path / "state")
    try:
        within(5, lambda: again.http.get(f"/drives/{x}/state").json()["fresh"], "it is back")

        def let_go() -> bool:
            """Nobody holds the axis any more: it is reported, unless the server just stops it."""
            shown = again.http.get(f"/drives/{x}/state").json()["state"]
            body = {"goal": "Switch on disabled"}
            path = f"/drives/{x}/transition"
            return shown == body["goal"] or again.http.post(path, json=body).is_success

        def put_back() -> bool:
            """On one press, again where the server was just about it by itself."""
            pending = {
                o["key"]: o["raw"]
                for o in again.http.get(f"/drives/{x}").json()["pending_restores"]
            }
            if not pending:
                return True
            assert pending.get("6083:00", before) == before
            assert again.http.post(f"/drives/{x}/jobs/put-back").status_code in (202, 409)
            return False

        until(let_go, HANG_S)
        until(put_back, HANG_S)
    finally:
        again.end()
    assert asyncio.run(number(url, 0x6083, "UINT32")) == before


@pytest.mark.long
def test_ended_server_stops_the_axis_first(drives: DemoBench, tmp_path: Path) -> None:
    url = drives.addresses["mlink://virtual0"]
    server = ServerProcess(tmp_path / "state")
    x = add_drive(server, url)
    body = {"mode": "PV", "target": 200, "acceleration": 3000, "deceleration": 3000,
            "travel_limit": 30, "torque_limit": 150, "timeout_s": 60, "consent": True}  # fmt: skip
    server.http.post(f"/drives/{x}/jobs/move", json=body).raise_for_status()
    until(lambda: server.http.get(f"/drives/{x}/state").json()["velocity"] > 100, HANG_S)
    server.end()
    seen = asyncio.run(positions(url, 0.3))
    assert abs(seen[-1][1] - seen[0][1]) < 65536 * 0.002


@pytest.mark.long
@pytest.mark.parametrize("how", ["server ends", "axis leaves the bench"])
def test_an_axis_left_enabled_loses_its_power(drives: DemoBench, tmp_path: Path, how: str) -> None:
    """Nobody looks after it any more (DS402 status: not Operation enabled, 6041h bit 2)."""
    url = drives.addresses["mlink://virtual0"]
    server = ServerProcess(tmp_path / "state")
    x = add_drive(server, url)
    body = {"goal": "Operation enabled", "mode": 1}
    server.http.post(f"/drives/{x}/transition", json=body).raise_for_status()
    assert server.http.get(f"/drives/{x}/state").json()["state"] == "Operation enabled"
    if how == "axis leaves the bench":
        server.http.delete(f"/drives/{x}").raise_for_status()
    server.end()
    assert not asyncio.run(number(url, 0x6041, "UINT16")) & 1 << 2


async def number(url: str, index: int, type_: DataType) -> int:
    link = link_for(url)
    await link.open()
    try:
        return int.from_bytes(await link.read(1, Address(index, 0, type_)), "little")
    finally:
        await link.close()
