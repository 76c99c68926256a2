"""Deceleration of STOP, raised to at least that of the motion itself.

Quick stop brakes by 6085h (CiA 402-2 clause 8.4.6), whose default is with some makers a sixtieth
of usual decelerations: an R6L's 131072 inc/s² are 60 rpm/s, so STOP from 300 rpm would take 5 s.
"""

from __future__ import annotations

from collections.abc import Mapping

from backend.axes.axis.stop.settings import COAST, OPTION, braking_option
from backend.axes.drive.drive import Drive
from backend.axes.drive.optional import existing
from backend.axes.scales.units import AxisUnits
from profiles.schema import Parameter, Raw

#: Time from any permitted speed to standstill [s], as `drivers.motion.playback` ramps down.
STOP_S = 0.1


def quick_stop_keys(drive: Drive) -> tuple[str, ...]:
    """Keys that `raise_quick_stop` may change.

    These are the option code (605Ah), and the quick stop deceleration where it can be compared with
    the profile deceleration.
    """
    pair = _pair(drive)
    option = drive.profile.by_key.get(OPTION)
    keys = () if pair is None else (pair[0].key,)
    if option is None or option.access != "rw" or drive.unreachable_why(option):
        return keys
    return (*keys, OPTION)


async def raise_quick_stop(drive: Drive, before: Mapping[str, Raw]) -> None:
    """Make STOP brake at least as hard as the motion that is about to begin; lower no value.

    An option code with which a quick stop coasts is changed to one that brakes. The caller restores
    the keys of `quick_stop_keys` to the values in ``before``.
    """
    await _let_it_brake(drive, before)
    pair = _pair(drive)
    if pair is None:
        return
    quick = before.get(pair[0].key)
    # Without 6084h a drive brakes by 6083h (CiA 402-2, object 6084h).
    ramps = await existing(drive, (pair[1].key, drive.key("profile_acceleration")))
    profile = next((reading.raw for reading in ramps.values()), None)
    if isinstance(quick, int) and isinstance(profile, int) and quick < profile:
        await _write(drive, pair[0], profile)


async def raise_quick_stop_from(
    drive: Drive, units: AxisUnits, speed_rpm: float, before: Mapping[str, Raw]
) -> None:
    """Make a quick stop end a motion of this speed within `STOP_S`; lower no value.

    Quick stop is the only means of braking an axis without a cyclic loop: an axis that leaves its
    envelope at 1500 rpm would continue for 25 s and 310 revolutions with the default of an R6L,
    60 rpm/s. The caller restores the keys of `quick_stop_keys` to the values in ``before``.
    """
    await _let_it_brake(drive, before)
    pair = _pair(drive)
    if pair is None or pair[0].unit != units.spec.acceleration:
        return
    if not units.scales.acceleration.certain:
        # The effect of a larger number is not known; the drive's own ramp stays.
        return
    quick, needed = before.get(pair[0].key), units.acceleration_raw(speed_rpm / STOP_S)
    if isinstance(quick, int) and quick < needed:
        await _write(drive, pair[0], needed)


async def _let_it_brake(drive: Drive, before: Mapping[str, Raw]) -> None:
    """Replace 605Ah = 0 (power off, the axis coasts) by an option that brakes."""
    option = braking_option(drive)
    if before.get(OPTION) == COAST and option is not None:
        await drive.write(OPTION, option)


async def _write(drive: Drive, quick: Parameter, raw: int) -> None:
    highest = quick.raw_limits[1]
    await drive.write(quick.key, raw if highest is None else int(min(raw, highest)))


def _pair(drive: Drive) -> tuple[Parameter, Parameter] | None:
    keys = drive.key("quick_stop_deceleration"), drive.key("profile_deceleration")
    if keys[0] is None or keys[1] is None:
        return None
    quick, profile = drive.parameter(keys[0]), drive.parameter(keys[1])
    alike = (quick.unit, quick.scale, quick.offset) == (profile.unit, profile.scale, profile.offset)
    acts = quick.access == "rw" and (quick.effective, quick.settable) == ("now", "any")
    return (quick, profile) if alike and acts else None
