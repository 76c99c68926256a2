"""Whether the process that borrowed values still lives: then it restores them itself."""

from __future__ import annotations

import os
from pathlib import Path

_BOOT = Path("/proc/sys/kernel/random/boot_id")
#: Fields of /proc/PID/stat behind the command's name: the 20th of these is the start time (proc(5),
#: field 22).
_START_AFTER_NAME = 19


def this_process() -> str:
    """A mark of this process that no other one has, after a restart of the computer neither."""
    return _mark(os.getpid()) or f"{os.getpid()}"


def lives(mark: str) -> bool:
    """Whether the process of this mark runs now; False where the system does not say."""
    number = mark.partition(" ")[0]
    return number.isdigit() and mark == (_mark(int(number)) or f"{os.getpid()}")


def _mark(pid: int) -> str:
    """Number, start and boot of a process; empty where the system has no /proc or it is gone."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text("ascii", "replace").rpartition(")")[2].split()
        return f"{pid} {fields[_START_AFTER_NAME]} {_BOOT.read_text('ascii').strip()}"
    except (OSError, IndexError):
        return ""
