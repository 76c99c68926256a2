"""Timing check of computer and adapter: measurement, storage, and verdict for a cycle time.

Without real-time scheduling and raw sockets (Windows, macOS), no frame is guaranteed to leave in
time. Process data are therefore exchanged only after a check of some seconds: the host wakes up
every millisecond, sends one frame that reads register 0000h of a slave, and waits for it. A cycle
is missed if waking up and the frame together take longer than the cycle.
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

from drivers.computer.timing.clock import resolution_s
from drivers.computer.timing.lateness import EDGES_US, Histogram, missed_bound
from drivers.errors import NotAllowed
from drivers.ethercat.process.protocol import Message
from drivers.ethercat.wire.lanes import Wire
from drivers.ethercat.wire.steps import Read

CHECK_S = 10.0
PERIOD_US = 1000
ALLOWED_MISSED = 0.001
"""Share of missed cycles up to which a frequency response keeps its accuracy; derived in
`backend.foundation.preflight.verdicts`.
"""
COARSEST_CLOCK_S = 1e-4
"""A tenth of the shortest cycle [s]. Before CPython 3.13 the clock of Windows has 15.6 ms steps."""
_REGISTER = Read(0x0000, 2)


@dataclass(frozen=True, slots=True)
class Punctuality:
    """One check: a histogram of the time from the due time to the frame's return.

    ``counts`` by the bins of `EDGES_US` [µs]. Frames that did not come back are in the last one.
    """

    counts: tuple[int, ...]

    @property
    def cycles(self) -> int:
        """Number of cycles measured."""
        return sum(self.counts)

    def missed(self, cycle_us: float) -> int:
        """Return the cycles that ended too late; a bin that extends beyond the cycle counts."""
        ends = (*EDGES_US, math.inf)
        return sum(n for n, end in zip(self.counts, ends, strict=True) if end > cycle_us)

    def bound(self, cycle_us: float) -> float:
        """Return the upper bound of the share of missed cycles, with 95 % confidence."""
        return missed_bound(self.missed(cycle_us), self.cycles)

    def allows(self, cycle_us: float) -> bool:
        """Return whether process data may be exchanged with this cycle [µs]."""
        return self.bound(cycle_us) <= ALLOWED_MISSED


class Check:
    """The measurement in the host. One call of `cycle` is one cycle; commands run in between."""

    def __init__(self, segment: Wire, station: int, seconds: float) -> None:
        self._segment = segment
        self._station = station
        self._left = max(round(seconds * 1e6 / PERIOD_US), 1)
        self._used = Histogram.empty()
        self._due_ns = time.monotonic_ns() + PERIOD_US * 1000

    def cycle(self) -> Message | None:
        """Wait for the next due time and send one frame; return the result after the last cycle."""
        time.sleep(max(self._due_ns - time.monotonic_ns(), 0) * 1e-9)
        answered = self._segment.exchange([(self._station, _REGISTER)])[0] is not None
        used_us = (time.monotonic_ns() - self._due_ns) / 1000
        self._used.add(used_us if answered else 10 * EDGES_US[-1])
        # A missed cycle is not made up for: the next one is on the grid again.
        late = max(time.monotonic_ns() - self._due_ns, 0) // (PERIOD_US * 1000)
        self._due_ns += (late + 1) * PERIOD_US * 1000
        self._left -= 1
        return None if self._left else {"counts": list(self._used.counts)}


class Kept:
    """The last check of each adapter, in a file in the cache folder."""

    def __init__(self, interface: str, file: Path | None = None) -> None:
        """Select the adapter; only tests set ``file``."""
        self.interface = interface
        self._file = file or _folder() / "ethercat-punctuality.json"
        # Another Python or computer has a different clock and different sleeps.
        self._key = f"{interface} {socket.gethostname()} {sys.version.split()[0]}"

    def read(self) -> Punctuality | None:
        """Return the last check; None if there is none."""
        counts = self._all().get(self._key)
        if not isinstance(counts, list) or len(counts) != len(EDGES_US) + 1:
            return None
        if not all(isinstance(count, int) and count >= 0 for count in counts):
            return None
        return Punctuality(tuple(counts))

    def write(self, found: Punctuality) -> None:
        """Store the check. If that is not possible, the next exchange measures again."""
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
    """Require a clock of this Python fine enough to show whether a cycle was kept.

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
    """Require that process data may be exchanged with this cycle.

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
