"""Two coupled axes in the cyclic loop: both stop together, and their skew is limited.

Pure: `PairGuard.look` is called once per cycle, after both axes have processed their inputs. An
axis that it stops begins to brake with the outputs of the next cycle.
"""

from __future__ import annotations

from dataclasses import dataclass

from drivers.halt import HaltCause, Halted
from drivers.motion.playback import AxisLoop
from drivers.motion.setpoint_plan import Phase

_MOVED = (Phase.PLAYING, Phase.HOLDING)


@dataclass(frozen=True, slots=True)
class SkewLimit:
    """Limit of the skew between two axes.

    The difference of both positions may change by ``skew_max`` [increments of the first axis] since
    ``zero`` [increments of each]; one increment of the second axis is ``ratio`` of the first,
    negative if they count in opposite directions.
    """

    zero: tuple[int, int]
    ratio: float
    skew_max: float

    def skew(self, first: int, second: int) -> float:
        """Return the difference of both travels [increments of the first axis]."""
        return (first - self.zero[0]) - self.ratio * (second - self.zero[1])


class PairGuard:
    """Monitors two axes from the cycle in which they start together."""

    def __init__(self, axes: tuple[AxisLoop, AxisLoop], limit: SkewLimit) -> None:
        self.axes = axes
        self._limit = limit

    @property
    def over(self) -> bool:
        """True when neither axis is moved by setpoints any more."""
        return all(axis.phase is Phase.IDLE for axis in self.axes)

    def look(self) -> None:
        """Stop both axes if one was stopped or if the skew exceeds its limit."""
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
