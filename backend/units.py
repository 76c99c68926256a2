"""Motion quantities of one axis: raw drive units to revolutions, rpm, rpm/s and per cent.

Sources: CiA 402-2 clause 7 (position factor: encoder resolution, gear ratio, feed constant) and
each profile's ``units``, which carries the manual's line.
"""

from __future__ import annotations

from dataclasses import dataclass

from backend.drive import Drive
from backend.optional import existing
from drivers.errors import NotAllowed, OutOfRange
from profiles.schema import Parameter, UnitSpec

#: Raw units per rpm for families that count speed in turns; inc/s depends on the gearing.
_RAW_PER_RPM = {"rpm": 1.0, "0.1 rpm": 10.0}
#: Raw units per 1 % of rated torque.
_RAW_PER_PERCENT = {"‰ rated": 10.0, "0.1 %": 10.0, "% rated": 1.0, "0.01 %": 100.0}


@dataclass(frozen=True, slots=True)
class AxisUnits:
    """Scales of one axis. ``counts_per_rev`` is None where the resolution is unknown."""

    spec: UnitSpec
    counts_per_rev: float | None

    @property
    def names(self) -> dict[str, str]:
        """Unit shown for each quantity."""
        turns = self.counts_per_rev is not None
        return {
            "position": "rev" if turns else self.spec.position,
            "velocity": "rpm" if self._raw_per_rpm is not None else self.spec.velocity,
            "acceleration": "rpm/s" if self._raw_per_rpm is not None else self.spec.acceleration,
            "torque": "%",
            "following_error": "rev" if turns else self.spec.position,
            "dc_voltage": "V",
            "temperature": "°C",
        }

    @property
    def _raw_per_rpm(self) -> float | None:
        if self.spec.velocity == "inc/s":
            return None if self.counts_per_rev is None else self.counts_per_rev / 60.0
        return _RAW_PER_RPM.get(self.spec.velocity)

    # Without a known scale the raw unit is shown under its own name, so 1:1 is right there.

    def position(self, raw: float) -> float:
        """Increments to revolutions."""
        return raw / (self.counts_per_rev or 1.0)

    def position_raw(self, revolutions: float) -> int:
        """Revolutions to increments."""
        return round(revolutions * (self.counts_per_rev or 1.0))

    def velocity(self, raw: float) -> float:
        """Raw speed to rpm."""
        return raw / (self._raw_per_rpm or 1.0)

    def velocity_raw(self, rpm: float) -> int:
        """Rpm to raw speed."""
        return round(rpm * (self._raw_per_rpm or 1.0))

    def velocity_raw_of(self, parameter: Parameter, rpm: float) -> int:
        """Rpm to the raw speed of an object whose own unit may differ from that of 60FFh.

        6099h of the M6-L is in rpm beside velocities in increments per second (000:2167).
        """
        if parameter.unit == "rpm":
            return round(parameter.to_raw(rpm))
        return self.velocity_raw(rpm)

    def acceleration_raw(self, rpm_per_s: float) -> int:
        """Rpm/s to the raw ramp: a rate, or a time in ms for families that say so."""
        reference = self.spec.ramp_reference_rpm
        if self.spec.acceleration.startswith("ms") and reference is not None:
            return max(1, round(1000.0 * reference / rpm_per_s))
        if self.spec.acceleration.startswith("inc/s"):
            return max(1, round(rpm_per_s * (self.counts_per_rev or 60.0) / 60.0))
        return max(1, round(rpm_per_s * _RAW_PER_RPM.get(self.spec.velocity, 1.0)))

    def torque(self, raw: float) -> float:
        """Raw torque to % of rated."""
        return raw / _RAW_PER_PERCENT.get(self.spec.torque, 10.0)

    def torque_raw(self, percent: float) -> int:
        """% of rated to raw torque."""
        return round(percent * _RAW_PER_PERCENT.get(self.spec.torque, 10.0))


def gentlest_ramp_rpm_s(drive: Drive, key: str) -> float | None:
    """The gentlest ramp of a drive whose ramps are times; None where nothing bounds it."""
    spec = drive.profile.units
    reference, longest = spec.ramp_reference_rpm, drive.parameter(key).raw_limits[1]
    if reference is None or not spec.acceleration.startswith("ms") or not longest:
        return None
    return 1000.0 * reference / longest


