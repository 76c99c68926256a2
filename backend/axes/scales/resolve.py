"""Scales of one axis: their origin, and whether they are certain.

Order of priority: what a person stated, as long as the drive's scaling objects are unchanged; then
the drive's own objects (60A8h to 60AAh with 608Fh, 6091h and 6092h; CiA 402-2 clause 7); then the
maker's file and the manual. The defaults of the standard alone do not make a scale certain, as
makers use others.
"""

from __future__ import annotations

import re
from collections.abc import Container, Mapping
from dataclasses import dataclass

from backend.axes.drive.drive import Drive
from backend.axes.drive.optional import existing
from backend.axes.scales.scale import Origin, Quantity, Scale, Scales, Uncertainty
from backend.axes.scales.taught import Taught
from profiles.schema import UnitSpec
from profiles.si_unit import SiUnit, decode_si_unit

#: Objects of the standard that state units and resolution; read where the profile has them.
SI_POSITION, SI_VELOCITY, SI_ACCELERATION = "60A8:00", "60A9:00", "60AA:00"
_RESOLUTION, _RESOLUTION_REVS = "608F:01", "608F:02"
#: The encoder that speeds are counted with, and factors of the maker's units (CiA 402-2 clause 10).
_SPEED_RESOLUTION, _SPEED_RESOLUTION_REVS = "6090:01", "6090:02"
_FACTORS = {
    Quantity.VELOCITY: ("6096:01", "6096:02"),
    Quantity.ACCELERATION: ("6097:01", "6097:02"),
}
_ORIGINS = {"manual": Origin.MANUAL, "makers_file": Origin.MAKERS_FILE, "standard": Origin.UNKNOWN}
#: Relative difference above which two values of one resolution or factor disagree.
_SAME = 1e-3


@dataclass(frozen=True, slots=True)
class Reported:
    """Raw values of the objects that define the scales, by key, without absent objects.

    ``encoder``: resolution by the family's own parameter, where it has one [increments/rev].
    """

    raws: Mapping[str, int]
    encoder: float | None = None

    def get(self, key: str | None) -> int | None:
        """The raw value, where the drive has the object with a value above 0; None otherwise."""
        raw = self.raws.get(key or "")
        return raw if raw is not None and raw > 0 else None


def stating_keys(drive: Drive) -> tuple[str, ...]:
    """Keys of all objects that define the scales of this drive."""
    spec, known = drive.profile.units, drive.profile.by_key
    keys = [spec.gear_numerator, spec.gear_denominator, spec.feed, spec.feed_revolutions]
    keys += [_RESOLUTION, _RESOLUTION_REVS, SI_POSITION, SI_VELOCITY, SI_ACCELERATION]
    keys += [_SPEED_RESOLUTION, _SPEED_RESOLUTION_REVS, *sum(_FACTORS.values(), ())]
    return tuple(
        dict.fromkeys(
            key
            for key in keys
            if key is not None and key in known and not drive.unreachable_why(known[key])
        )
    )


async def read_reported(drive: Drive, absent: Container[str] = ()) -> Reported:
    """Read the objects that define the scales now, without those known to be ``absent``.

    Raises:
        DriveError: an object that it has cannot be read.
    """
    # In batches first; objects that failed are read singly, to find out whether they exist.
    readings = await drive.read_many([key for key in stating_keys(drive) if key not in absent])
    failed = [key for key, reading in readings.items() if reading.raw is None]
    readings = readings | await existing(drive, failed)
    return Reported(
        {
            key: int(reading.raw)
            for key, reading in readings.items()
            if isinstance(reading.raw, (int, float))
        }
    )


def scales_of(spec: UnitSpec, reported: Reported, taught: Taught | None) -> Scales:
    """The scales from the units of the profile, the drive's objects and a person's statement."""
    said = taught if taught is not None and taught.holds(reported.raws) else None
    position = _position(spec, reported, said)
    return Scales(
        position,
        _rate(spec, reported, said, position.raw_per_unit, Quantity.VELOCITY),
        _rate(spec, reported, said, position.raw_per_unit, Quantity.ACCELERATION),
    )


def origin_of(spec: UnitSpec, quantity: Quantity) -> Origin:
    """Origin of the unit of this quantity in the profile.

    A profile without a stated origin has the unit from its manual, unless its source is the
    standard: such profiles were imported before the origin was stored.
    """
    stated = spec.origins.get(quantity.value)
    if stated is None:
        stated = "standard" if spec.source.startswith("CiA:") else "manual"
    return _ORIGINS[stated]


# Position ---------------------------------------------------------------------------------------


