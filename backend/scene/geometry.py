"""Positions of the parts of an axis in the scene for a motor position, without I/O.

The scene is not to scale: every linear axis has a track of the same length, onto which its travel
is mapped. Angles are in radian, quaternions are (w, x, y, z).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from backend.axes.scales.gear_calculator import Mechanics
from drivers.errors import OutOfRange

#: Half the length of a track in the scene.
HALF_TRACK = 0.9
#: Share of a track for the range between two limits; the rest shows positions beyond them.
_LIMITED_PART = 0.8

Quaternion = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class Track:
    """Range of travel that a track shows [mm, degrees or rev].

    ``limited``: it is the range of the drive's software limits; otherwise it grows with the axis.
    """

    low: float
    high: float
    limited: bool

    def place(self, travel: float) -> float:
        """Scene x of a travel; limited to the ends of the track."""
        part = _LIMITED_PART if self.limited else 1.0
        middle, half = (self.low + self.high) / 2, (self.high - self.low) / 2
        x = (travel - middle) / half * HALF_TRACK * part
        return max(-HALF_TRACK, min(HALF_TRACK, x))

    def showing(self, travel: float) -> Track:
        """This track, or a longer one that includes ``travel``; a limited track stays the same."""
        if self.limited or self.low <= travel <= self.high:
            return self
        middle = (self.low + self.high) / 2
        half = (self.high - self.low) / 2
        while abs(travel - middle) > half:
            half *= 2
        return Track(middle - half, middle + half, limited=False)


@dataclass(frozen=True, slots=True)
class Travel:
    """Effect of a motor revolution: travel, turns of the load, and the unit of travel."""

    per_rev: float
    load_turns_per_rev: float
    unit: str


def travel_of(mechanics: Mechanics | None) -> Travel:
    """Effect of one motor revolution; a bare shaft where the mechanics are not known."""
    if mechanics is None:
        return Travel(1.0, 1.0, "rev")
    try:
        per_rev = float(mechanics.travel_per_motor_turn())
    except OutOfRange:
        return Travel(1.0, 1.0, "rev")
    return Travel(per_rev, mechanics.load_turns / mechanics.motor_turns, mechanics.unit)


def track_of(travel: Travel, position_rev: float, limits_rev: tuple[float, float] | None) -> Track:
    """The first track: between the software limits, otherwise around zero and the position.

    Without limits it extends five revolutions beyond both.
    """
    if limits_rev is not None and limits_rev[0] < limits_rev[1]:
        low, high = sorted(limit * travel.per_rev for limit in limits_rev)
        return Track(low, high, limited=True)
    reach = 5.0 * abs(travel.per_rev)
    here = position_rev * travel.per_rev
    return Track(min(0.0, here) - reach, max(0.0, here) + reach, limited=False)


def turn(revolutions: float, axis: str) -> Quaternion:
    """Rotation by revolutions about a scene axis, as a quaternion."""
    half = math.pi * math.fmod(revolutions, 2.0)
    sine = math.sin(half)
    return (
        math.cos(half),
        sine if axis == "x" else 0.0,
        sine if axis == "y" else 0.0,
        sine if axis == "z" else 0.0,
    )
