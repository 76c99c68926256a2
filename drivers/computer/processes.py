"""Processes: identification, priority, limits and termination."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import psutil

#: Whether a child process can have its own session, so that Ctrl+C does not reach it (not on
#: Windows, which has no such sessions).
SESSIONS = sys.platform != "win32"
_BOOT = Path("/proc/sys/kernel/random/boot_id")
#: Index of the start time among the fields of /proc/PID/stat after the command's name (proc(5),
#: field 22).
_START_AFTER_NAME = 19


def process_mark(pid: int) -> str:
    """Return a mark that no other process has, before or after a restart of the computer.

    Empty if no such process runs. On Linux number, start in ticks and boot; elsewhere number and
    start time as recorded by the system, which a later change of the clock does not affect.
    """
    if sys.platform == "linux":
        return _mark_from_proc(pid)
    elif sys.platform == "darwin":  # noqa: RET505 - type checkers follow the branches of a system
        return _mark_from_ps(pid)
    else:
        return _mark_by_psutil(pid)


def _mark_by_psutil(pid: int) -> str:
    """Return the mark on Windows: psutil calls GetProcessTimes, which keeps the recorded start."""
    try:
        return f"{pid} {psutil.Process(pid).create_time():.6f}"
    except psutil.Error:
        return ""


def _mark_from_ps(pid: int) -> str:
    """Return the mark by ps(1): on macOS, psutil's start time follows changes of the clock."""
    fixed = {**os.environ, "LC_ALL": "C", "TZ": "UTC"}
    listed = subprocess.run(
        ["/bin/ps", "-o", "lstart=", "-p", str(pid)],
        capture_output=True,
        text=True,
        env=fixed,
        check=False,
    )
    started = " ".join(listed.stdout.split())
    return f"{pid} {started}" if started else ""


def _mark_from_proc(pid: int) -> str:
    try:
        fields = Path(f"/proc/{pid}/stat").read_text("ascii", "replace").rpartition(")")[2].split()
        return f"{pid} {fields[_START_AFTER_NAME]} {_BOOT.read_text('ascii').strip()}"
    except (OSError, IndexError):
        return ""


def yield_processor(nice: int = 10) -> None:
    """Lower the priority of this process: ``nice`` steps, on Windows one priority class."""
    if sys.platform == "win32":
        psutil.Process().nice(psutil.BELOW_NORMAL_PRIORITY_CLASS)
        return
    os.nice(nice)


def prefer_process() -> None:
    """Raise the priority of this process to Windows' class HIGH_PRIORITY, without a permission.

    No effect on other systems, or if it is refused.
    """
    if sys.platform == "win32":
        with contextlib.suppress(psutil.Error):
            psutil.Process().nice(psutil.HIGH_PRIORITY_CLASS)


def limit_memory(most_bytes: int) -> bool:
    """Limit the address space of this process; return False if not possible (Windows)."""
    if sys.platform == "win32":
        return False
    import resource

    try:
        resource.setrlimit(resource.RLIMIT_AS, (most_bytes, most_bytes))
    except (OSError, ValueError):
        # macOS refuses a limit below what is already mapped.
        return False
    return True


def raise_descriptors(wanted: int) -> None:
    """Allow this process ``wanted`` open files, or the permitted maximum; unlimited on Windows."""
    if sys.platform == "win32":
        return
    import resource

    now, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = wanted if most == resource.RLIM_INFINITY else min(wanted, most)
    if now == resource.RLIM_INFINITY or now >= wanted:
        return
    try:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, most))
    except (OSError, ValueError):
        return  # fewer connections, which is reported where one is refused


def end_within(seconds: int) -> None:
    """End this process after this time, whatever it waits for (SIGALRM).

    Windows has no such alarm: a thread ends the process there, unless a library call holds the
    interpreter; then the parent process ends it.
    """
    if sys.platform == "win32":
        alarm = threading.Timer(seconds, os._exit, (1,))
        alarm.daemon = True
        alarm.start()
        return
    signal.alarm(seconds)
