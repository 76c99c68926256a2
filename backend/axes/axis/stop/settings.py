"""How a drive brakes on a quick stop and on halt: 605Ah, 605Dh and the ramps in force.

CiA 402-2 objects 605Ah and 605Dh: 0 switches off the power (605Ah) or the drive function (605Dh)
so that the axis coasts; 1 and 5 use 6084h; 2 and 6 use 6085h; 3, 4, 7 and 8 use the limits of
current and voltage.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from backend.axes.drive.drive import Drive
from backend.axes.drive.readings import Reading
from backend.axes.scales.units import AxisUnits

OPTION, HALT_OPTION = "605A:00", "605D:00"
COAST = 0
#: Options that brake, in order of preference; first 2: brake by 6085h, then Switch on disabled.
_BRAKING = (2, 6, 1, 5, 3, 4, 7, 8)
_SLOW, _QUICK = (1, 5), (2, 6)


@dataclass(frozen=True, slots=True)
class StopSettings:
    """Stop settings as read last; None for an object that the drive lacks or does not report.

    ``slow``: raw 6084h; ``quick``: raw 6085h.
    """

    option: int | None = None
    halt_option: int | None = None
    slow: int | None = None
    quick: int | None = None

    @property
    def coasts(self) -> bool:
        """Whether a quick stop switches the power off instead of braking."""
        return self.option == COAST

    @property
    def halt_brakes(self) -> bool:
        """Whether halt (bit 8 of the control word) brakes; assumed where 605Dh is not known."""
        return self.halt_option != COAST

    def ramp_raw(self) -> int | None:
        """Raw deceleration that a stop uses; None where no ramp applies.

        Where a quick stop would coast, this is the ramp of halt.
        """
        if self.coasts:
            return self.slow if self.halt_option in (None, 1) else self.quick
        if self.option in _SLOW:
            return self.slow
        if self.option is None or self.option in _QUICK:
            return self.quick if self.quick is not None else self.slow
        return None


def settings_keys(drive: Drive) -> list[str]:
    """Keys that `settings_of` evaluates, as far as a connected port carries them."""
    named = [OPTION, HALT_OPTION, *_ramps(drive)]
    return [
        key
        for key in named
        if key is not None
        and (parameter := drive.profile.by_key.get(key)) is not None
        and parameter.access != "wo"
        and not drive.unreachable_why(parameter)
    ]


def settings_of(drive: Drive, readings: Mapping[str, Reading]) -> StopSettings:
    """The settings among these readings."""

    def raw(key: str | None) -> int | None:
        reading = readings.get(key or "")
        value = None if reading is None else reading.raw
        return value if isinstance(value, int) else None

    slow, quick = _ramps(drive)
    return StopSettings(raw(OPTION), raw(HALT_OPTION), raw(slow), raw(quick))


def known_settings(drive: Drive) -> StopSettings:
    """The stop settings from the last readings, without a request to the drive."""
    return settings_of(drive, drive.readings)


def braking_option(drive: Drive) -> int | None:
    """A value of 605Ah that brakes and that the drive supports; None where there is none."""
    parameter = drive.profile.by_key.get(OPTION)
    if parameter is None or parameter.access != "rw":
        return None
    if not parameter.enum:
        return _BRAKING[0]
    return next((option for option in _BRAKING if option in parameter.enum), None)


def deceleration_rpm_s(units: AxisUnits, raw: int | None) -> float | None:
    """A raw deceleration in rpm/s; None where its unit is not known."""
    if raw is None or raw <= 0:
        return None
    spec = units.spec
    if spec.acceleration.startswith("ms"):
        reference = spec.ramp_reference_rpm
        return None if reference is None else 1000.0 * reference / raw
    if spec.acceleration.startswith("inc/s"):
        return None if units.counts_per_rev is None else raw / units.counts_per_rev * 60.0
    return float(raw) if spec.acceleration.startswith("rpm") else None


def _ramps(drive: Drive) -> tuple[str | None, str | None]:
    return drive.key("profile_deceleration"), drive.key("quick_stop_deceleration")
