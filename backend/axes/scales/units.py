"""Conversion of motion quantities of one axis: raw drive units to rev, rpm, rpm/s and per cent.

Sources: CiA 402-2 clause 7 (position factor: encoder resolution, gear ratio, feed constant) and
each profile's ``units``, with its reference to the manual.
"""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass, replace

from backend.axes.drive.drive import Drive
from backend.axes.drive.optional import existing
from backend.axes.scales.resolve import by_text, origin_of, read_reported, scales_of
from backend.axes.scales.scale import Origin, Quantity, Scale, Scales, ScaleUnknown, Uncertainty
from backend.axes.scales.taught import Taught
from drivers.errors import NotAllowed, OutOfRange
from drivers.objects.feedback import FeedbackScale
from drivers.texts import limits
from profiles.schema import Parameter, UnitSpec

#: Raw units per 1 % of rated torque.
_RAW_PER_PERCENT = {"‰ rated": 10.0, "0.1 %": 10.0, "% rated": 1.0, "0.01 %": 100.0}
#: A difference between 606Ch and the speed from positions below this is rounding of a coarse 606Ch.
_IGNORED_RPM = 30.0
_RAW = "raw"


@dataclass(frozen=True, slots=True)
class AxisUnits:
    """Scales of one axis. ``counts_per_rev`` is None where the resolution is unknown.

    A raw value can always be shown: without a certain scale it is shown unconverted, in its raw
    unit. The conversion from engineering units to raw raises `ScaleUnknown` in that case, so that
    no tool can move by an unknown unit.
    """

    spec: UnitSpec
    counts_per_rev: float | None
    stated: Scales | None = None
    """Scales as resolved for the drive; None: as stated by the units of the profile."""
    drive: str = "the drive"

    @property
    def scales(self) -> Scales:
        """The three scales with their origins."""
        if self.stated is not None:
            return self.stated
        per_rev, spec = self.counts_per_rev, self.spec
        origin = origin_of(spec, Quantity.POSITION)
        position = Scale(
            Quantity.POSITION,
            per_rev,
            spec.position,
            origin,
            spec.source,
            Uncertainty.NO_RESOLUTION if per_rev is None else None,
        )
        velocity, acceleration = (
            by_text(quantity, text, per_rev, Origin.MANUAL, spec)
            for quantity, text in (
                (Quantity.VELOCITY, spec.velocity),
                (Quantity.ACCELERATION, spec.acceleration),
            )
        )
        return Scales(position, velocity, acceleration)

    @property
    def names(self) -> dict[str, str]:
        """Unit shown for each quantity."""
        scales, turns = self.scales, self.counts_per_rev is not None
        position = "rev" if turns else scales.position.raw_unit or _RAW
        fast, rising = scales.velocity, scales.acceleration
        return {
            "position": position,
            "velocity": "rpm" if fast.certain else fast.raw_unit or _RAW,
            "acceleration": "rpm/s" if rising.certain else rising.raw_unit or _RAW,
            "torque": "%",
            "following_error": position,
            "dc_voltage": "V",
            "temperature": "°C",
        }

    def _raw_per(self, scale: Scale) -> float:
        """Raw values per unit; raises ScaleUnknown where the scale is not certain."""
        if scale.raw_per_unit is None:
            raise ScaleUnknown(self.drive, scale)
        return scale.raw_per_unit

    @property
    def _per_rev(self) -> float:
        if self.counts_per_rev is None:
            scale = self.scales.position
            if scale.certain:
                scale = Scale(
                    Quantity.POSITION,
                    None,
                    scale.raw_unit,
                    Origin.UNKNOWN,
                    uncertainty=Uncertainty.NO_RESOLUTION,
                )
            raise ScaleUnknown(self.drive, scale)
        return self.counts_per_rev

    def require_certain(self) -> None:
        """Check that the scales of position and speed are certain, so that an envelope holds.

        Raises:
            ScaleUnknown: one is not certain; the error contains a remedy.
        """
        self._per_rev  # noqa: B018 - raises
        self._raw_per(self.scales.velocity)

    def position(self, raw: float) -> float:
        """Increments to revolutions; without a certain scale the increments themselves."""
        return raw / (self.counts_per_rev or 1.0)

    def position_raw(self, revolutions: float) -> int:
        """Revolutions to increments.

        Raises:
            ScaleUnknown: increments per revolution are not certain.
        """
        return round(revolutions * self._per_rev)

    def velocity(self, raw: float) -> float:
        """Raw speed to rpm; without a certain scale the raw speed itself."""
        return raw / (self.scales.velocity.raw_per_unit or 1.0)

    def velocity_raw(self, rpm: float) -> int:
        """Rpm to raw speed.

        Raises:
            ScaleUnknown: the unit of speeds is not certain.
        """
        return round(rpm * self._raw_per(self.scales.velocity))

    def velocity_raw_of(self, parameter: Parameter, rpm: float) -> int:
        """Rpm to the raw speed of an object whose own unit may differ from that of 60FFh.

        6099h of the M6-L is in rpm, while its velocities are in increments per second (000:2167).
        """
        if parameter.unit == "rpm":
            return round(parameter.to_raw(rpm))
        return self.velocity_raw(rpm)

    @property
    def ramps_are_times(self) -> bool:
        """Whether ramps are times to a reference speed; a larger number is a gentler ramp then."""
        return self.spec.acceleration.startswith("ms")

    def acceleration_raw(self, rpm_per_s: float) -> int:
        """Rpm/s to the raw ramp: a rate, or a time in ms for families whose ramps are times.

        Raises:
            ScaleUnknown: the unit of ramps is not certain.
        """
        per = self._raw_per(self.scales.acceleration)
        reference = self.spec.ramp_reference_rpm
        if self.ramps_are_times and reference is not None:
            return max(1, round(1000.0 * reference / rpm_per_s))
        return max(1, round(rpm_per_s * per))

    def torque(self, raw: float) -> float:
        """Raw torque to % of rated."""
        return raw / _RAW_PER_PERCENT.get(self.spec.torque, 10.0)

    def torque_raw(self, percent: float) -> int:
        """% of rated to raw torque."""
        return round(percent * _RAW_PER_PERCENT.get(self.spec.torque, 10.0))

    @property
    def feedback(self) -> FeedbackScale | None:
        """Relation between 606Ch and 6064h; None where a scale is not certain."""
        per_rpm = self.scales.velocity.raw_per_unit
        if per_rpm is None or self.counts_per_rev is None:
            return None
        return FeedbackScale(60.0 * per_rpm / self.counts_per_rev, _IGNORED_RPM * abs(per_rpm))

    def rest_tolerance(self) -> int:
        """Movement that still counts as standstill [increments]: 0.0005 rev, but at least 2."""
        return max(2, round(0.0005 * (self.counts_per_rev or 0.0)))


