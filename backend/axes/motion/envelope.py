"""Limits that one motion must not exceed."""

from __future__ import annotations

from dataclasses import dataclass

from backend.axes.motion.travel_unit import TravelUnit


@dataclass(frozen=True, slots=True)
class Envelope:
    """Limits of one motion: travel from the start point [rev], speed [rpm], torque [%], time [s].

    ``travel_unit`` and ``travel_per_rev`` are the unit of the requester, used in messages to them.
    """

    travel_rev: float
    speed_rpm: float
    torque_percent: float
    time_s: float
    travel_unit: str = "rev"
    travel_per_rev: float = 1.0

    @property
    def shown(self) -> TravelUnit:
        """The unit for messages."""
        return TravelUnit(self.travel_unit, self.travel_per_rev)
