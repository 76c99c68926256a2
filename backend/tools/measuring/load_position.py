"""The position of a second encoder, where the drive has one."""

from __future__ import annotations

from backend.axes.axis.axis import Axis
from backend.axes.axis.cyclic import CyclicSession
from backend.axes.drive.optional import existing
from drivers.errors import NotAllowed


async def load_position(axis: Axis, session: CyclicSession) -> str:
    """Key of the second encoder's position, which must come with every cycle.

    Raises:
        NotAllowed: the drive has none, or it is not in the process data.
    """
    drive = axis.drive
    key = drive.key("load_position")
    if key is None or key not in await existing(drive, (key,)):
        raise NotAllowed("load-side.no-second-position", drive=drive.name)
    if not session.carries(drive, key):
        raise NotAllowed(
            "measuring.not-part-cyclic-data",
            drive=drive.name,
            parameter=key,
            replace="load position",
        )
    return key


async def recorded_load_position(axis: Axis, session: CyclicSession) -> tuple[str, ...]:
    """Its key where there is one to record with every cycle; empty where there is none."""
    key = axis.drive.key("load_position")
    if key is None or not session.carries(axis.drive, key):
        return ()
    return (key,) if key in await existing(axis.drive, (key,)) else ()
