"""Two axes of one machine in the cyclic loop: neither goes on alone, and their skew has a limit.

Pure: `PairGuard.look` is called once in each cycle, after both axes have decided. What it stops
begins to brake with the outputs of the next cycle.
"""

from __future__ import annotations

from dataclasses import dataclass

from drivers.halt import HaltCause, Halted
from drivers.motion.playback import AxisLoop
from drivers.motion.setpoint_plan import Phase

_MOVED = (Phase.PLAYING, Phase.HOLDING)


@dataclass(frozen=True, slots=True)
class SkewLimit:
    """``skew_max`` [increments of the first axis] that the difference of both positions may change
    by since ``zero`` [increments of each]; one increment of the second axis is ``ratio`` of the
    first, negative where they count against each other.
    """

    zero: tuple[int, int]
    ratio: float
    skew_max: float

    def skew(self, first: int, second: int) -> float:
        """Difference of both ways [increments of the first axis]."""
        return (first - self.zero[0]) - self.ratio * (second - self.zero[1])


class PairGuard:
    """Watches two axes from the cycle in which they begin together."""

    def __init__(self, axes: tuple[AxisLoop, AxisLoop], limit: SkewLimit) -> None:
        self.axes = axes
        self._limit = limit

    @property
    def over(self) -> bool:
        """Neither axis is moved by setpoints any more."""
        return all(axis.phase is Phase.IDLE for axis in self.axes)

    def look(self) -> None:
        """Stop both where one was stopped or the skew is beyond its limit."""
        positions = [axis.position for axis in self.axes]
        if None not in positions:
            skew = self._limit.skew(positions[0] or 0, positions[1] or 0)
            if abs(skew) > self._limit.skew_max:
                for axis in self._moved():
                    axis.stop(Halted.beyond("skew", skew, self._limit.skew_max))
        for axis, other in (self.axes, self.axes[::-1]):
            if axis.phase in _MOVED and other.phase not in _MOVED:
                note = "" if other.halted is None else other.halted.text
                axis.stop(Halted(HaltCause.PARTNER, note=note))

    def _moved(self) -> list[AxisLoop]:
        return [axis for axis in self.axes if axis.phase in _MOVED]
