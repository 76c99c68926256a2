"""The held button of a jog: its signs of life, their gaps, and its release.

If no sign of life arrives for `GAP_S`, the axis brakes. If signs arrive again within `RESUME_S` of
the begin of the gap, and the button was never released, the motion continues; later a new press is
needed. Signs may arrive late, in bunches or out of order: each contains its time of sending and how
long its page had been silent by then, so that an old sign counts as old. After a gap, a single sign
moves nothing: what was sent together with it, above all a release, is processed first.
"""

from __future__ import annotations

from collections.abc import Callable

from backend.tools.moving.jog.release import END_OF_JOG
from backend.tools.thresholds import jog_hold as threshold
from drivers.computer.timing.clock import elapsed_s
from drivers.texts.message import Text, text

GAP_S = threshold.GAP_S
RESUME_S = threshold.RESUME_S
CONFIRM_S = threshold.CONFIRM_S
_RELEASED = END_OF_JOG["released"]
_EXPIRED = text("jog.end-no-sign-of-life", silent_ms=1e3 * RESUME_S)


class Hold:
    """Hold state of the button of the person who jogs.

    ``clock`` returns seconds that include the time in which the computer slept. ``number`` is the
    number of the press, to distinguish its signs from those of an earlier press; signs without one
    (0) count for any press. ``paused`` is called with True when a gap begins and with False when
    the motion continues, with the present length of the gap in s.
    """

    def __init__(
        self,
        number: int = 0,
        clock: Callable[[], float] = elapsed_s,
        paused: Callable[[bool, float], None] = lambda _braked, _s: None,
    ) -> None:
        self.number = number
        #: Reason of the release; None while the button is held or may still be held.
        self.released: Text | None = None
        self._clock = clock
        self._paused = paused
        #: Last time at which the page is known to have been alive, by this computer's clock.
        self._alive = clock()
        self._last_number = -1
        #: Smallest difference between arrival and sending: transmission without delay, plus clock
        #: offset.
        self._way: float | None = None
        #: The open gap: its begin, and the arrival of the first sign that may end it.
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
        """Process a sign of life of press ``number``.

        ``sign`` is its running number, ``sent_s`` its time of sending by the page's own clock,
        ``silent_s`` how long the page had sent none by then. A sign with ``pressed`` False is a
        release, in whatever order it arrives.
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
            # It proves only that the page was alive some time ago.
            return
        if self._gap_began is not None and self._back is None:
            if alive - self._gap_began > RESUME_S:
                self.release(_EXPIRED)
                return
            self._back = now
        self._alive = alive

    def release(self, reason: Text, number: int = 0) -> None:
        """Release the button, or end the hold for another reason; it cannot be resumed.

        A late release of an earlier press (``number``) is ignored.
        """
        if not number or not self.number or number >= self.number:
            self.released = self.released or reason

    def ended(self) -> Text | None:
        """Reason to stop; None while the button is held or may still be held."""
        self._look(self._clock())
        return self.released

    def braking(self) -> bool:
        """Whether the axis must brake and wait because a gap is open; ends a gap that is over."""
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
        """Open a gap where a sign is overdue; end the hold where the gap is too long."""
        if self.released is not None:
            return
        silent = now - self._alive
        if self._gap_began is None:
            if silent <= GAP_S:
                return
            self._gap_began, self._back = self._alive, None
            self._paused(True, silent)
        elif silent > GAP_S:
            # Signs that had resumed are missing again: the same gap continues.
            self._back = None
        if self._back is None and now - self._gap_began > RESUME_S:
            self.release(_EXPIRED)
