"""Two virtual drives on one beam, measured together over EtherCAT frames.

Truth is what the beam was given; the tool sees positions, speeds and torques of the drives alone.
"""

from __future__ import annotations

import asyncio
import json
import math
from typing import Any

import numpy as np
import pytest

from backend.commands.measuring.tools import lines_of
from backend.tools.tool import Run
from backend.tools.tuning.gantry.run import TOOL
from drivers.cia402 import State
from drivers.errors import MotionHalted, NotAllowed, OutOfRange
from drivers.halt import HaltCause
from drivers.virtual.defects import OUT_OF_SQUARE_RAD
from drivers.virtual.mechanics import gantry_response
from drivers.virtual.wires.netns import Namespace
from tests.unit.analysis.gantry_plant import Gantry
from tests.virtual.tools.rig import At, silent
from tests.virtual.tools.set_ups.gantry import (
    ASKED,
    RATED,
    SQUARE,
    Two,
    codes,
    gantry,
    measured,
    motor,
    static_stiffness,
)

pytestmark = pytest.mark.timeout(600)


def between(found: Any, truth: float) -> bool:
    low, high = found.ci95
    return bool(low <= truth <= high)


@pytest.mark.long
async def test_two_axes_without_a_beam_are_no_gantry(namespace: Namespace) -> None:
    async with gantry(namespace, joined=False) as two:
        found = await measured(two, ASKED.model_copy(update={"resolution_hz": 10.0}))
    assert codes(found)[0] == "not_coupled"
    assert not {"square", "square_uncertain", "out_of_square", "skew_mode"} & set(codes(found))
    assert found.modes == ()
    assert found.fight_percent is None
    assert found.inertia_kgm2 is None
    assert found.skew_stiffness_nm_per_rad is None
    # What each motor needs was measured, whatever is between them.
    for friction in found.friction_percent:
        assert friction.value == pytest.approx(100 * 0.03 / RATED, abs=0.2)
    assert "No coupling of both axes shows" in TOOL.text(
        TOOL.report(found).notes[0].name, "en", TOOL.report(found).notes[0].values
    )


@pytest.mark.long
async def test_a_square_gantry(namespace: Namespace) -> None:
    kept: list[tuple[Any, Any]] = []

    def keep(_name: str, arrays: Any, meta: Any) -> None:
        kept.append((arrays, json.loads(json.dumps(meta))))

    async with gantry(namespace) as two:
        places = await two.positions()
        found = await measured(two, keep=keep)
        assert await two.positions() == pytest.approx(places, abs=0.004)
        for axis in two.axes:
            assert await axis.state() is not State.OPERATION_ENABLED
    f = np.array(found.frequency_hz)
    truth = gantry_response(SQUARE, (motor(), motor()), f)
    use = f < 180.0
    inside = []
    for entry in found.entries:
        true_db = 20 * np.log10(np.abs(truth[:, entry.speed - 1, entry.torque - 1]))
        off, half = np.abs(np.array(entry.magnitude_db) - true_db), np.array(entry.half_db)
        inside += list(off <= half)
        assert np.median(off[use]) < 0.3, entry.torque
        assert np.median(half[use]) < 0.5, entry.torque
    assert np.mean(inside) >= 0.93
    # Motion alike by the sum of both torques, and the skew by half of their difference.
    common = np.sum(truth, axis=(1, 2)) / 4
    skew = truth[:, 0, 0] - truth[:, 0, 1] - truth[:, 1, 0] + truth[:, 1, 1]
    assert [motion.kind for motion in found.motions] == ["common", "skew"]
    for motion, exact in zip(found.motions, (common, skew), strict=True):
        off = np.abs(np.array(motion.magnitude_db) - 20 * np.log10(np.abs(exact)))
        assert np.mean(off <= np.array(motion.half_db)) >= 0.93, motion.kind
        # Wider than of the entries: what the images do to each of them may add up.
        assert np.median(np.array(motion.half_db)[use]) < 0.65, motion.kind
    assert codes(found)[0] == "square"
    # The modes of the equations of motion, which are those of this beam and these motors.
    assert [m.kind for m in found.modes] == ["skew", "common", "skew"]
    for mode, (frequency_hz, damping, share) in zip(found.modes, Gantry().modes(), strict=True):
        low, high = mode.frequency_ci95_hz
        assert low <= frequency_hz <= high
        low, high = mode.damping_ci95
        assert low <= damping <= high
        assert mode.skew_share == pytest.approx(share, abs=0.05)
    assert between(found.inertia_kgm2, 3e-4)
    assert between(found.skew_stiffness_nm_per_rad, static_stiffness(SQUARE))
    for friction in found.friction_percent:
        # Coulomb and viscous friction at the steady speed.
        assert 100 * 0.03 / RATED < friction.value < 100 * 0.036 / RATED
    assert found.margins is not None
    assert found.margins.stable is True
    assert "pair_sound" in codes(found)
    assert "factor" in codes(found)
    ((arrays, meta),) = kept
    again = TOOL.reevaluate(arrays, meta)
    assert again.model_dump(mode="json") == found.model_dump(mode="json")


