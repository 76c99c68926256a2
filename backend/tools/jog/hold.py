"""The held button of a jog: its signs of life, their gaps, and its release.

A sign of life that is missing for `GAP_S` brakes the axis. Where the hold is alive again within
`RESUME_S` of the gap's begin, and was never released, the axis goes on; later a new press is
needed. Signs may come late, in bunches or in another order than they were sent: each says when it
was sent and how long its page had been silent then, so that an old one counts as old, and after a
gap one sign alone moves nothing: what was sent next to it, a release above all, is read first.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from backend.tools.jog.release import END_OF_JOG
from backend.tools.thresholds import jog_hold as threshold
from drivers.texts.message import Text, text

GAP_S = threshold.GAP_S
RESUME_S = threshold.RESUME_S
CONFIRM_S = threshold.CONFIRM_S
_RELEASED = END_OF_JOG["released"]
_EXPIRED = text("jog.end-no-sign-of-life", silent_ms=1e3 * RESUME_S)


class Hold:
    """The button of the person who jogs. ``clock`` gives monotonic seconds.

    ``number`` is the press's, to distinguish its signs from those of an earlier press; signs
    without one (0) count for any. ``paused`` is called with True when a gap begins and with False
    when the axis goes on, with the gap's length in s so far.
    """

    def __init__(
        self,
        number: int = 0,
        clock: Callable[[], float] = time.monotonic,
        paused: Callable[[bool, float], None] = lambda _braked, _s: None,
    ) -> None:
        self.number = number
        #: Why it is released; None while the button is held or may still be held.
        self.released: Text | None = None
        self._clock = clock
        self._paused = paused
        #: When the page was alive last, by this computer's clock.
        self._alive = clock()
        self._last_number = -1
        #: Smallest difference of arrival and sending: the way without any delay.
        self._way: float | None = None
        #: The gap that is open: when it began, and the arrival of the first sign that may end it.
        self._gap_began: float | None = None
        self._back: float | None = None

    def renew(
        self,
        number: int = 0,
        sign: int | None = None,
        *,
        sent_s: float | None = None,
        silent_s: float = 0.0,
        pressed: bool = True,
    ) -> None:
        """A sign of life of press ``number``.

        ``sign`` counts them, ``sent_s`` is when it was sent by the page's own clock, ``silent_s``
        how long the page itself had given none then. One that says that the button is not
        ``pressed`` is a release, in whatever order it comes.
        """
        if number and number != self.number:
            return
        if not pressed:
            self.release(_RELEASED)
            return
        if sign is not None:
            if sign <= self._last_number:
                return
            self._last_number = sign
        now = self._clock()
        self._look(now)
        late = 0.0
        if sent_s is not None:
            way = now - sent_s
            self._way = way if self._way is None else min(self._way, way)
            late = way - self._way
        alive = now - late - max(silent_s, 0.0)
        if self.released is not None or alive <= self._alive:
            return
        if now - alive > GAP_S:
            # It proves that the page lived some time ago, and no more.
            return
        if self._gap_began is not None and self._back is None:
            if alive - self._gap_began > RESUME_S:
                self.release(_EXPIRED)
                return
            self._back = now
        self._alive = alive

    def release(self, reason: Text, number: int = 0) -> None:
        """The button was let go, or what amounts to it; nothing revives this hold.

        One of an earlier press (``number``) that comes late is no matter of this one.
        """
        if not number or not self.number or number >= self.number:
            self.released = self.released or reason

    def ended(self) -> Text | None:
        """Why to stop, or None while the button is held or may still be held."""
        self._look(self._clock())
        return self.released

    def braking(self) -> bool:
        """Whether the axis has to brake and to wait, as a gap is open. Ends a gap that is over."""
        now = self._clock()
        self._look(now)
        if self.released is not None or self._gap_began is None:
            return False
        alive = now - self._alive <= GAP_S
        if self._back is not None and alive and self._alive - self._back >= CONFIRM_S:
            began, self._gap_began, self._back = self._gap_began, None, None
            self._paused(False, now - began)
            return False
        return True

    def _look(self, now: float) -> None:
        """Open a gap where a sign is missing; end the hold where a gap is too long."""
        if self.released is not None:
            return
        silent = now - self._alive
        if self._gap_began is None:
            if silent <= GAP_S:
                return
            self._gap_began, self._back = self._alive, None
            self._paused(True, silent)
        elif silent > GAP_S:
            # What had come back is gone again: the same gap goes on.
            self._back = None
        if self._back is None and now - self._gap_began > RESUME_S:
            self.release(_EXPIRED)
