"""Exclusive access to a drive for a time, as a lock before its link.

Some drives accept no SDO while they store their parameters: an EP3E that receives one meanwhile
stores nothing (001:1209-1212). The lock waits for the requests under way, then admits only the
procedure. Other requests wait when the access is short, and otherwise fail with its remaining
time. Motion commands, above all STOP, do not wait: they end the exclusive access, even though the
storing may fail.
"""

from __future__ import annotations

import asyncio
import time
from collections import Counter
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from drivers.errors import Busy

#: Other requests wait for an exclusive access that ends within this time [s].
_PATIENCE_S = 2.5


class ExclusiveAccessHeld(Busy):
    """Another task has exclusive access to the drive; nothing was requested."""


class ExclusiveAccess:
    """Lock that decides which task may send requests to a drive now.

    For the event loop only; a task may nest its requests.
    """

    def __init__(self, drive: str) -> None:
        self._drive = drive
        self._asking: Counter[asyncio.Task[object] | None] = Counter()
        self._calmer = asyncio.Event()
        self._alone: asyncio.Task[object] | None = None
        self._over = asyncio.Event()
        self._until = 0.0

    @property
    def held(self) -> bool:
        """Whether a task has exclusive access."""
        return self._alone is not None

    @asynccontextmanager
    async def alone(self, seconds: float) -> AsyncIterator[None]:
        """Exclusive access, from when all requests of other tasks have ended, for ``seconds``.

        Raises:
            ExclusiveAccessHeld: another task has exclusive access already.
        """
        task = asyncio.current_task()
        self._refuse()
        self._alone, self._until = task, time.monotonic() + seconds
        self._over.clear()
        try:
            while any(other is not task for other in self._asking):
                self._calmer.clear()
                await self._calmer.wait()
            self._until = time.monotonic() + seconds
            yield
        finally:
            if self._alone is task:
                self._end()

    @asynccontextmanager
    async def asking(self) -> AsyncIterator[None]:
        """Context of a request to the drive; waits for the end of a short exclusive access.

        Raises:
            ExclusiveAccessHeld: the exclusive access of another task lasts longer.
        """
        task = asyncio.current_task()
        while self._alone not in (None, task) and task not in self._asking:
            if self._until - time.monotonic() > _PATIENCE_S:
                self._refuse()
            await self._over.wait()
        self._asking[task] += 1
        try:
            yield
        finally:
            self._asking[task] -= 1
            if not self._asking[task]:
                del self._asking[task]
                self._calmer.set()

    def interrupt(self) -> None:
        """End the exclusive access for a command, unless the commanding task holds it."""
        if self._alone is not asyncio.current_task():
            self._end()

    def _end(self) -> None:
        self._alone = None
        self._over.set()

    def _refuse(self) -> None:
        if self._alone is None:
            return
        left_s = max(self._until - time.monotonic(), 0.0)
        raise ExclusiveAccessHeld("drive.must-not-asked-another", drive=self._drive, left_s=left_s)
