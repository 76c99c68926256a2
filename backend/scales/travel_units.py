"""The unit in which a person types and reads travel: motor revolutions, or mm or ° of the load.

The tools work in revolutions, rpm and rpm/s. A request in another unit is converted once, on its
way in (`backend.api.drive.convert_motion`), and its messages are written in the unit of
the request.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from backend.scales.gear_calculator import Mechanics
from drivers.errors import NotAllowed

if TYPE_CHECKING:
    from backend.scales.units import AxisUnits


@dataclass(frozen=True, slots=True)
class TravelUnit:
    """``per_rev``: travel of one motor revolution in ``name``. Speeds are rpm or ``name``/s."""

    name: str = "rev"
    per_rev: float = 1.0

    @property
    def speed_name(self) -> str:
        """Unit of speeds."""
        return "rpm" if self.name == "rev" else f"{self.name}/s"

    @property
    def _speed_per_rpm(self) -> float:
        return 1.0 if self.name == "rev" else self.per_rev / 60.0

    def rev(self, travel: float) -> float:
        """Travel to motor revolutions."""
        return travel / self.per_rev

    def rpm(self, speed: float) -> float:
        """Speed to rpm, or acceleration to rpm/s."""
        return speed / self._speed_per_rpm

    def travel(self, revolutions: float) -> float:
        """Motor revolutions to travel."""
        return revolutions * self.per_rev

    def speed(self, rpm: float) -> float:
        """Rpm to speed, or rpm/s to acceleration."""
        return rpm * self._speed_per_rpm

    def say(self, revolutions: float, form: str = ".4g") -> str:
        """Travel in words: 12.5 mm."""
        return f"{self.travel(revolutions):{form}} {self.name}"

    def say_speed(self, rpm: float) -> str:
        """Speed in words: 300 mm/s."""
        return f"{self.speed(rpm):.4g} {self.speed_name}"


REVOLUTIONS = TravelUnit()


def travel_unit(drive: str, name: str, mechanics: Mechanics | None, units: AxisUnits) -> TravelUnit:
    """The unit that a request names, where the axis has it.

    Raises:
        NotAllowed: no mechanics are kept that travel in it, or increments per turn are unknown.
        OutOfRange: the mechanics lack a dimension.
    """
    if name == REVOLUTIONS.name:
        return REVOLUTIONS
    known = mechanics.unit if mechanics is not None else ""
    if mechanics is None or known != name:
        raise NotAllowed(
            "scales.travel-needs-mechanics-say",
            drive=drive,
            value=name,
            limit=f"rev, {known}" if known else "rev",
        )
    if units.counts_per_rev is None:
        raise NotAllowed("scales.increments-per-revolution-unknown", drive=drive, value=name)
    return TravelUnit(name, float(mechanics.travel_per_motor_turn()))
