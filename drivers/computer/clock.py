"""Clocks that one system has and another has not."""

from __future__ import annotations

import sys
import time


def resolution_s() -> float:
    """The steps of `time.monotonic`: 15.6 ms on Windows before CPython 3.13, else below 1 µs."""
    return time.get_clock_info("monotonic").resolution


def elapsed_s() -> float:
    """Seconds since some time before the start of this process; never set, never back.

    Time in which the computer slept counts on Linux (CLOCK_BOOTTIME).
    """
    if sys.platform == "linux":
        return time.clock_gettime(time.CLOCK_BOOTTIME)
    else:  # noqa: RET505 - type checkers follow the branches of a system
        return time.monotonic()