def _position(spec: UnitSpec, reported: Reported, said: Taught | None) -> Scale:
    code = reported.get(SI_POSITION)
    unit = None if code is None else decode_si_unit(code)
    name = spec.position if unit is None else unit.name
    if said is not None and said.counts_per_rev is not None:
        return Scale(Quantity.POSITION, said.counts_per_rev, name, Origin.USER)
    if code is not None and unit is None and code != 0:
        return _uncertain(Quantity.POSITION, Uncertainty.UNREADABLE, source=f"60A8h = {code:08X}h")
    if (empty := _zero(spec, reported)) is not None:
        return _uncertain(Quantity.POSITION, Uncertainty.NO_RESOLUTION, name, f"{empty} = 0")
    ratio = _ratio(spec, reported)
    feed, resolution = _feed(spec, reported), _resolution(reported)
    trusted = origin_of(spec, Quantity.POSITION) is not Origin.UNKNOWN
    if not trusted and feed == 1.0 and (resolution or 1.0) > 1.0:
        return _uncertain(Quantity.POSITION, Uncertainty.FEED_OF_ONE, name, "6092h, 608Fh")
    if unit is not None and not unit.counts:
        return _by_unit(unit, name, feed, ratio)
    gear = _names(reported, spec.gear_numerator, spec.gear_denominator)
    if spec.feed is not None and spec.feed in reported.raws:
        if feed is None:
            return _uncertain(Quantity.POSITION, Uncertainty.NO_RESOLUTION, name, _shown(spec.feed))
        source = _joined(_names(reported, spec.feed, spec.feed_revolutions), gear)
        return Scale(Quantity.POSITION, feed / ratio, name, Origin.DRIVE, source)
    counts = reported.encoder or resolution
    if counts:
        source = _joined([_shown(_RESOLUTION)] if resolution else ["encoder"], gear)
        return Scale(Quantity.POSITION, counts / ratio, name, Origin.DRIVE, source)
    if spec.counts_per_rev is None:
        return _uncertain(Quantity.POSITION, Uncertainty.NO_RESOLUTION, name)
    origin = origin_of(spec, Quantity.POSITION)
    return Scale(Quantity.POSITION, spec.counts_per_rev / ratio, name, origin, spec.source)


def _by_unit(unit: SiUnit, name: str, feed: float | None, ratio: float) -> Scale:
    """Position scale where 60A8h states an angle or a length."""
    turns = unit.turns
    if turns is None:
        if feed is None:
            return _uncertain(Quantity.POSITION, Uncertainty.LINEAR, name, "60A8h")
        return Scale(Quantity.POSITION, feed / ratio, name, Origin.DRIVE, "60A8h, 6092h")
    per_turn = 1.0 / (turns * unit.factor)
    if feed is not None and feed != 1.0 and abs(feed - per_turn) > _SAME * per_turn:
        return _uncertain(Quantity.POSITION, Uncertainty.UNIT_AND_FEED, name, "60A8h, 6092h")
    return Scale(Quantity.POSITION, per_turn / ratio, name, Origin.DRIVE, "60A8h")


def _zero(spec: UnitSpec, reported: Reported) -> str | None:
    """Key of the part of a ratio that is 0 in the drive; None without one.

    A part of 0 is not valid (CiA 402-2 clause 7); what the drive uses in its place is up to the
    maker. A profile may state that a gear with 0 in both parts was never set and does not count.
    """
    parts: list[str | None] = [spec.gear_numerator, spec.gear_denominator]
    if spec.gear_not_set_at_zero and all(key and reported.raws.get(key) == 0 for key in parts):
        parts.clear()
    parts.append(spec.feed_revolutions if reported.get(spec.feed) else None)
    parts.append(_RESOLUTION_REVS if reported.get(_RESOLUTION) else None)
    return next((key for key in parts if key and reported.raws.get(key) == 0), None)


def _ratio(spec: UnitSpec, reported: Reported) -> float:
    """Motor revolutions per revolution of the shaft behind the gear."""
    return float(reported.get(spec.gear_numerator) or 1) / float(
        reported.get(spec.gear_denominator) or 1
    )


def _feed(spec: UnitSpec, reported: Reported) -> float | None:
    """Position units per revolution of the shaft; None where no feed constant is set."""
    feed = reported.get(spec.feed)
    return None if feed is None else feed / (reported.get(spec.feed_revolutions) or 1)


def _resolution(reported: Reported) -> float | None:
    counts = reported.get(_RESOLUTION)
    return None if counts is None else counts / (reported.get(_RESOLUTION_REVS) or 1)


# Speed and acceleration -------------------------------------------------------------------------


