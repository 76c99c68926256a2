"""The segment's time in nanoseconds: real, or in lockstep with the process-data frames."""

from __future__ import annotations

import time
from typing import Protocol


class WireClock(Protocol):
    """Defines the time at which frames arrive."""

    def arrival(self, process_data: bool, cycle_ns: int, age_ns: int = 0) -> int:
        """Return the time of the present frame; never before the last one.

        ``process_data`` is True for frames with logical datagrams, ``cycle_ns`` is the cycle of the
        segment (0 if none is set), ``age_ns`` the time since the kernel received the frame.
        """

    def now(self, until_ns: int | None = None) -> int:
        """Return the present time without a frame, at most ``until_ns`` if given."""

    def ahead_s(self, wire_ns: int) -> float | None:
        """Return the seconds until a segment time; None if time follows the frames."""

    def grid(self, start_ns: int, cycle_ns: int) -> int:
        """Return the actual start of a SYNC0 grid that the master set to ``start_ns``."""


class RealClock:
    """Monotonic time since the segment was started."""

    def __init__(self) -> None:
        self._start = time.monotonic_ns()
        self._last = 0

    def arrival(self, process_data: bool, cycle_ns: int, age_ns: int = 0) -> int:
        """Return the kernel's receive time, so that our own scheduling has no effect."""
        del process_data, cycle_ns
        self._last = max(self._last, time.monotonic_ns() - self._start - age_ns)
        return self._last

    def now(self, until_ns: int | None = None) -> int:
        """Return the present time."""
        present = time.monotonic_ns() - self._start
        self._last = max(self._last, present if until_ns is None else min(present, until_ns))
        return self._last

    def ahead_s(self, wire_ns: int) -> float | None:
        """Return the seconds from now."""
        return (wire_ns + self._start - time.monotonic_ns()) * 1e-9

    def grid(self, start_ns: int, cycle_ns: int) -> int:
        """Return the master's start time."""
        del cycle_ns
        return start_ns


class LockstepClock:
    """One cycle per process-data frame, independent of the real frame rate; deterministic.

    Process-data frames arrive in the middle of cycles, on the grid (n + ½)·cycle. Every other frame
    takes ``frame_ns``, so that mailbox transfers fit between two cycles; after `IDLE_FRAMES` frames
    without process data, each takes ``idle_frame_ns``, so that time passes while the master polls
    for an answer or a state.
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
        """Return the next half cycle for process data, otherwise a little later."""
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
        """Return the time of the last frame."""
        del until_ns
        return self._now

    def ahead_s(self, wire_ns: int) -> float | None:
        """Return None: unknown."""
        del wire_ns
        return None

    def grid(self, start_ns: int, cycle_ns: int) -> int:
        """Return the next multiple of the cycle: the master's own clock must have no effect."""
        return -(-start_ns // cycle_ns) * cycle_ns


class SteadyClock:
    """Real time without process data, and one cycle per frame with process data.

    For drives and a master on one busy computer: a cycle that is late for lack of processor time is
    then not late for the drives, and measurements are as on a bus without load. When the frames
    stop, real time continues after `SILENT_NS`, so that watchdogs work.
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
        """Return the middle of the next cycle for process data of a synchronised segment."""
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
        """Return the last frame's time during process data, otherwise real time from there on."""
        del until_ns
        real = self._real()
        if not self._flowing(real):
            self._now = max(self._now, real - self._behind)
        return self._now

    def ahead_s(self, wire_ns: int) -> float | None:
        """Return None: time follows the frames, or no pulse is expected."""
        del wire_ns
        return None

    def grid(self, start_ns: int, cycle_ns: int) -> int:
        """Return the next multiple of the cycle."""
        return -(-start_ns // cycle_ns) * cycle_ns
