"""Motion class of an object: the effect that writing it can have on a motor, from the profile."""

from __future__ import annotations

from typing import Literal

from profiles.schema import Parameter

MotionClass = Literal["none", "at_enable", "energises"]


def motion_of(parameter: Parameter) -> MotionClass:
    """Return the motion class. A writable object without one counts as ``energises``, the worst."""
    if parameter.access == "ro":
        return "none"
    return parameter.motion or "energises"


def held_still(parameter: Parameter) -> bool:
    """Whether the object may be written only without motor power and with nothing
    moving the axis.
    """
    return motion_of(parameter) == "at_enable" and not parameter.safe_in_motion
