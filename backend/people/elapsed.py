"""Time that only goes on: for what may last so long and no longer.

The wall clock is set: by a person, by a time server after the start, by a supply that failed. A
grant must end after its minutes all the same. Time in which the computer slept counts, where the
system reports it.
"""

from __future__ import annotations

import time

from drivers.computer.clock import elapsed_s

__all__ = ["elapsed_s", "moment_of"]


def moment_of(elapsed: float) -> float:
    """Epoch seconds by the wall clock of now at which `elapsed_s` is, or was, ``elapsed``."""
    return time.time() + elapsed - elapsed_s()
