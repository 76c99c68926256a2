"""Notices that the computer slept, or that this program did not run for a while.

Timers of the event loop stand still meanwhile: dead-man times, grants and the silence of pages
would go on after waking as if no time had passed, and a drive may have moved on by itself.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from drivers.computer.timing.clock import elapsed_s

#: Longer than a busy computer delays a program, shorter than the sleep of a computer [s].
LONGEST_S = 5.0
PERIOD_S = 0.25


class SleepWatch:
    """Calls ``awoke`` with the length of each gap [s] of more than `LONGEST_S` between two looks.

    ``ticks`` returns seconds that include the time in which the computer slept.
    """

    def __init__(
        self, awoke: Callable[[float], None], ticks: Callable[[], float] = elapsed_s
    ) -> None:
        self._awoke, self._ticks = awoke, ticks
        self._looked = ticks()

    def look(self) -> None:
        """Compare with the last look; to be called every `PERIOD_S`."""
        now = self._ticks()
        gap_s, self._looked = now - self._looked, now
        if gap_s > LONGEST_S:
            self._awoke(gap_s)

    async def run(self) -> None:
        """Look until cancelled."""
        while True:
            await asyncio.sleep(PERIOD_S)
            self.look()
