"""Trouble on the wire: a measurement must end, say why, and leave everything as it was.

What needs no wire is in `test_wrong_situations`.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import pytest

from backend.axes.axis.cyclic import CyclicSession
from backend.foundation.work.jobs import Progress
from backend.tools.measuring.restore import settle
from backend.tools.tuning.sweep import profile_speed
from backend.tools.tuning.sweep.evaluation import SweepSettings
from backend.tools.tuning.sweep.run import sweep
from drivers.cia402 import State
from drivers.errors import DriveError, NotAllowed
from drivers.virtual.wires.netns import Namespace
from tests.virtual.tools.rig import WIDE, Bench, bench, mechanics, settings_of, silent

ONE = mechanics((1e-4, 60.0, 0.006))
MODE = "6060:00"


def spy(reached: Callable[[Progress], bool]) -> tuple[Progress, asyncio.Event]:
    """A progress that reports when the tool has come to a place."""
    there = asyncio.Event()
    progress = Progress(lambda: there.set() if reached(progress) else None)
    return progress, there


async def as_before(b: Bench, before: dict[str, object]) -> None:
    state = await b.axis.state()
    assert state is not State.OPERATION_ENABLED
    after = await b.values()
    assert after == before, {k: (before[k], after[k]) for k in before if before[k] != after[k]}


@pytest.mark.long
async def test_cancelled(namespace: Namespace) -> None:
    async with bench(namespace, ONE, settings={"2008:01": 1, "2008:02": 12768 + 20000,
                                               "2008:03": 42768, "2008:04": 12800,
                                               "2008:05": 42600}) as b:  # fmt: skip
        before = await b.values()
        assert before["2008:01"] == 1
        progress, there = spy(lambda p: "measuring" in p.step and p.fraction > 0.2)
        task = asyncio.create_task(sweep(b.axis, b.session, SweepSettings(WIDE), progress))
        await asyncio.wait_for(there.wait(), 100.0)
        await asyncio.sleep(0.2)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        await as_before(b, before)


@pytest.mark.long
async def test_a_fault_in_the_middle(namespace: Namespace) -> None:
    async with bench(namespace, ONE) as b:
        before = await b.values()
        progress, there = spy(lambda p: "measuring" in p.step and p.fraction > 0.15)
        task = asyncio.create_task(sweep(b.axis, b.session, SweepSettings(WIDE), progress))
        await asyncio.wait_for(there.wait(), 100.0)
        b.segment.command("inject", slave=0, what="over_temperature", value=1)
        with pytest.raises(NotAllowed, match=r"Operation enabled|Fault|fault"):
            await task
        await as_before(b, before)


@pytest.mark.long
async def test_the_cable_is_pulled_and_put_back(namespace: Namespace) -> None:
    """What the drive is pending, its mode above all, comes back over the healed segment."""
    async with bench(namespace, ONE) as b:
        before = await settings_of(b.axis.drive, MODE)
        progress, there = spy(lambda p: "measuring" in p.step and p.fraction > 0.15)

        async def measure() -> None:
            async with profile_speed.prepared(b.axis, b.session, WIDE, False):
                await sweep(b.axis, b.session, SweepSettings(WIDE), progress)

        task = asyncio.create_task(measure())
        await asyncio.wait_for(there.wait(), 100.0)
        b.segment.command("cut", cable=0)
        try:
            with pytest.raises(DriveError, match=r"not restored: .*6060:00 \(was"):
                await asyncio.wait_for(task, 30.0)
        finally:
            b.segment.command("heal")
        async with asyncio.timeout(60.0):
            while not await settled(b, before):  # noqa: ASYNC110 - nothing tells of it
                await asyncio.sleep(0.1)
        assert not b.axis.drive.pending_restores
        assert not b.axis.stop_pending


async def settled(b: Bench, before: dict[str, object]) -> bool:
    """What a server does when a drive answers again; whether all is as before now."""
    try:
        if b.axis.stop_pending and not await b.axis.repeat_stop():
            return False
        await settle(b.axis, asked=False)
        return await settings_of(b.axis.drive, MODE) == before
    except DriveError:
        return False


@pytest.mark.long
async def test_a_load_that_pulls_is_measured_only_under_a_loop(namespace: Namespace) -> None:
    spec = mechanics((1e-4, 200.0, 0.005), gravity=0.15)
    # The holding brake of the drive keeps the load while it is disabled (2108h:01).
    async with bench(namespace, spec, settings={"2108:01": 1}) as b:
        if await b.axis.state() is State.FAULT:
            await b.axis.reset_fault()
        before = await b.values()
        units = await b.axis.units()
        start = await b.axis.position_raw()
        with pytest.raises(NotAllowed, match="pulls the axis"):
            await sweep(b.axis, b.session, SweepSettings(WIDE, loop="none"), silent())
        assert abs(units.position(await b.axis.position_raw() - start)) < 0.3
        await as_before(b, before)


async def test_without_an_exchange_nothing_moves(namespace: Namespace) -> None:
    async with bench(namespace, ONE) as b:
        idle = CyclicSession(b.link, [b.axis.drive])
        with pytest.raises(NotAllowed, match="cyclic"):
            await sweep(b.axis, idle, SweepSettings(WIDE, loop="speed"), silent())
