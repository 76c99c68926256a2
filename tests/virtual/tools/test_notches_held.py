"""What notches do is learned on an axis that a load pulls without ever letting it go.

The truth is what the virtual drives make of the values: M6-L a width in Hz and a depth that no
manual prints, R6L a twentieth of the centre per width level and a hundredth of the amplitude per
depth level.
"""

from __future__ import annotations

import asyncio
from dataclasses import replace

import pytest

from backend.foundation.work.jobs import Progress
from backend.tools.measuring.axis_facts import read_facts
from backend.tools.tuning.notch import in_loop as notch_in_loop
from backend.tools.tuning.notch.meaning import NotchMeaning
from backend.tools.tuning.sweep.evaluation import SweepResult, SweepSettings, completed
from backend.tools.tuning.sweep.run import sweep
from drivers.cia402 import Mode, State
from drivers.errors import NotAllowed
from drivers.virtual.mechanics import MechanicsSpec
from tests.virtual.tools.direct import DirectBench, direct
from tests.virtual.tools.rig import WIDE, mechanics
from tests.virtual.tools.test_wrong_situations import dump


def vertical() -> MechanicsSpec:
    """Disabled it is held by its brake, as real ones are."""
    spec = mechanics((1e-4, 40.0, 0.003), coulomb=0.04, gravity=0.2)
    return spec.model_copy(update={"motor": spec.motor.model_copy(update={"brake": True})})


async def learned(b: DirectBench, found: SweepResult, progress: Progress) -> NotchMeaning:
    facts = completed(await read_facts(b.axis), found)
    return await notch_in_loop.measure_meaning_in_loop(
        b.axis, b.session, WIDE, facts, found, 1.5e-4, progress
    )


@pytest.mark.long
@pytest.mark.parametrize("drive", ["m6l", "r6l"])
async def test_a_held_axis_learns_its_notches_and_stays_held(
    drive: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    silent = Progress(lambda: None)
    async with direct(vertical(), drive=drive) as b:
        if await b.axis.state() is State.FAULT:
            await b.axis.reset_fault()
        before = await dump(b)
        found = await sweep(b.axis, b.session, SweepSettings(WIDE, realisations=1), silent)
        modes: list[int | None] = []
        drive_to = b.link.drive_to

        async def noted(station: int, goal: State, mode: int | None = None) -> None:
            modes.append(mode)
            await drive_to(station, goal, mode)

        monkeypatch.setattr(b.link, "drive_to", noted)

        # Cancelled while the first notch is in force and the axis moves.
        def reported() -> None:
            if "trying notch 1" in progress.step and progress.fraction > 0.15:
                task.cancel()

        progress = Progress(reported)
        task = asyncio.create_task(learned(b, found, progress))
        with pytest.raises(asyncio.CancelledError):
            await task
        assert "trying notch 1" in progress.step
        assert await dump(b) == before
        assert await b.axis.state() is not State.OPERATION_ENABLED

        # Where the cancelled one left it; every motion is counted from its own beginning.
        home = await b.axis.position_raw()
        b.link.highest.update(low=home, high=home)
        meaning = await learned(b, found, silent)
        assert await dump(b) == before
        assert await b.axis.state() is not State.OPERATION_ENABLED
        assert set(modes) <= {None, int(Mode.CSV)}, "the speed loop is closed all the time"
        units = await b.axis.units()
        low, high = (units.position(b.link.highest[end] - home) for end in ("low", "high"))
        assert max(-low, high) < 1.5

        # A loop that has no room for whatever a notch may be is left alone.
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(notch_in_loop, "safe_centre_hz", lambda *_: None)
            with pytest.raises(NotAllowed, match="could make the loop oscillate"):
                await learned(b, found, silent)
        with pytest.raises(NotAllowed, match="no mechanical model"):
            await learned(b, replace(found, model=None), silent)
        assert await dump(b) == before
    if drive == "m6l":
        assert meaning.width_scale == pytest.approx(1.0, rel=0.05)
        assert meaning.depth_db == pytest.approx(-40.0, abs=4.0)
    else:
        assert meaning.levels is not None
        for level, share in meaning.levels.width_ratio:
            assert share == pytest.approx(level / 20.0, rel=0.05)
        depths = dict(meaning.levels.depth_db)
        assert depths[10] == pytest.approx(-20.0, abs=1.5)
        assert depths[20] == pytest.approx(-13.98, abs=0.7)
        assert depths[40] == pytest.approx(-7.96, abs=0.5)
