"""What ends by itself: silent pages, hand-overs, grants, the enabling button, sessions."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING

from backend.people.station import People
from backend.station.bench import Bench
from drivers.errors import DriveError

if TYPE_CHECKING:
    from backend.api.live.page import Page

log = logging.getLogger(__name__)

#: With the quarter second between looks, a silent connection loses control within `SILENT_END_S`,
#: and what moves by its command ends.
SILENCE_S = 1.7
_LOOK_S, _HOLD_LOOK_S, _TEND_S = 0.25, 0.02, 5.0
#: A page that was not heard for this long, in s, has lost control: what people are shown.
SILENT_END_S = 2.0


class PeopleWatch:
    """Looks after all live connections; ``fell_silent`` is called with each that says nothing."""

    def __init__(
        self,
        bench: Bench,
        people: People,
        pages: Mapping[str, Page],
        fell_silent: Callable[[Page], None],
    ) -> None:
        self._bench, self._people, self._pages = bench, people, pages
        self._fell_silent = fell_silent
        #: An enabling button was pressed: from then on it is looked after 50 times a second.
        self.hold_pressed = asyncio.Event()

    async def run(self) -> None:
        """For as long as the server lives."""
        async with asyncio.TaskGroup() as group:
            group.create_task(self._look(), name="people")
            group.create_task(self._watch_holds(), name="enabling")
            group.create_task(self._tend(), name="accounts")

    async def _look(self) -> None:
        leases = self._bench.leases
        while True:
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
            # The database may be away for a while; who is known stays known.
            with _going_on(), contextlib.suppress(DriveError):
                await self._people.accounts.tend()
            await asyncio.sleep(_TEND_S)


@contextlib.contextmanager
def _going_on() -> Iterator[None]:
    """One defect must not end the watch over everything that moves: it is logged."""
    try:
        yield
    except Exception:
        log.exception("what ends by itself could not be ended")
