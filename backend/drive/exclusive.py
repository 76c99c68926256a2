"""A drive that must be left alone for a while: the gate before its link.

Some drives bear no SDO while they store their parameters: an EP3E that is asked meanwhile stores
nothing (001:1209-1212). The gate lets what is under way end, then only the procedure through;
others wait when it is short, and are informed how long it takes when it is not. Commands of motion,
a STOP above all, do not ask the gate: they end the rest, whatever becomes of the storing.
"""

from __future__ import annotations

import asyncio
import time
from collections import Counter
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from drivers.errors import Busy

#: A rest that ends within this time is waited for.
_PATIENCE_S = 2.5


class ExclusiveAccessHeld(Busy):
    """The drive is left alone; nothing was asked."""


class ExclusiveAccess:
    """Who may ask a drive now. For the event loop; a task that asks may ask within that again."""

    def __init__(self, drive: str) -> None:
        self._drive = drive
        self._asking: Counter[asyncio.Task[object] | None] = Counter()
        self._calmer = asyncio.Event()
        self._alone: asyncio.Task[object] | None = None
        self._over = asyncio.Event()
        self._until = 0.0

    @property
    def held(self) -> bool:
        """Somebody has the drive alone."""
        return self._alone is not None

    @asynccontextmanager
    async def alone(self, seconds: float) -> AsyncIterator[None]:
        """Begins when every request of others has ended; they stay away for ``seconds``.

        Raises:
            ExclusiveAccessHeld: another task has the drive alone already.
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
        """Around a request to the drive; waits for the end of a short rest.

        Raises:
            ExclusiveAccessHeld: the drive is left alone for longer than that.
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
        """A command is more urgent: the rest is over, unless the commanding task holds it."""
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
