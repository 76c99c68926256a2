"""A bus that loses samples, or a computer that is late, costs a measurement time and not its sense.

Samples of a lost frame are not numbers, and setpoints that went out late disturb the axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from backend.foundation.work.jobs import Progress
from backend.tools.measuring.axis_facts import read_facts
from backend.tools.measuring.recording import bridged
from backend.tools.mechanics.inertia.evaluation import InertiaSettings
from backend.tools.mechanics.inertia.moves import first_look
from backend.tools.mechanics.inertia.probe import probe_axis
from backend.tools.moving.moves.go_back import go_back
from backend.tools.tuning.sweep import run as sweep_tool
from backend.tools.tuning.sweep.evaluation import Loop, SweepSettings
from backend.tools.tuning.sweep.run import sweep
from drivers.link import ScopeBlock, Trajectory
from tests.virtual.tools.direct import DirectBench, direct
from tests.virtual.tools.rig import WIDE, errors, mechanics, silent

ONE = mechanics((1e-4, 60.0, 0.006))


def test_what_was_lost_lies_between_its_neighbours() -> None:
    table = np.array([[np.nan, 0.0], [10.0, 5.0], [0.0, np.nan], [np.nan, 0.0], [16.0, 2.0]])
    valid = np.array([False, True, False, False, True])
    filled = bridged(table, valid)
    assert filled == pytest.approx(np.array([[10, 5], [10, 5], [12, 4], [14, 3], [16, 2]]))
    assert bridged(table[valid], valid[valid]) is not None
    assert np.isnan(table[0, 0]), "what came is not changed"


def losing(b: DirectBench, every: int) -> None:
    """One frame of so many, from now on."""
    count = 0

    def lost() -> bool:
        nonlocal count
        count += 1
        return count % every == 0

    b.link.lost = lost


async def test_an_axis_is_not_pushed_harder_for_a_frame_that_was_lost() -> None:
    async with direct(ONE, drive="r6l") as b:
        facts, home = await read_facts(b.axis), await b.axis.position_raw()
        units = await b.axis.units()

        async def felt() -> tuple[float, float]:
            b.link.highest["torque"] = 0.0
            probed = await probe_axis(b.axis, b.session, WIDE, facts, home)
            return probed.inertia_kgm2, units.torque(b.link.highest["torque"])

        plain_kgm2, plain_percent = await felt()
        losing(b, 50)
        inertia_kgm2, percent = await felt()
        assert inertia_kgm2 == pytest.approx(plain_kgm2, rel=0.1)
        assert percent < 1.1 * plain_percent


async def test_a_first_move_is_not_taken_for_a_leap() -> None:
    async with direct(ONE, drive="r6l") as b:
        facts, units = await read_facts(b.axis), await b.axis.units()
        # Far from the zero of its position.
        home = await b.axis.position_raw() + units.position_raw(10.0)
        await go_back(b.axis, b.session, home, WIDE, facts)
        home = await b.axis.position_raw()
        losing(b, 50)
        look = await first_look(b.axis, b.session, InertiaSettings(WIDE), facts, home, None)
        assert 0.1 < look.followed < 1.5
        assert look.rough.inertia_kgm2 == pytest.approx(1.5e-4, rel=0.3)


class Late:
    """The computer is late for two cycles in the middle of long plays with these numbers."""

    def __init__(self, b: DirectBench, numbers: set[int]) -> None:
        self.long: list[int] = []
        self._numbers, self._cycles, self._play = numbers, 0, b.link.play
        b.link.play = self._played  # type: ignore[method-assign]
        b.link.late = self._late

    async def _played(self, trajectories: Sequence[Trajectory]) -> int:
        if len(trajectories[0].values) > 1500:
            self.long.append(len(trajectories[0].values))
            self._cycles = 0
        return await self._play(trajectories)

    def _late(self) -> int:
        self._cycles += 1
        return 2 if self._cycles == 900 and len(self.long) in self._numbers else 0


@pytest.mark.long
@pytest.mark.parametrize("loop", ["none", "speed"])
async def test_a_realisation_that_lost_samples_is_played_again(
    loop: Loop, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sweep_tool, "evaluate", lambda records, *_: records)
    steps: list[str] = []
    progress = Progress(lambda: steps.append(progress.step))
    async with direct(ONE, drive="r6l") as b:
        late = Late(b, {1, 3})
        settings = SweepSettings(WIDE, loop=loop, realisations=1)
        records: Any = await sweep(b.axis, b.session, settings, progress)
    assert len(late.long) == 4, "both realisations, and each of them once more"
    again = "measuring, realisation {} of 2: repeated, because samples were lost"
    assert {again.format(n) for n in (1, 2)} <= set(steps)
    assert [e.excitation.realisation for e, _ in records] == [0, 0]
    for sequence, recording in records:
        assert np.all(recording.valid[: sequence.excitation.samples.size - 50])


@pytest.mark.long
async def test_a_bus_that_loses_samples_all_the_time_ends_in_bounded_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What is played again is counted over all realisations; each has its best try."""
    monkeypatch.setattr(sweep_tool, "evaluate", lambda records, *_: records)
    async with direct(ONE, drive="r6l") as b:
        late = Late(b, set(range(100)))
        settings = SweepSettings(WIDE, loop="speed", realisations=2)
        records: Any = await sweep(b.axis, b.session, settings, silent())
    assert len(late.long) == 8, "no more than as many again"
    for sequence, recording in records:
        e = sequence.excitation
        last = recording.valid[e.first_sample + 2 * e.period_samples :][: e.period_samples]
        assert np.all(last), "one period is whole"


@pytest.mark.long
async def test_what_is_played_again_is_shared_where_a_period_is_whole_already(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(sweep_tool, "evaluate", lambda records, *_: records)
    steps: list[str] = []
    progress = Progress(lambda: steps.append(progress.step))
    async with direct(ONE, drive="r6l") as b:
        late = Late(b, set(range(100)))
        await sweep(b.axis, b.session, SweepSettings(WIDE, realisations=1), progress)
    assert len(late.long) == 4
    assert "measuring, realisation 2 of 2: repeated, because samples were lost" in steps


@pytest.mark.long
async def test_what_was_before_a_motion_is_no_part_of_it_however_late_it_comes() -> None:
    """A server that stood still finds the samples of before when the motion has begun."""
    async with direct(ONE) as b:
        play, old = b.link.play, 20_000

        async def belated(trajectories: Sequence[Trajectory]) -> int:
            first = await play(trajectories)
            rest = np.random.default_rng(1).integers(-50, 50, (old, len(b.link._channels)))
            samples = rest.astype(np.float64)
            for consumer in tuple(b.link._consumers):
                consumer(ScopeBlock(0, 0.0, 1e-3, b.link._channels, samples, cycle=first - old))
            return first

        b.link.play = belated  # type: ignore[method-assign]
        found = await sweep(b.axis, b.session, SweepSettings(WIDE), silent())
    assert errors(found.direct, ONE, 5, 250).magnitude_db < 0.3
