"""Restoring the mode of operation after motions through the cyclic exchange.

The loop writes 6060h with its process data. A drive that keeps the mode of the last measurement
would be enabled in it by whoever enables it next, from its panel or another program.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from backend.axes.axis import loop
from backend.axes.axis.axis import Axis
from backend.axes.axis.cyclic import CyclicSession
from backend.axes.axis.restoring import CLEANUP_TIMEOUT_S, RestoreFailed, shielded
from backend.axes.drive.drive import Drive
from backend.axes.drive.identity import confirm_identity
from drivers.cia402 import Mode, State
from drivers.errors import DriveError, LinkTimeout, NotAllowed
from drivers.texts.message import text

_CYCLIC = (Mode.CSP, Mode.CSV, Mode.CST)
_STANDS_S, _TAKEN_S, _POLL_S = 2.0, 2.0, 0.01


@asynccontextmanager
async def keeping_mode(axis: Axis, session: CyclicSession) -> AsyncIterator[None]:
    """Restore 6060h after motions that choose a mode through the loop.

    Does nothing where an outer context already does so, where the loop does not own the mode, and
    where the drive shows a mode that cannot be written (none, at power-on).

    Raises:
        RestoreFailed: on exit; the mode is then a pending restore.
    """
    drive = axis.drive
    keys = [] if session.power() is None else await axis.restorable_mode()
    if not keys or drive.pending_restores.is_temporary(keys[0]):
        yield
        return
    (key,) = keys
    before = await drive.raw(key)
    with (
        axis.granted(text("motion.purpose-exchange")),
        drive.pending_restores.temporary({key: before}),
    ):
        modes_of_the_loop(drive, session, key)
        try:
            yield
        finally:
            await shielded(
                lambda: _give_back(axis, session, key, before), CLEANUP_TIMEOUT_S, drive.name
            )


def modes_of_the_loop(drive: Drive, session: CyclicSession, key: str) -> None:
    """Record the modes that the loop may leave in ``key``, as it does not write by `Drive`."""
    for mode in (Mode.PV,) if drive.id in session.by_speed else _CYCLIC:
        drive.pending_restores.commanded(key, int(mode))


async def _give_back(axis: Axis, session: CyclicSession, key: str, before: int) -> None:
    drive = axis.drive
    left = {key: before}
    try:
        if await drive.raw(key) != before:
            await _choose(axis, session, key, before)
        left.clear()
    except DriveError as error:
        raise RestoreFailed(
            "axis.not-restored", drive=drive.name, key=key, before=before, cause=error.text
        ) from error
    finally:
        drive.pending_restores.add(left)


async def _choose(axis: Axis, session: CyclicSession, key: str, mode: int) -> None:
    """Write the mode of a disabled axis, through the loop where that owns the mode.

    Raises:
        DriveError: the axis is enabled or turns, does not show the mode, or another drive
            answers here.
    """
    drive, power = axis.drive, session.power()
    # An EP3E may trip over a mode that changes while its motor turns (001:487).
    if await axis.state() is State.OPERATION_ENABLED or not await axis.standstill(_STANDS_S):
        raise NotAllowed("axis.enabled-turns", drive=drive.name)
    if power is None or not session.running:
        # The link may have been lost meanwhile, and another drive may answer now.
        await confirm_identity(drive)
        await drive.energise(key, mode, axis.grant(key))
        return
    await loop.give_back_mode(session, drive, mode, axis.grant(key))
    deadline = time.monotonic() + _TAKEN_S
    while await drive.raw(key) != mode:
        if time.monotonic() > deadline:
            raise LinkTimeout("axis.not-take-mode-back", drive=drive.name)
        await asyncio.sleep(_POLL_S)
