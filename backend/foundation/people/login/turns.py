"""Queue for the password hash: one computation at a time, and no crowd delays other clients.

A hash deliberately costs a tenth of a second of a core, and several at a time would take the
cores from the cyclic exchange. Turns are therefore given in a fixed order: first to known
clients (a browser that has logged in before, somebody who changes their password), then to the
other address with the fewest wrong tries, and between equal ones in rotation: clients that guess
come after those that have not been wrong. Within one address the newest client has the turn and
the oldest is refused with "try again", so that a crowd of earlier guesses does not delay the
client that comes after it.
"""

from __future__ import annotations

import asyncio
from collections import OrderedDict, deque
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from backend.foundation.people.errors import TooOften

#: Limits of the queue: clients of one place, and places.
MOST_OF_PLACE, MOST_PLACES = 3, 64
_RETRY_S = 1.0

Waiting = asyncio.Future[None]


class _Lane:
    """Waiting clients, grouped by the place that they come from."""

    def __init__(self) -> None:
        self._places: OrderedDict[str, deque[Waiting]] = OrderedDict()
        self._wrong: dict[str, int] = {}

    def join(self, place: str, wrong: int) -> Waiting:
        """Join the queue; ``wrong`` is the number of wrong tries of this place.

        Raises:
            TooOften: too many places wait already, none with more wrong tries.
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
        """Leave the queue."""
        waiting = self._places.get(place)
        if waiting is not None and mine in waiting:
            waiting.remove(mine)
            if not waiting:
                del self._places[place], self._wrong[place]

    def next(self) -> Waiting | None:
        """Newest client of the place whose turn it is; None if nobody waits."""
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
    """Turns at the password hash of one station."""

    def __init__(self) -> None:
        self._busy = False
        self._known, self._strangers = _Lane(), _Lane()

    @asynccontextmanager
    async def turn(self, place: str, *, known: bool, wrong: int = 0) -> AsyncIterator[None]:
        """Wait for a turn and hold it. ``place`` is an address, or the id of a browser or session.

        ``wrong`` is the number of its wrong tries.

        Raises:
            TooOften: newer clients of the same place replaced this one, or too many places wait.
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
        # Still busy in between: a client that arrives now must not overtake the one just called.
        self._busy = following is not None
        if following is not None:
            following.set_result(None)
