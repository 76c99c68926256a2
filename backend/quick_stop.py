"""How hard a drive brakes on STOP, beside how hard a motion brakes by itself.

Quick stop brakes by 6085h (CiA 402-2 clause 8.4.6), which some makers ship at a sixtieth of what
people move with: an R6L's 131072 inc/s² are 60 rpm/s, so STOP from 300 rpm would take 5 s.
"""

from __future__ import annotations

from collections.abc import Mapping

from backend.drive import Drive
from profiles.schema import Parameter, Raw


def quick_stop_keys(drive: Drive) -> tuple[str, ...]:
    """Key of the quick-stop deceleration, where it can be compared with the profile's."""
    pair = _pair(drive)
    return () if pair is None else (pair[0].key,)


async def raise_quick_stop(drive: Drive, before: Mapping[str, Raw]) -> None:
    """Let STOP brake at least as hard as the motion that is about to begin; lower nothing.

    The caller puts back what `quick_stop_keys` names, to the values in ``before``.
    """
    pair = _pair(drive)
    if pair is None:
        return
    quick, profile = before.get(pair[0].key), (await drive.read(pair[1].key)).raw
    if isinstance(quick, int) and isinstance(profile, int) and quick < profile:
        highest = pair[0].raw_limits[1]
        await drive.write(pair[0].key, profile if highest is None else int(min(profile, highest)))


def _pair(drive: Drive) -> tuple[Parameter, Parameter] | None:
    keys = drive.key("quick_stop_deceleration"), drive.key("profile_deceleration")
    if keys[0] is None or keys[1] is None:
        return None
    quick, profile = drive.parameter(keys[0]), drive.parameter(keys[1])
    alike = (quick.unit, quick.scale, quick.offset) == (profile.unit, profile.scale, profile.offset)
    acts = quick.access == "rw" and (quick.effective, quick.settable) == ("now", "any")
    return (quick, profile) if alike and acts else None
