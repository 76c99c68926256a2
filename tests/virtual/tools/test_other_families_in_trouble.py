"""R6L and EP3E (EtherCAT) and DS_C (CANopen) in trouble: every way out of a measurement.

As `test_wrong_situations` has it for MMS7 and M6-L, within the frame that the API and the command
line put around a measurement, so that the mode of operation is looked at as well.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass

import pytest

from backend.axes.axis.axis import Axis
from backend.axes.axis.cyclic import CyclicSession
from backend.foundation.work.jobs import Progress
from backend.tools.measuring.interrupted import Interrupted
from backend.tools.measuring.restore import settle
from backend.tools.mechanics.inertia.evaluation import InertiaSettings
from backend.tools.mechanics.inertia.run import inertia
from backend.tools.tuning.sweep import profile_speed
from backend.tools.tuning.sweep.evaluation import SweepSettings
from backend.tools.tuning.sweep.run import sweep
from drivers.cia402 import State
from drivers.errors import DriveError
from drivers.virtual.device import Device
from tests.virtual.tools.can_rig import LockstepBus, can_bench, incremental
from tests.virtual.tools.direct import DirectLink, direct
from tests.virtual.tools.rig import WIDE, At, mechanics, settings_of

ONE = mechanics((1e-4, 60.0, 0.006))
MODE = "6060:00"
RATED_NM = 1.27


@dataclass(frozen=True)
class Under:
    """A drive that is measured."""

    axis: Axis
    session: CyclicSession
    device: Device
    line: DirectLink | LockstepBus

    def pull(self) -> None:
        """The cable; a drive with a watchdog is disabled by it."""
        self.line.cut = True
        if not self.session.unwatched(self.axis.drive):
            self.device.inject("watchdog")

    async def measure(self, tool: str, progress: Progress) -> None:
        """As a job or the command line does it."""
        axis, session = self.axis, self.session
        async with profile_speed.prepared(axis, session, WIDE, True):
            if tool == "inertia":
                settings = InertiaSettings(WIDE, rated_torque_nm=RATED_NM)
                await inertia(axis, session, settings, progress)
            else:
                one = SweepSettings(WIDE, realisations=1, rated_torque_nm=RATED_NM)
                await sweep(axis, session, one, progress)


@asynccontextmanager
async def under(drive: str) -> AsyncIterator[Under]:
    if drive == "ds_c":
        async with can_bench(incremental(ONE), pace=40.0) as b:
            yield Under(b.axis, b.session, b.bus.node.device, b.bus)
    else:
        async with direct(ONE, drive=drive) as b:
            yield Under(b.axis, b.session, b.link.device, b.link)


#: What a drive of each family trips over by its own temperature or load.
FAULT = {"r6l": "over_temperature", "ep3e": "over_temperature", "ds_c": "overload"}
#: In the middle of a motion: by speed, by torque, and by the profile velocity without a watchdog.
midways = pytest.mark.parametrize(
    ("drive", "tool", "step"),
    [
        ("r6l", "inertia", "reciprocating move"),
        ("ep3e", "sweep", "measuring"),
        ("ds_c", "inertia", "reciprocating move"),
    ],
    ids=list(FAULT),
)


@pytest.mark.long
@midways
@pytest.mark.parametrize("trouble", ["cancelled", "faulted"])
async def test_everything_is_as_before(drive: str, tool: str, step: str, trouble: str) -> None:
    async with under(drive) as b:
        before = await settings_of(b.axis.drive, MODE)
        assert len(before) > 40
        acts: dict[str, Callable[[], object]] = {
            "cancelled": lambda: task.cancel(),  # noqa: PLW0108 (the task is made below)
            "faulted": lambda: b.device.inject(FAULT[drive]),
        }
        at = At(step, acts[trouble])
        task = asyncio.create_task(b.measure(tool, at.progress))
        with pytest.raises(asyncio.CancelledError if trouble == "cancelled" else DriveError) as why:
            await task
        assert at.done
        if trouble == "faulted":
            assert "verload" in str(why.value) or "emperature" in str(why.value)
        assert await b.axis.state() is not State.OPERATION_ENABLED
        assert await settings_of(b.axis.drive, MODE) == before
        assert not b.axis.drive.pending_restores
        assert not b.axis.stop_pending


@pytest.mark.long(keep=1)
@midways
async def test_what_a_lost_drive_is_pending_comes_back_by_itself(
    drive: str, tool: str, step: str
) -> None:
    async with under(drive) as b:
        before = await settings_of(b.axis.drive, MODE)
        at = At(step, b.pull)
        with pytest.raises(DriveError) as reported:
            await b.measure(tool, at.progress)
        assert at.done
        pending = {entry.key for entry in b.axis.drive.pending_restores.entries}
        b.line.cut = False
        # A free axis coasts for a while.
        b.line.pass_s(3.0)
        # What the monitor does when the drive answers again: the stop first, then the rest.
        if b.axis.stop_pending:
            assert await b.axis.repeat_stop()
        assert await b.axis.standstill(2.0)
        assert await b.axis.state() is not State.OPERATION_ENABLED
        after = await settings_of(b.axis.drive, MODE)
        changed = {key for key in before if before[key] != after[key]}
        assert changed <= pending
        for key in changed:
            assert f"{key} (was {before[key]})" in reported.value.message
        found = await settle(b.axis, asked=False)
        assert found["left"] == {}
        assert await settings_of(b.axis.drive, MODE) == before
        assert not b.axis.drive.pending_restores


@pytest.mark.long
async def test_an_emergency_stop_that_is_released_lets_nothing_go_on() -> None:
    """DS_C has an input for it (003:514-516), which brakes without any fault."""
    async with under("ds_c") as b:
        before = await settings_of(b.axis.drive, MODE)
        control = b.device.control  # type: ignore[attr-defined]
        at = At("reciprocating move", lambda: control.emergency_stop(True))
        with pytest.raises(Interrupted, match="left Operation enabled"):
            await b.measure("inertia", at.progress)
        assert at.done
        assert await settings_of(b.axis.drive, MODE) == before
        control.emergency_stop(False)
        b.line.pass_s(0.5)
        assert await b.axis.state() is not State.OPERATION_ENABLED
        assert await b.axis.standstill(1.0)
