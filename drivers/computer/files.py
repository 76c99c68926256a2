"""Writing to files."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

FOLDERS_MOVE_WHILE_OPEN = sys.platform != "win32"
"""Whether a folder can be renamed while a process has a file in it open."""


def write_parts(descriptor: int, parts: Sequence[bytes | memoryview]) -> int:
    """Write the parts in order, by one system call if there is one; return the bytes written.

    Raises:
        OSError: nothing was written.
    """
    if sys.platform == "win32":
        return os.write(descriptor, b"".join(parts))
    else:  # noqa: RET505 - type checkers follow the branches of a system
        return os.writev(descriptor, parts)


def program_name(name: str) -> str:
    """Return the file name of a program."""
    return f"{name}.exe" if sys.platform == "win32" else name
