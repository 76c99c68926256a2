"""The load side on virtual drives with a second encoder, through the drive's own object 60E4h.

Truth is what the mechanics were given; the tool sees counts, torques and speeds alone.
"""

from __future__ import annotations

import math
from typing import Any

import pytest

from backend.commands.measuring.tools import lines_of
from backend.tools.mechanics.load_side.result import LoadSideResult
from backend.tools.mechanics.load_side.run import TOOL
from drivers.errors import NotAllowed
from drivers.virtual.defects import WORN_BACKLASH_RAD
from tests.virtual.tools.direct import direct
from tests.virtual.tools.rig import settings_of
from tests.virtual.tools.set_ups.demo import with_defect
from tests.virtual.tools.set_ups.load_side import (
    ASKED,
    CYCLE_S,
    DRIVE,
    GAP,
    LOAD,
    STIFFNESS,
    axis,
    measured,
)

pytestmark = pytest.mark.timeout(600)


def codes(found: LoadSideResult) -> list[str]:
    return [each.code for each in found.findings]


@pytest.mark.long
async def test_backlash_stiffness_and_error_are_those_of_the_mechanics() -> None:
    kept: dict[str, Any] = {}

    def keep(name: str, arrays: dict[str, Any], meta: dict[str, object]) -> None:
        kept.update(name=name, arrays=arrays, meta=meta)

    async with direct(axis(), CYCLE_S, drive=DRIVE) as bench:
        before = await settings_of(bench.axis.drive)
        home = await bench.axis.position_raw()
        found = await measured(bench, keep=keep)
        assert await settings_of(bench.axis.drive) == before
        away = (await bench.axis.units()).position(await bench.axis.position_raw() - home)
        assert abs(away) < 0.02
    degrees = math.degrees(GAP)
    assert found.backlash_deg is not None
    count = 360.0 / 2**17
    assert found.backlash_deg.value == pytest.approx(degrees, abs=max(0.05 * degrees, 2 * count))
    assert found.stiffness_nm_per_rad is not None
    assert found.stiffness_nm_per_rad.value == pytest.approx(STIFFNESS, rel=0.10)
    low, high = found.stiffness_nm_per_rad.ci95
    assert low is not None
    assert high is not None
    assert low < STIFFNESS < high
    assert found.locked_motor_hz is not None
    own = math.sqrt(STIFFNESS / LOAD) / (2 * math.pi)
    assert found.locked_motor_hz.value == pytest.approx(own, rel=0.05)
    assert found.load_inertia_kgm2 is not None
    assert found.load_inertia_kgm2.value == pytest.approx(LOAD, rel=0.10)
    assert found.counts_per_load_rev == pytest.approx(2**17, rel=1e-3)
    # Once per revolution with the amplitude of the eccentricity, twice with the second order's.
    first = {each.order_per_rev: each.amplitude_deg for each in found.error_orders}
    assert first[1.0] == pytest.approx(math.degrees(1e-3), rel=0.05)
    assert first[2.0] == pytest.approx(math.degrees(2e-4), rel=0.10)
    assert codes(found) == ["measured"]
    again = TOOL.reevaluate(kept["arrays"], kept["meta"])
    assert again.model_dump(mode="json") == found.model_dump(mode="json")


@pytest.mark.long
async def test_the_backlash_of_a_worn_belt_is_found_with_the_next_step() -> None:
    """As the demo plants it, on an axis that has no backlash otherwise."""
    healthy = axis(gap=0.0)
    async with direct(with_defect(healthy, "belt_worn"), CYCLE_S, drive=DRIVE) as bench:
        found = await measured(bench)
    assert codes(found)[0] == "measured"
    assert found.backlash_deg is not None
    truth = math.degrees(WORN_BACKLASH_RAD)
    assert found.backlash_deg.value == pytest.approx(truth, abs=max(0.05 * truth, 2 * 360 / 2**17))
    low, high = found.backlash_deg.ci95
    assert low is not None
    assert high is not None
    assert 0.0 < low < high
    words = lines_of(TOOL, found)[0]
    assert words.startswith("The backlash is")
    assert "belt tension" in words


@pytest.mark.long
async def test_an_encoder_behind_a_gear_that_counts_backwards() -> None:
    spec = axis(gap=0.01, gear=2.0, inverted=True, offset_counts=2**31 - 5000)
    asked = ASKED.model_copy(update={"gear_ratio": 2.0, "motor_inertia_kgm2": None})
    async with direct(spec, CYCLE_S, drive=DRIVE) as bench:
        found = await measured(bench, asked)
    assert found.counts_per_load_rev == pytest.approx(-(2**17), rel=1e-3)
    assert found.backlash_deg is not None
    assert found.backlash_deg.value == pytest.approx(math.degrees(0.01) / 2.0, rel=0.05)
    assert found.stiffness_nm_per_rad is None
    assert "motor_inertia_unknown" in codes(found)


async def test_a_drive_without_a_second_position_is_refused_before_anything_moves(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    bare = axis().model_copy(update={"load_encoder": None})
    for drive in (DRIVE, "m6l", "r6l"):
        async with direct(bare, drive=drive) as bench:
            touched: list[object] = []

            async def forbidden(*words: object, found: list[object] = touched) -> None:
                found.append(words)

            for name in ("write", "play", "drive_to"):
                monkeypatch.setattr(bench.link, name, forbidden)
            with pytest.raises(NotAllowed) as refused:
                await measured(bench)
            monkeypatch.undo()
            assert refused.value.code == "load-side.no-second-position"
            assert touched == []


@pytest.mark.long
async def test_a_load_that_came_off_is_named() -> None:
    spec = axis(gap=0.0, counts_per_rev=16)
    loose = spec.model_copy(
        update={
            "load": (
                spec.load[0].model_copy(
                    update={"stiffness_nm_per_rad": 1e-6, "damping_nms_per_rad": 0.0}
                ),
            )
        }
    )
    async with direct(loose, CYCLE_S, drive=DRIVE) as bench:
        with pytest.raises(NotAllowed) as refused:
            await measured(bench)
    assert refused.value.code == "load-side.load-stands"
