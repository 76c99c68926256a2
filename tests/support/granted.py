"""Settings of a virtual bench that a person makes with the right to move: written with a grant."""

from __future__ import annotations

from collections.abc import Mapping

from backend.axes.axis.axis import Axis
from backend.axes.motion.classes import motion_of
from drivers.cia402 import Mode


async def set_up(axis: Axis, settings: Mapping[str, int]) -> None:
    """Write raw values, those that can put energy into the motor included."""
    drive = axis.drive
    with axis.granted("the bench of a test") as grant:
        for key, raw in settings.items():
            if motion_of(drive.parameter(key)) == "energises":
                await drive.energise(key, raw, grant)
            else:
                await drive.write(key, raw)


async def set_mode(axis: Axis, mode: Mode) -> None:
    """Choose a mode of operation, as a transition does."""
    with axis.granted("the bench of a test"):
        await axis.set_mode(mode)
