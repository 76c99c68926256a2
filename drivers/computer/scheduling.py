"""When the kernel lets a thread run: what anybody may ask for, and what needs a permission.

Source: sched(7), prctl(2); slices of fair tasks: Linux 6.12, ``kernel/sched/syscalls.c``.
"""

from __future__ import annotations

import ctypes
import gc
import os
import platform
import sys

VIRTUAL_PRIORITY = "SERVODECK_VIRTUAL_PRIORITY"
"""Environment variable with the SCHED_FIFO priority of processes that stand for hardware."""
_PR_SET_TIMERSLACK = 29
_SYS_SCHED_SETATTR = {"x86_64": 314, "aarch64": 274, "riscv64": 274}
SHORT_SLICE_NS = 100_000
"""The least that the kernel gives."""


class _SchedAttr(ctypes.Structure):
    """``struct sched_attr`` of sched_setattr(2)."""

    _fields_ = (
        ("size", ctypes.c_uint32),
        ("policy", ctypes.c_uint32),
        ("flags", ctypes.c_uint64),
        ("nice", ctypes.c_int32),
        ("priority", ctypes.c_uint32),
        ("runtime", ctypes.c_uint64),
        ("deadline", ctypes.c_uint64),
        ("period", ctypes.c_uint64),
    )


def fine_timers() -> None:
    """Let sleeps end on time: Linux groups those of a thread by 50 µs otherwise, and Windows ends
    the waits of a process with its timer, every 15.6 ms (timeBeginPeriod: every millisecond).
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_TIMERSLACK, 1, 0, 0, 0)
    elif sys.platform == "win32":
        ctypes.windll.winmm.timeBeginPeriod(1)


def real_time(priority: int) -> bool:
    """SCHED_FIFO for this process; False where that is not permitted.

    A thread that has it may never spin: the kernel throttles it for 50 ms a second.
    """
    if sys.platform != "linux":
        return False
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except OSError:
        return False
    return True


def virtual_priority() -> bool:
    """SCHED_FIFO for a process that stands for hardware, where the environment asks for it.

    A real drive answers however busy the engineer's computer is. `VIRTUAL_PRIORITY` is set where
    other work shares the computer with the virtual drives, as in the tests. False where nothing
    is asked for, the value is no priority, or the system does not permit it.
    """
    asked = os.environ.get(VIRTUAL_PRIORITY, "")
    return asked.isdecimal() and 0 < int(asked) < 100 and real_time(int(asked))


def short_slice() -> bool:
    """Ask for short turns, and so to get them soon: needs no permission.

    A waking task then goes before one with longer turns that runs (PREEMPT_SHORT), instead of
    waiting for the end of that one's turn, which is up to 3 ms. Its share of the processor stays
    the same. False where the kernel does not know of it, or this task is not an ordinary one.
    """
    if sys.platform != "linux":
        return False
    number = _SYS_SCHED_SETATTR.get(platform.machine())
    if number is None:
        return False
    if os.sched_getscheduler(0) != os.SCHED_OTHER:
        return False
    wanted = _SchedAttr(
        size=ctypes.sizeof(_SchedAttr),
        policy=os.SCHED_OTHER,
        nice=os.getpriority(os.PRIO_PROCESS, 0),
        runtime=SHORT_SLICE_NS,
    )
    return bool(ctypes.CDLL(None).syscall(number, 0, ctypes.byref(wanted), 0) == 0)


def spare_collector() -> None:
    """Take what is alive now out of the garbage collector's sight, for good.

    For the end of a long process' start: modules, profiles and routes stay anyway, and looking
    through all of them again and again is a pause of a tenth of a second each time.
    """
    gc.collect()
    gc.freeze()