def gentlest_ramp_rpm_s(drive: Drive, key: str) -> float | None:
    """Gentlest ramp of a drive whose ramps are times [rpm/s]; None where it has no bound."""
    spec = drive.profile.units
    reference, longest = spec.ramp_reference_rpm, drive.parameter(key).raw_limits[1]
    if reference is None or not spec.acceleration.startswith("ms") or not longest:
        return None
    return 1000.0 * reference / longest


def ramp_raw(units: AxisUnits, drive: Drive, key: str, rpm_per_s: float) -> int:
    """The raw ramp of this parameter for a value in rpm/s.

    Raises:
        OutOfRange: gentler than the longest ramp time of the drive; reported in rpm/s, the unit
            that was entered.
    """
    raw = units.acceleration_raw(rpm_per_s)
    gentlest = gentlest_ramp_rpm_s(drive, key)
    reference, longest = units.spec.ramp_reference_rpm, drive.parameter(key).raw_limits[1]
    if gentlest is None or longest is None or raw <= longest:
        return raw
    raise OutOfRange(
        "scales.rpm-gentler-drive-longest",
        drive=drive.name,
        parameter=key,
        value=rpm_per_s,
        limit=limits.at_least(gentlest, "rpm/s"),
        longest_ms=longest,
        reference_rpm=reference,
        gentlest=gentlest,
    )


async def read_units(
    drive: Drive, taught: Taught | None = None, absent: Container[str] = ()
) -> AxisUnits:
    """Units of an axis with its present gearing and the ``taught`` scales.

    User increments per motor revolution are ``feed/feed_revs * shaft_revs/motor_revs`` where the
    family has a feed constant. Otherwise they are the resolution of the encoder (608Fh or the
    family's own object) or of the profile, divided by the gear ratio. A feed constant of 0 leaves
    the resolution unknown (M6-L with P05.05 = 0, 000:1276). Gear ratio, feed constant and
    resolution are optional in CiA 402-2 (clause 7): a drive without a gear object has the ratio 1;
    without feed constant and resolution the scale is unknown. Units are those of 60A8h to 60AAh
    where the drive has them. Objects known to be ``absent`` are not read.

    Raises:
        DriveError: the objects cannot be read.
        NotAllowed: a unit switch of the drive is not at the value for which the profile's units
            hold.
    """
    await _check_unit_switches(drive)
    reported = await read_reported(drive, absent)
    if drive.profile.units.feed not in reported.raws:
        reported = replace(reported, encoder=await encoder_counts(drive))
    scales = scales_of(drive.profile.units, reported, taught)
    return AxisUnits(drive.profile.units, scales.position.raw_per_unit, scales, drive.name)


#: Plausible numbers of encoder bits; any other is taken as a misread parameter.
_ENCODER_BITS = range(10, 33)


async def encoder_counts(drive: Drive) -> int | None:
    """Increments per revolution of the connected encoder; None where they are not reported.

    R6L motors have 17 or 23 bits (002:589), and the R6L's gear counts in encoder increments. For a
    family without a parameter of its own, 608Fh is read where the drive has it.

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
    counts, turns = (drive.profile.by_key.get(key) for key in ("608F:01", "608F:02"))
    if counts is None or drive.unreachable_why(counts):
        return None
    found = await existing(drive, [p.key for p in (counts, turns) if p is not None])
    raws = [reading.raw for reading in found.values() if isinstance(reading.raw, int)]
    return None if not raws or not all(raws) else round(raws[0] / (raws[1] if raws[1:] else 1))


async def _check_unit_switches(drive: Drive) -> None:
    """Check that no unit switch of the drive gives motion objects units other than the profile's.

    Raises:
        NotAllowed: one does; the message names the parameter and the value for the profile's units.
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
                "scales.units-tool-hold",
                drive=drive.name,
                parameter=parameter.key,
                value=found,
                limit=str(quirk.raw),
                parameter_number=parameter.number or parameter.key,
                key=parameter.name,
                raw=quirk.raw,
                help=quirk.help,
            )
