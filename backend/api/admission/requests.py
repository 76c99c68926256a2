"""Limits on requests that begin and run at once, and on the request rate of unknown clients.

STOP is neither counted nor delayed.
"""

from __future__ import annotations

import asyncio
import time
from collections import Counter, OrderedDict, deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from backend.foundation.people.errors import TooOften
from backend.foundation.people.login.budgets import address_group
from backend.foundation.people.login.throttle import Bucket

#: Requests in progress at once: all but STOP, those of unknown clients, and
#: of these from one address.
MOST_REQUESTS, MOST_OF_STRANGERS, MOST_OF_PLACE = 400, 200, 40
#: Additional requests of unknown clients, only for addresses without a request in progress: a few
#: addresses with long requests then do not shut out all others.
MOST_FIRST_OF_PLACES = 100
#: Requests that begin in one turn of the event loop; a turn with nothing else to do is short.
PER_TURN = 1
#: A STOP that is carried out holds other requests back for this time at most [s], and then none is
#: held for this share of it, so that one person who presses STOP all the time shuts nobody out.
HELD_S, FREE_SHARE = 0.1, 0.25
#: How often requests that are held back look whether they may begin [s].
_LOOK_S = 0.002
#: Rate of requests of unknown clients from one address: burst, and requests per second.
_STRANGERS = (200.0, 50.0)
_KEEP = 4096


class Beginnings:
    """Lets a limited number of requests begin per turn of the event loop; the others wait in order.

    A turn carries out all that is ready. With hundreds of requests in one turn, STOP, which is
    read in the next turn, would wait for all of them; so their work is spread over turns, and
    STOP bypasses the queue. STOP itself needs several turns, so none begins meanwhile.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._left = PER_TURN
        self._waiting: deque[Callable[[], None]] = deque()
        self._turning = False
        self._clock = clock
        self._stops = 0
        self._held_from = self._held_until = self._free_until = 0.0

    @contextmanager
    def held(self) -> Iterator[None]:
        """Hold other requests back while a STOP is carried out; see `HELD_S`."""
        now = self._clock()
        if self._stops == 0 and now >= self._free_until:
            self._held_from, self._held_until = now, now + HELD_S
        self._stops += 1
        try:
            yield
        finally:
            self._stops -= 1
            if self._stops == 0:
                self._end_hold()

    def _end_hold(self) -> None:
        """Let requests begin, and hold none for a share of the time that they were held."""
        ended = min(self._clock(), self._held_until)
        if ended > self._held_from:
            self._free_until = ended + FREE_SHARE * (ended - self._held_from)
        self._held_from = self._held_until = 0.0

    @property
    def _holding(self) -> bool:
        if self._stops == 0 or self._held_until == 0.0:
            return False
        if self._clock() < self._held_until:
            return True
        self._end_hold()
        return False

    def begin(self, work: Callable[[], None]) -> None:
        """Run ``work`` now or in one of the next turns, in the order of the calls."""
        self._keep_turning()
        if self._left > 0 and not self._waiting and not self._holding:
            self._left -= 1
            work()
        else:
            self._waiting.append(work)

    async def turn(self) -> None:
        """Wait until this request may begin."""
        mine: asyncio.Future[None] = asyncio.get_running_loop().create_future()

        def called() -> None:
            if not mine.done():
                mine.set_result(None)

        self.begin(called)
        await mine

    def _keep_turning(self) -> None:
        if not self._turning:
            self._turning = True
            asyncio.get_running_loop().call_soon(self._turn)

    def _turn(self) -> None:
        self._turning = False
        self._left = PER_TURN
        if self._waiting and self._holding:
            self._turning = True
            asyncio.get_running_loop().call_later(_LOOK_S, self._turn)
            return
        if self._waiting:
            self._keep_turning()
        while self._waiting and self._left > 0:
            self._left -= 1
            self._waiting.popleft()()


class Admission:
    """Limits of one server. ``place`` is an address; known browsers are not counted by address."""

    def __init__(self) -> None:
        self.beginnings = Beginnings()
        self._running = 0
        self._strangers: Counter[str] = Counter()
        self._buckets: OrderedDict[str, Bucket] = OrderedDict()

    def require_rate(self, address: str) -> None:
        """Check the request rate of an unknown client at this address.

        Raises:
            TooOften: there were too many requests.
        """
        place = address_group(address)
        bucket = self._buckets.pop(place, None) or Bucket(*_STRANGERS)
        self._buckets[place] = bucket
        while len(self._buckets) > _KEEP:
            self._buckets.popitem(last=False)
        if not bucket.take():
            raise TooOften("api-admission.too-many-requests-without", 1.0)

    @contextmanager
    def running(self, address: str, *, known: bool, stop: bool) -> Iterator[None]:
        """Count a request while it runs.

        Raises:
            TooOften: too many requests run.
        """
        if stop:
            with self.beginnings.held():
                yield
            return
        place = "" if known else address_group(address)
        if self._running >= MOST_REQUESTS:
            raise TooOften("api-admission.too-many-requests-run", 1.0)
        most = MOST_OF_STRANGERS + (0 if self._strangers[place] else MOST_FIRST_OF_PLACES)
        if not known and (
            self._strangers[place] >= MOST_OF_PLACE or self._strangers.total() >= most
        ):
            raise TooOften("api-admission.too-many-requests-without-login", 1.0)
        self._running += 1
        if not known:
            self._strangers[place] += 1
        try:
            yield
        finally:
            self._running -= 1
            if not known:
                self._strangers[place] -= 1
                if self._strangers[place] <= 0:
                    del self._strangers[place]
