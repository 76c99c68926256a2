"""A safety function that a person triggers on a virtual axis, and the same one failing.

What the axis does after the torque has gone follows from its inertia and friction alone; how a
power stage switches off, and in what it fails, is planted here and known to no tool.
"""

from __future__ import annotations

import math
from typing import Any

import pytest

from backend.axes.axis.restoring import RestoreFailed
from backend.tools.watching.safety_check.run import TOOL, plan_of
from drivers.errors import NotAllowed, OutOfRange
from drivers.virtual.firmware.cia402.states import State as Firmware
from tests.virtual.tools.direct import DirectBench, direct
from tests.virtual.tools.set_ups.safety_check import (
    ASKED,
    COULOMB_NM,
    INERTIA,
    RATED_NM,
    RPM,
    braked,
    off,
    recorded,
    stiff,
)


def told_only(bench: DirectBench) -> None:
    """The drive says that it has no power, and runs on: a channel that is bridged."""
    control = bench.link.device.control
    control.modes.end()
    control.state = Firmware.SWITCH_ON_DISABLED


async def test_safe_torque_off_coasts_by_friction_alone() -> None:
    """Coulomb friction brakes: t = Jω/T, and the way is half of what that speed would make."""
    async with direct(stiff(), drive="r6l") as bench:
        found = await recorded(bench, off)
    omega = 2 * math.pi * RPM / 60.0
    coast_s = INERTIA * omega / COULOMB_NM
    assert found.verdict == "recorded"
    assert found.sign == "state"
    assert found.speed_rpm == pytest.approx(RPM, rel=0.02)
    assert found.torque_before_percent == pytest.approx(100 * COULOMB_NM / RATED_NM, rel=0.15)
    assert found.torque_free_ms is not None
    assert found.torque_free_ms <= 4.0
    assert found.stop_ms == pytest.approx(1e3 * coast_s, rel=0.06)
    assert found.stop_rev == pytest.approx(0.5 * RPM / 60.0 * coast_s, rel=0.05)
    assert found.torque_after_percent is not None
    assert found.torque_after_percent <= found.torque_noise_percent


async def test_torque_that_remains_is_told_as_danger() -> None:
    """What keeps it running against its friction is torque. Its mode cannot be restored then."""
    kept: dict[str, Any] = {}
    async with direct(stiff(), drive="r6l") as bench:
        with pytest.raises(RestoreFailed):
            await recorded(bench, told_only, kept=kept)
    found = TOOL.reevaluate(kept["arrays"], kept["meta"])
    assert found.verdict == "torque_remains"
    assert found.torque_free_ms is None
    assert "Put the axis out of use" in TOOL.text(TOOL.report(found).notes[0].name)


async def test_what_else_stopped_the_axis_is_named() -> None:
    """An entry of the fault table by itself: the person decides whether it is of the function."""
    async with direct(stiff(), drive="r6l") as bench:
        found = await recorded(bench, lambda b: b.link.device.control.faults.raise_code("AL.301"))
    assert found.reports
    assert "AL.301" in found.reports[0]
    assert any(note.name == "reports" for note in TOOL.report(found).notes)


async def test_a_stop_by_ramp_is_ss1_and_a_coasting_one_is_not() -> None:
    asked = ASKED.model_copy(
        update={"function": "ss1", "stop_limit_ms": 300.0, "stop_limit_rev": 1.5}
    )
    async with direct(stiff(), drive="r6l") as bench:
        found = await recorded(bench, braked, asked)
    assert found.verdict == "within_limits"
    assert found.stop_ms == pytest.approx(200.0, abs=20.0)
    assert found.stop_rev == pytest.approx(0.5 * RPM / 60.0 * 0.2, rel=0.06)
    async with direct(stiff(), drive="r6l") as bench:
        found = await recorded(bench, off, asked)
    assert found.verdict == "power_off_at_speed"


@pytest.mark.long
async def test_nothing_triggered_is_no_pass_and_limits_are_judged() -> None:
    async with direct(stiff(), drive="r6l") as bench:
        found = await recorded(bench, None)
        assert found.verdict == "not_triggered"
        assert found.torque_free_ms is None
        asked = ASKED.model_copy(update={"stop_limit_ms": 50.0, "stop_limit_rev": 0.1})
        found = await recorded(bench, off, asked)
    assert found.verdict == "beyond_limits"
    assert set(found.exceeded) == {"stop_time", "stop_distance"}


async def test_a_speed_limit_that_does_not_act_is_found() -> None:
    asked = ASKED.model_copy(
        update={"function": "speed_limit", "limited_rpm": 400.0, "wait_s": 2.0}
    )
    async with direct(stiff(), drive="r6l") as bench:
        found = await recorded(bench, None, asked)
    assert found.verdict == "no_reaction"
    assert found.highest_rpm == pytest.approx(RPM, rel=0.03)


async def test_nothing_moves_without_a_statement_or_without_room() -> None:
    async with direct(stiff(), drive="r6l") as bench:
        for changed, error in (
            ({"nothing_hangs": False}, NotAllowed),
            ({"speed_rpm": 950.0}, OutOfRange),
            ({"function": "limit_positive", "travel_limit": 5.0}, OutOfRange),
            ({"function": "speed_limit"}, OutOfRange),
        ):
            with pytest.raises(error):
                await recorded(bench, off, ASKED.model_copy(update=changed))
        units = await bench.axis.units()
        assert abs(units.velocity(bench.link.highest["speed"])) < 1.0, "the encoder's noise"


def test_a_short_axis_moves_to_and_fro_within_its_travel() -> None:
    plan = plan_of(ASKED.model_copy(update={"travel_limit": 20.0}), 1000.0, 0.0)
    way = plan.cumsum() / 60.0 / 1000.0
    assert -0.01 <= way.min() <= way.max() <= 0.86 * 20.0
    assert plan.max() == pytest.approx(RPM)
    assert plan.min() == pytest.approx(-RPM)
