"""Where the grid of the cycles lies on the reference clock: pure, no I/O."""

from __future__ import annotations

from dataclasses import dataclass

_USUAL_PART = 0.01
"""Weight of the newest lateness in the usual one: about a hundred cycles count."""
_PROPORTIONAL, _INTEGRAL = 0.05, 0.0005
_LIMIT = 1 / 50
"""The grid moves by this part of a cycle at most, in one cycle."""


@dataclass(slots=True)
class GridPhase:
    """A PI controller that lets frames pass half a cycle before SYNC0."""

    cycle_ns: int
    _integral_ns: float = 0.0
    _usual_late_ns: float = 0.0

    def error_ns(self, dc_ns: int, late_ns: int) -> int:
        """By how much frames of this grid pass too late, from the reference clock's time in one.

        ``late_ns`` is by how much this one came after its place in the grid. What is usual of
        that counts, up to a quarter of a cycle. More says nothing of the clocks: a frame that is
        late by more than half a cycle would pass for an early one, and the grid would slip by
        whole cycles while their counter does not.
        """
        cycle = self.cycle_ns
        usual = min(late_ns, cycle // 4)
        self._usual_late_ns += (usual - self._usual_late_ns) * _USUAL_PART
        phase = (dc_ns - late_ns + round(self._usual_late_ns) - cycle // 2) % cycle
        return phase - cycle if phase > cycle // 2 else phase

    def correction_ns(self, error_ns: int) -> int:
        """What is to be added to the time of the next cycle."""
        limit = self.cycle_ns * _LIMIT
        integral = self._integral_ns + error_ns * _INTEGRAL
        self._integral_ns = min(max(integral, -limit), limit)
        return -round(min(max(error_ns * _PROPORTIONAL + self._integral_ns, -limit), limit))
