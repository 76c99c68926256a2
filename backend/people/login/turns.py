"""Turns at the password hash: one at a time, and nobody's crowd keeps another waiting.

A hash costs a tenth of a second of a core on purpose, and more than one at a time would keep the
cores from what moves. So turns are given in a fixed order: first to those who are known (a browser
that has logged in before, somebody who changes their password), then to everybody else's address
with the fewest wrong tries, and between equal ones in rotation: those who guess go behind those
who have not been wrong. Of one address the newest has the turn and the oldest goes away with "try
again", so that a crowd of guesses in front does not keep back the one that comes after it.
"""

from __future__ import annotations

import asyncio
from collections import OrderedDict, deque
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from backend.people.errors import TooOften

#: Waiting at a time: of one place, and places.
MOST_OF_PLACE, MOST_PLACES = 3, 64
_RETRY_S = 1.0

Waiting = asyncio.Future[None]


class _Lane:
    """Those who wait, by the place that they come from."""

    def __init__(self) -> None:
        self._places: OrderedDict[str, deque[Waiting]] = OrderedDict()
        self._wrong: dict[str, int] = {}

    def join(self, place: str, wrong: int) -> Waiting:
        """Wait for a turn; ``wrong`` counts the wrong tries of this place.

        Raises:
            TooOften: too many places wait already that were not wrong more often.
        """
        waiting = self._places.get(place)
        if waiting is None:
            self._make_room(wrong)
            waiting = self._places[place] = deque()
        self._wrong[place] = wrong
        if len(waiting) >= MOST_OF_PLACE:
            _refuse(waiting.popleft())
        mine: Waiting = asyncio.get_running_loop().create_future()
        waiting.append(mine)
        return mine

    def _make_room(self, wrong: int) -> None:
        if len(self._places) < MOST_PLACES:
            return
        worst = max(self._places, key=self._wrong.__getitem__)
        if self._wrong[worst] <= wrong:
            raise TooOften("people.too-many-log-ins", _RETRY_S)
        del self._wrong[worst]
        for each in self._places.pop(worst):
            _refuse(each)

    def leave(self, place: str, mine: Waiting) -> None:
        """Wait no longer."""
        waiting = self._places.get(place)
        if waiting is not None and mine in waiting:
            waiting.remove(mine)
            if not waiting:
                del self._places[place], self._wrong[place]

    def next(self) -> Waiting | None:
        """The newest of the place whose turn it is; None where nobody waits."""
        while self._places:
            place = min(self._places, key=self._wrong.__getitem__)  # of equal ones the first
            waiting = self._places.pop(place)
            mine = waiting.pop()
            if waiting:
                self._places[place] = waiting
            else:
                del self._wrong[place]
            if not mine.done():
                return mine
        return None


def _refuse(waiting: Waiting) -> None:
    if not waiting.done():
        waiting.set_exception(TooOften("people.too-many-log-ins", _RETRY_S))


class HashTurns:
    """The turns of one station."""

    def __init__(self) -> None:
        self._busy = False
        self._known, self._strangers = _Lane(), _Lane()

    @asynccontextmanager
    async def turn(self, place: str, *, known: bool, wrong: int = 0) -> AsyncIterator[None]:
        """Wait for a turn and have it. ``place`` is an address, or a browser or session.

        ``wrong`` counts its wrong tries.

        Raises:
            TooOften: others of the same place came after, or too many places wait.
        """
        if self._busy:
            lane = self._known if known else self._strangers
            mine = lane.join(place, wrong)
            try:
                await mine
            except asyncio.CancelledError:
                lane.leave(place, mine)
                if mine.done() and not mine.cancelled() and mine.exception() is None:
                    self._pass_on()  # the turn had just come
                raise
        self._busy = True
        try:
            yield
        finally:
            self._pass_on()

    def _pass_on(self) -> None:
        following = self._known.next() or self._strangers.next()
        # It stays in use in between: who comes now does not get in before who was called.
        self._busy = following is not None
        if following is not None:
            following.set_result(None)
