"""The first motion of an axis whose holding brake is still opening: 000:1377, 002:8117.

A drive loses what it is reported meanwhile. Judged by the shaft.
"""

from __future__ import annotations

import pytest

from backend.axes.axis.axis import Envelope
from backend.foundation.work.jobs import Progress
from backend.tools.measuring.axis_facts import brake_opens_s
from backend.tools.moving.moves.homing import HomingSettings, home
from backend.tools.moving.moves.move import MoveSettings, SequenceSettings, move, sequence
from benchmarks.stopping import vertical
from benchmarks.stopping.clock import run_simulated
from benchmarks.stopping.rig import Rig, free_axis, rig

ENVELOPE = Envelope(3.0, 400.0, 100.0, 6.0)
#: Times of the brake that are longer than any drive takes to acknowledge a setpoint, and their sum
#: in seconds: R6L 002:8193, M6-L P02.10.
SLOW: dict[str, tuple[dict[str, int], float]] = {
    "r6l": ({"2001:0C": 400, "2001:0D": 300}, 0.7),
    "m6l": ({"2002:0B": 500}, 0.5),
}


def _slow(bench: Rig) -> float:
    vertical.with_brake(bench)
    values, _ = SLOW[bench.family]
    for key, raw in values.items():
        bench.poke(key, raw)
    return SLOW[bench.family][1]


def _turns(bench: Rig) -> float:
    return bench.shaft_deg / 360.0


@pytest.mark.parametrize("family", sorted(SLOW))
def test_the_first_move_arrives_although_the_brake_opens_slowly(family: str) -> None:
    async def main() -> None:
        async with rig(family, free_axis(brake=True)) as bench:
            opens_s = _slow(bench)
            axis = bench.connected.axis
            assert await brake_opens_s(axis.drive) == pytest.approx(opens_s)
            start = _turns(bench)
            settings = MoveSettings(
                "PP",
                1.5,
                ENVELOPE,
                relative=True,
                speed_rpm=300.0,
                acceleration_rpm_s=3000.0,
                deceleration_rpm_s=3000.0,
            )
            bench.bench.motion.permit(bench.connected.drive.id)
            await move(axis, settings, Progress(lambda: None))
            assert _turns(bench) - start == pytest.approx(1.5, abs=0.05)

    run_simulated(main)


@pytest.mark.long
def test_a_sequence_begins_with_its_first_place() -> None:
    async def main() -> None:
        async with rig("r6l", free_axis(brake=True)) as bench:
            _slow(bench)
            start = _turns(bench)
            axis = bench.connected.axis
            here = (await axis.units()).position(await axis.position_raw())
            settings = SequenceSettings(here + 1.0, here, 300.0, 3000.0, 0.1, 1, ENVELOPE)
            bench.bench.motion.permit(bench.connected.drive.id)
            found = await sequence(axis, settings, Progress(lambda: None))
            assert found["cycles"] == 1
            assert _turns(bench) - start == pytest.approx(0.0, abs=0.05)

    run_simulated(main)


def test_a_second_homing_is_not_taken_for_done_while_the_brake_opens() -> None:
    """Method 35 homes where the axis is; 33 must turn to the next index pulse."""

    async def main() -> None:
        async with rig("r6l", free_axis(brake=True)) as bench:
            _slow(bench)
            axis = bench.connected.axis
            bench.bench.motion.permit(bench.connected.drive.id)

            async def homed(method: int) -> float:
                before = _turns(bench)
                settings = HomingSettings(method, ENVELOPE, 60.0, 20.0, 1000.0)
                await home(axis, settings, Progress(lambda: None))
                return abs(_turns(bench) - before)

            away = MoveSettings("PP", 0.3, ENVELOPE, relative=True, speed_rpm=300.0)
            await move(axis, away, Progress(lambda: None))
            assert await homed(35) == pytest.approx(0.0, abs=0.01)
            assert await homed(33) > 0.2

    run_simulated(main)
