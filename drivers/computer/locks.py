"""Locks on files that end with the process that holds them, however it ends."""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
from pathlib import Path
from typing import BinaryIO

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

#: Byte locked on Windows, which cannot lock a whole file: far behind any content, as a locked byte
#: cannot be read by others.
_LOCKED_BYTE = 1 << 30


def open_lock_file(path: Path) -> int:
    """Open or create a file to lock; return its descriptor, which no child process inherits.

    Raises:
        OSError: it cannot be opened for writing.
    """
    # Descriptors are not inherited on any system (PEP 446).
    return os.open(path, os.O_RDWR | os.O_CREAT, 0o600)


def try_lock(descriptor: int) -> bool:
    """Lock an open file for this process alone; return False while another one holds it.

    The lock ends with the descriptor: flock(2), and `msvcrt.locking` on Windows.
    """
    if sys.platform == "win32":
        os.lseek(descriptor, _LOCKED_BYTE, os.SEEK_SET)
        try:
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        except OSError:  # EACCES or EDEADLOCK, by the C runtime
            return False
        return True
    else:  # noqa: RET505 - type checkers follow the branches of a system
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        return True


def hold_file(name: str) -> BinaryIO:
    """Hold a name for this process alone by a locked temporary file, until the file is closed.

    Adapter names contain characters that file names must not, so the file is named by a digest.

    Raises:
        OSError: another process holds it, or the file cannot be created.
    """
    digest = hashlib.sha256(name.encode()).hexdigest()[:32]
    descriptor = open_lock_file(Path(tempfile.gettempdir()) / f"servodeck-{digest}.lock")
    if not try_lock(descriptor):
        os.close(descriptor)
        raise BlockingIOError(f"{name} is held by another process")
    return os.fdopen(descriptor, "rb")
