"""Where that can be done which a parameter table may not do: the page, and the route."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from backend.motion.grant import NotGranted
from profiles.schema import Parameter, Profile

Page = Literal["", "motion", "io", "parameters"]

_DRIVE = "/api/v1/drives/{drive_id}"


@dataclass(frozen=True, slots=True)
class Door:
    """``page`` is the page's name, empty where only a script can do it with ``route``; ``how`` says
    what to do there."""

    page: Page
    route: str
    how: str


_POWER = Door(
    "motion",
    f"POST {_DRIVE}/transition",
    "enable the axis and choose its mode on the Motion page",
)
_MOVE = Door(
    "motion",
    f"POST {_DRIVE}/jobs/move",
    "move the axis on the Motion page, which sets limits and a dead-man",
)
_FORCE = Door("io", f"POST {_DRIVE}/io/forcing/{{name}}", "overrule terminals on the I/O page")
_ASSIGN = Door(
    "io",
    f"PUT {_DRIVE}/motion-settings/{{key}}",
    "choose what a terminal does on the I/O page, with the axis disabled",
)
_SET = Door(
    "",
    f"PUT {_DRIVE}/motion-settings/{{key}}",
    "somebody with the right to move sets it, with the axis disabled",
)
#: Roles that are the power state; every other role that energises is a set-point.
_POWER_ROLES = frozenset({"control_word", "mode"})


def door_of(profile: Profile, parameter: Parameter) -> Door:
    """Where this object, which can put energy into the motor, is written in order."""
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
            return Door(
                "parameters",
                f"POST {_DRIVE}/procedures/{procedure.name}",
                f"run the procedure “{procedure.title}”",
            )
    return _SET


def refused(drive: str, profile: Profile, parameter: Parameter) -> NotGranted:
    """The refusal to write this object without a grant, with where it can be done."""
    door = door_of(profile, parameter)
    error = NotGranted(
        "motion.put-energy-motor-not",
        drive=drive,
        parameter=parameter.key,
        remedy=f"{door.how} ({door.route})",
        key=parameter.name,
        how=door.how,
        route=door.route,
    )
    error.page, error.route = door.page, door.route
    return error
