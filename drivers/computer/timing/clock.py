"""Clocks that are not available on every system."""

from __future__ import annotations

import sys
import time


def resolution_s() -> float:
    """Return the resolution of `time.monotonic` [s]: 15.6 ms on Windows before CPython 3.13."""
    return time.get_clock_info("monotonic").resolution


def elapsed_s() -> float:
    """Return the seconds since a time before the start of this process; never set, never back.

    Includes the time in which the computer slept: CLOCK_BOOTTIME on Linux, CLOCK_MONOTONIC on
    macOS, whose `time.monotonic` stands still meanwhile, and GetTickCount64 on Windows.
    """
    if sys.platform == "linux":
        return time.clock_gettime(time.CLOCK_BOOTTIME)
    elif sys.platform == "darwin":  # noqa: RET505 - type checkers follow the branches of a system
        return time.clock_gettime(time.CLOCK_MONOTONIC)
    else:
        return time.monotonic()
