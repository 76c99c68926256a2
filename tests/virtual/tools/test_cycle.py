"""The load of a cycle that somebody else moves, read without writing; and from a recording.

What the cycle takes follows from the speed, another signal than the torque: J·α + Coulomb +
viscous friction of a rigid axis.
"""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from backend.records.recording.writer import RecordingWriter
from backend.tools.tool import Run
from backend.tools.watching.cycle.result import CycleResult
from backend.tools.watching.cycle.run import TOOL
from backend.tools.watching.cycle.settings import CycleSettings
from drivers.errors import NotAllowed
from drivers.link import ScopeBlock
from tests.virtual.tools.direct import DirectBench, direct
from tests.virtual.tools.rig import settings_of, silent
from tests.virtual.tools.set_ups.cycle import (
    PERIOD_S,
    RATED_NM,
    RPM,
    SPEED_RPM,
    machine,
    rigid,
    torques_nm,
)


@pytest.mark.long
async def test_the_cycle_of_a_machine_is_read_while_another_moves_it() -> None:
    kept: dict[str, Any] = {}

    def keep(name: str, arrays: dict[str, Any], meta: dict[str, object]) -> None:
        kept.update(name=name, arrays=arrays, meta=meta)

    asked = CycleSettings(duration_s=7.5, motor_rated_nm=RATED_NM, thermal_time_min=15.0)
    async with direct(rigid(), drive="m6l") as bench:
        moving = asyncio.create_task(machine(bench, 8))
        await asyncio.sleep(1.5)
        found = await TOOL.run(Run(bench.axis, None, silent(), keep), asked)
        await moving
    assert found.period_s == pytest.approx(PERIOD_S, rel=0.01)
    assert found.periods >= 4
    time, speed = kept["arrays"]["time_s"], kept["arrays"]["speed_rpm"]
    assert found.period_s is not None
    whole = (time > 0.01) & (time <= found.periods * found.period_s)
    torque = torques_nm(time, speed)[whole]
    truth = 100.0 * float(np.sqrt(np.mean(torque**2))) / RATED_NM
    assert found.rms_percent == pytest.approx(truth, rel=0.02)
    low, high = found.rms_ci95_percent
    assert low is not None
    assert high is not None
    assert low < high
    assert found.highest_speed_rpm == pytest.approx(SPEED_RPM, rel=0.05)
    assert found.power is not None
    power = torque * speed[whole] * RPM
    braking = -float(np.sum(power[power < 0.0])) * 1e-3 / found.periods
    assert found.power.braking_j == pytest.approx(braking, rel=0.05)
    assert found.verdict in ("endures", "undecided")
    again = TOOL.reevaluate(kept["arrays"], kept["meta"])
    assert again == found


async def test_nothing_is_written_and_an_idle_axis_is_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Polled, as next to a controller on another bus: no exchange of process data runs."""
    async with direct(rigid(), drive="mms7") as bench:
        await bench.session.stop()
        bench.axis.session = None
        before = await settings_of(bench.axis.drive)
        touched: list[object] = []

        async def forbidden(*words: object) -> None:
            touched.append(words)

        for name in ("write", "configure", "start", "play", "drive_to", "reset_fault"):
            monkeypatch.setattr(bench.link, name, forbidden)
        found = await TOOL.run(Run(bench.axis, None, silent()), CycleSettings(duration_s=2.0))
        monkeypatch.undo()
        assert touched == []
        assert await settings_of(bench.axis.drive) == before
    assert isinstance(found, CycleResult)
    assert found.verdict == "idle"
    assert found.samples > 100


async def recorded(bench: DirectBench, path: Path, drive: str, *roles: str) -> None:
    """A second at +150 % and 600 rpm, a second at −150 %, for ten periods, at 500 Hz."""
    axis, units = bench.axis, await bench.axis.units()
    keys = tuple(axis.drive.require(role) for role in roles)
    raws = {"torque_actual": units.torque_raw(150.0), "velocity_actual": units.velocity_raw(600.0)}
    channels = [
        {"drive": drive, "drive_name": "X", "key": key, "name": key, "unit": ""} for key in keys
    ]
    header = {
        "clock": {"sample_s": 0.0, "epoch_s": 1.7e9},
        "streams": [{"synchronous": True, "channels": channels}],
    }
    writer = RecordingWriter(path, header, lambda error: pytest.fail(str(error)))
    time = np.arange(0.0, 20.0, 0.002)
    sign = np.where(time % 2.0 < 1.0, 1.0, -1.0)
    values = [
        float(str(axis.drive.parameter(key).to_value(raws[role])))
        for role, key in zip(roles, keys, strict=True)
    ]
    writer.put(0, ScopeBlock(1, 0.0, 0.002, keys, np.outer(sign, values), 0))
    writer.close({"reason": "stopped"})


async def test_a_recording_is_evaluated_as_the_drive_is(tmp_path: Path) -> None:
    async with direct(rigid(), drive="m6l") as bench:
        path = tmp_path / "press 4.sdrec"
        await recorded(bench, path, "x", "torque_actual", "velocity_actual")
        asked = CycleSettings(recording="press 4.sdrec", motor_rated_nm=RATED_NM)
        run = Run(bench.axis, None, silent(), recording=lambda name: tmp_path / name)
        found = await TOOL.run(run, asked)
        assert found.recording == "press 4.sdrec"
        assert found.period_s == pytest.approx(2.0, rel=0.01)
        assert found.rms_percent == pytest.approx(150.0, rel=0.01)
        assert found.verdict == "overloads"
        lacking = tmp_path / "other.sdrec"
        await recorded(bench, lacking, "x", "torque_actual")
        with pytest.raises(NotAllowed, match="606C"):
            await TOOL.run(run, asked.model_copy(update={"recording": "other.sdrec"}))
