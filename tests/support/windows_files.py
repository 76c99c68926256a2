"""Rules of Windows for open files, kept by this system for the length of a test.

A file that is open can neither be deleted nor renamed nor replaced, a folder with an open file in
it cannot be renamed, and only a file that is open for writing can be flushed (MoveFileEx,
DeleteFile and FlushFileBuffers of learn.microsoft.com; files opened by Python do not share
deletion). Only descriptors of this process count.
"""

from __future__ import annotations

import errno
import fcntl
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest


def open_below(path: str) -> list[str]:
    """Files at or below a path that this process has open."""
    found = []
    for entry in Path("/proc/self/fd").iterdir():
        try:
            place = str(entry.readlink())
        except OSError:
            continue
        if (place == path or place.startswith(f"{path}/")) and not Path(place).is_dir():
            found.append(place)
    return found


def _whole(path: Any, dir_fd: int | None) -> str:
    base = Path.cwd() if dir_fd is None else Path(f"/proc/self/fd/{dir_fd}").readlink()
    return str(os.path.normpath(base / path))


def keep_rules(monkeypatch: pytest.MonkeyPatch) -> None:
    """Refuse from now on what Windows refuses."""

    def guarded(real: Callable[..., None]) -> Callable[..., None]:
        def checked(*paths: Any, **places: Any) -> None:
            for number, path in enumerate(paths):
                fd = places.get("dir_fd", places.get(("src_dir_fd", "dst_dir_fd")[number]))
                whole = _whole(path, fd)
                if open_below(whole):
                    raise PermissionError(
                        errno.EACCES, "The process cannot access the file", str(path)
                    )
            real(*paths, **places)

        return checked

    for name in ("rename", "replace", "unlink", "remove"):
        monkeypatch.setattr(os, name, guarded(getattr(os, name)))
    fsync = os.fsync

    def flush(descriptor: int) -> None:
        if fcntl.fcntl(descriptor, fcntl.F_GETFL) & os.O_ACCMODE == os.O_RDONLY:
            raise OSError(errno.EBADF, "Bad file descriptor")
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", flush)


def ignore_case(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a new file be refused from now on where there is one whose name differs in case only."""
    real = Path.open

    def opened(path: Path, mode: str = "r", *arguments: Any, **options: Any) -> Any:
        if "x" in mode and any(
            one.name.casefold() == path.name.casefold() for one in path.parent.iterdir()
        ):
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path))
        return real(path, mode, *arguments, **options)

    monkeypatch.setattr(Path, "open", opened)
