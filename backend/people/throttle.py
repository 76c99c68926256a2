"""Back-off against guessing, per name and per address; memory is bounded."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass

#: The first wait, and the longest.
FIRST_WAIT_S = 2.0
LONGEST_WAIT_S = 900.0
#: After this long without a wrong try everything is forgotten.
FORGET_S = 3600.0
_KEEP = 10_000


@dataclass(slots=True)
class _Record:
    failures: int = 0
    blocked_until: float = 0.0
    last: float = 0.0


class Throttle:
    """Doubling waits after ``free_tries`` wrong tries. ``clock`` counts seconds."""

    def __init__(self, free_tries: int, clock: Callable[[], float] = time.monotonic) -> None:
        self._free_tries = free_tries
        self._clock = clock
        self._records: OrderedDict[str, _Record] = OrderedDict()

    def wait_s(self, *keys: str) -> float:
        """Seconds until any of these may try again; 0 where they may now."""
        now = self._clock()
        return max(
            (r.blocked_until - now for k in keys if (r := self._known(k)) is not None), default=0.0
        )

    def failures(self, key: str) -> int:
        """Wrong tries within the last hour without a right one."""
        record = self._known(key)
        return 0 if record is None else record.failures

    def failed(self, *keys: str, free_tries: int | None = None) -> None:
        """A wrong try. ``free_tries`` is how many this one is judged by, where not as always."""
        now = self._clock()
        free = self._free_tries if free_tries is None else free_tries
        for key in keys:
            record = self._known(key) or _Record()
            record.failures += 1
            record.last = now
            over = record.failures - free
            if over >= 0:
                wait = min(LONGEST_WAIT_S, FIRST_WAIT_S * 2.0 ** min(over, 20))
                record.blocked_until = now + wait
            self._records[key] = record
            self._records.move_to_end(key)
        while len(self._records) > _KEEP:
            self._records.popitem(last=False)

    def succeeded(self, *keys: str) -> None:
        """The right answer; earlier wrong ones of these are forgotten."""
        for key in keys:
            self._records.pop(key, None)

    def _known(self, key: str) -> _Record | None:
        record = self._records.get(key)
        if record is not None and self._clock() - record.last > FORGET_S:
            del self._records[key]
            return None
        return record


class Bucket:
    """So many at once, and so many a second after that."""

    def __init__(
        self, burst: float, per_second: float, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._burst, self._rate, self._clock = burst, per_second, clock
        self._left, self._at = burst, clock()

    def take(self) -> bool:
        """Whether there is one more."""
        now = self._clock()
        self._left = min(self._burst, self._left + (now - self._at) * self._rate)
        self._at = now
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True
