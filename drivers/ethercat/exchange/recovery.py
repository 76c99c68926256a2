"""Automatic restart of the cyclic exchange after it broke off.

A started exchange remains requested until it is stopped. If its process died, its interface
vanished or the loop gave up, it is configured and started again as soon as the segment can be
reached, with growing pauses. Every axis comes back disabled: nothing here enables an axis, and
motions that ran before have ended.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

from drivers.errors import DriveError
from drivers.ethercat.process.ending import end_task
from drivers.texts.message import Text, text

PAUSES_S = (0.3, 1.0, 3.0, 10.0)


class Recovery:
    """Calls ``set_up`` until it succeeds; ``notify`` receives a message at every change."""

    def __init__(
        self,
        ready: Callable[[], bool],
        set_up: Callable[[], Awaitable[None]],
        notify: Callable[[Text, bool], None],
    ) -> None:
        """``ready`` returns whether an attempt makes sense.

        ``notify`` receives a message and whether the exchange runs again.
        """
        self._ready = ready
        self._set_up = set_up
        self._notify = notify
        self._task: asyncio.Task[None] | None = None
        self.trouble: Text | None = None
        """Why the exchange does not run although it is requested; None otherwise."""

    @property
    def active(self) -> bool:
        """Whether the exchange is being set up again or waits for the next attempt."""
        return self._task is not None

    def begin(self, why: Text) -> None:
        """Start the attempts; no effect while they are running."""
        if self._task is None:
            self.trouble = why
            self._task = asyncio.get_running_loop().create_task(self._run())

    async def end(self) -> None:
        """End the attempts, because the exchange is no longer requested."""
        task, self._task = self._task, None
        self.trouble = None
        if task is not None and task is not asyncio.current_task():
            await end_task(task)

    async def _run(self) -> None:
        last: Text | None = None
        attempt = 0
        while True:
            await asyncio.sleep(PAUSES_S[min(attempt, len(PAUSES_S) - 1)])
            if not self._ready():
                continue
            attempt += 1
            try:
                await self._set_up()
            except DriveError as error:
                self.trouble = error.text
                if error.text != last:
                    last = error.text
                    self._notify(text("event.exchange-not-restored", cause=last), False)
                continue
            self._task = None
            self.trouble = None
            self._notify(text("event.exchange-runs-again"), True)
            return
