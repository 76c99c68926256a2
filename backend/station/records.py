"""Stored data of a station: the database with library and audit, and the folders next to it."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from pathlib import Path

from backend.foundation.store import state_version
from backend.foundation.store.blobs import Blobs
from backend.foundation.store.database import DatabaseFailed, Store
from backend.foundation.store.files import StorageFailed
from backend.foundation.store.lock import FolderLock
from backend.foundation.work.journal import Journal
from backend.records.audit import AuditLog
from backend.records.audit.trail import Trail
from backend.records.library import Library, LibrarySets
from backend.records.library.described import folders
from backend.records.library.index import Index
from drivers.errors import Busy, with_remedy
from drivers.texts.message import Text, text

#: Time for which the start waits for a database on a server [s].
REMOTE_S = 1.0


class Records:
    """Database, audit and library of one station. The constructor opens and writes nothing.

    ``database`` and ``blobs`` are URLs (see docs/library.md); None means the state folder.
    """

    def __init__(
        self, folder: Path, journal: Journal, database: str | None = None, blobs: str | None = None
    ) -> None:
        self.station = socket.gethostname()
        self.store = Store(folder, database)
        self.audit = AuditLog(self.store, self.station, changed=self._audit_changed)
        self.trail = Trail(self.store)
        self.library = Library(self.store, Blobs(blobs or str(folder / "blobs")), self.audit.add)
        self.sets = LibrarySets(self.library, folder / "sets")
        self.index = Index(self.store, self.station, folders(folder))
        self._lock = FolderLock(folder)
        self._journal = journal
        self._loop: asyncio.AbstractEventLoop | None = None
        self._taking_up: asyncio.Task[None] | None = None

    def claim(self) -> None:
        """Lock the state folder for this process, creating it where it is missing. Blocks.

        Data of an older servodeck are migrated.

        Raises:
            Busy: another servodeck uses the folder.
            StateRefused: a newer servodeck has written the folder; nothing was changed.
        """
        state_version.check(self.store.folder)
        with contextlib.suppress(OSError):
            # A folder that cannot be created or written needs no lock against a second process.
            self.store.folder.mkdir(parents=True, exist_ok=True)
        if not self._lock.take():
            raise Busy(
                "station.another-servodeck-uses-state",
                value=str(self.store.folder),
                folder=str(self.store.folder),
            )
        try:
            if state_version.bring_up_to_date(self.store.folder):
                self._journal.add(text("journal.migrated"))
        except StorageFailed as error:
            self._journal.add(with_remedy(error), level="error")
        except BaseException:
            self._lock.give()
            raise

    def release(self) -> None:
        """Release the lock of the folder; does nothing where it is not held."""
        self._lock.give()

    async def open(self) -> None:
        """Open the database and process data left over from earlier.

        A station without a database still works: drives are moved and stopped, and functions that
        need the database report its error.
        """
        self._loop = asyncio.get_running_loop()
        if not self._lock.take():
            self._journal.add(
                text("journal.folder-used-twice", folder=str(self.store.folder)),
                level="error",
            )
        self.audit.start()
        self._taking_up = asyncio.create_task(self._take_up(), name="records")
        # A remote database that does not answer must not delay the drives.
        done, _ = await asyncio.wait(
            {self._taking_up}, timeout=None if self.store.sqlite_file else REMOTE_S
        )
        for task in done:
            task.result()

    async def _take_up(self) -> None:
        try:
            await self.store.call(self.store.open)
            await self.store.call(self.sets.take_in)
        except DatabaseFailed as error:
            line = text("journal.database-failed", cause=with_remedy(error))
            self._journal.add(line, level="error")
        except StorageFailed as error:
            self._journal.add(with_remedy(error), level="error")

    async def close(self) -> None:
        """Write pending audit records, close the database and release the folder."""
        self._loop = None
        if self._taking_up is not None:
            await asyncio.wait({self._taking_up})
        await asyncio.to_thread(self.audit.close)
        await asyncio.to_thread(self.store.close)
        self._lock.give()

    def _audit_changed(self, problem: Text | None) -> None:
        """Log a change of the audit's state; called on the audit's thread."""
        loop = self._loop
        if loop is not None and not loop.is_closed():
            line = (
                text("journal.audit-up-to-date")
                if problem is None
                else text("journal.audit-waits", cause=problem)
            )
            loop.call_soon_threadsafe(
                lambda: self._journal.add(line, level="error" if problem else "info")
            )
