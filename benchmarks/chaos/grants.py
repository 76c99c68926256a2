"""The grants of the motion authority as the server itself reports them, for the judge.

The server writes a line into a pipe whenever a grant of an axis begins or ends (a pipe, since its
disk may be full). Both processes read the same monotonic clock.
"""

from __future__ import annotations

import contextlib
import json
import os
import threading
import time
from dataclasses import dataclass, field

#: A pipe that holds the grants of a server that the judge has not looked at for a while.
_CHUNK = 65536


@dataclass
class _Axis:
    live: bool = False
    last_live: float = -1.0


@dataclass
class GrantLog:
    """When each axis last had a live grant, by the drive's id. Used by the judge's thread."""

    _axes: dict[str, _Axis] = field(default_factory=dict)
    _end: int | None = None
    _rest: bytes = b""
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def anew(self) -> int:
        """A pipe for the next server; returns the end that it writes to."""
        reads, writes = os.pipe()
        os.set_blocking(reads, False)
        os.set_blocking(writes, False)
        with self._lock:
            self._drain()
            self._drop()
            self._end = reads
        return writes

    def close(self) -> None:
        """No server any more."""
        with self._lock:
            self._drop()

    def last_live(self, drive: str) -> float:
        """Monotonic time of the last moment at which this axis had a grant; -1: never."""
        with self._lock:
            self._drain()
            axis = self._axes.get(drive)
            if axis is None:
                return -1.0
            return time.monotonic() if axis.live else axis.last_live

    def _drain(self) -> None:
        with contextlib.suppress(BlockingIOError):
            while self._end is not None and (data := os.read(self._end, _CHUNK)):
                self._rest += data
        *lines, self._rest = self._rest.split(b"\n")
        for line in lines:
            change = json.loads(line)
            axis = self._axes.setdefault(change["drive"], _Axis())
            if axis.live or change["live"]:
                axis.last_live = change["at"]
            axis.live = change["live"]

    def _drop(self) -> None:
        """A server that is gone grants nothing."""
        now = time.monotonic()
        for axis in self._axes.values():
            if axis.live:
                axis.live, axis.last_live = False, now
        if self._end is not None:
            os.close(self._end)
        self._end, self._rest = None, b""
