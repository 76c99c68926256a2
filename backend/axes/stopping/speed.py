"""Detects whether an axis moves, from 606Ch and from differences of 6064h; both must agree."""

from __future__ import annotations

import asyncio
import math
import time
from collections import deque
from dataclasses import dataclass

from backend.axes.axis.axis import Axis
from backend.axes.scales.units import AxisUnits
from drivers.cia402 import State
from drivers.errors import DriveError, LinkTimeout

#: Standstill limits, rpm: both speeds must be below theirs. An unfiltered 606Ch shows some rpm of
#: noise at standstill.
STANDS_BY_POSITION_RPM = 3.0
STANDS_BY_SPEED_RPM = 6.0
#: Limits where the increments per revolution are unknown: increments per window, raw speed.
_STILL_INC, _STILL_RAW = 20, 2000
#: Shortest interval over which a position difference is taken, s.
WINDOW_S = 0.05
#: Time for which an axis must stay below the limits to count as standstill, s: an axis that
#: reverses is below them for a moment.
DWELL_S = 0.15
#: Process data older than this, s, do not represent the present state.
_NEWEST_S = 0.05
#: Time allowed for one sample, s; on a serial line several drives are polled in turn.
LOOK_S = 1.0


@dataclass(frozen=True, slots=True)
class Sample:
    """One sample of an axis: monotonic time, raw position and speed (None: not reported)."""

    at_s: float
    state: State
    position: int | None
    velocity: int | None


