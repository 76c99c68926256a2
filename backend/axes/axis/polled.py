"""Supervision of a polled motion by 606Ch and 6064h: jog, moves, homing without cyclic exchange."""

from __future__ import annotations

import time

from backend.axes.axis.scaled import ScaledAxis
from backend.axes.scales.units import AxisUnits
from backend.axes.scales.words import halt_remedy, halt_words
from drivers.errors import motion_halted
from drivers.motion.guard import SpeedGuard
from drivers.texts.message import text

_WINDOW_S = 0.5
"""Window of the speed from position differences [s]; polls come unevenly, every 20 to 60 ms."""
_MARGIN = 2.0
_LATE_S, _LATE = 0.05, 4.0
"""Limits of the answer time: absolute [s], and as a multiple of the fastest answer. The instant of
a reading that took longer than both is not known well enough."""


class PolledGuard:
    """Supervision of one motion of one axis.

    ``speed_rpm``: speed limit; the speed from position differences may reach twice that.
    """

    def __init__(self, axis: ScaledAxis, units: AxisUnits, speed_rpm: float) -> None:
        self._axis = axis
        self._units = units
        limit = abs(units.velocity_raw(speed_rpm))
        self._guard = SpeedGuard(units.feedback, limit, _WINDOW_S, _MARGIN)
        self._fastest_s: float | None = None

    def look(self, position: int, velocity: int, asked_s: float) -> None:
        """Check one poll, requested at ``asked_s`` (`time.monotonic`) and answered just now.

        Raises:
            MotionHalted: the axis is too fast, or position and velocity contradict each other.
        """
        now = time.monotonic()
        took = now - asked_s
        self._fastest_s = took if self._fastest_s is None else min(took, self._fastest_s)
        if took > max(_LATE_S, _LATE * self._fastest_s):
            self._guard.interrupt()
            return
        halt = self._guard.look(position, velocity, 0.5 * (asked_s + now))
        if halt is not None:
            name = self._axis.drive.name
            raise motion_halted(
                name,
                halt,
                words=halt_words(halt, self._units),
                drive=name,
                remedy=halt_remedy(halt, text("axis.check-load-and-limits")),
            )

    def interrupt(self) -> None:
        """Restart the comparison after the position was redefined, as homing does."""
        self._guard.interrupt()
