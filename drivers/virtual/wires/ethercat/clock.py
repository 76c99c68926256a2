"""The wire's time in nanoseconds: real, or in lockstep with the process-data frames."""

from __future__ import annotations

import time
from typing import Protocol


class WireClock(Protocol):
    """Says when a frame arrived."""

    def arrival(self, process_data: bool, cycle_ns: int, age_ns: int = 0) -> int:
        """Time of the frame being handled now; never before the last one.

        ``process_data`` distinguishes frames with logical datagrams from all others, ``cycle_ns``
        is the cycle of the segment (0 while there is none), ``age_ns`` how long ago the kernel saw
        it.
        """

    def now(self, until_ns: int | None = None) -> int:
        """Present time without a frame; at most ``until_ns``, where that is given."""

    def ahead_s(self, wire_ns: int) -> float | None:
        """How long until this time of the wire; None where time follows the frames."""

    def grid(self, start_ns: int, cycle_ns: int) -> int:
        """Where a SYNC0 grid that the master placed at ``start_ns`` really begins."""


class RealClock:
    """Monotonic time since the segment was switched on."""

    def __init__(self) -> None:
        self._start = time.monotonic_ns()
        self._last = 0

    def arrival(self, process_data: bool, cycle_ns: int, age_ns: int = 0) -> int:
        """Arrival by the kernel's time stamp, so that our own scheduling does not matter."""
        del process_data, cycle_ns
        self._last = max(self._last, time.monotonic_ns() - self._start - age_ns)
        return self._last

    def now(self, until_ns: int | None = None) -> int:
        """Present time."""
        present = time.monotonic_ns() - self._start
        self._last = max(self._last, present if until_ns is None else min(present, until_ns))
        return self._last

    def ahead_s(self, wire_ns: int) -> float | None:
        """From now."""
        return (wire_ns + self._start - time.monotonic_ns()) * 1e-9

    def grid(self, start_ns: int, cycle_ns: int) -> int:
        """Where the master placed it."""
        del cycle_ns
        return start_ns


class LockstepClock:
    """One cycle per process-data frame, however fast or slow they come; deterministic.

    Process-data frames arrive in the middle of cycles, on the grid (n + ½)·cycle. Every other
    frame takes ``frame_ns``, so that there is room for mailbox work between two cycles; when
    `IDLE_FRAMES` have come without process data, each takes ``idle_frame_ns``, so that polling
    for an answer or a state makes time pass.
    """

    IDLE_FRAMES = 40

    def __init__(
        self,
        cycle_ns: int = 1_000_000,
        frame_ns: int = 5_000,
        idle_frame_ns: int = 200_000,
    ) -> None:
        self.cycle_ns = cycle_ns
        self.frame_ns = frame_ns
        self.idle_frame_ns = idle_frame_ns
        self._now = 0
        self._others = self.IDLE_FRAMES

    def arrival(self, process_data: bool, cycle_ns: int, age_ns: int = 0) -> int:
        """Next half-cycle for process data, a little later for anything else."""
        del age_ns
        if process_data:
            cycle = cycle_ns or self.cycle_ns
            self._now = ((self._now + cycle // 2) // cycle) * cycle + cycle // 2
            self._others = 0
        else:
            self._others += 1
            idle = self._others > self.IDLE_FRAMES
            self._now += self.idle_frame_ns if idle else self.frame_ns
        return self._now

    def now(self, until_ns: int | None = None) -> int:
        """Time of the last frame."""
        del until_ns
        return self._now

    def ahead_s(self, wire_ns: int) -> float | None:
        """Unknown."""
        del wire_ns
        return None

    def grid(self, start_ns: int, cycle_ns: int) -> int:
        """The next whole multiple of the cycle: the master's own clock must not matter here."""
        return -(-start_ns // cycle_ns) * cycle_ns


class SteadyClock:
    """Real time while no process data flow, and one cycle per frame while they do.

    For drives and a master that share a busy computer: a cycle that comes late for lack of
    processor time is then not late for the drives, and measurements are as on a quiet bus. When
    the frames end, real time goes on after `SILENT_NS`, so that watchdogs work.
    """

    SILENT_NS = 200_000_000

    def __init__(self, frame_ns: int = 2_000) -> None:
        self._start = time.monotonic_ns()
        self._frame_ns = frame_ns
        self._now = 0
        self._behind = 0
        self._last_cyclic: int | None = None

    def _real(self) -> int:
        return time.monotonic_ns() - self._start

    def _flowing(self, real: int) -> bool:
        return self._last_cyclic is not None and real - self._last_cyclic < self.SILENT_NS

    def arrival(self, process_data: bool, cycle_ns: int, age_ns: int = 0) -> int:
        """Middle of the next cycle for process data of a synchronised segment."""
        real = self._real()
        flowing = self._flowing(real)
        if process_data and cycle_ns:
            start = self._now if flowing else max(self._now, real - age_ns - self._behind)
            self._now = ((start + cycle_ns // 2) // cycle_ns) * cycle_ns + cycle_ns // 2
            self._last_cyclic, self._behind = real, real - self._now
        elif flowing:
            self._now += self._frame_ns
        else:
            self._now = max(self._now, real - age_ns - self._behind)
        return self._now

    def now(self, until_ns: int | None = None) -> int:
        """Time of the last frame while process data flow, else real time from there on."""
        del until_ns
        real = self._real()
        if not self._flowing(real):
            self._now = max(self._now, real - self._behind)
        return self._now

    def ahead_s(self, wire_ns: int) -> float | None:
        """Unknown while process data flow, and without them there is nothing to wait for."""
        del wire_ns
        return None

    def grid(self, start_ns: int, cycle_ns: int) -> int:
        """The next whole multiple of the cycle."""
        return -(-start_ns // cycle_ns) * cycle_ns
