"""Whether this computer and adapter keep a cycle: measured, kept, and judged for a cycle time.

Without real-time scheduling and raw sockets (Windows, macOS) nothing guarantees that a frame leaves
in time. So process data are exchanged only where a check of some seconds has shown it: the host
wakes up every millisecond, sends one frame that reads register 0000h of a slave, and waits for it.
A cycle is missed where waking up and the frame together take longer than the cycle.
"""

from __future__ import annotations

import json
import math
import os
import socket
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import platformdirs

from drivers.computer.clock import resolution_s
from drivers.computer.lateness import EDGES_US, Histogram, missed_bound
from drivers.errors import NotAllowed
from drivers.ethercat.process.protocol import Message
from drivers.ethercat.wire.lanes import Wire
from drivers.ethercat.wire.steps import Read

CHECK_S = 10.0
PERIOD_US = 1000
ALLOWED_MISSED = 0.001
"""The share of missed cycles with which a frequency response keeps its accuracy; derived in
`backend.preflight.verdicts`."""
COARSEST_CLOCK_S = 1e-4
"""A tenth of the shortest cycle. Before CPython 3.13 the clock of Windows has steps of 15.6 ms."""
_REGISTER = Read(0x0000, 2)


@dataclass(frozen=True, slots=True)
class Punctuality:
    """One check: a histogram of the time from the due moment to the frame's return.

    ``counts`` by the classes of `EDGES_US`, µs. Frames that did not come back are in the last one.
    """

    counts: tuple[int, ...]

    @property
    def cycles(self) -> int:
        """How many were measured."""
        return sum(self.counts)

    def missed(self, cycle_us: float) -> int:
        """Cycles that were not over in time; a class that reaches beyond counts wholly."""
        ends = (*EDGES_US, math.inf)
        return sum(n for n, end in zip(self.counts, ends, strict=True) if end > cycle_us)

    def bound(self, cycle_us: float) -> float:
        """The share of missed cycles that is not exceeded with 95 % confidence."""
        return missed_bound(self.missed(cycle_us), self.cycles)

    def allows(self, cycle_us: float) -> bool:
        """Whether process data may be exchanged in this cycle."""
        return self.bound(cycle_us) <= ALLOWED_MISSED


class Check:
    """The measurement in the host. One call of `cycle` is one cycle; commands go in between."""

    def __init__(self, segment: Wire, station: int, seconds: float) -> None:
        self._segment = segment
        self._station = station
        self._left = max(round(seconds * 1e6 / PERIOD_US), 1)
        self._used = Histogram.empty()
        self._due_ns = time.monotonic_ns() + PERIOD_US * 1000

    def cycle(self) -> Message | None:
        """Wait for the next moment and send one frame; the result once all are measured."""
        time.sleep(max(self._due_ns - time.monotonic_ns(), 0) * 1e-9)
        answered = self._segment.exchange([(self._station, _REGISTER)])[0] is not None
        used_us = (time.monotonic_ns() - self._due_ns) / 1000
        self._used.add(used_us if answered else 10 * EDGES_US[-1])
        # A cycle that is over is not made up for: the next one is on the grid again.
        late = max(time.monotonic_ns() - self._due_ns, 0) // (PERIOD_US * 1000)
        self._due_ns += (late + 1) * PERIOD_US * 1000
        self._left -= 1
        return None if self._left else {"counts": list(self._used.counts)}


class Kept:
    """The last check of each adapter, in a file among what can be made again."""

    def __init__(self, interface: str, file: Path | None = None) -> None:
        """``file`` is given by tests."""
        self.interface = interface
        self._file = file or _folder() / "ethercat-punctuality.json"
        # Another Python or computer has another clock and other sleeps.
        self._key = f"{interface} {socket.gethostname()} {sys.version.split()[0]}"

    def read(self) -> Punctuality | None:
        """The last check; None where there is none."""
        counts = self._all().get(self._key)
        if not isinstance(counts, list) or len(counts) != len(EDGES_US) + 1:
            return None
        if not all(isinstance(count, int) and count >= 0 for count in counts):
            return None
        return Punctuality(tuple(counts))

    def write(self, found: Punctuality) -> None:
        """Keep it. Where that is not possible the next exchange measures again."""
        kept = self._all() | {self._key: asdict(found)["counts"]}
        try:
            self._file.parent.mkdir(parents=True, exist_ok=True)
            self._file.write_text(json.dumps(kept), "utf-8")
        except OSError:
            return

    def _all(self) -> dict[str, object]:
        try:
            found = json.loads(self._file.read_text("utf-8"))
        except (OSError, ValueError):
            return {}
        return found if isinstance(found, dict) else {}


def require_fine_clock(measured_s: Callable[[], float] = resolution_s) -> None:
    """The clock of this Python can show whether a cycle was kept.

    Raises:
        NotAllowed: its steps are longer than `COARSEST_CLOCK_S`.
    """
    if measured_s() > COARSEST_CLOCK_S:
        raise NotAllowed(
            "ethercat.clock-too-coarse",
            value=round(measured_s() * 1000, 3),
            limit=f"{COARSEST_CLOCK_S * 1000:g} ms",
        )


def require_punctual(interface: str, found: Punctuality, cycle_s: float) -> None:
    """Process data may be exchanged in this cycle.

    Raises:
        NotAllowed: too many cycles would be missed.
    """
    if not found.allows(cycle_s * 1e6):
        raise NotAllowed(
            "ethercat.process-data-too-late",
            value=f"{100 * found.bound(cycle_s * 1e6):.2g} %",
            limit=f"{100 * ALLOWED_MISSED:g} %",
            interface=interface,
            cycle_ms=cycle_s * 1000,
            missed=found.missed(cycle_s * 1e6),
            cycles=found.cycles,
        )


def _folder() -> Path:
    return Path(os.environ.get("SERVODECK_CACHE") or platformdirs.user_cache_dir("servodeck"))
