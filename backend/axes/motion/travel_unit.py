"""Unit in which travel and speed are shown: rev and rpm, or mm or ° of the load."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class TravelUnit:
    """``per_rev``: travel in ``name`` per motor revolution. Speeds are in rpm or ``name``/s."""

    name: str = "rev"
    per_rev: float = 1.0

    @property
    def speed_name(self) -> str:
        """Unit of speed."""
        return "rpm" if self.name == "rev" else f"{self.name}/s"

    @property
    def _speed_per_rpm(self) -> float:
        return 1.0 if self.name == "rev" else self.per_rev / 60.0

    def rev(self, travel: float) -> float:
        """Convert travel to motor revolutions."""
        return travel / self.per_rev

    def rpm(self, speed: float) -> float:
        """Convert speed to rpm, or acceleration to rpm/s."""
        return speed / self._speed_per_rpm

    def travel(self, revolutions: float) -> float:
        """Convert motor revolutions to travel."""
        return revolutions * self.per_rev

    def speed(self, rpm: float) -> float:
        """Convert rpm to speed, or rpm/s to acceleration."""
        return rpm * self._speed_per_rpm

    def say(self, revolutions: float, form: str = ".4g") -> str:
        """Format motor revolutions as travel, for example 12.5 mm."""
        return f"{self.travel(revolutions):{form}} {self.name}"

    def say_speed(self, rpm: float) -> str:
        """Format rpm as speed, for example 300 mm/s."""
        return f"{self.speed(rpm):.4g} {self.speed_name}"


REVOLUTIONS = TravelUnit()