@pytest.mark.long
async def test_a_gantry_out_of_square_is_named_with_its_way(namespace: Namespace) -> None:
    """Brakes hold the beam where both motors show the same, which is not where it rests."""
    spec = SQUARE.model_copy(update={"square_error_rad": OUT_OF_SQUARE_RAD})
    async with gantry(namespace, SQUARE, brake=True, defects=("out_of_square",)) as two:
        found = await measured(two)
    stiffness = static_stiffness(spec)
    # Axis 1 would rest ahead of axis 2, so that it is behind where both show the same.
    assert codes(found)[0] == "out_of_square"
    assert between(found.fight_percent, -100 * stiffness * OUT_OF_SQUARE_RAD / RATED)
    assert found.out_of_square_rev is not None
    assert between(found.out_of_square_rev, -OUT_OF_SQUARE_RAD / math.tau)
    assert found.out_of_square_mm is not None
    assert between(found.out_of_square_mm, -OUT_OF_SQUARE_RAD / math.tau * 10.0)
    words = "\n".join(lines_of(TOOL, found))
    assert "The gantry is out of square" in words
    assert "Axis 2 is ahead of axis 1" in words
    assert "Correct the reference (homing offset) of one axis by that" in words


async def stands(two: Two) -> None:
    for axis in two.axes:
        assert await axis.standstill(1.0)
        assert await axis.state() is not State.OPERATION_ENABLED


async def test_whatever_stops_one_axis_stops_both(namespace: Namespace) -> None:
    async with gantry(namespace) as two:
        before, places = await two.settings(), await two.positions()
        await refused_before_anything_moves(two)
        assert await two.positions() == pytest.approx(places, abs=1e-4)
        await a_skew_beyond_its_limit(two)
        await a_halt_of_one_axis(two)
        assert await two.settings() == before
        # Last, since the fault stays.
        await a_fault_of_one_axis(two)


async def refused_before_anything_moves(two: Two) -> None:
    with pytest.raises(OutOfRange) as refused:
        await measured(two, ASKED.model_copy(update={"travel_limit": 0.01}))
    assert refused.value.code == "gantry.no-room"
    with pytest.raises(OutOfRange) as refused:
        await measured(two, ASKED.model_copy(update={"time_limit_s": 5.0}))
    assert refused.value.code == "gantry.no-time"
    with pytest.raises(NotAllowed) as alone, two.axes[0].granted("gantry"):
        await TOOL.run(Run(two.axes[0], two.session, silent()), ASKED)
    assert alone.value.code == "gantry.no-partner"


async def a_skew_beyond_its_limit(two: Two) -> None:
    asked = ASKED.model_copy(update={"skew_limit_rev": 0.0005})
    with pytest.raises(MotionHalted) as halted:
        await measured(two, asked)
    assert halted.value.halt.cause is HaltCause.SKEW
    await stands(two)


async def a_halt_of_one_axis(two: Two) -> None:
    """As STOP of one station reaches the loop: this axis alone is commanded."""
    stopped: list[asyncio.Task[None]] = []

    def stop() -> None:
        stopped.append(asyncio.ensure_future(two.session.cyclic.halt(2)))

    at = At("experiment 1", stop, fraction=0.1)
    with pytest.raises(NotAllowed) as ended:
        await measured(two, progress=at.progress)
    assert at.done
    assert ended.value.drive == "R"
    await stands(two)


async def a_fault_of_one_axis(two: Two) -> None:
    seen: list[np.ndarray] = []
    keys = [axis.drive.require("position_actual") for axis in two.axes]
    names = [f"{axis.drive.id}/{key}" for axis, key in zip(two.axes, keys, strict=True)]

    def take(block: Any) -> None:
        seen.append(block.samples[:, [block.channels.index(name) for name in names]])

    def fault() -> None:
        two.segment.command("inject", slave=0, what="over_temperature")

    at = At("experiment 1", fault, fraction=0.1)
    unsubscribe = two.session.cyclic.blocks(take)
    try:
        with pytest.raises(NotAllowed):
            await measured(two, progress=at.progress)
    finally:
        unsubscribe()
    assert at.done
    await stands(two)
    ways = np.concatenate(seen) - seen[0][0]
    rev = abs((await two.axes[0].units()).position(1.0))
    # Neither went on alone: without that the beam would be twisted by the whole way of one axis.
    assert np.max(np.abs(ways[:, 0] - ways[:, 1])) * rev < 0.1
