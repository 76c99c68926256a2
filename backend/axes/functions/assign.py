"""Settings that can start a motion at once: functions of terminals, control sources, mappings.

A terminal that is assigned "jog" while its input is on starts a jog, while the status word still
shows a disabled axis. Such a setting is therefore written with a grant, and only while the motor
has no power. The shaft is supervised afterwards; where it turns, the setting is restored and the
axis is stopped.
"""

from __future__ import annotations

import asyncio
import time

from backend.axes.axis.axis import Axis
from backend.axes.axis.restoring import CLEANUP_TIMEOUT_S, shielded
from backend.axes.drive.readings import Reading
from backend.axes.drive.terminals import TerminalState, read_terminals
from backend.axes.motion.alternatives import alternative_of
from backend.axes.motion.classes import motion_of
from backend.axes.motion.grant import NotGranted
from drivers.cia402 import State
from drivers.errors import DriveError, NotAllowed
from drivers.texts.message import Text, profile_text, text
from profiles.schema import Parameter, Raw

#: Time for which the shaft is supervised, and polling period [s]; a drive's own jog turns it at
#: once.
_WATCHED_S, _LOOK_S = 0.3, 0.01
#: Movement of a shaft at standstill by encoder noise or a jolt [rev].
_STILL_REV = 0.001
_AT_REST_S = 0.3
_DISABLED = frozenset({State.SWITCH_ON_DISABLED, State.READY, State.NOT_READY, State.FAULT})


async def assign(axis: Axis, key: str, raw: Raw, reason: str = "") -> Reading:
    """Write one such setting, read it back, and check that the shaft does not turn.

    ``reason``: given by the person, for the purpose of the grant.

    Raises:
        NotGranted: it is a command, not a setting; the message states where it belongs.
        NotAllowed: the motor has power, the shaft turns, or it began to turn.
        Busy: something moves the axis.
    """
    drive = axis.drive
    parameter = drive.parameter(key)
    _require_setting(axis, parameter)
    purpose = text(
        "motion.purpose-set-why" if reason else "motion.purpose-set",
        key=parameter.key,
        name=profile_text(drive.profile.drive, parameter.name),
        reason=reason,
    )
    with axis.granted(purpose, keys=frozenset({parameter.key})) as grant:
        await _require_rest(axis, parameter)
        await _require_inputs_off(axis, parameter, raw)
        before = (await drive.read(parameter.key)).raw
        start = await axis.position_raw()
        reading = await drive.energise(parameter.key, raw, grant)
        if not await _turns(axis, start):
            return reading

        left: list[Text] = []

        async def undo() -> None:
            try:
                if before is not None:
                    await drive.energise(parameter.key, before, grant)
            except DriveError as error:
                left.append(error.text)
            await axis.quick_stop()

        await shielded(undo, CLEANUP_TIMEOUT_S, drive.name)
    raise NotAllowed(
        "functions.axis-began-to-turn",
        drive=drive.name,
        parameter=parameter.key,
        value=raw,
        name=profile_text(drive.profile.drive, parameter.name),
        undone=text("functions.could-not-be-restored", cause=left[0])
        if left
        else text("functions.is-again", before=before),
    )


async def _require_inputs_off(axis: Axis, parameter: Parameter, raw: Raw) -> None:
    """Check that an input to be assigned is off, and that one to be inverted has no function.

    This is checked first, as a drive may refuse to remove a function while it is active (M6-L).

    Raises:
        NotAllowed: the function would take effect at once.
    """
    drive = axis.drive
    facts = drive.profile.functions.terminals
    for state in await read_terminals(drive):
        terminal, name = state.terminal, state.terminal.name
        if terminal.direction != "in":
            continue
        if parameter.key == terminal.function_key:
            if raw not in facts.unused_inputs and state.on:
                raise NotAllowed(
                    "functions.new-function-act-once",
                    drive=drive.name,
                    parameter=parameter.key,
                    value=raw,
                    name=name,
                )
        elif _inverts(axis, state, parameter, raw) and state.function not in facts.unused_inputs:
            raise NotAllowed(
                "functions.function-act-once-when",
                drive=drive.name,
                parameter=parameter.key,
                value=raw,
                name=name,
            )


def _inverts(axis: Axis, state: TerminalState, parameter: Parameter, raw: Raw) -> bool:
    """Whether this write changes the polarity of this terminal."""
    drive, name = axis.drive, state.terminal.name
    if parameter.key == state.terminal.polarity_key:
        known = drive.readings.get(parameter.key)
        return known is None or known.raw != raw
    for place in drive.profile.functions.terminals.polarities:
        if place.key == parameter.key and name in place.bits and isinstance(raw, int):
            wanted = bool(raw >> place.bits[name] & 1)
            return state.inverted is None or state.inverted != wanted
    return False


async def _turns(axis: Axis, start: int) -> bool:
    """Whether the shaft leaves the position ``start`` [increments] while it is supervised."""
    units = await axis.units()
    tolerance = max(2, units.position_raw(_STILL_REV))
    deadline = time.monotonic() + _WATCHED_S
    while time.monotonic() < deadline:
        if abs(await axis.position_raw() - start) > tolerance:
            return True
        await asyncio.sleep(_LOOK_S)
    return False


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
        door = alternative_of(profile, parameter)
        error = NotGranted(
            "functions.command-not-setting",
            drive=drive.name,
            parameter=key,
            remedy=text("motion.by-door", how=door.how, route=door.route),
            key=parameter.name,
            how=door.how,
            route=door.route,
        )
        error.page, error.route = door.page, door.route
        raise error


async def _require_rest(axis: Axis, parameter: Parameter) -> None:
    drive = axis.drive
    if await axis.state() in _DISABLED and await axis.standstill(_AT_REST_S):
        return
    raise NotAllowed(
        "functions.set-motor-no-power",
        drive=drive.name,
        parameter=parameter.key,
        key=parameter.name,
    )
