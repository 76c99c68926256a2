"""Timeouts: silent pages, hand-overs, grants, the enabling button, sessions."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING

from backend.foundation.people.station import People
from backend.foundation.work.sleep_watch import PERIOD_S, SleepWatch
from backend.station.bench import Bench
from drivers.errors import DriveError

if TYPE_CHECKING:
    from backend.api.live.page import Page

log = logging.getLogger(__name__)

#: With the quarter second between checks, a silent connection loses control within `SILENT_END_S`,
#: and motion that it commanded ends. [s]
SILENCE_S = 1.7
_LOOK_S, _HOLD_LOOK_S, _TEND_S = PERIOD_S, 0.02, 5.0
#: Silence after which a page has lost control [s], as shown to people.
SILENT_END_S = 2.0


class PeopleWatch:
    """Watches all live connections; ``fell_silent`` is called with each that has gone silent."""

    def __init__(
        self,
        bench: Bench,
        people: People,
        pages: Mapping[str, Page],
        fell_silent: Callable[[Page], None],
    ) -> None:
        self._bench, self._people, self._pages = bench, people, pages
        self._fell_silent = fell_silent
        self._sleep = SleepWatch(bench.motion.awoke)
        #: Set when an enabling button is pressed; while it is held it is checked 50 times a second.
        self.hold_pressed = asyncio.Event()

    async def run(self) -> None:
        """Run the checks for as long as the server runs."""
        async with asyncio.TaskGroup() as group:
            group.create_task(self._look(), name="people")
            group.create_task(self._watch_holds(), name="enabling")
            group.create_task(self._tend(), name="accounts")

    async def _look(self) -> None:
        leases = self._bench.leases
        while True:
            with _going_on():
                self._sleep.look()
            now = time.monotonic()
            for page in list(self._pages.values()):
                if now - page.heard > SILENCE_S:
                    with _going_on():
                        self._fell_silent(page)
            with _going_on():
                leases.tick(lambda drive: self._bench.jobs.moving(drive) is not None)
            with _going_on():
                self._people.support.tick()
            await asyncio.sleep(_LOOK_S)

    async def _watch_holds(self) -> None:
        support = self._people.support
        while True:
            await self.hold_pressed.wait()
            self.hold_pressed.clear()
            while support.any_hold:
                with _going_on():
                    support.watch()
                await asyncio.sleep(_HOLD_LOOK_S)

    async def _tend(self) -> None:
        while self._people.accounts_needed:
            # The database may be unreachable for a while; the accounts in memory stay valid.
            with _going_on(), contextlib.suppress(DriveError):
                await self._people.accounts.tend()
            await asyncio.sleep(_TEND_S)


@contextlib.contextmanager
def _going_on() -> Iterator[None]:
    """Log an error instead of raising it: one error must not end the watch over all motion."""
    try:
        yield
    except Exception:
        log.exception("what ends by itself could not be ended")
