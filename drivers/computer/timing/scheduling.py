"""Scheduling of threads by the kernel: requests with and without a permission.

Source: sched(7), prctl(2); slices of fair tasks: Linux 6.12, ``kernel/sched/syscalls.c``.
"""

from __future__ import annotations

import ctypes
import gc
import os
import platform
import sys

VIRTUAL_PRIORITY = "SERVODECK_VIRTUAL_PRIORITY"
"""Environment variable with the SCHED_FIFO priority of processes that emulate hardware."""
_PR_SET_TIMERSLACK = 29
_SYS_SCHED_SETATTR = {"x86_64": 314, "aarch64": 274, "riscv64": 274}
SHORT_SLICE_NS = 100_000
"""The shortest slice that the kernel grants [ns]."""


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
    """Make sleeps end on time.

    Otherwise Linux groups those of a thread by 50 µs, and Windows ends the waits of a process with
    its timer, every 15.6 ms (timeBeginPeriod: every millisecond).
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_TIMERSLACK, 1, 0, 0, 0)
    elif sys.platform == "win32":
        ctypes.windll.winmm.timeBeginPeriod(1)


def real_time(priority: int) -> bool:
    """Request SCHED_FIFO for this process; return False if not permitted.

    A thread with SCHED_FIFO must never spin: the kernel throttles it for 50 ms a second.
    """
    if sys.platform != "linux":
        return False
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except OSError:
        return False
    return True


def virtual_priority() -> bool:
    """Request SCHED_FIFO for a process that emulates hardware, if the environment requires it.

    A real drive answers however busy the computer is. `VIRTUAL_PRIORITY` is set where other work
    shares the computer with the virtual drives, as in the tests. Returns False if it is not set,
    its value is not a priority, or the system does not permit it.
    """
    asked = os.environ.get(VIRTUAL_PRIORITY, "")
    return asked.isdecimal() and 0 < int(asked) < 100 and real_time(int(asked))


def short_slice() -> bool:
    """Request short slices, and thus an early start; needs no permission.

    A waking task then preempts a running one with longer slices (PREEMPT_SHORT), instead of waiting
    for the end of its slice, which is up to 3 ms. Its share of the processor is unchanged. False if
    the kernel does not support it, or this task is not an ordinary one.
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
    """Exclude all present objects from garbage collection permanently.

    For the end of a long start of a process: modules, profiles and routes stay alive anyway, and
    each scan of all of them is a pause of a tenth of a second.
    """
    gc.collect()
    gc.freeze()
