"""The station under trial: virtual drives, the server's process, and the truth past the wire."""

from __future__ import annotations

import contextlib
import json
import os
import resource
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx

from backend.station.demo import DemoBench
from benchmarks.chaos.grants import GrantLog
from drivers import cia402
from drivers.errors import DriveError
from drivers.virtual.wires.ethercat.launch import VirtualSegment

POSITION, STATUS = 0x6064, 0x6041
PASSWORD = "eleven blue horses"
#: A server ends in order within this time.
_ENDED_S = 20.0


@dataclass(frozen=True)
class AxisSpec:
    """A drive of the trial. ``setting`` is a parameter that people change, with legal bounds.

    ``energising`` are objects that move or enable this family, with raw values that do it. ``on``
    is the kind of its bus where the trial has several.
    """

    name: str
    family: str
    setting: str
    low: int
    high: int
    energising: tuple[tuple[str, int], ...] = ()
    on: str = ""


#: 6060h, 60FFh and the control word move every family (CiA 402-2 clause 8.4); DS_C has no 6060h.
_STANDARD = (("6060:00", 3), ("60FF:00", 100_000), ("6040:00", 0x06), ("6040:00", 0x0F))
_MMS7 = (*_STANDARD, ("2031:02", 1), ("2108:01", 1))
_DS_C = _STANDARD[1:]
#: The families of an EtherCAT segment; a seed takes three of them.
_SEGMENT = (
    AxisSpec("A", "mms7", "2005:03", 500, 3000, _MMS7),
    AxisSpec("B", "m6l", "2008:01", 150, 400, (*_STANDARD, ("2003:02", 17), ("2003:0F", 3),
                                              ("200C:01", 4))),
    AxisSpec("C", "r6l", "2006:01", 200, 500, (*_STANDARD, ("200C:0B", 1), ("200C:0C", 1))),
    AxisSpec("D", "ep3e", "2005:00", 20, 60, (*_STANDARD, ("60FE:01", 0), ("60FE:02", 1))),
)  # fmt: skip
_LINES: dict[str, tuple[AxisSpec, ...]] = {
    "mlink": (
        AxisSpec("A", "mms7", "2005:03", 500, 3000, _MMS7),
        AxisSpec("B", "mms7", "2005:03", 500, 3000, _MMS7),
    ),
    "canopen": (AxisSpec("A", "ds_c", "2502:00", 1, 50, _DS_C),),
    "modbus": (
        AxisSpec("A", "ds_c", "2502:00", 1, 50, _DS_C),
        AxisSpec("B", "ds_c", "2502:00", 1, 50, _DS_C),
    ),
    # One server, three buses.
    "mixed": (
        AxisSpec("A", "mms7", "2005:03", 500, 3000, _MMS7, "mlink"),
        AxisSpec("B", "ds_c", "2502:00", 1, 50, _DS_C, "canopen"),
        AxisSpec("C", "ds_c", "2502:00", 1, 50, _DS_C, "modbus"),
    ),
}
BUSES = (*_LINES, "ethercat")


def specs_of(bus: str, seed: int) -> tuple[AxisSpec, ...]:
    """The drives of a trial: on EtherCAT three of the four families, by the seed."""
    if bus != "ethercat":
        return _LINES[bus]
    # Seed 1 leaves the EP3E out, 2 the MMS7, 3 the M6-L, 4 the R6L.
    left_out = (seed + 2) % len(_SEGMENT)
    return tuple(spec for place, spec in enumerate(_SEGMENT) if place != left_out)


@dataclass(frozen=True)
class Truth:
    """What a drive itself says. ``time_s`` is the drive's own time."""

    wall_s: float
    time_s: float
    position: int
    enabled: bool


def starved_s() -> float:
    """For how long, since the machine began, something waited for a processor [s]."""
    try:
        with Path("/proc/pressure/cpu").open() as file:
            return float(file.readline().rpartition("total=")[2]) / 1e6
    except (OSError, ValueError):
        return 0.0


