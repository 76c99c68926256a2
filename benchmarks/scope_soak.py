"""16 channels at 4 kHz to the disk and to two browsers, one of them suspended for a third.

A station with four EtherCAT axes in a process of its own records 16 channels, and two Chromium
show them on the Scope page; the second one is stopped (SIGSTOP, as a closed lid does) for the
middle third. ``SERVODECK_SCOPE_SOAK_S`` sets the length; 1800 s are the half hour required.
On a computer that is busy with other things ``SERVODECK_SCOPE_SOAK_STEADY=1`` lets the segment's
time follow the frames: no cycle is left out, they only come more slowly. Where this program may,
it grants what a station grants, and says so.

Aims, each judged in the last lines: no sample lost on disk beyond those that the bus itself left
out; nothing lost in the view of the page that is awake, and what the other one missed counted;
memory of the server flat after the first minutes; jitter of the cycle as without any browser;
GET /drives p99 below 50 ms.
"""

from __future__ import annotations

import asyncio
import json
import os
import pwd
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import httpx
import numpy as np
from playwright.sync_api import Browser, Page, sync_playwright

from backend.commands.server.serve import settle
from backend.records.recording.reader import RecordingReader
from backend.station.demo import DemoBench
from benchmarks._aims import Aim, print_verdict
from tests.support.station import Station

URL = "ethercat://virtual0"
SECONDS = float(os.environ.get("SERVODECK_SCOPE_SOAK_S", "1800"))
STEADY = os.environ.get("SERVODECK_SCOPE_SOAK_STEADY") == "1"
CYCLE_US = 250
AXES = 4
KEYS = ("6064:00", "606C:00", "6077:00", "60F4:00")
FLAGS = ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run"]
#: What the cycle is like with nobody looking, before the soak begins.
BASELINE_S = 15.0
#: The page holds 80 s; until its rings, the fault capture's and the allocator's pools are full,
#: memory may grow: for this part of the run, and at most so many seconds.
SETTLING_PART, SETTLING_S = 1 / 3, 180.0
#: Growth after it that still counts as flat: what a leak of 10 kB/s makes of half an hour.
FLAT_MIB = 16.0
#: p99 of the cycle's lateness may be this much more with everything on; one histogram step.
JITTER_FACTOR, JITTER_US = 1.5, 50.0
#: Of the server's unit.
NICE = -10
#: Of the client's thread (SCHED_FIFO), below the bus.
CLIENT_PRIORITY = 1
#: From the bus to what a page says of it, at most.
SHOWN_S = 1.0
#: A page that slept is informed of what it missed, less what waited for it in queues and sockets.
REPORTED_PART = 0.8


def bench_text() -> str:
    """Four MMS7 in a row."""
    return "".join(
        f'[[axis]]\nname = "A{n}"\ndrive = "mms7"\non = "{URL}"\nstation = {n}\n'
        for n in range(1, AXES + 1)
    )


def run_station(folder: Path) -> None:
    """The child: serve until the standard input ends."""
    bench = folder / "bench.toml"
    bench.write_text(bench_text())
    station = Station(folder, bench)
    if STEADY:
        station.drives = DemoBench(bench, folder / "wires", folder / "nvm", steady=True)
    station.start()
    asyncio.run(settle())
    try:
        print(json.dumps({"port": station.port, "pid": os.getpid()}), flush=True)
        sys.stdin.read()
    finally:
        station.stop()


