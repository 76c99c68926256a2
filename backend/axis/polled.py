"""606Ch and 6064h of a motion that is polled: jog, moves and homing without a cyclic exchange."""

from __future__ import annotations

import time

from backend.axis.scaled import ScaledAxis
from backend.scales.units import AxisUnits
from backend.scales.words import halt_remedy, halt_words
from drivers.errors import motion_halted
from drivers.motion.guard import SpeedGuard
from drivers.texts.message import text

_WINDOW_S = 0.5
"""Polls come every 20 to 60 ms, and not evenly."""
_MARGIN = 2.0
_LATE_S, _LATE = 0.05, 4.0
"""An answer that took longer, or so many times as long as the fastest, was read who knows when."""


class PolledGuard:
    """One motion of one axis. ``speed_rpm``: its speed limit; the position may reach twice that."""

    def __init__(self, axis: ScaledAxis, units: AxisUnits, speed_rpm: float) -> None:
        self._axis = axis
        self._units = units
        limit = abs(units.velocity_raw(speed_rpm))
        self._guard = SpeedGuard(units.feedback, limit, _WINDOW_S, _MARGIN)
        self._fastest_s: float | None = None

    def look(self, position: int, velocity: int, asked_s: float) -> None:
        """One poll that was asked for at ``asked_s`` (`time.monotonic`) and has just come.

        Raises:
            MotionHalted: the axis is too fast, or the two contradict each other.
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
        """The position was set again, as homing does."""
        self._guard.interrupt()
