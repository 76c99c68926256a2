"""Whether the process that changed values still lives: then it restores them itself."""

from __future__ import annotations

import os

from drivers.computer.processes import process_mark


def this_process() -> str:
    """A mark of this process that no other one has, after a restart of the computer neither."""
    return process_mark(os.getpid()) or f"{os.getpid()}"


def lives(mark: str) -> bool:
    """Whether the process of this mark runs now; False where the system does not say."""
    number = mark.partition(" ")[0]
    return number.isdigit() and mark == (process_mark(int(number)) or f"{os.getpid()}")
