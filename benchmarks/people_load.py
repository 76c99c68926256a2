"""Fifty viewers on one station while an operator jogs: time to stop, and jitter of the cycle.

The same jogs without and with viewers, on the virtual drives of the demo: the time from the
release of the button to standstill, the time from STOP to its answer, and the lateness of the
cyclic exchange of a virtual EtherCAT segment. Aim: unchanged within noise.
"""

from __future__ import annotations

import json
import multiprocessing
import statistics
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from websockets.sync.client import connect

from tests.support.station import Live, Station, until

VIEWERS = 50
ROUNDS = 8
SEGMENT = "ethercat://virtual0"
WIRES = (("X", "mlink://virtual0"), ("Z", SEGMENT))
_AXIS = """
[[axis]]
name = "{name}"
drive = "mms7"
on = "{on}"
station = 1
[axis.mechanics.motor]
inertia_kgm2 = 5e-5
rated_torque_nm = 1.27
rated_speed_rpm = 3000
[axis.mechanics.friction]
viscous_nms = 2e-4
coulomb_nm = 0.03
"""
#: Faster than the noise of the simulated encoder, slower than the jog.
MOVING_RPM = 15.0


class Viewer:
    """A page that looks: states of all axes, a scope of three signals, and its pings."""

    def __init__(self, url: str, drives: list[str]) -> None:
        self._socket = connect(url, max_size=None)
        self._over = threading.Event()
        self.received = 0
        self._send({"type": "watch_state", "drives": drives})
        channels = [{"drive": drives[0], "key": key} for key in ("6064:00", "606C:00", "6077:00")]
        self._send({"type": "scope_start", "subscription": 1, "channels": channels})
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _send(self, message: dict[str, object]) -> None:
        self._socket.send(json.dumps(message))

    def _run(self) -> None:
        asked = time.monotonic()
        while not self._over.is_set():
            try:
                self._socket.recv(timeout=0.2)
                self.received += 1
            except TimeoutError:
                pass
            except Exception:
                return
            if time.monotonic() - asked > 0.5:
                asked = time.monotonic()
                self._send({"type": "ping", "n": 1})

    def close(self) -> None:
        """Leave."""
        self._over.set()
        self._thread.join(5)
        self._socket.close()


def look(url: str, drives: list[str], count: int, ready: Any, over: Any, heard: Any) -> None:
    """All viewers, in a process of their own: on site they have computers of their own, too."""
    viewers = [Viewer(url, drives) for _ in range(count)]
    ready.set()
    over.wait()
    heard.value = sum(each.received for each in viewers)
    for each in viewers:
        each.close()


@contextmanager
def looking(url: str, drives: list[str], count: int) -> Iterator[None]:
    """So many viewers meanwhile."""
    spawn = multiprocessing.get_context("spawn")
    ready, over, heard = spawn.Event(), spawn.Event(), spawn.Value("i", 0)
    process = spawn.Process(target=look, args=(url, drives, count, ready, over, heard))
    process.start()
    try:
        assert ready.wait(60), "the viewers do not come in"
        time.sleep(2)
        yield
    finally:
        over.set()
        process.join(30)
    print(f"{count} viewers: {heard.value} messages delivered")


def jog(page: Live, drive: str) -> None:
    """Begin to jog."""
    page.send(type="jog_start", drive=drive, direction=1, speed=60, acceleration=3000,
              travel_limit=50, torque_limit=100)  # fmt: skip


def standstill(station: Station, page: Live, drive: str, end: Callable[[], object]) -> float:
    """Seconds from the end of a jog to the first reading at standstill."""

    def speed() -> float:
        return abs(float(station.state(drive)["velocity"]))

    for _ in range(10):
        jog(page, drive)
        with page.holding(drive), suppress(AssertionError):
            until(lambda: speed() > MOVING_RPM * 2, 4, "the axis moves")
            break  # a busy computer may have missed renewals, which rightly ends a jog
        page.wait("jog_ended", 15, drive=drive)
    began = time.perf_counter()
    end()
    until(lambda: speed() < MOVING_RPM, 5, "the axis stands")
    took = time.perf_counter() - began
    page.wait("jog_ended", 15, drive=drive)
    return took


def lateness(station: Station) -> dict[str, Any]:
    """What the cyclic exchange says about itself."""
    segment = station.ok(station.http.get("/ethercat/segment", params={"url": SEGMENT}))
    return segment["exchange"] or {}


def measure(station: Station, drive: str) -> dict[str, list[float]]:
    """Rounds of release and STOP."""
    release, stop = [], []
    with station.live() as page:
        for _ in range(ROUNDS):
            release.append(
                standstill(station, page, drive, lambda: page.send(type="jog_stop", drive=drive))
            )
            stop.append(
                standstill(station, page, drive, lambda: station.http.post("/stop", json={}))
            )
    return {"release to standstill": release, "STOP to standstill": stop}


def main() -> None:
    """Print both, side by side."""
    with tempfile.TemporaryDirectory(prefix="servodeck-load-") as folder:
        bench = Path(folder) / "bench.toml"
        bench.write_text("".join(_AXIS.format(name=n, on=on) for n, on in WIRES), "utf-8")
        station = Station(Path(folder), bench)
        station.start()
        try:
            drives = [station.add(1, name="X")]
            report(station, drives, cyclic=begin_exchange(station, drives))
        finally:
            station.stop()


def begin_exchange(station: Station, drives: list[str]) -> bool:
    """Cyclic exchange next to it, where this computer allows a virtual segment."""
    try:
        drives.append(station.add(1, SEGMENT, name="Z"))
        body = {"url": SEGMENT, "cycle_us": 2000}
        station.ok(station.http.post("/buses/cyclic", json=body))
    except AssertionError as problem:
        print(f"no cyclic exchange: {problem}")
        return False
    return True


def report(station: Station, drives: list[str], *, cyclic: bool) -> None:
    """Measure without and with viewers and print the table."""
    figures = {}
    late = {}
    busy = {}
    for count in (0, VIEWERS):
        url = f"ws://127.0.0.1:{station.port}/api/v1/live"
        with looking(url, drives, count):
            began, used = time.perf_counter(), time.process_time()
            figures[count] = measure(station, drives[0])
            # The viewers are a process of their own; here are the server and this benchmark.
            busy[count] = (time.process_time() - used) / (time.perf_counter() - began) * 100
            late[count] = lateness(station) if cyclic else {}
    print(f"{'':28}{'no viewer':>20}{f'{VIEWERS} viewers':>20}   (median / worst, ms)")
    for name in figures[0]:
        cells = [
            f"{statistics.median(f[name]) * 1e3:.0f} / {max(f[name]) * 1e3:.0f}"
            for f in figures.values()
        ]
        print(f"{name:28}{cells[0]:>20}{cells[1]:>20}")
    print(f"{'server, % of a core':28}{busy[0]:>20.0f}{busy[VIEWERS]:>20.0f}")
    for name in sorted(late[0]):
        if isinstance(late[0][name], (int, float)) and not isinstance(late[0][name], bool):
            print(f"cyclic {name:21}{late[0][name]:>20.1f}{late[VIEWERS].get(name, 0):>20.1f}")
