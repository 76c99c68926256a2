"""The demo with one axis of its bench, whose time follows the frames of the bus.

Server, wires, drives and mechanics are those of `servodeck demo`. There, time is that of the
computer while no process data flow; here it never is, so that a busy computer changes no figure.
The other drives of the demo would only take the computer that this one needs.
"""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import drivers.virtual
from backend.station.demo import connect_axes
from tests.support.station import HANG_S, Station, until

#: The axis as the bench file names it, and as the interface does.
NAME = "Gantry left"
AXIS = "gantry-left"


def bench_text() -> str:
    """The axis in the bench file of the demo."""
    file = Path(drivers.virtual.__file__).parent / "standard_bench.toml"
    _, *axes = file.read_text("utf-8").split("[[axis]]")
    (axis,) = [each for each in axes if f'name = "{NAME}"' in each]
    return f"[[axis]]{axis}"


class Demo:
    """The running station; the axis is connected, as the demo connects it."""

    def __init__(self, folder: Path) -> None:
        file = folder / "bench.toml"
        file.write_text(bench_text(), "utf-8")
        self._station = Station(folder, file, ["--lockstep"])
        self._station.start()
        bench, loop = self._station.bench, self._station.loop
        assert bench is not None
        assert loop is not None
        drives = self._station.drives
        bench.buses.cause_fault = drives.cause_fault
        connecting = asyncio.run_coroutine_threadsafe(connect_axes(bench, drives.spec), loop)
        assert connecting.result(HANG_S) == [AXIS]
        self.http = self._station.http
        self.url = f"{self._station.url}/"

    def ask(self, path: str) -> Any:
        """What the interface answers.

        Raises:
            AssertionError: it refuses.
        """
        answer = self.http.get(path)
        assert answer.is_success, answer.text
        return answer.json()

    def fresh(self) -> Any:
        """The state of the axis, once its drive answers."""

        def answered() -> Any:
            state = self.ask(f"/drives/{AXIS}/state")
            return state if state["fresh"] and state["position"] is not None else None

        return until(answered, HANG_S, "the axis answers")

    def close(self) -> None:
        """End server and drives."""
        self._station.stop()
