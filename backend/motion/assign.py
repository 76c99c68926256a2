"""Settings that can start a motion at once: functions of terminals, control sources, mappings.

A terminal that is given "jog" while its input is on begins to jog, with a status word that says
"disabled". So such a setting is written with a grant, only while the motor has no power; the
shaft is watched afterwards, and where it turns the setting is put back and the axis is stopped.
"""

from __future__ import annotations

from backend.axis import Axis
from backend.motion.classes import motion_of
from backend.motion.doors import door_of
from backend.motion.grant import NotGranted
from backend.readings import Reading
from backend.restoring import CLEANUP_TIMEOUT_S, shielded
from drivers.cia402 import State
from drivers.errors import NotAllowed
from profiles.schema import Parameter, Raw

#: For so long the shaft is watched; a drive's own jog turns it at once.
_WATCHED_S = 0.3
_DISABLED = frozenset({State.SWITCH_ON_DISABLED, State.READY, State.NOT_READY, State.FAULT})


async def assign(axis: Axis, key: str, raw: Raw) -> Reading:
    """Write one such setting, read it back, and make sure that nothing turns.

    Raises:
        NotGranted: it is a command, not a setting; the error says where it belongs.
        NotAllowed: the motor has power, the shaft turns, or it began to turn.
        Busy: something moves the axis.
    """
    drive = axis.drive
    parameter = drive.parameter(key)
    _require_setting(axis, parameter)
    with axis.granted(
        f"set {parameter.key} {parameter.name}", keys=frozenset({parameter.key})
    ) as grant:
        await _require_rest(axis, parameter)
        before = (await drive.read(parameter.key)).raw
        reading = await drive.energise(parameter.key, raw, grant)
        if await axis.standstill(_WATCHED_S):
            return reading

        async def undo() -> None:
            if before is not None:
                await drive.energise(parameter.key, before, grant)
            await axis.quick_stop()

        await shielded(undo, CLEANUP_TIMEOUT_S, drive.name)
    raise NotAllowed(
        f"{drive.name}: the axis began to turn with {parameter.key} {parameter.name} = {raw}: "
        f"it is {before} again, and the axis was stopped",
        drive=drive.name,
        parameter=parameter.key,
        value=raw,
        remedy="switch the inputs off that jog, home or enable, then try again",
    )


def _require_setting(axis: Axis, parameter: Parameter) -> None:
    drive = axis.drive
    profile, key = drive.profile, parameter.key
    commanded = {signal.key for signal in profile.signals if motion_of(parameter) == "energises"}
    forced = {
        place.key
        for forcing in profile.functions.terminals.forcing
        for place in (forcing.enable, forcing.value)
        if place is not None
    }
    run = {s.key for p in profile.procedures for s in p.steps if s.do == "write"}
    if key in commanded | forced | run:
        door = door_of(profile, parameter)
        error = NotGranted(
            f"{drive.name}: {key} {parameter.name} is a command, not a setting",
            drive=drive.name,
            parameter=key,
            remedy=f"{door.how} ({door.route})",
        )
        error.page, error.route = door.page, door.route
        raise error


async def _require_rest(axis: Axis, parameter: Parameter) -> None:
    drive = axis.drive
    if await axis.state() in _DISABLED and await axis.standstill(_WATCHED_S):
        return
    raise NotAllowed(
        f"{drive.name}: {parameter.key} {parameter.name} is set only while the motor has no "
        "power and the axis stands",
        drive=drive.name,
        parameter=parameter.key,
        remedy="disable the axis first",
    )
