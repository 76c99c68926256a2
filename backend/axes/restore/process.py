"""Check whether the process that changed values still runs and so restores them itself."""

from __future__ import annotations

import os

from drivers.computer.processes import process_mark


def this_process() -> str:
    """Unique mark of this process, also across restarts of the computer."""
    return process_mark(os.getpid()) or f"{os.getpid()}"


def lives(mark: str) -> bool:
    """Whether the process of this mark runs now; False where the system does not report it."""
    number = mark.partition(" ")[0]
    return number.isdigit() and mark == (process_mark(int(number)) or f"{os.getpid()}")