class SpeedWatch:
    """Tracks the speed of one axis over successive samples."""

    def __init__(self, axis: Axis, units: AxisUnits | None) -> None:
        self._axis = axis
        self.units = units
        self._samples: deque[Sample] = deque(maxlen=100)
        self._still_since: float | None = None
        self.travelled_inc = 0
        self.answered_s: float | None = None

    @property
    def certain(self) -> bool:
        """Whether the increments per revolution are known, so that speeds are in rpm."""
        return self.units is not None and self.units.counts_per_rev is not None

    @property
    def newest(self) -> Sample | None:
        """The last sample."""
        return self._samples[-1] if self._samples else None

    async def look(self) -> Sample:
        """Take one sample.

        Raises:
            DriveError: the drive reports neither position nor speed.
        """
        try:
            async with asyncio.timeout(LOOK_S):
                sample = await self._sample()
        except TimeoutError as error:
            name = self._axis.drive.name
            raise LinkTimeout("stopping.not-tell-how-moves", drive=name) from error
        self.take(sample)
        return sample

    async def _sample(self) -> Sample:
        drive = self._axis.drive
        roles = ("status_word", "position_actual", "velocity_actual")
        keys = [key for role in roles if (key := drive.key(role)) is not None]
        session, reported = self._axis.session, {}
        if session is not None:
            reported = drive.take(session.newest(drive, keys, _NEWEST_S))
        missing = [key for key in keys if key not in reported]
        if len(missing) > 1 or drive.require("status_word") in missing:
            # Do not query a drive whose mailbox does not answer for values the process data already
            # contain.
            reported |= await drive.read_many(missing)
        readings = (reported.get(drive.key(role) or "") for role in roles)
        word, position, velocity = (None if r is None else r.integer for r in readings)
        if word is None or (position is None and velocity is None):
            problem = next((r.error for r in reported.values() if r.error), "link.no-answer")
            raise LinkTimeout(problem, drive=drive.name)
        return Sample(time.monotonic(), drive.decode_state(word), position, velocity)

    def take(self, sample: Sample) -> None:
        """Add a sample."""
        before = self.newest
        if before is not None and sample.position is not None and before.position is not None:
            self.travelled_inc += abs(_difference(sample.position, before.position))
        self._samples.append(sample)
        self.answered_s = sample.at_s
        if self._moves(sample):
            self._still_since = None
        elif self._still_since is None:
            self._still_since = sample.at_s

    @property
    def turns(self) -> bool:
        """Whether the last sample showed motion, or was not sufficient to exclude it."""
        return self._still_since is None

    def at_position_of(self, before: Sample, now: Sample) -> bool:
        """Whether both positions agree within the travel of a standing axis, and 606Ch is low.

        The travel allowed is that of the speed limit, of `WINDOW_S` at most however old ``before``
        is: an axis that oscillates comes back to its old position.
        """
        if now.position is None or before.position is None:
            return False
        counts = None if self.units is None else self.units.counts_per_rev
        span_s = min(now.at_s - before.at_s, WINDOW_S)
        most = _STILL_INC if counts is None else STANDS_BY_POSITION_RPM / 60 * span_s * counts
        limit = STANDS_BY_SPEED_RPM if self.certain else _STILL_RAW
        slow = (self._by_velocity(now) or 0.0) <= limit
        return slow and abs(_difference(now.position, before.position)) <= most

    def stands(self, dwell_s: float = DWELL_S) -> bool:
        """Whether both speeds have been below their limits for this time."""
        now = self.newest
        return (
            now is not None
            and self._still_since is not None
            and now.at_s - self._still_since >= dwell_s
        )

    def speed(self) -> float | None:
        """Return the magnitude of the speed in the axis' unit: the greater of both measurements."""
        now = self.newest
        if now is None:
            return None
        both = [self._by_position(now), self._by_velocity(now)]
        if both[1] is not None and self.units is not None and not self.certain:
            # Increments per second are no speed to be compared with the drive's own.
            both = both[1:]
        return max((value for value in both if value is not None), default=None)

    def slows(self, over_s: float = 0.25) -> bool:
        """Whether the speed now is lower than ``over_s`` ago, by more than its noise."""
        pair = self._then_and_now(over_s)
        return pair is not None and pair[1] < pair[0] * 0.995 - 0.2

    def time_to_standstill_s(self, over_s: float = 0.25) -> float:
        """Return the time to standstill [s] at the present deceleration; infinity if none."""
        pair = self._then_and_now(over_s)
        if pair is None or not self.slows(over_s):
            return math.inf
        return pair[1] / (pair[0] - pair[1]) * over_s

    def _then_and_now(self, over_s: float) -> tuple[float, float] | None:
        now = self.newest
        if now is None:
            return None
        then = next((s for s in reversed(self._samples) if now.at_s - s.at_s >= over_s), None)
        if then is None:
            return None
        before, after = self._best(then), self._best(now)
        return None if before is None or after is None else (before, after)

    def _best(self, sample: Sample) -> float | None:
        by_position = self._by_position(sample)
        return self._by_velocity(sample) if by_position is None else by_position

    def _moves(self, sample: Sample) -> bool:
        by_position, by_velocity = self._by_position(sample), self._by_velocity(sample)
        if by_position is None and sample.position is not None:
            return True  # no speed before the second sample
        if not self.certain:
            moved = self._moved(sample)
            return moved is None or abs(moved) > _STILL_INC or (by_velocity or 0.0) > _STILL_RAW
        return (by_position or 0.0) > STANDS_BY_POSITION_RPM or (
            (by_velocity or 0.0) > STANDS_BY_SPEED_RPM
        )

    def _moved(self, sample: Sample) -> int | None:
        earlier = self._earlier(sample)
        if earlier is None or sample.position is None or earlier.position is None:
            return None
        return _difference(sample.position, earlier.position)

    def _earlier(self, sample: Sample) -> Sample | None:
        return next((s for s in reversed(self._samples) if sample.at_s - s.at_s >= WINDOW_S), None)

    def _by_position(self, sample: Sample) -> float | None:
        """Return the magnitude in rpm, or in increments/s if the resolution is unknown."""
        earlier, moved = self._earlier(sample), self._moved(sample)
        if earlier is None or moved is None:
            return None
        per_s = abs(moved) / (sample.at_s - earlier.at_s)
        counts = None if self.units is None else self.units.counts_per_rev
        return per_s if counts is None else per_s / counts * 60.0

    def _by_velocity(self, sample: Sample) -> float | None:
        if sample.velocity is None:
            return None
        return abs(
            float(sample.velocity) if self.units is None else self.units.velocity(sample.velocity)
        )


def _difference(new: int, old: int) -> int:
    """Difference of two 32-bit positions, which wrap around at the end of their range."""
    return (new - old + 2**31) % 2**32 - 2**31


async def units_of(axis: Axis) -> AxisUnits | None:
    """Return the known units, else read them; None where the drive does not answer."""
    known = axis.known_units
    if known is not None:
        return known
    try:
        async with asyncio.timeout(LOOK_S):
            return await axis.units()
    except (DriveError, TimeoutError):
        return None
