"""Pauses of some microseconds, as required by serial lines at megabaud rates."""

from __future__ import annotations

import time

#: Excess duration of a sleep with fine timers, measured on several machines.
_OVERSLEEP_S = 40e-6


def sleep_precisely(seconds: float) -> None:
    """Sleep, and wait actively for the last 40 µs: a pause at 2.5 Mbaud lasts only 15 µs.

    Even ``time.sleep(0)`` would take longer than that.
    """
    until = time.monotonic() + seconds
    if seconds > _OVERSLEEP_S:
        time.sleep(seconds - _OVERSLEEP_S)
    while time.monotonic() < until:
        pass
