"""What writing an object can do to a motor, as the profile says it."""

from __future__ import annotations

from typing import Literal

from profiles.schema import Parameter

MotionClass = Literal["none", "at_enable", "energises"]


def motion_of(parameter: Parameter) -> MotionClass:
    """The motion class. What can be written and has none is treated as the worst."""
    if parameter.access == "ro":
        return "none"
    return parameter.motion or "energises"


def held_still(parameter: Parameter) -> bool:
    """Whether it is written only while the motor has no power and nothing moves the axis."""
    return motion_of(parameter) == "at_enable" and not parameter.safe_in_motion
