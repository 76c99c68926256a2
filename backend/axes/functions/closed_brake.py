"""Keeping a holding brake closed while its axis is enabled, as the family's manual permits."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Literal

from backend.axes.axis.axis import Axis
from backend.axes.drive.drive import Drive
from drivers.cia402 import State
from drivers.errors import NotAllowed
from profiles.functions import Forcing
from profiles.schema import IoTerminal

#: Why the outputs of a drive cannot keep its brake closed.
Obstacle = Literal[
    "means_unknown",
    "built_in",
    "fixed_output",
    "bus_bit",
    "no_output",
    "output_inverted",
    "output_forced",
]


async def obstacle_of(drive: Drive) -> Obstacle | None:
    """Why this drive would or might release its brake; None where its outputs can be used."""
    means = drive.profile.functions.brake_test
    if means is None:
        return "means_unknown"
    if means.output_function is None:
        return means.obstacle
    outputs = await _brake_outputs(drive)
    if not outputs:
        return "no_output"
    for terminal in outputs:
        if await _inverted(drive, terminal.name):
            return "output_inverted"
        if await _forced(drive, terminal.name):
            return "output_forced"
    return None


@asynccontextmanager
async def kept_closed(axis: Axis) -> AsyncIterator[None]:
    """Context in which no output has the brake's function, so that its coil has no current.

    The calling work holds the grant of the axis. On exit the functions are restored.

    Raises:
        NotAllowed: the axis is enabled.
        RestoreFailed: on exit; the message names what could not be restored.
    """
    drive = axis.drive
    means = drive.profile.functions.brake_test
    assert means is not None, "asked before"
    assert means.output_function is not None, "asked before"
    if await axis.state() is State.OPERATION_ENABLED:
        raise NotAllowed("brake.enabled-already", drive=drive.name)
    keys = [each.function_key for each in await _brake_outputs(drive) if each.function_key]
    async with axis.restoring(*keys):
        for key in keys:
            await drive.energise(key, means.output_function, axis.grant(key))
        yield


def forcing_keys(drive: Drive) -> frozenset[str]:
    """Keys of objects by which somebody could switch on an output meanwhile."""
    return frozenset(
        place.key
        for forcing in _forcings(drive)
        for place in (forcing.enable, forcing.value)
        if place is not None
    )


def _forcings(drive: Drive) -> list[Forcing]:
    facts = drive.profile.functions.terminals
    return [each for each in facts.forcing if each.name == "outputs"]


async def _brake_outputs(drive: Drive) -> list[IoTerminal]:
    codes = drive.profile.functions.terminals.brake_functions
    found = []
    for terminal in drive.profile.terminals:
        if terminal.direction != "out" or terminal.function_key is None:
            continue
        if await drive.raw(terminal.function_key) in codes:
            found.append(terminal)
    return found


async def _inverted(drive: Drive, name: str) -> bool:
    """Whether an output is inverted: it would be on without its function and release the brake."""
    for place in drive.profile.functions.terminals.polarities:
        if name in place.bits and await drive.raw(place.key) >> place.bits[name] & 1:
            return True
    return False


async def _forced(drive: Drive, name: str) -> bool:
    """Whether the bus forces the output, so that it would be on as soon as its function permits."""
    for forcing in _forcings(drive):
        for place in (forcing.enable, forcing.value):
            if place is None or name not in place.bits:
                continue
            if await drive.raw(place.key) >> place.bits[name] & 1:
                return True
    return False
