"""Non-volatile memory of a virtual drive: one small file, replaced as a whole."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path

from profiles.replacing import move_into_place
from profiles.schema import Raw


class Nvm:
    """Values by parameter key. Without a path they survive a power cycle but not the process."""

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self._memory: dict[str, Raw] = {}
        self.damaged = False
        if path is not None and path.exists():
            self._memory = self._read(path)

    def _read(self, path: Path) -> dict[str, Raw]:
        try:
            stored = json.loads(path.read_text("utf-8"))
            return {str(key): value for key, value in stored["values"].items()}
        except (OSError, ValueError, KeyError, AttributeError, TypeError):
            # A drive with a damaged memory starts with defaults and reports it (004:4825-4832).
            self.damaged = True
            return {}

    def load(self) -> dict[str, Raw]:
        """Return the values saved last."""
        return dict(self._memory)

    def save(self, values: Mapping[str, Raw]) -> None:
        """Replace the contents; a crash leaves either the old or the new file.

        Raises:
            OSError: the file cannot be written; the old contents are kept.
        """
        if self._path is not None:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            handle, name = tempfile.mkstemp(dir=self._path.parent, prefix=self._path.name)
            try:
                with os.fdopen(handle, "w", encoding="utf-8") as file:
                    json.dump({"format": 1, "values": dict(values)}, file, indent=1)
                    file.flush()
                    os.fsync(file.fileno())
                move_into_place(Path(name), self._path)
            except OSError:
                Path(name).unlink(missing_ok=True)
                raise
        self._memory = dict(values)
        self.damaged = False
