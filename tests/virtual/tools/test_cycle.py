"""The load of a cycle that somebody else moves, read without writing; and from a recording.

What the cycle takes is known by formula: J·α + Coulomb + viscous friction of a rigid axis.
"""

from __future__ import annotations

import asyncio
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from backend.recording.writer import RecordingWriter
from backend.tools.autotune.axis_facts import read_facts
from backend.tools.cycle.result import CycleResult
from backend.tools.cycle.run import TOOL
from backend.tools.cycle.settings import CycleSettings
from backend.tools.inertia.moves import speed_move
from backend.tools.tool import Run
from drivers.errors import NotAllowed
from drivers.link import ScopeBlock
from drivers.virtual.mechanics import MechanicsSpec
from tests.virtual.tools.direct import DirectBench, direct
from tests.virtual.tools.rig import WIDE, settings_of, silent

RATED_NM, INERTIA, COULOMB, VISCOUS = 1.27, 4e-4, 0.05, 3e-4
SPEED_RPM, RAMP_S, HOLD_S, STAND_S = 900.0, 0.1, 0.15, 0.25
PERIOD_S = 2 * (2 * RAMP_S + HOLD_S + STAND_S)
RPM = 2 * math.pi / 60.0


def rigid() -> MechanicsSpec:
    return MechanicsSpec.model_validate({
        "motor": {"inertia_kgm2": INERTIA, "rated_torque_nm": RATED_NM, "rated_speed_rpm": 3000},
        "friction": {"viscous_nms": VISCOUS, "coulomb_nm": COULOMB},
    })  # fmt: skip


def profile(cycles: int) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """To and fro, 1 kHz, in rpm."""
    up = np.linspace(0.0, 1.0, round(RAMP_S * 1000))
    one = np.concatenate(
        [up, np.ones(round(HOLD_S * 1000)), up[::-1], np.zeros(round(STAND_S * 1000))]
    )
    return SPEED_RPM * np.tile(np.concatenate([one, -one]), cycles)


def effective_nm() -> float:
    """Root mean square over a period, by integrating the squares in closed form."""
    alpha, omega = SPEED_RPM * RPM / RAMP_S, SPEED_RPM * RPM

    def ramp(accelerating: float) -> float:
        # (a + b·x)² over x = 0…1
        a, b = accelerating * INERTIA * alpha + COULOMB, VISCOUS * omega
        return a * a + a * b + b * b / 3.0

    hold = (COULOMB + VISCOUS * omega) ** 2
    half = RAMP_S * (ramp(1.0) + ramp(-1.0)) + HOLD_S * hold
    return math.sqrt(2.0 * half / PERIOD_S)


async def machine(bench: DirectBench, cycles: int) -> None:
    """The controller: it moves the axis and knows nothing of who reads."""
    facts = await read_facts(bench.axis)
    await speed_move(bench.axis, bench.session, profile(cycles), WIDE, facts, lambda _x: None)


async def test_the_cycle_of_a_machine_is_read_while_another_moves_it() -> None:
    kept: dict[str, Any] = {}

    def keep(name: str, arrays: dict[str, Any], meta: dict[str, object]) -> None:
        kept.update(name=name, arrays=arrays, meta=meta)

    asked = CycleSettings(duration_s=7.0, motor_rated_nm=RATED_NM, thermal_time_min=15.0)
    async with direct(rigid(), drive="m6l") as bench:
        moving = asyncio.create_task(machine(bench, 9))
        await asyncio.sleep(1.5)
        found = await TOOL.run(Run(bench.axis, None, silent(), keep), asked)
        await moving
    assert found.period_s == pytest.approx(PERIOD_S, rel=0.01)
    assert found.periods >= 4
    truth = 100.0 * effective_nm() / RATED_NM
    assert found.rms_percent == pytest.approx(truth, rel=0.03)
    low, high = found.rms_ci95_percent
    assert low is not None and high is not None and low < high
    assert found.highest_speed_rpm == pytest.approx(SPEED_RPM, rel=0.05)
    assert found.power is not None
    # While it brakes: (J·α − Coulomb − viscous·ω)·ω, twice a period, where that is positive.
    alpha, omega = SPEED_RPM * RPM / RAMP_S, SPEED_RPM * RPM
    force, slope = INERTIA * alpha - COULOMB, VISCOUS * omega
    braking = 2.0 * RAMP_S * omega * (force / 2.0 - slope / 3.0)
    assert found.power.braking_j == pytest.approx(braking, rel=0.05)
    assert found.verdict in ("endures", "undecided")
    again = TOOL.reevaluate(kept["arrays"], kept["meta"])
    assert again == found


async def test_nothing_is_written_and_an_idle_axis_is_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Polled, as beside a controller on another bus: no exchange of process data runs."""
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
