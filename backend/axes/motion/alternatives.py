"""Page and route through which an object is written that a parameter table must not write."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from backend.axes.motion.grant import NotGranted
from drivers.texts.message import Text, profile_text, text
from profiles.schema import Parameter, Profile

Page = Literal["", "motion", "io", "parameters"]

_DRIVE = "/api/v1/drives/{drive_id}"


@dataclass(frozen=True, slots=True)
class Alternative:
    """Page and route for one object. ``page`` is the page's name, empty where only a script can do
    it with ``route``; ``how`` is the instruction for that page."""

    page: Page
    route: str
    how: Text


_POWER = Alternative(
    "motion",
    f"POST {_DRIVE}/transition",
    text("motion.door-power"),
)
_MOVE = Alternative(
    "motion",
    f"POST {_DRIVE}/jobs/move",
    text("motion.door-move"),
)
_FORCE = Alternative("io", f"POST {_DRIVE}/io/forcing/{{name}}", text("motion.door-force"))
_ASSIGN = Alternative(
    "io",
    f"PUT {_DRIVE}/motion-settings/{{key}}",
    text("motion.door-assign"),
)
_SET = Alternative(
    "",
    f"PUT {_DRIVE}/motion-settings/{{key}}",
    text("motion.door-set"),
)
#: Roles that change the power state; every other role that energises the motor is a setpoint.
_POWER_ROLES = frozenset({"control_word", "mode"})


def alternative_of(profile: Profile, parameter: Parameter) -> Alternative:
    """Return the page and route for writing this object, which can put energy into the motor."""
    key = parameter.key
    for signal in profile.signals:
        if signal.key == key:
            return _POWER if signal.role in _POWER_ROLES else _MOVE
    if any(key in (each.function_key, each.polarity_key) for each in profile.terminals):
        return _ASSIGN
    if any(key == place.key for place in profile.functions.terminals.polarities):
        return _ASSIGN
    for forcing in profile.functions.terminals.forcing:
        if key in {place.key for place in (forcing.enable, forcing.value) if place is not None}:
            return _FORCE
    for procedure in profile.procedures:
        if any(step.do == "write" and step.key == key for step in procedure.steps):
            return Alternative(
                "parameters",
                f"POST {_DRIVE}/procedures/{procedure.name}",
                text("motion.door-procedure", title=profile_text(profile.drive, procedure.title)),
            )
    return _SET


def refused(drive: str, profile: Profile, parameter: Parameter) -> NotGranted:
    """Return the error for a write of this object without a grant, naming the page and route."""
    door = alternative_of(profile, parameter)
    error = NotGranted(
        "motion.put-energy-motor-not",
        drive=drive,
        parameter=parameter.key,
        remedy=text("motion.by-door", how=door.how, route=door.route),
        key=parameter.name,
        how=door.how,
        route=door.route,
    )
    error.page, error.route = door.page, door.route
    return error