def _rate(
    spec: UnitSpec,
    reported: Reported,
    said: Taught | None,
    per_rev: float | None,
    quantity: Quantity,
) -> Scale:
    fast = quantity is Quantity.VELOCITY
    key = SI_VELOCITY if fast else SI_ACCELERATION
    code = reported.get(key)
    unit = None if code is None else decode_si_unit(code)
    text = spec.velocity if fast else spec.acceleration
    taught = None if said is None else said.raw_per_rpm if fast else said.raw_per_rpm_s
    if said is not None and taught is not None:
        origin = Origin.MEASURED if fast and said.velocity_origin == "measured" else Origin.USER
        return Scale(quantity, taught, unit.name if unit else "", origin)
    if (other := _other_factor(reported, quantity)) is not None:
        return _uncertain(quantity, Uncertainty.FACTOR, unit.name if unit else text, other)
    if code is not None:
        source = f"{_shown(key)} = {code:08X}h"
        if unit is None:
            return _uncertain(quantity, Uncertainty.UNREADABLE, source=source)
        return _by_rate_unit(quantity, unit, per_rev, _ratio(spec, reported), source)
    origin = origin_of(spec, quantity)
    if origin is Origin.UNKNOWN:
        return _uncertain(quantity, Uncertainty.NOT_STATED)
    return by_text(quantity, text, per_rev, origin, spec)


def _other_factor(reported: Reported, quantity: Quantity) -> str | None:
    """Objects that show that raw values may not be in the stated unit; None without any.

    They are 6090h where it differs from 608Fh, and 6096h or 6097h where its factor is not 1.
    Whether and at which point a drive applies them is up to the maker.
    """
    first, second = _FACTORS[quantity]
    numerator, divisor = reported.get(first), reported.get(second) or 1
    if numerator is not None and abs(numerator / divisor - 1.0) > _SAME:
        return _shown(first)
    speed, counts = reported.get(_SPEED_RESOLUTION), _resolution(reported)
    if speed is None or counts is None or quantity is not Quantity.VELOCITY:
        return None
    by_speed = speed / (reported.get(_SPEED_RESOLUTION_REVS) or 1)
    if abs(by_speed - counts) <= _SAME * counts:
        return None
    return _joined([_shown(_SPEED_RESOLUTION), _shown(_RESOLUTION)])


def _by_rate_unit(
    quantity: Quantity, unit: SiUnit, per_rev: float | None, ratio: float, source: str
) -> Scale:
    seconds = _seconds_of(quantity, unit)
    if seconds is None or not (unit.counts or unit.turns):
        return _uncertain(quantity, Uncertainty.UNREADABLE, unit.name, source)
    if unit.counts:
        if per_rev is None:
            return _uncertain(quantity, Uncertainty.NEEDS_RESOLUTION, unit.name, source)
        steps = per_rev
    else:
        if abs(ratio - 1.0) > _SAME:
            return _uncertain(quantity, Uncertainty.BEHIND_GEAR, unit.name, f"{source}, 6091h")
        steps = 1.0 / (unit.turns or 1.0)
    # One rpm is 1/60 rev/s; one rpm/s is 1/60 rev/s².
    return Scale(quantity, steps * seconds / 60.0 / unit.factor, unit.name, Origin.DRIVE, source)


def _seconds_of(quantity: Quantity, unit: SiUnit) -> float | None:
    """Seconds, or square seconds, in the unit's denominator."""
    if quantity is Quantity.VELOCITY:
        return unit.seconds
    return unit.square_seconds


_MULTIPLE = re.compile(r"(?:(0?\.\d+|1|10|100)\s*)?(rpm|r/min|rpm/s|inc/s|inc/s²|pulse/s|pulse/s²)")


def by_text(
    quantity: Quantity, text: str, per_rev: float | None, origin: Origin, spec: UnitSpec
) -> Scale:
    """Scale from a unit text of a profile: ``inc/s``, ``rpm``, ``0.1 rpm``, ``rpm/s``, ``ms``."""
    text = text.strip()
    if quantity is Quantity.ACCELERATION and text.startswith("ms"):
        # A ramp time to a reference speed is not a factor; `AxisUnits` converts it.
        known = spec.ramp_reference_rpm is not None
        return Scale(
            quantity,
            1.0 if known else None,
            text,
            origin,
            spec.source,
            None if known else Uncertainty.NOT_STATED,
        )
    found = _MULTIPLE.fullmatch(text)
    if found is None:
        return _uncertain(quantity, Uncertainty.UNREADABLE, text, spec.source)
    step, bare = float(found[1] or 1.0), found[2]
    if bare.startswith(("inc", "pulse")):
        if per_rev is None:
            return _uncertain(quantity, Uncertainty.NEEDS_RESOLUTION, text, spec.source)
        return Scale(quantity, per_rev / 60.0 / step, text, origin, spec.source)
    return Scale(quantity, 1.0 / step, text, origin, spec.source)


# Parts ------------------------------------------------------------------------------------------


def _uncertain(
    quantity: Quantity, uncertainty: Uncertainty, name: str = "", source: str = ""
) -> Scale:
    return Scale(quantity, None, name, Origin.UNKNOWN, source, uncertainty)


def _names(reported: Reported, *keys: str | None) -> list[str]:
    found = [_shown(key) for key in keys if key is not None and key in reported.raws]
    return list(dict.fromkeys(found))


def _shown(key: str) -> str:
    return f"{key.split(':', maxsplit=1)[0]}h"


def _joined(*parts: list[str]) -> str:
    return ", ".join(dict.fromkeys(name for part in parts for name in part))