@contextmanager
def station_process(folder: Path) -> Iterator[tuple[httpx.Client, int, str]]:
    """A client, the server's process id, and its address."""
    child = subprocess.Popen(
        [sys.executable, "-m", "benchmarks.scope_soak", "--station", str(folder)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert child.stdin is not None
    assert child.stdout is not None
    try:
        reported = json.loads(child.stdout.readline())
        url = f"http://127.0.0.1:{reported['port']}"
        with httpx.Client(base_url=f"{url}/api/v1", timeout=60) as http:
            yield http, int(reported["pid"]), url
    finally:
        child.stdin.close()
        child.wait(30)
        child.stdout.close()


class Poller(threading.Thread):
    """Times an ordinary request ten times a second."""

    def __init__(self, base: str) -> None:
        super().__init__(daemon=True)
        self.times_ms: list[float] = []
        self.stop = threading.Event()
        self._base = base

    def run(self) -> None:
        with suppress(OSError):  # it stands for a client whose computer has no browsers or drives
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(CLIENT_PRIORITY))
        with httpx.Client(base_url=f"{self._base}/api/v1", timeout=30) as http:
            while not self.stop.wait(0.1):
                began = time.monotonic()
                http.get("/drives").raise_for_status()
                self.times_ms.append((time.monotonic() - began) * 1e3)


def memory_mib(pid: int) -> float:
    """Resident memory of a process."""
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS"):
            return int(line.split()[1]) / 1024
    return float("nan")


def cpu_s(pid: int) -> float:
    """Processor time of a process so far."""
    fields = Path(f"/proc/{pid}/stat").read_text("ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def fieldbus(server: int) -> dict[str, int]:
    """The processes beneath a station's that serve the bus: part to process id."""
    parents, lines = {}, {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            with suppress(OSError, IndexError):  # it has ended meanwhile
                stat = (entry / "stat").read_text("ascii").rpartition(")")[2].split()
                parents[int(entry.name)] = int(stat[1])
                lines[int(entry.name)] = (entry / "cmdline").read_bytes().split(b"\0")
    beneath = {server}
    while more := {pid for pid, parent in parents.items() if parent in beneath} - beneath:
        beneath |= more
    modules = {
        "virtual segment": b"drivers.virtual.wires.ethercat",
        "host": b"drivers.ethercat.process.host",
    }
    return {
        part: pid
        for part, module in modules.items()
        for pid in beneath
        if lines[pid][1:3] == [b"-m", module]
    }


def grant_real_time(parts: dict[str, int]) -> str:
    """What a station grants host and server (docs/station.md), where the virtual bench's namespace
    cannot. The virtual drives get one of the cores: real ones do not take this computer's time.
    """
    try:
        *ours, theirs = sorted(os.sched_getaffinity(0))
        for part, priority, cores in (("virtual segment", 45, {theirs}), ("host", 40, set(ours))):
            os.sched_setscheduler(parts[part], os.SCHED_FIFO, os.sched_param(priority))
            os.sched_setaffinity(parts[part], cores)
        for task in Path(f"/proc/{parts['server']}/task").iterdir():
            os.setpriority(os.PRIO_PROCESS, int(task.name), NICE)
            os.sched_setaffinity(int(task.name), ours)
        with suppress(FileNotFoundError):  # sessions share alike whatever is nice inside them
            Path(f"/proc/{parts['server']}/autogroup").write_text(str(NICE), "ascii")
    except (OSError, ValueError) as error:
        return f"not granted ({error})"
    return (
        f"SCHED_FIFO for the bus and nice {NICE} for the server as on a station, virtual drives "
        f"on core {theirs}, host and server on the others; browsers anywhere"
    )


def prepare(http: httpx.Client) -> list[str]:
    """Four axes, and the exchange at 4 kHz."""
    drives = []
    for n in range(1, AXES + 1):
        body = {"url": URL, "station": n, "profile": "mms7", "name": f"A{n}"}
        drives.append(str(http.post("/drives", json=body).raise_for_status().json()["id"]))
    body = {"url": URL, "cycle_us": CYCLE_US}
    for _ in range(20):  # a computer that is busy with others may need several tries
        answer = http.post("/buses/cyclic", json=body)
        if answer.is_success:
            break
        time.sleep(1)
    answer.raise_for_status()
    return drives


def cycle_figures(http: httpx.Client) -> dict[str, Any]:
    """Counters of the cycle since the exchange began."""
    (bus,) = http.get("/buses").raise_for_status().json()
    details: dict[str, Any] = bus["quality"]["details"]
    return details


def open_scope(page: Page, url: str, drives: list[str]) -> None:
    """A Scope page with all channels."""
    setup = {
        "traces": [
            {"id": f"c{n}", "drive": drive, "key": key, "show": "axis", "factor": 1, "offset": 0,
             "unit": ""}
            for n, (drive, key) in enumerate(((d, k) for d in drives for k in KEYS), 1)
        ],
        "maths": [], "window_s": 5, "persistence": 0, "trigger": {"mode": "off"},
    }  # fmt: skip
    page.goto(url)
    page.evaluate("s => localStorage.setItem('servodeck.scope.setup', s)", json.dumps(setup))
    page.goto(f"{url}/#/scope")
    page.reload()
    page.locator('[data-trace="c16"]').wait_for(timeout=60_000)


class Chromium:
    """A browser that runs by itself; it is only looked into while its `attached` is entered.

    Whatever stays attached is informed of every frame of its sockets, gigabytes in half an hour.
    """

    def __init__(self, folder: Path) -> None:
        program = shutil.which("chromium") or "/usr/bin/chromium"
        self._reported = folder / "DevToolsActivePort"
        folder.mkdir()
        ordinary = []
        if os.geteuid() == 0:  # root's Chromium gives its threads nice -8, next to the server's
            nobody = pwd.getpwnam("nobody")
            os.chown(folder, nobody.pw_uid, nobody.pw_gid)
            ordinary = ["setpriv", f"--reuid={nobody.pw_uid}", f"--regid={nobody.pw_gid}",
                        "--clear-groups", "env", f"HOME={folder}"]  # fmt: skip
        self._process = subprocess.Popen(
            [*ordinary, program, *FLAGS, "--remote-debugging-port=0", f"--user-data-dir={folder}",
             "about:blank"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip

    @contextmanager
    def attached(self) -> Iterator[Browser]:
        """The browser, for as long as this is entered."""
        deadline = time.monotonic() + 30
        while not self._reported.exists() or not (lines := self._reported.read_text().splitlines()):
            if time.monotonic() > deadline:
                raise TimeoutError("Chromium did not start within 30 s")
            time.sleep(0.05)
        with sync_playwright() as playwright:
            browser = playwright.chromium.connect_over_cdp(f"http://127.0.0.1:{lines[0]}")
            # Not closed: when the connection ends the pages of the first context stay open.
            yield browser

    def end(self) -> None:
        """Close it."""
        self._process.terminate()
        self._process.wait(timeout=20)


def processes(browser: Browser) -> list[dict[str, Any]]:
    """Processes of a browser: type, id, processor time."""
    session = browser.new_browser_cdp_session()
    found: list[dict[str, Any]] = session.send("SystemInfo.getProcessInfo")["processInfo"]
    session.detach()
    return found


def scope_page(browser: Browser) -> Page:
    """The page that `open_scope` left open."""
    return next(page for page in browser.contexts[0].pages if page.url.endswith("#/scope"))


def lost(page: Page) -> int:
    """Samples that the page says its view has lost."""
    return int(page.locator("[data-lost]").get_attribute("data-lost") or 0)


class View:
    """What the page that is awake loses beyond the cycles that the bus itself leaves out.

    Page and bus are read one after the other, so the figure is known within what happened between.
    """

    def __init__(self, http: httpx.Client) -> None:
        self._http = http
        self._begin = self._end = (0, 0, 0)

    def begin(self, page: Page) -> None:
        """Before the soak."""
        self._begin = self._read(page)

    def end(self, page: Page) -> None:
        """After it."""
        self._end = self._read(page)

    def own_losses(self) -> tuple[int, int]:
        """Least and most rows that were lost on the way to the page."""
        (before_0, lost_0, after_0), (before_1, lost_1, after_1) = self._begin, self._end
        lost = lost_1 - lost_0
        return lost - AXES * (after_1 - before_0), lost - AXES * (before_1 - after_0)

    def _read(self, page: Page) -> tuple[int, int, int]:
        before = int(cycle_figures(self._http)["cyclic_overruns"])
        time.sleep(2 * SHOWN_S)  # the page shows what the bus reported
        reported = lost(page)
        time.sleep(SHOWN_S)
        return before, reported, int(cycle_figures(self._http)["cyclic_overruns"])


def disk_figures(path: Path) -> tuple[int, int, int]:
    """Samples on the disk, samples that the bus left out, and samples unaccounted for."""
    rows: dict[int, int] = {}
    out: dict[int, int] = {}
    first: dict[int, float] = {}
    last: dict[int, float] = {}
    with RecordingReader(path) as reader:
        for block in reader.blocks():
            stream = block.stream
            rows[stream] = rows.get(stream, 0) + len(block.values)
            # What was lost before the first block is no loss of the recording.
            out[stream] = out.get(stream, -block.lost) + block.lost
            first.setdefault(stream, float(block.times_s[0]))
            last[stream] = float(block.times_s[-1])
    dt = CYCLE_US / 1e6
    missing = sum(round((last[s] - first[s]) / dt) + 1 - rows[s] - out[s] for s in rows)
    return sum(rows.values()), sum(out.values()), missing


def soak(http: httpx.Client, server: int, url: str, folder: Path, browsers: list[Chromium]) -> None:
    """Run it and print the figures."""
    drives = prepare(http)
    parts = {"server": server} | fieldbus(server)
    scheduling = grant_real_time(parts)
    time.sleep(BASELINE_S)
    quiet = cycle_figures(http)
    channels = [{"drive": d, "key": k} for d in drives for k in KEYS]
    before, sleeping, view = [], [], View(http)
    for each in browsers:
        with each.attached() as browser:
            open_scope(browser.contexts[0].new_page(), url, drives)
            found = processes(browser)
        before.append(sum(p["cpuTime"] for p in found))
        sleeping = [int(p["id"]) for p in found if p["type"] != "browser"]
    with browsers[0].attached() as browser:
        view.begin(scope_page(browser))
    http.post("/recordings", json={"name": "soak", "channels": channels}).raise_for_status()
    poller = Poller(url)
    poller.start()
    began, used = time.monotonic(), {part: cpu_s(pid) for part, pid in parts.items()}
    memory = []
    stopped = False
    while (now := time.monotonic() - began) < SECONDS:
        asleep = SECONDS / 3 < now < 2 * SECONDS / 3
        if asleep is not stopped:
            for pid in sleeping:
                os.kill(pid, signal.SIGSTOP if asleep else signal.SIGCONT)
            stopped = asleep
        memory.append(memory_mib(server))
        time.sleep(1)
    took = time.monotonic() - began
    spent = {part: cpu_s(pid) - used[part] for part, pid in parts.items()}
    poller.stop.set()
    poller.join()
    after, views = [], []
    for each in browsers:
        with each.attached() as browser:
            after.append(sum(p["cpuTime"] for p in processes(browser)))
            views.append(lost(scope_page(browser)))
            if each is browsers[0]:
                view.end(scope_page(browser))
    info = http.post("/recordings/soak.sdrec/stop").raise_for_status().json()
    busy = cycle_figures(http)
    samples, left_out, missing = disk_figures(folder / "state/recordings/soak.sdrec")
    rate = samples / AXES / took
    print(
        f"{took:.0f} s, {AXES} axes, {len(channels)} channels at {1e6 / CYCLE_US:.0f} Hz, "
        f"{rate:.0f} cycles a second came; browser 2 slept {SECONDS / 3:.0f} s"
    )
    print(
        f"disk: {samples} rows, {info['bytes'] / 1e6:.0f} MB, {left_out} left out by the bus, "
        f"{missing} unaccounted for; state {info['state']}"
    )
    least, most = view.own_losses()
    print(
        f"views: browser 1 lost {views[0]} rows, on the way to it {least} to {most} of them, "
        f"the others the bus left out; browser 2 lost {views[1]} "
        f"(its sleep: about {AXES * rate * SECONDS / 3:.0f})"
    )
    settled = memory[int(min(SETTLING_S, took * SETTLING_PART) / took * len(memory)) :]
    tenth = max(1, len(settled) // 10)
    grown = float(np.median(settled[-tenth:]) - np.median(settled[:tenth]))
    by_part = ", ".join(f"{part} {100 * s / took:.0f} %" for part, s in spent.items())
    print(
        f"of a core: {by_part}; memory of the server {settled[0]:.0f} MiB settled, "
        f"{settled[-1]:.0f} MiB at the end, {max(memory):.0f} at most"
    )
    shares = [100 * (b - a) / took for a, b in zip(before, after, strict=True)]
    print(f"browsers: {shares[0]:.0f} % and {shares[1]:.0f} % of a core")
    print(f"scheduling of host and virtual drives: {scheduling}")
    for name, figures in (("alone", quiet), ("with all", busy)):
        late = figures.get("cyclic_late_p50_us"), figures.get("cyclic_late_p99_us")
        print(
            f"cycle {name}: late p50 {late[0]} µs, p99 {late[1]} µs, "
            f"{figures.get('cyclic_overruns')} overruns"
        )
    p50, p99 = np.percentile(poller.times_ms, [50, 99])
    print(
        f"GET /drives: p50 {p50:.1f} ms, p99 {p99:.1f} ms ({len(poller.times_ms)} requests); "
        f"load of the machine {os.getloadavg()[1]:.1f}"
    )
    jitter = [float(f.get("cyclic_late_p99_us", float("nan"))) for f in (quiet, busy)]
    missed = AXES * rate * SECONDS / 3
    aims = [
        Aim(f"the recording is complete, {missing} samples unaccounted for on the disk",
            info["state"] == "complete" and missing == 0),
        Aim(f"the page that was awake lost {max(least, 0)} rows beyond those that the bus left "
            "out, none", least <= 0),
        Aim(f"the page that slept was informed of {views[1]} lost rows of about {missed:.0f}",
            REPORTED_PART * missed <= views[1] <= missed / REPORTED_PART),
        Aim(f"the server's memory grew by {grown:.1f} MiB, at most {FLAT_MIB:.0f}",
            grown <= FLAT_MIB),
        Aim(f"GET /drives p99 {p99:.1f} ms, below 50 ms", bool(p99 < 50)),
    ]  # fmt: skip
    if not STEADY:  # time that follows the frames is never late
        aims.append(
            Aim(
                f"lateness of the cycle p99 {jitter[0]:.0f} µs alone, {jitter[1]:.0f} µs with all",
                jitter[1] <= JITTER_FACTOR * jitter[0] + JITTER_US,
            )
        )
    print_verdict(aims)


def main() -> None:
    """Print the figures."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o711)  # what it holds is found by name by a browser that is not root's
        with station_process(folder) as (http, server, url):
            browsers = [Chromium(folder / f"browser{n}") for n in (1, 2)]
            try:
                soak(http, server, url, folder, browsers)
            finally:
                for each in browsers:
                    each.end()


if __name__ == "__main__":
    if sys.argv[1:2] == ["--station"]:
        run_station(Path(sys.argv[2]))
    else:
        main()
