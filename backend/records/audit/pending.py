"""Events that wait for the database, as lines of a file. A truncated line is left out."""

from __future__ import annotations

import contextlib
import json
import os
from pathlib import Path


class PendingFile:
    """The file of waiting events; flushed after every append, deleted once they are stored."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def read(self) -> list[str]:
        """Complete lines of an earlier run; a rest after the last line feed is truncated."""
        try:
            data = self._path.read_bytes()
            whole = data.rfind(b"\n") + 1
            if whole < len(data):
                os.truncate(self._path, whole)
        except OSError:
            return []
        return [text for line in data[:whole].splitlines() if (text := _body(line))]

    def append(self, bodies: list[str]) -> bool:
        """Append lines; False where they cannot be written."""
        data = "".join(f"{body}\n" for body in bodies).encode()
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with self._path.open("ab", buffering=0) as file:
                end = file.seek(0, os.SEEK_END)
                whole = file.write(data) == len(data)
                if whole:
                    os.fsync(file.fileno())
                else:
                    file.truncate(end)
        except OSError:
            return False
        return whole

    def clear(self) -> None:
        """Delete the file; if that fails, its events are later recognised as written already."""
        with contextlib.suppress(OSError):
            self._path.unlink(missing_ok=True)


def _body(line: bytes) -> str:
    try:
        text = line.decode()
        content = json.loads(text)
    except ValueError:
        return ""
    needed = ("time", "station", "person", "kind", "axis", "target")
    return text if isinstance(content, dict) and all(name in content for name in needed) else ""
