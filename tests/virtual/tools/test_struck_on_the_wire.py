"""Cable and supply fail in the middle of a tuning, over frames: what only a wire can show."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

import pytest

from backend.foundation.work.jobs import Progress
from backend.tools.measuring.axis_facts import read_facts
from backend.tools.measuring.restore import settle
from backend.tools.mechanics.inertia.evaluation import InertiaSettings
from backend.tools.mechanics.inertia.run import inertia
from backend.tools.tuning.autotune.design.notches import Learning, learn_notches
from backend.tools.tuning.sweep import profile_speed
from backend.tools.tuning.sweep.evaluation import SweepSettings, completed
from backend.tools.tuning.sweep.run import sweep
from drivers.cia402 import State
from drivers.errors import DriveError
from drivers.virtual.wires.netns import Namespace
from tests.virtual.tools.can_rig import CanBench, can_bench, incremental
from tests.virtual.tools.rig import WIDE, At, Bench, bench, settings_of
from tests.virtual.tools.strike import Known, axis_of, measured
from tests.virtual.tools.strike import work as work_of

MODE = "6060:00"
SPEC = axis_of(vertical=False)
RATED_NM = 1.27


async def work(b: Bench | CanBench, part: str, known: Known | None, progress: Progress) -> None:
    axis, session = b.axis, b.session
    async with profile_speed.prepared(axis, session, WIDE, True):
        if part == "inertia":
            settings = InertiaSettings(WIDE, rated_torque_nm=RATED_NM)
            await inertia(axis, session, settings, progress)
        elif part == "sweep":
            one = SweepSettings(WIDE, realisations=1, rated_torque_nm=RATED_NM)
            await sweep(axis, session, one, progress)
        elif part == "verify":
            await work_of(b, part, known, progress)
        else:
            assert known is not None
            facts = completed(await read_facts(axis), known.mechanics)
            how = Learning(WIDE, "auto", "free")
            await learn_notches(axis, session, how, facts, known.outcome, known.mechanics, progress)


async def struck(
    b: Bench | CanBench,
    doing: Callable[[Progress], Awaitable[None]],
    step: str,
    fraction: float,
    strike: Callable[[], object],
    mend: Callable[[], object],
) -> None:
    """It ends in time with a reason that names the drive, and all comes back when it answers."""
    before = await settings_of(b.axis.drive, MODE)
    at = At(step, strike, fraction)
    try:
        with pytest.raises(DriveError, match="X:"):
            await asyncio.wait_for(doing(at.progress), 120.0)
        assert at.done
    finally:
        mend()
    async with asyncio.timeout(90.0):
        while not await settled(b, before):  # noqa: ASYNC110 - nothing tells of it
            await asyncio.sleep(0.1)
    assert not b.axis.drive.pending_restores
    assert not b.axis.stop_pending
    assert await b.axis.state() is not State.OPERATION_ENABLED
    units, stood = await b.axis.units(), await b.axis.position_raw()
    await asyncio.sleep(0.5)
    assert abs(units.position(await b.axis.position_raw() - stood)) < 0.01


async def settled(b: Bench | CanBench, before: dict[str, object]) -> bool:
    """What a server does when a drive answers again; whether all is as before now."""
    try:
        if b.axis.stop_pending and not await b.axis.repeat_stop():
            return False
        await settle(b.axis, asked=False)
        return await settings_of(b.axis.drive, MODE) == before
    except DriveError:
        return False


@pytest.mark.long
@pytest.mark.parametrize(
    ("drive", "part", "step", "fraction", "kind"),
    [
        ("r6l", "inertia", "reciprocating move", 0.45, "power"),
        ("mms7", "inertia", "reciprocating move", 0.45, "cable"),
        ("ep3e", "sweep", "realisation 1 of 2", 0.3, "power"),
        ("r6l", "notches", "trying notch 2", 0.3, "power"),
        ("mms7", "verify", "6 of 6: measuring the tuned loop: measuring", 0.8, "power"),
    ],
)
async def test_over_ethercat(
    namespace: Namespace, drive: str, part: str, step: str, fraction: float, kind: str
) -> None:
    late = part in ("notches", "verify")
    known = await measured(drive, SPEC, tune=part == "verify") if late else None
    async with bench(namespace, SPEC, drive=drive) as b:
        acts = {"power": ("power_off", "power_on"), "cable": ("cut", "heal")}[kind]
        reported = {"cable": 0} if kind == "cable" else {"slave": 0}

        def strike() -> None:
            b.segment.command(acts[0], **reported)

        def mend() -> None:
            b.segment.command(acts[1], **({} if kind == "cable" else reported))

        await struck(b, lambda p: work(b, part, known, p), step, fraction, strike, mend)


@pytest.mark.long
@pytest.mark.parametrize(
    ("part", "step"), [("inertia", "reciprocating move"), ("sweep", "realisation 2 of 2")]
)
async def test_over_canopen(part: str, step: str) -> None:
    """The control supply of a DS_C, which has no watchdog, is off for two seconds."""
    async with can_bench(incremental(SPEC), pace=40.0) as b:

        def strike() -> None:
            b.bus.node.device.inject("power_off", 2.0)

        def mend() -> None:
            b.bus.pass_s(4.0)

        await struck(b, lambda p: work(b, part, None, p), step, 0.4, strike, mend)
