"""Writing to files."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

from drivers.computer.registry import REGISTRY, RegistryValue

FOLDERS_MOVE_WHILE_OPEN = sys.platform != "win32"
"""Whether a folder can be renamed while a process has a file in it open."""


_FILE_SYSTEM = r"SYSTEM\CurrentControlSet\Control\FileSystem"
#: MAX_PATH without its closing NUL (learn.microsoft.com, "Maximum Path Length Limitation").
_MAX_PATH = 259


def longest_path(registry: RegistryValue = REGISTRY.value) -> int | None:
    """Return the characters that a path may have; None where no limit is in the way.

    CPython allows longer paths on Windows where the computer has the setting LongPathsEnabled.
    """
    if sys.platform == "win32" and registry(_FILE_SYSTEM, "LongPathsEnabled") != 1:
        return _MAX_PATH
    return None


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