def ramp_raw(units: AxisUnits, drive: Drive, key: str, rpm_per_s: float) -> int:
    """The raw ramp of this parameter for rpm/s.

    Raises:
        OutOfRange: gentler than the longest ramp time of the drive; said in rpm/s, as the time in
            the drive is nothing that anybody typed.
    """
    raw = units.acceleration_raw(rpm_per_s)
    gentlest = gentlest_ramp_rpm_s(drive, key)
    reference, longest = units.spec.ramp_reference_rpm, drive.parameter(key).raw_limits[1]
    if gentlest is None or longest is None or raw <= longest:
        return raw
    raise OutOfRange(
        f"{drive.name}: {rpm_per_s:g} rpm/s is gentler than this drive can be: its longest ramp "
        f"({key}) takes {longest:g} ms for {reference:g} rpm",
        drive=drive.name,
        parameter=key,
        value=rpm_per_s,
        limit=f"at least {gentlest:g} rpm/s",
        remedy=f"choose {gentlest:g} rpm/s or more, and a low speed to begin with",
    )


async def read_units(drive: Drive) -> AxisUnits:
    """Units of an axis with its present gearing.

    User increments per motor revolution are ``feed/feed_revs * shaft_revs/motor_revs`` where the
    family has a feed constant, else the profile's resolution divided by the gear ratio. A feed
    constant of 0 leaves the resolution unknown (M6-L with P05.05 = 0, 000:1276). Gear ratio and
    feed constant are optional in CiA 402-2 (clause 7, 6091h and 6092h): where the drive says that
    it has no such object, nothing is geared, and without a feed constant the resolution is unknown.

    Raises:
        DriveError: the gear parameters cannot be read.
        NotAllowed: a unit switch of the drive is not where the profile's units hold.
    """
    spec = drive.profile.units
    await _check_unit_switches(drive)
    keys = [
        key
        for key in (spec.gear_numerator, spec.gear_denominator, spec.feed, spec.feed_revolutions)
        if key is not None and not drive.unreachable_why(drive.parameter(key))
    ]
    raw: dict[str, float] = {}
    for key, reading in (await existing(drive, keys)).items():
        value = reading.raw
        if isinstance(value, (int, float)) and (value > 0 or key == spec.feed):
            raw[key] = float(value)

    def of(key: str | None) -> float:
        return raw.get(key or "", 1.0)

    ratio = of(spec.gear_numerator) / of(spec.gear_denominator)
    if spec.feed is not None and spec.feed in raw:
        per_rev: float | None = of(spec.feed) / of(spec.feed_revolutions) or None
    else:
        per_rev = await encoder_counts(drive) or spec.counts_per_rev
    return AxisUnits(spec, None if per_rev is None else per_rev / ratio)


#: Encoders with fewer or more bits than these are a misread parameter.
_ENCODER_BITS = range(10, 33)


async def encoder_counts(drive: Drive) -> int | None:
    """Increments per revolution of the encoder that is connected, where the drive tells them.

    R6L motors come with 17 or 23 bits (002:589), and its gear counts in encoder increments.

    Raises:
        DriveError: the parameter cannot be read.
    """
    gear = drive.profile.functions.gear
    for key in (gear.encoder_bits_key, gear.encoder_counts_key):
        if key is None or drive.unreachable_why(drive.parameter(key)):
            continue
        raw = await drive.raw(key)
        if key == gear.encoder_counts_key:
            return raw or None
        return 1 << raw if raw in _ENCODER_BITS else None
    return None


async def _check_unit_switches(drive: Drive) -> None:
    """Refuse where a parameter gives the motion objects other units than those of the profile.

    Raises:
        NotAllowed: naming the parameter and the value at which the units hold.
    """
    for quirk in drive.profile.quirks:
        if quirk.kind != "unit_switch" or quirk.key is None or quirk.raw is None:
            continue
        parameter = drive.parameter(quirk.key)
        if drive.unreachable_why(parameter):
            continue
        found = (await drive.read(quirk.key)).raw
        if found != quirk.raw:
            raise NotAllowed(
                f"{drive.name}: {parameter.number or parameter.key} {parameter.name} is {found}; "
                f"the units of this tool hold for {quirk.raw}",
                drive=drive.name,
                parameter=parameter.key,
                value=found,
                limit=str(quirk.raw),
                remedy=f"set it back to {quirk.raw}. {quirk.help}",
            )
