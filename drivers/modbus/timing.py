"""Pauses of some microseconds, as serial lines at megabauds need them."""

from __future__ import annotations

import time

#: What a sleep oversleeps with fine timers, measured on several machines.
_OVERSLEEP_S = 40e-6


def sleep_precisely(seconds: float) -> None:
    """Sleep, and wait out the last 40 µs awake: a pause at 2.5 Mbaud lasts 15 µs in all.

    Even ``time.sleep(0)`` would take longer than that.
    """
    until = time.monotonic() + seconds
    if seconds > _OVERSLEEP_S:
        time.sleep(seconds - _OVERSLEEP_S)
    while time.monotonic() < until:
        pass
