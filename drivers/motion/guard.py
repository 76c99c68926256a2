"""Speed monitoring of one motion by 606Ch and by position, with a check that both agree."""

from __future__ import annotations

from drivers.halt import HaltCause, Halted
from drivers.objects.feedback import (
    LIMIT_MARGIN,
    WINDOW_S,
    Contradiction,
    FeedbackScale,
    FeedbackWatch,
)


class SpeedGuard:
    """Monitors one motion. ``limit`` is the speed limit in raw 606Ch, None for no limit.

    The speed by position is too high above ``margin`` times the limit, because samples are not
    exactly equally spaced.
    """

    def __init__(
        self,
        scale: FeedbackScale | None,
        limit: float | None,
        window_s: float = WINDOW_S,
        margin: float = LIMIT_MARGIN,
    ) -> None:
        self._watch = None if scale is None else FeedbackWatch(scale, window_s)
        self._limit = limit
        self._margin = margin

    def look(self, position: int | None, velocity: float | None, at_s: float) -> Halted | None:
        """Check one sample of raw 6064h and 606Ch at a time [s]; return why it ends the motion."""
        watch, limit = self._watch, self._limit
        certain = None
        if watch is not None and position is not None and velocity is not None:
            certain = watch.take(position, velocity, at_s)
        if velocity is not None and limit is not None and abs(velocity) > limit:
            denied = None if watch is None else watch.denied()
            return Halted.beyond("speed", velocity, limit) if denied is None else _of(denied)
        if certain is not None:
            return _of(certain)
        if watch is None or limit is None or (seen := watch.too_fast(limit * self._margin)) is None:
            return None
        denied = watch.unnoticed(seen)
        return Halted.beyond("speed", seen, limit) if denied is None else _of(denied)

    def gap(self) -> None:
        """Note that cycles were skipped: nothing is compared across the gap."""
        if self._watch is not None:
            self._watch.gap()

    def interrupt(self) -> None:
        """Restart the comparison: the position was set again, or samples are missing."""
        if self._watch is not None:
            self._watch.interrupt()


def _of(contradiction: Contradiction) -> Halted:
    kind = contradiction.kind
    return Halted(
        HaltCause.CONTRADICTION, "speed", contradiction.reported, contradiction.seen, kind.value
    )
