"""A free axis that becomes faster than its envelope is stopped near it and measured with less."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from backend.tools.tuning.sweep import adaptive as sweep_adaptive
from backend.tools.tuning.sweep import run as sweep_tool
from backend.tools.tuning.sweep.evaluation import SweepSettings
from drivers.cia402 import State
from tests.virtual.tools.direct import direct
from tests.virtual.tools.rig import WIDE, mechanics, silent

#: A light chain that swings at 82, 238 and 386 Hz: the motor moves more than a rigid axis would.
SWINGING = mechanics(
    (1.09e-5, 15.2, 4.43e-4),
    (6.13e-6, 8.16, 6.26e-4),
    (2.34e-5, 22.1, 3.09e-4),
    motor=4.11e-5,
    viscous=5.6e-5,
    coulomb=0.029,
)


async def test_the_second_excitation_is_smaller(monkeypatch: pytest.MonkeyPatch) -> None:
    played = sweep_adaptive.play_informative
    first: list[float] = []
    ended: list[int] = []

    async def noted(*given: Any) -> Any:
        first.extend(float(np.max(np.abs(s.excitation.samples))) for s in given[4])
        return await played(*given)

    def evaluate(records: Any, *_: Any) -> Any:
        ended.append(len(records))
        return records

    monkeypatch.setattr(sweep_tool, "play_informative", noted)
    monkeypatch.setattr(sweep_tool, "evaluate", evaluate)
    async with direct(SWINGING, drive="r6l") as b:
        units, home = await b.axis.units(), await b.axis.position_raw()
        quick = await b.axis.drive.raw("6085:00")
        settings = SweepSettings(WIDE, loop="none", realisations=1)
        records: Any = await sweep_tool.sweep(b.axis, b.session, settings, silent())
        highest_rpm = units.velocity(b.link.highest["speed"])
        far = max(b.link.highest["high"] - home, home - b.link.highest["low"])
        assert await b.axis.drive.raw("6085:00") == quick
        assert await b.axis.state() is not State.OPERATION_ENABLED
        assert abs(units.position(await b.axis.position_raw() - home)) < 0.05
    assert highest_rpm > WIDE.speed_rpm, "else this test shows nothing"
    assert ended == [2]
    second = [float(np.max(np.abs(s.excitation.samples))) for s, _recording in records]
    assert max(second) < 0.9 * min(first)
    # It never left its travel, and the play that counts kept its speed.
    assert units.position(far) < WIDE.travel_rev
    for _sequence, recording in records:
        assert np.max(np.abs(recording.velocity_rad_s)) < WIDE.speed_rpm * 2 * np.pi / 60
