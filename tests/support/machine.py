"""Whether the machine itself kept a test's processes from running."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx

from tests.support.station import until

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

        Where the kernel does not report, it counts as busy.
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


class OwnTime:
    """How long what is done inside takes, less what the machine kept us waiting for a processor.

    Counted are the threads of this process, which the server shares with the test: whoever waits
    for a processor with the interpreter's lock in hand keeps all others. ``with_children`` counts
    what this process started too, such as the virtual drives and the browser: of each the thread
    that waited longest, as one does its part after the other. A server that waits for a wire or for
    a time-out, or works for long without letting others in, shows all the same; and so does
    everything on a machine that has time for us.
    """

    def __init__(self, *, with_children: bool = False) -> None:
        self.s = 0.0
        self._with_children = with_children
        self._began_s = 0.0
        self._before_ns: dict[str, dict[str, int]] = {}

    def __enter__(self) -> OwnTime:
        self._before_ns, self._began_s = self._waited_ns(), time.monotonic()
        return self

    def __exit__(self, *_exc: object) -> None:
        took_s = time.monotonic() - self._began_s
        waited_ns = 0
        for process, threads in self._waited_ns().items():
            before_ns = self._before_ns.get(process, {})
            each_ns = [ns - before_ns.get(thread, 0) for thread, ns in threads.items()]
            waited_ns += sum(each_ns) if process == "self" else max(each_ns, default=0)
        self.s = max(took_s - waited_ns / 1e9, 0.0)

    def _waited_ns(self) -> dict[str, dict[str, int]]:
        """For how long the threads have waited, by process."""
        processes = ["self"]
        for process in processes:  # it grows meanwhile
            if self._with_children:
                processes += _children(process)
        return {process: _runnable_ns(process) for process in processes}


def within(limit_s: float, condition: Callable[[], object], what: str = "") -> Any:
    """`until`, where the product has to do it within ``limit_s`` of `OwnTime` at most."""
    with OwnTime(with_children=True) as took:
        value = until(condition, what=what)
    assert took.s < limit_s, f"it took {took.s:.2f} s: {what}"
    return value


class ApiWatch:
    """Asks the interface again and again while a test goes on, and keeps how long it took.

    What the machine took is not counted, see `OwnTime`.
    """

    def __init__(self, url: str) -> None:
        self.times_s: list[float] = []
        self._url = url
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
        with httpx.Client(timeout=20) as http:
            while not self._over.wait(0.02):
                with OwnTime() as took:
                    http.get(self._url).raise_for_status()
                self.times_s.append(took.s)


def _runnable_ns(process: str) -> dict[str, int]:
    """For how long each thread has waited for a processor; none if the kernel reports none."""
    reported = {}
    for thread in Path(f"/proc/{process}/task").glob("*/schedstat"):
        # A thread may end while it is looked at.
        with contextlib.suppress(OSError):
            reported[str(thread)] = int(thread.read_text().split()[1])
    return reported


def _children(process: str) -> list[str]:
    found: list[str] = []
    for thread in Path(f"/proc/{process}/task").glob("*/children"):
        with contextlib.suppress(OSError):
            found += thread.read_text().split()
    return found
