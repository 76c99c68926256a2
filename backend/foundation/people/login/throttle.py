"""Back-off against guessing, per name and per address, with bounded memory."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass

#: Shortest and longest wait [s].
FIRST_WAIT_S = 2.0
LONGEST_WAIT_S = 900.0
#: Time [s] without a wrong try after which a record is deleted.
FORGET_S = 3600.0
_KEEP = 10_000


@dataclass(slots=True)
class _Record:
    failures: int = 0
    blocked_until: float = 0.0
    last: float = 0.0


class Throttle:
    """Waits that double with each wrong try after ``free_tries``. ``clock`` returns seconds."""

    def __init__(self, free_tries: int, clock: Callable[[], float] = time.monotonic) -> None:
        self._free_tries = free_tries
        self._clock = clock
        self._records: OrderedDict[str, _Record] = OrderedDict()

    def wait_s(self, *keys: str) -> float:
        """Time [s] until all of these keys may try again; 0 if they may now."""
        now = self._clock()
        return max(
            (r.blocked_until - now for k in keys if (r := self._known(k)) is not None), default=0.0
        )

    def failures(self, key: str) -> int:
        """Wrong tries of a key since its last right one; 0 if the last was over an hour ago."""
        record = self._known(key)
        return 0 if record is None else record.failures

    def failed(self, *keys: str, free_tries: int | None = None) -> None:
        """Count a wrong try. ``free_tries`` replaces the usual number for this try."""
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
        """Reset the counts of these keys after a right try."""
        for key in keys:
            self._records.pop(key, None)

    def _known(self, key: str) -> _Record | None:
        record = self._records.get(key)
        if record is not None and self._clock() - record.last > FORGET_S:
            del self._records[key]
            return None
        return record


class Bucket:
    """Token bucket: ``burst`` at once, ``per_second`` on average after that."""

    def __init__(
        self, burst: float, per_second: float, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._burst, self._rate, self._clock = burst, per_second, clock
        self._left, self._at = burst, clock()

    def take(self) -> bool:
        """Take one token; returns False if none is left."""
        now = self._clock()
        self._left = min(self._burst, self._left + (now - self._at) * self._rate)
        self._at = now
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True
