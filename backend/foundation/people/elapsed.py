"""Monotonic time, for limits on a duration.

The wall clock can be set: by a person, by a time server after the start, or by a power failure. A
grant must end after its minutes all the same. Time in which the computer was suspended counts,
where the system reports it.
"""

from __future__ import annotations

import time

from drivers.computer.timing.clock import elapsed_s

__all__ = ["elapsed_s", "moment_of"]


def moment_of(elapsed: float) -> float:
    """Convert `elapsed_s` time to epoch seconds, by the current wall clock."""
    return time.time() + elapsed - elapsed_s()
