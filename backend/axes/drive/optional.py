"""Objects that a drive really has, among those that CiA 402-2 makes optional.

The standard profile contains all of them; a drive that lacks one refuses to read it. The result is
not stored but read again where it matters, as a drive that is still starting may refuse an object
that it has.
"""

from __future__ import annotations

from collections.abc import Iterable

from backend.axes.drive.drive import Drive
from backend.axes.drive.readings import Reading
from drivers.errors import NotAllowed, Rejected

#: Abort codes of an object or subindex that the drive does not have (CiA 301 table 22).
ABSENT = frozenset({0x06020000, 0x06090011})

_TORQUE_LIMITS = ("torque_limit_positive", "torque_limit_negative", "max_torque")


async def existing(drive: Drive, keys: Iterable[str | None]) -> dict[str, Reading]:
    """Readings of those ``keys`` that the drive has, in their order; None is skipped.

    Raises:
        DriveError: a key cannot be read for any other reason.
    """
    found: dict[str, Reading] = {}
    for key in keys:
        if key is None:
            continue
        try:
            found[key] = await drive.read(key)
        except Rejected as refusal:
            if refusal.abort_code not in ABSENT:
                raise
    return found


async def torque_limits(drive: Drive) -> list[str]:
    """Keys of the drive's torque limits, which together limit both directions.

    Empty for a profile without any torque limit. 6072h, 60E0h and 60E1h are optional in CiA 402-2:
    the first limits both directions, the others one each.

    Raises:
        NotAllowed: the drive lacks limits that its profile names, so one direction has no limit.
        DriveError: a limit cannot be read.
    """
    named = [key for role in _TORQUE_LIMITS if (key := drive.key(role)) is not None]
    found = await existing(drive, named)
    positive, negative, both = (drive.key(role) in found for role in _TORQUE_LIMITS)
    if not named or both or (positive and negative):
        return list(found)
    missing = [drive.parameter(key) for key in named if key not in found]
    names = ", ".join(f"{parameter.key} {parameter.name}" for parameter in missing)
    raise NotAllowed(
        "drive.drive-not-torque-cannot", drive=drive.name, parameter=missing[0].key, names=names
    )


async def ramp_keys(drive: Drive) -> tuple[str, str]:
    """Keys of profile acceleration and profile deceleration.

    Without 6084h the drive also brakes by 6083h (CiA 402-2, object 6084h), so both keys are the
    same.

    Raises:
        NotAllowed: the drive has no profile acceleration, so its stopping distance is not known.
        DriveError: a ramp cannot be read.
    """
    up, down = drive.require("profile_acceleration"), drive.require("profile_deceleration")
    found = await existing(drive, (up, down))
    if up not in found:
        raise NotAllowed(
            "drive.drive-not-not-known",
            drive=drive.name,
            parameter=up,
            key=drive.parameter(up).name,
        )
    return up, down if down in found else up
