"""Whether the machine itself kept a test's processes from running."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from pathlib import Path

import httpx

_PRESSURE = Path("/proc/pressure/cpu")
_BUSY = 0.25


class Stopwatch:
    """From now on: for how much of the time somebody waited for a processor (Linux PSI).

    A link that loses its drive, or a brake after 30 ms without the bus, is a defect where the
    machine had time, and right where it had not.
    """

    def __init__(self) -> None:
        self._began_s = time.monotonic()
        self._waited_us = _waited_us()

    def busy(self) -> bool:
        """Whether the machine was too busy for what happened to mean anything.

        Where the kernel does not tell, it counts as busy.
        """
        waited_us, before_us = _waited_us(), self._waited_us
        if waited_us is None or before_us is None:
            return True
        passed_us = (time.monotonic() - self._began_s) * 1e6
        return waited_us - before_us > _BUSY * passed_us


def _waited_us() -> int | None:
    try:
        first = _PRESSURE.read_text().splitlines()[0]
    except (OSError, IndexError):
        return None
    return int(first.rpartition("total=")[2])


class ApiWatch:
    """Asks the interface again and again while a test goes on, and keeps how long it took.

    What the server's thread and the asking one spent waiting for a processor is taken off: it is
    the machine's time and not the server's. A server that waits for a wire, or works for long
    without letting others in, shows all the same.
    """

    def __init__(self, url: str, server_thread: int) -> None:
        self.times_s: list[float] = []
        self._url = url
        self._server = server_thread
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._ask, daemon=True)

    def __enter__(self) -> ApiWatch:
        self._thread.start()
        return self

    def __exit__(self, *_exc: object) -> None:
        self._over.set()
        self._thread.join()

    def p99_s(self) -> float:
        """Below it lie 99 of 100 answers."""
        ordered = sorted(self.times_s)
        return ordered[int(0.99 * (len(ordered) - 1))]

    def _ask(self) -> None:
        threads = (self._server, threading.get_native_id())
        with httpx.Client(timeout=20) as http:
            while not self._over.wait(0.02):
                waited_s, began_s = _runnable_s(threads), time.monotonic()
                http.get(self._url).raise_for_status()
                took_s = time.monotonic() - began_s
                self.times_s.append(max(took_s - (_runnable_s(threads) - waited_s), 0.0))


def _runnable_s(threads: Sequence[int]) -> float:
    """Seconds that these threads of ours waited for a processor; 0 where the kernel tells none."""
    total_ns = 0
    for thread in threads:
        try:
            told = Path(f"/proc/self/task/{thread}/schedstat").read_text().split()
        except OSError:
            continue
        total_ns += int(told[1])
    return total_ns / 1e9
