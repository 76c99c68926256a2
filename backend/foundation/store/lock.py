"""Lock that lets only one servodeck process at a time use a state folder."""

from __future__ import annotations

import os
from pathlib import Path
from types import TracebackType

from drivers.computer.locks import open_lock_file, try_lock


class FolderLock:
    """Lock on a state folder; the system releases it when its process ends, in whatever way.

    ``held`` is True while this process holds it. A folder that does not exist, or cannot be
    written, is not locked and counts as held.
    """

    NAME = "servodeck.lock"

    def __init__(self, folder: Path) -> None:
        self._path = folder / self.NAME
        self._file: int | None = None
        self.held = False

    def take(self) -> bool:
        """Try to take the lock; True if it is held, False if another process has it."""
        if self.held:
            return True
        try:
            self._file = open_lock_file(self._path)
        except OSError:
            self.held = True
            return True
        if not try_lock(self._file):
            self.give()
            return False
        self.held = True
        return True

    def give(self) -> None:
        """Release the lock; does nothing if it is not held."""
        if self._file is not None:
            os.close(self._file)
            self._file = None
        self.held = False

    def __enter__(self) -> FolderLock:
        self.take()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.give()
