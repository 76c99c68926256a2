"""What the exchange changes on an axis for a measurement comes back: its mode (6060h).

Without a wire, by the product's own loop; each way out of a measurement, and the line lost in it.
"""

from __future__ import annotations

import asyncio
import contextlib

import pytest

from backend.axes.axis.restoring import RestoreFailed
from backend.tools.measuring.recording import enabled
from backend.tools.measuring.restore import settle
from backend.tools.tuning.sweep import profile_speed
from drivers.cia402 import Mode, State
from drivers.errors import NotAllowed
from tests.support.granted import set_mode
from tests.virtual.tools.direct import DirectBench, direct
from tests.virtual.tools.rig import WIDE, mechanics

ONE = mechanics((1e-4, 60.0, 0.006))
MODE = "6060:00"
drives = pytest.mark.parametrize("drive", ["r6l", "ep3e"])


async def measured(b: DirectBench, how: str) -> None:
    """The frame of every measurement, left in one way or another."""
    async with (
        profile_speed.prepared(b.axis, b.session, WIDE, False),
        enabled(b.axis, b.session, Mode.CSV),
    ):
        assert await b.axis.drive.raw(MODE) == Mode.CSV
        assert [(entry.key, entry.raw) for entry in b.axis.drive.pending_restores.outstanding] == [
            (MODE, Mode.HM)
        ], "for the next server, should this one be killed"
        match how:
            case "cancelled":
                raise asyncio.CancelledError
            case "faulted":
                b.link.device.inject("over_temperature")
                while await b.axis.state() is not State.FAULT:  # noqa: ASYNC110 - nothing tells
                    await asyncio.sleep(0.01)
            case "lost":
                b.link.cut = True
                b.link.device.inject("watchdog")


#: How each way out ends for who measures; a fault must not pass for a measurement that went well.
REPORTED = {
    "ended": contextlib.nullcontext(),
    "cancelled": pytest.raises(asyncio.CancelledError),
    "faulted": pytest.raises(NotAllowed, match=r"has a fault( at the end of its motion)? \("),
}


@drives
@pytest.mark.parametrize("how", REPORTED)
async def test_the_mode_is_as_before(drive: str, how: str) -> None:
    async with direct(ONE, drive=drive) as b:
        await set_mode(b.axis, Mode.HM)
        with REPORTED[how]:
            await measured(b, how)
        assert await b.axis.state() is (
            State.FAULT if how == "faulted" else State.SWITCH_ON_DISABLED
        )
        assert await b.axis.drive.raw(MODE) == Mode.HM
        assert not b.axis.drive.pending_restores.outstanding


@drives
async def test_the_mode_of_a_lost_drive_is_pending_to_it(drive: str) -> None:
    async with direct(ONE, drive=drive) as b:
        await set_mode(b.axis, Mode.HM)
        with pytest.raises(RestoreFailed, match=r"6060:00 \(was 6\)"):
            await measured(b, "lost")
        b.link.cut = False
        assert await b.axis.drive.raw(MODE) == Mode.CSV
        found = await settle(b.axis, asked=False)
        assert found == {"back": {MODE: Mode.HM}, "left": {}}
        assert await b.axis.drive.raw(MODE) == Mode.HM
        assert not b.axis.drive.pending_restores