class TrialStation:
    """Server and drives of one bus, and the ways to hurt them."""

    def __init__(self, folder: Path, bus: str, specs: tuple[AxisSpec, ...]) -> None:
        self.bus, self.specs = bus, specs
        self.urls = list(dict.fromkeys(self.url_of(axis) for axis in range(len(specs))))
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        bench = folder / "bench.toml"
        bench.write_text(
            "".join(
                f'[[axis]]\nname = "{s.name}"\ndrive = "{s.family}"\non = "{self.url_of(n)}"\n'
                f"station = {self.place_of(n)}\n"
                for n, s in enumerate(self.specs)
            )
        )
        self._bench_file = bench
        self.drives = DemoBench(bench, folder / "wires", folder / "nvm", steady=True)
        self.log = folder / "server.log"
        self.process: subprocess.Popen[str] | None = None
        self.port = 0
        self.down_since: float | None = None
        self._asking, self._telling = threading.Lock(), threading.Lock()
        self.grants = GrantLog()
        self._own_status = {s.name: s.family == "ds_c" for s in self.specs}

    def url_of(self, axis: int) -> str:
        """The bus of an axis."""
        return f"{self.specs[axis].on or self.bus}://virtual0"

    def place_of(self, axis: int) -> int:
        """Its station there, from 1."""
        return 1 + [self.url_of(n) for n in range(axis)].count(self.url_of(axis))

    def connecting(self, axis: int) -> dict[str, object]:
        """The request that makes it a drive of the bench."""
        spec = self.specs[axis]
        return {
            "url": self.url_of(axis),
            "station": self.place_of(axis),
            "profile": spec.family,
            "name": spec.name,
        }

    @property
    def root(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    # --- processes --------------------------------------------------------------------

    def start(self) -> None:
        self.drives.start()
        if self.drives.problems:
            raise SystemExit("; ".join(self.drives.problems))
        self.start_server()

    def _wires(self) -> dict[str, Any]:
        if self.bus != "ethercat":
            return {url: {"real": self.drives.addresses[url]} for url in self.urls}
        launcher = list(self.drives._namespaces[0].command(()))
        return {self.urls[0]: {"interface": "ec0m", "launcher": launcher}}

    @property
    def segment(self) -> VirtualSegment:
        """The virtual EtherCAT segment."""
        return self.drives.segments[self.urls[0]]

    def start_server(self) -> None:
        """Raises RuntimeError when it does not start."""
        log = self.log.open("a")
        writes = self.grants.anew()
        self.process = subprocess.Popen(
            [sys.executable, "-m", "benchmarks.chaos.server", "--state",
             str(self.folder / "state"), "--wires", json.dumps(self._wires()),
             "--grants", str(writes)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log, text=True,
            pass_fds=(writes,),
        )  # fmt: skip
        os.close(writes)
        log.close()
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        if not line:
            raise RuntimeError("the server does not start: " + self.log.read_text()[-2000:])
        self.port = json.loads(line)["port"]
        self.down_since = None

    def tell_server(self, **command: object) -> Any:
        assert self.process is not None
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        with self._telling:
            self.process.stdin.write(json.dumps(command) + "\n")
            self.process.stdin.flush()
            line = self.process.stdout.readline()
        return json.loads(line) if line else {}

    def kill_server(self) -> None:
        assert self.process is not None
        self.down_since = time.monotonic()
        self.process.kill()
        self._reap()

    def end_server(self) -> int:
        """In order; the exit status."""
        assert self.process is not None
        assert self.process.stdin is not None
        self.down_since = time.monotonic()
        self.process.stdin.close()
        began, starved = time.monotonic(), starved_s()
        # A machine that keeps processes waiting gets as much more time.
        while (status := self.process.poll()) is None:
            if time.monotonic() - began > _ENDED_S + starved_s() - starved:
                self.process.kill()
                status = -9
                break
            time.sleep(0.05)
        self._reap()
        return status

    def _reap(self) -> None:
        process = self.process
        assert process is not None
        process.wait()
        for stream in (process.stdin, process.stdout):
            with contextlib.suppress(OSError):
                assert stream is not None
                stream.close()

    def host_process(self) -> int | None:
        """The EtherCAT process of the server."""
        if self.process is None:
            return None
        for entry in Path("/proc").iterdir():
            if not entry.name.isdigit():
                continue
            with contextlib.suppress(OSError):
                command = (entry / "cmdline").read_bytes()
                parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
                if b"drivers.ethercat.process.host" in command and parent == self.process.pid:
                    return int(entry.name)
        return None

    def limit_files(self, size: int | None) -> None:
        """No file of the server grows beyond this; a disk that is full."""
        assert self.process is not None
        hard = resource.RLIM_INFINITY
        with contextlib.suppress(ProcessLookupError):
            resource.prlimit(
                self.process.pid, resource.RLIMIT_FSIZE, (hard if size is None else size, hard)
            )

    def restart_segment(self) -> None:
        """The virtual segment again, after it was killed."""
        self.segment.close()
        options = ["--bench", str(self._bench_file), "--on", self.urls[0], "--steady",
                   "--nvm", str(self.folder / "nvm" / "ethercat0")]  # fmt: skip
        self.drives.segments[self.urls[0]] = VirtualSegment.start(
            "ec0s", options, self.drives._namespaces[0]
        )

    def locked(self, work: Callable[[], None]) -> None:
        """Do something while nobody asks the drives."""
        with self._asking:
            work()

    def virtual_process(self) -> int:
        if self.bus == "ethercat":
            return self.segment.pid
        assert self.drives._host is not None
        return self.drives._host.pid

    def stop(self) -> None:
        if self.process is not None and self.process.poll() is None:
            with contextlib.suppress(OSError):
                self.process.send_signal(signal.SIGCONT)
            self.end_server()
        self.grants.close()
        self.drives.stop()

    # --- trouble and truth ------------------------------------------------------------

    def trouble(self, do: str, **arguments: object) -> Any:
        """A command to the virtual drives."""
        with self._asking:
            if self.bus == "ethercat":
                return self.segment.command(do, **arguments)
            return self.drives.command(do=do, **arguments)

    def object(self, axis: int, index: int, subindex: int = 0) -> bytes:
        """An object's value by the drive's own word."""
        if self.bus == "ethercat":
            reported = self.trouble("read", slave=axis, index=index, subindex=subindex)
        else:
            reported = self.trouble(
                "read", axis=self.specs[axis].name, index=index, subindex=subindex
            )
        return bytes.fromhex(str(reported))

    def truth(self, axis: int) -> Truth | None:
        """None while the virtual drives themselves cannot be asked."""
        try:
            position = self.object(axis, POSITION)
            word = int.from_bytes(self.object(axis, STATUS), "little")
            now = time.monotonic()
            drive_s = now
            if self.bus == "ethercat":
                drive_s = float(self.trouble("state")["time_s"])
        except (DriveError, ValueError, AssertionError):
            return None
        own = self._own_status[self.specs[axis].name]
        state = cia402.decode_state(word, echoes_control=own)
        enabled = state is cia402.State.OPERATION_ENABLED
        value = int.from_bytes(position, "little", signed=True)
        return Truth(now, drive_s, value, enabled)

    # --- figures of the server --------------------------------------------------------

    def waited_s(self) -> float:
        """Seconds that the server's loop and this process waited for a processor."""
        total = 0
        pids = [os.getpid(), self.virtual_process()]
        if self.process is not None:
            pids.append(self.process.pid)
        for pid in pids:
            with contextlib.suppress(OSError, IndexError, ValueError):
                total += int(Path(f"/proc/{pid}/task/{pid}/schedstat").read_text().split()[1])
        return total / 1e9

    def figures(self) -> dict[str, Any]:
        """Tasks, threads, file descriptors, memory in MiB."""
        assert self.process is not None
        reported = self.tell_server(do="tell")
        folder = Path(f"/proc/{self.process.pid}")
        status = (folder / "status").read_text()
        rss = next(line for line in status.splitlines() if line.startswith("VmRSS"))
        reported["files"] = len(list((folder / "fd").iterdir()))
        reported["mib"] = int(rss.split()[1]) / 1024
        return dict(reported)

    def client(self) -> httpx.Client:
        return httpx.Client(base_url=f"{self.root}/api/v1", timeout=30)
