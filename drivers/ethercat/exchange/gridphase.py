"""Phase of the cycle grid relative to the reference clock: pure, no I/O."""

from __future__ import annotations

from dataclasses import dataclass

_USUAL_PART = 0.01
"""Weight of the newest lateness in its moving average: about a hundred cycles count."""
_PROPORTIONAL, _INTEGRAL = 0.05, 0.0005
_LIMIT = 1 / 50
"""Largest correction of the grid in one cycle, as a share of the cycle."""


@dataclass(slots=True)
class GridPhase:
    """A PI controller that makes frames pass half a cycle before SYNC0."""

    cycle_ns: int
    _integral_ns: float = 0.0
    _usual_late_ns: float = 0.0

    def error_ns(self, dc_ns: int, late_ns: int) -> int:
        """Return how late frames of this grid pass [ns], negative if early.

        ``dc_ns`` is the reference clock's time in a frame, and ``late_ns`` the delay of this frame
        relative to the grid. The moving average of the delay counts, limited to a quarter of a
        cycle; a longer delay carries no information on the clocks: a frame late by more than half a
        cycle would look like an early one, and the grid would slip by whole cycles while their
        counter does not.
        """
        cycle = self.cycle_ns
        usual = min(late_ns, cycle // 4)
        self._usual_late_ns += (usual - self._usual_late_ns) * _USUAL_PART
        phase = (dc_ns - late_ns + round(self._usual_late_ns) - cycle // 2) % cycle
        return phase - cycle if phase > cycle // 2 else phase

    def correction_ns(self, error_ns: int) -> int:
        """Return the correction [ns] to add to the time of the next cycle."""
        limit = self.cycle_ns * _LIMIT
        integral = self._integral_ns + error_ns * _INTEGRAL
        self._integral_ns = min(max(integral, -limit), limit)
        return -round(min(max(error_ns * _PROPORTIONAL + self._integral_ns, -limit), limit))
