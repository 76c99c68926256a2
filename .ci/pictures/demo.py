"""The demo with one axis of its bench, whose time follows the frames of the bus.

Server, wires, drives and mechanics are those of `servodeck demo`. There, time is that of the
computer while no process data flow; here it never is, so that a busy computer changes no figure.
The other drives of the demo would only take the computer that this one needs.

    python .ci/pictures/demo.py FOLDER    prints the address, and ends with its standard input
"""

from __future__ import annotations

import asyncio
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))


import drivers.virtual
from backend.station.demo import connect_axes
from tests.support.demo_api import DemoApi
from tests.support.station import HANG_S, Station

#: The axis as the bench file names it, and as the interface does.
NAME = "Gantry left"
AXIS = "gantry-left"


def bench_text() -> str:
    """The axis in the bench file of the demo."""
    file = Path(drivers.virtual.__file__).parent / "standard_bench.toml"
    _, *axes = file.read_text("utf-8").split("[[axis]]")
    (axis,) = [each for each in axes if f'name = "{NAME}"' in each]
    return f"[[axis]]{axis}"


def serve(folder: Path) -> None:
    """Run the station, with the axis connected, until the standard input ends."""
    file = folder / "bench.toml"
    file.write_text(bench_text(), "utf-8")
    station = Station(folder, file, ["--lockstep"])
    station.start()
    try:
        assert station.bench is not None
        assert station.loop is not None
        station.bench.buses.cause_fault = station.drives.cause_fault
        connecting = connect_axes(station.bench, station.drives.spec)
        connected = asyncio.run_coroutine_threadsafe(connecting, station.loop).result(HANG_S)
        assert connected == [AXIS]
        print(station.url, flush=True)
        sys.stdin.read()
    finally:
        station.stop()


class Demo(DemoApi):
    """The running station, in a process of its own: the browser's work must not delay the bus."""

    def __init__(self, folder: Path) -> None:
        command = [sys.executable, __file__, str(folder)]
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True)
        assert self._process.stdout is not None
        address = self._process.stdout.readline().strip()
        assert address, "the demo does not start"
        super().__init__(f"{address}/", AXIS)

    def close(self) -> None:
        """End server and drives."""
        self.http.close()
        self._process.communicate(timeout=HANG_S)


if __name__ == "__main__":
    serve(Path(sys.argv[1]))
