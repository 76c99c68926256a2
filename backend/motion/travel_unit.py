"""The unit in which travel and speed are shown: revolutions and rpm, or mm or ° of the load."""

from __future__ import annotations

from dataclasses import dataclass


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
        """Travel as text: 12.5 mm."""
        return f"{self.travel(revolutions):{form}} {self.name}"

    def say_speed(self, rpm: float) -> str:
        """Speed as text: 300 mm/s."""
        return f"{self.speed(rpm):.4g} {self.speed_name}"


REVOLUTIONS = TravelUnit()
