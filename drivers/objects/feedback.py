"""Check that 606Ch and the differences of 6064h report the same motion.

Both are compared over time windows. A 606Ch that lags, is averaged over some cycles or is coarsely
rounded therefore agrees; one in another unit, with the opposite sign, or constant does not.

Pure: `FeedbackWatch.take` receives samples with their times and never raises.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise

_PARTS = 5
"""Parts of a window; each has its own sums, and the window slides by one part."""
_RELATIVE = 0.25
"""Allowed difference, as a share of the greater of the two speeds."""
_LAG = 0.25
"""Share of a window by which 606Ch may lag: 10 ms of 40 ms."""
_COUNTS = 2.0
"""Possible error of a difference of positions, in increments."""
_MOST_IGNORED = 3.0
"""Rounding of 606Ch detected during the motion may widen ``ignored`` by at most this factor."""
_VOTES = 2 * _PARTS
"""Number of consecutive windows, each one part later, that must disagree."""
_APART = 3.0
"""Factor between the two above which a wrong value, not a real speed, exceeded a limit."""
_INSTANT = 4
"""Number of newest samples over which a speed beyond its limit is compared with the position."""
_WRAP = 2**32

WINDOW_S = 0.04
"""Window of a cyclic exchange [s]. Polled signals need longer windows."""
LIMIT_MARGIN = 1.15
"""Tolerance for a speed by position, which is averaged over cycles of unequal length."""


class Disagreement(StrEnum):
    """Kind of disagreement between 606Ch and the position."""

    SCALE = "scale"
    SIGN = "sign"
    SPEED_STANDS = "speed stands still"
    POSITION_STANDS = "position stands still"


@dataclass(frozen=True, slots=True)
class FeedbackScale:
    """Relation between 606Ch and 6064h.

    ``velocity_per_inc_s`` is raw 606Ch per increment per second of 6064h; differences below
    ``ignored`` [raw 606Ch] do not count.
    """

    velocity_per_inc_s: float
    ignored: float


@dataclass(frozen=True, slots=True)
class Contradiction:
    """Speed by 606Ch (``reported``) and by the position (``seen``), both in raw units of 606Ch."""

    kind: Disagreement
    reported: float
    seen: float


@dataclass(slots=True)
class _Part:
    moved: int = 0
    reported: float = 0.0
    time_s: float = 0.0
    peak_reported: float = 0.0


class FeedbackWatch:
    """Watches one motion of one axis. ``window_s`` [s] is the length of the comparison window."""

    def __init__(self, scale: FeedbackScale, window_s: float = WINDOW_S) -> None:
        self._scale = scale
        self._part_s = window_s / _PARTS
        self._parts: deque[_Part] = deque(maxlen=_PARTS)
        self._open = _Part()
        self._latest: tuple[int, float] | None = None
        """Increments and time [s] of the last two closed parts; None before the second."""
        self._last: tuple[int, float, float] | None = None
        self._newest: deque[tuple[int, float, float]] = deque(maxlen=_INSTANT)
        self._samples = 0
        self._undated = 0
        self._votes = 0
        self._finest = 0.0
        """Smallest step of 606Ch seen: an upper limit of its rounding."""

    def take(self, position: int, velocity: float, at_s: float) -> Contradiction | None:
        """Add a sample of raw 6064h and 606Ch at a time [s]; return a contradiction when sure."""
        if self._undated:
            self._undated -= 1
            return None
        last, self._last = self._last, (position, velocity, at_s)
        self._newest.append(self._last)
        if last is None or at_s <= last[2]:
            return None
        position_before, velocity_before, before_s = last
        step = abs(velocity - velocity_before)
        if step and (not self._finest or step < self._finest):
            self._finest = step
        part = self._open
        elapsed = at_s - before_s
        part.moved += _difference(position, position_before)
        part.reported += 0.5 * (velocity + velocity_before) * elapsed
        part.time_s += elapsed
        if (size := abs(velocity)) > part.peak_reported:
            part.peak_reported = size
        self._samples += 1
        if part.time_s < self._part_s or self._samples < 2:
            return None
        self._parts.append(part)
        if len(self._parts) > 1:
            before = self._parts[-2]
            self._latest = before.moved + part.moved, before.time_s + part.time_s
        self._open, self._samples = _Part(), 0
        return self._judge() if len(self._parts) == _PARTS else None

    def gap(self) -> None:
        """Note that cycles were skipped: nothing is compared across them; earlier parts are kept.

        The first sample after the gap is not used either: some drives latch it at the last frame
        before the gap, others just before it is fetched, so its time is not certain.
        """
        self._last, self._undated = None, 1
        self._newest.clear()

    def interrupt(self) -> None:
        """Begin a new window: the position was set again (homing), or samples are missing."""
        self._parts.clear()
        self._latest = None
        self._newest.clear()
        self._open, self._samples, self._votes, self._last = _Part(), 0, 0, None
        self._undated = 0

    def too_fast(self, limit: float) -> float | None:
        """Return the speed by position [raw 606Ch] if it certainly exceeds the limit, or None."""
        if self._latest is None:
            return None
        moved, time_s = self._latest
        per = abs(self._scale.velocity_per_inc_s)
        least = (abs(moved) - _COUNTS) / time_s * per
        return moved / time_s * self._scale.velocity_per_inc_s if least > limit else None

    def denied(self) -> Contradiction | None:
        """Return the contradiction if the newest positions do not confirm the speed by 606Ch."""
        newest = list(self._newest)
        if len(newest) < 2:
            return None
        time_s = newest[-1][2] - newest[0][2]
        if time_s <= 0:
            return None
        reported = (
            sum(0.5 * (new[1] + old[1]) * (new[2] - old[2]) for old, new in pairwise(newest))
            / time_s
        )
        moved = _difference(newest[-1][0], newest[0][0])
        per = self._scale.velocity_per_inc_s
        most = (abs(moved) + _COUNTS) / time_s * abs(per)
        return self._of(reported, moved, time_s) if self._apart(most, abs(reported)) else None

    def unnoticed(self, seen: float) -> Contradiction | None:
        """Return the contradiction if 606Ch recently reported no speed near ``seen``."""
        recent = self._recent()
        if not self._apart(max(part.peak_reported for part in recent), abs(seen)):
            return None
        time_s = sum(part.time_s for part in recent)
        moved = sum(part.moved for part in recent)
        return self._of(sum(part.reported for part in recent) / time_s, moved, time_s)

    def _apart(self, low: float, high: float) -> bool:
        return low * _APART < high and high - low > self._ignored

    def _of(self, reported: float, moved: int, time_s: float) -> Contradiction:
        within = abs(moved) <= _COUNTS
        seen = 0.0 if within else moved / time_s * self._scale.velocity_per_inc_s
        return Contradiction(disagreement(reported, seen), reported, seen)

    def _recent(self) -> list[_Part]:
        return [*list(self._parts)[-2:], self._open]

    @property
    def _ignored(self) -> float:
        base = self._scale.ignored
        return max(base, min(1.5 * self._finest, _MOST_IGNORED * base))

    def _judge(self) -> Contradiction | None:
        per = self._scale.velocity_per_inc_s
        time_s = sum(part.time_s for part in self._parts)
        reported = sum(part.reported for part in self._parts) / time_s
        seen = sum(part.moved for part in self._parts) / time_s * per
        speeds = [part.moved / part.time_s * per for part in self._parts]
        allowed = (
            _RELATIVE * max(abs(reported), abs(seen))
            + _LAG * (max(speeds) - min(speeds))
            + _COUNTS / time_s * abs(per)
            + self._ignored
        )
        if abs(reported - seen) <= allowed:
            self._votes = 0
            return None
        self._votes += 1
        if self._votes < _VOTES:
            return None
        return self._of(reported, sum(part.moved for part in self._parts), time_s)


def _difference(new: int, old: int) -> int:
    """Difference of two 32-bit positions, including across their overflow."""
    return (new - old + _WRAP // 2) % _WRAP - _WRAP // 2


def disagreement(reported: float, seen: float) -> Disagreement:
    """Classify how a speed by 606Ch and one by position disagree, both in raw units of 606Ch."""
    if abs(reported) < 1.0:
        return Disagreement.SPEED_STANDS
    if seen == 0.0:
        return Disagreement.POSITION_STANDS
    if reported * seen < 0 and 0.5 < abs(reported / seen) < 2:
        return Disagreement.SIGN
    return Disagreement.SCALE
