"""Where the parts of an axis stand for a motor position. Pure.

Scene units are of no scale: every linear axis gets a track of the same length, and its travel is
mapped onto it. Angles are in radian, quaternions are (w, x, y, z).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from backend.scales.gear_calculator import Mechanics
from drivers.errors import OutOfRange

#: Half the length of a track in the scene.
HALF_TRACK = 0.9
#: Part of a track that the range between two limits takes; the rest shows what lies beyond.
_LIMITED_PART = 0.8

Quaternion = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class Track:
    """The piece of travel (mm or degrees) that a track shows; ``limited`` by the drive's own
    software limits, or only as far as the axis was seen."""

    low: float
    high: float
    limited: bool

    def place(self, travel: float) -> float:
        """Scene x of a travel; beyond the track's ends it stays at the end."""
        part = _LIMITED_PART if self.limited else 1.0
        middle, half = (self.low + self.high) / 2, (self.high - self.low) / 2
        x = (travel - middle) / half * HALF_TRACK * part
        return max(-HALF_TRACK, min(HALF_TRACK, x))

    def showing(self, travel: float) -> Track:
        """This track, or a longer one that shows ``travel`` as well. Limits stay where they are."""
        if self.limited or self.low <= travel <= self.high:
            return self
        middle = (self.low + self.high) / 2
        half = (self.high - self.low) / 2
        while abs(travel - middle) > half:
            half *= 2
        return Track(middle - half, middle + half, limited=False)


@dataclass(frozen=True, slots=True)
class Travel:
    """How a motor revolution shows: travel of it, turns of the load for it, unit of the travel."""

    per_rev: float
    load_turns_per_rev: float
    unit: str


def travel_of(mechanics: Mechanics | None) -> Travel:
    """What one motor revolution does; a bare shaft where nothing is known of the mechanics."""
    if mechanics is None:
        return Travel(1.0, 1.0, "rev")
    try:
        per_rev = float(mechanics.travel_per_motor_turn())
    except OutOfRange:
        return Travel(1.0, 1.0, "rev")
    return Travel(per_rev, mechanics.load_turns / mechanics.motor_turns, mechanics.unit)


def track_of(travel: Travel, position_rev: float, limits_rev: tuple[float, float] | None) -> Track:
    """The track to begin with: between the software limits, else ten revolutions around here."""
    if limits_rev is not None and limits_rev[0] < limits_rev[1]:
        low, high = sorted(limit * travel.per_rev for limit in limits_rev)
        return Track(low, high, limited=True)
    reach = 5.0 * abs(travel.per_rev)
    here = position_rev * travel.per_rev
    return Track(min(0.0, here) - reach, max(0.0, here) + reach, limited=False)


def turn(revolutions: float, axis: str) -> Quaternion:
    """Rotation by revolutions about a scene axis; only the part of a turn matters."""
    half = math.pi * math.fmod(revolutions, 2.0)
    sine = math.sin(half)
    return (
        math.cos(half),
        sine if axis == "x" else 0.0,
        sine if axis == "y" else 0.0,
        sine if axis == "z" else 0.0,
    )
