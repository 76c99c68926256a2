"""Requesting real-time conditions from the kernel, and reporting what it granted."""

from __future__ import annotations

import ctypes
import gc
import signal
import sys
from dataclasses import dataclass

from drivers.computer.processes import prefer_process
from drivers.computer.timing import scheduling
from drivers.texts.message import Text, text

_MCL_CURRENT, _MCL_FUTURE = 1, 2
_PR_SET_PDEATHSIG = 1
_PRIORITY = 40


@dataclass(frozen=True, slots=True)
class RealTime:
    """The conditions granted; ``notes``: those that were not, and how to get them."""

    fifo_priority: int
    notes: tuple[Text, ...]
    memory_locked: bool = False


def claim(*, wanted: bool = True) -> RealTime:
    """Request SCHED_FIFO, locked memory and exact timers for this process.

    None of these is required for operation: without them single cycles are late and are counted. A
    SCHED_FIFO thread must never spin: the kernel throttles it for 50 ms a second.
    """
    if not wanted:
        return RealTime(0, notes=(text("computer.real-time-not-asked"),))
    notes: list[Text] = []
    scheduling.fine_timers()
    priority = _PRIORITY if scheduling.real_time(_PRIORITY) else 0
    locked = False
    if sys.platform == "linux":
        if not priority:
            scheduling.short_slice()
            notes.append(text("computer.no-real-time"))
        locked = ctypes.CDLL(None, use_errno=True).mlockall(_MCL_CURRENT | _MCL_FUTURE) == 0
        if not locked:
            notes.append(text("computer.memory-not-locked"))
    else:
        prefer_process()
        notes.append(text("computer.no-real-time-here"))
    # A pause of the garbage collector makes a cycle late; the loop creates no reference cycles.
    scheduling.spare_collector()
    gc.disable()
    sys.setswitchinterval(1e-4)
    return RealTime(priority, tuple(notes), locked)


def die_with_parent() -> None:
    """Make the kernel send SIGTERM to this process when its parent dies.

    Only on Linux; elsewhere the closed pipe shows the parent's end, as it does on Linux too.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0)
