"""The inertia of a load that its speed loop was never tuned for is found at the first attempt."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from backend.tools.measuring.axis_facts import read_facts
from backend.tools.mechanics.inertia.evaluation import InertiaSettings
from backend.tools.mechanics.inertia.run import inertia
from backend.tools.mechanics.inertia.soft_loop import SoftLoop, soft_loop_of
from backend.tools.moving.moves.go_back import go_back
from drivers.link import Trajectory
from tests.virtual.tools.direct import direct
from tests.virtual.tools.rig import WIDE, mechanics, silent

HEAVY = mechanics((3e-3, 300.0, 0.05), viscous=1e-3, coulomb=0.06)


def loop_move(kgm2: float, loop: SoftLoop, wanted: np.ndarray, rate: float) -> np.ndarray:
    """Speed [n] and torque [n] of a rigid axis without friction under this loop, by small steps."""
    fine, speed, integral, rows = 20, 0.0, 0.0, []
    for aim in wanted:
        for _ in range(fine):
            error = aim - speed
            integral += error / rate / fine
            torque = loop.proportional * error + loop.integral * integral
            speed += torque / kgm2 / rate / fine
        rows.append((speed, torque))
    return np.array(rows)


def test_what_a_soft_loop_takes_is_known_before() -> None:
    rate, loop, kgm2 = 1000.0, SoftLoop(0.017, 0.48), 3e-3
    t = np.arange(1500) / rate
    short = np.where(t < 0.35, 1.0 - np.cos(2 * np.pi * t / 0.35), 0.0) * 2.0
    speed, torque = loop_move(kgm2, loop, short, rate).T
    valid = np.ones(t.size, dtype=bool)
    found = soft_loop_of(short, speed, torque, valid, rate)
    assert found is not None
    assert found.proportional == pytest.approx(loop.proportional, rel=0.05)
    assert found.integral == pytest.approx(loop.integral, rel=0.05)
    # A faster move, with nothing and with most of its torque sent ahead.
    wanted = np.interp(t, [0.1, 0.4, 0.8, 1.1], [0.0, 60.0, 60.0, 0.0])
    needed = kgm2 * np.gradient(wanted) * rate
    peak = float(np.max(np.abs(loop_move(kgm2, loop, wanted, rate)[:, 1])))
    assert peak > 1.3 * np.max(needed), "else this test shows nothing"
    assert found.peak_nm(needed, 0.0 * needed, kgm2, rate) == pytest.approx(peak, rel=0.05)
    assert found.peak_nm(needed, 0.9 * needed, kgm2, rate) < 1.1 * np.max(needed)
    assert soft_loop_of(short, speed, np.sin(40 * t), valid, rate) is None


@pytest.mark.long
async def test_a_heavy_axis_needs_one_attempt() -> None:
    async with direct(HEAVY, drive="r6l") as b:
        moves: list[int] = []
        play = b.link.play

        async def played(trajectories: Sequence[Trajectory]) -> int:
            moves.append(len(trajectories[0].values))
            return await play(trajectories)

        b.link.play = played  # type: ignore[method-assign]
        found = await inertia(b.axis, b.session, InertiaSettings(WIDE), silent())
        units = await b.axis.units()
        highest = units.torque(b.link.highest["torque"])
    assert len([n for n in moves if n > 2000]) == 1
    assert highest < 0.85 * WIDE.torque_percent
    assert found.result.inertia_kgm2.value == pytest.approx(3.05e-3, rel=0.02)
    assert found.result.coulomb_nm.value == pytest.approx(0.06, rel=0.1)


async def test_a_heavy_axis_goes_home_slower_where_its_torque_is_limited() -> None:
    async with direct(HEAVY, drive="r6l") as b:
        facts = await read_facts(b.axis, None)
        units = await b.axis.units()
        home = await b.axis.position_raw()
        away = home + units.position_raw(0.3)
        await go_back(b.axis, b.session, away, WIDE, facts)
        taken = units.torque(b.link.highest["torque"])
        lengths: list[int] = []
        play = b.link.play

        async def played(trajectories: Sequence[Trajectory]) -> int:
            lengths.append(len(trajectories[0].values))
            return await play(trajectories)

        b.link.play = played  # type: ignore[method-assign]
        narrow = replace(WIDE, torque_percent=0.6 * taken)
        await go_back(b.axis, b.session, home, narrow, facts)
        left = abs(units.position(await b.axis.position_raw() - home))
    assert lengths[1] > 1.5 * lengths[0]
    assert left < 0.05
