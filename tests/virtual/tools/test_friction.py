"""The friction map of every family against the analytic friction of the virtual mechanics.

Friction falls by 1 - tanh there, and by exp(-(v/vs)^δ) in the tool's model: neither is the other.
"""

from __future__ import annotations

import asyncio
from dataclasses import replace

import numpy as np
import pytest

from backend.tools.measuring.recording import bridged
from backend.tools.mechanics.friction.result import FrictionResult
from backend.tools.mechanics.friction.run import TOOL
from backend.tools.tool import Run
from drivers.cia402 import State
from drivers.errors import NotAllowed, OutOfRange
from drivers.link import ScopeBlock
from drivers.virtual.mechanics import FrictionSpec
from drivers.virtual.wires.netns import Namespace
from tests.virtual.tools.direct import DirectBench, direct
from tests.virtual.tools.rig import At, bench, settings_of, silent
from tests.virtual.tools.set_ups.friction import (
    ASKED,
    FRICTION,
    RATED_NM,
    RIPPLE,
    RIPPLED,
    SMOOTH,
    largest_error,
    mapped,
    true_percent,
    under,
)


def codes(found: FrictionResult) -> set[str]:
    return {each.code for each in found.findings}


@pytest.mark.long
@pytest.mark.parametrize("drive", ["mms7", "m6l", "r6l", "ep3e", "ds_c"])
async def test_the_curve_of_every_family(drive: str) -> None:
    async with under(drive, RIPPLED) as (axis, session):
        found = await mapped(axis, session)
    assert largest_error(found, RIPPLED) < 0.05
    speeds = np.array([p.speed_rpm for p in found.points])
    # Both directions, from slow to fast: a curve over the speeds measured and no others.
    assert speeds.min() < -400.0 < 400.0 < speeds.max()
    assert np.min(np.abs(speeds)) < 16.0
    assert np.max(np.abs(found.curve_speed_rpm)) == pytest.approx(np.max(np.abs(speeds)))
    truth = true_percent(RIPPLED, speeds)
    inside = [
        low <= true <= high
        for (low, high), true in zip(
            [p.torque_ci95_percent for p in found.points], truth, strict=True
        )
    ]
    assert np.mean(inside) >= 0.85
    orders = {each.order_per_rev: each for each in found.harmonics}
    # The third, 0.4 % of rated torque, is near to what a soft loop and a coarse encoder show.
    assert {1, 24} <= set(orders) <= {1, 24, 48}
    assert orders[24].amplitude_percent == pytest.approx(100 * 0.012 / RATED_NM, rel=0.15)
    low, high = orders[24].amplitude_ci95_percent
    assert low < 100 * 0.012 / RATED_NM < high
    # What was not measured is not known, and says so.
    assert found.standstill_percent is None
    assert "standstill_not_measured" in codes(found)
    coulomb, viscous = found.coulomb_percent, found.viscous_percent_per_rpm
    assert coulomb is not None
    assert viscous is not None
    assert coulomb.value == pytest.approx(100 * 0.04 / RATED_NM, rel=0.05)
    assert found.load_percent is not None
    assert found.load_percent.value == pytest.approx(0.0, abs=0.1)


@pytest.mark.long
async def test_gravity_is_a_constant_pull_and_no_friction() -> None:
    # Friction holds it without power, as a steep screw does: a drive without a brake lets go.
    hanging = FRICTION.model_copy(update={"gravity_nm": 0.03})
    spec = SMOOTH.model_copy(update={"friction": hanging})
    async with direct(spec) as b:
        found = await mapped(b.axis, b.session, ASKED.model_copy(update={"ripple": False}))
    assert found.load_percent is not None
    assert found.load_percent.value == pytest.approx(100 * 0.03 / RATED_NM, rel=0.03)
    for point in found.points:
        truth = true_percent(spec, point.speed_rpm) + 100 * 0.03 / RATED_NM
        assert point.torque_percent == pytest.approx(float(truth), rel=0.05)
    assert "ripple_not_asked" in codes(found)
    assert found.harmonics == ()


async def test_friction_without_stribeck_and_ripple_has_none() -> None:
    plain = FrictionSpec(viscous_nms=3e-4, coulomb_nm=0.04)
    async with direct(SMOOTH.model_copy(update={"friction": plain})) as b:
        found = await mapped(b.axis, b.session)
    assert found.stribeck_percent is None
    assert {"stribeck_not_seen", "ripple_not_seen"} <= codes(found)
    assert "compensation_in_controller" not in codes(found)
    assert found.harmonics == ()
    assert found.compensation_csv() is None
    assert found.viscous_percent_per_rpm is not None
    # 3e-4 Nm·s/rad in % of 1.27 Nm per rpm.
    expected = 3e-4 * 2 * np.pi / 60.0 / RATED_NM * 100.0
    low, high = found.viscous_percent_per_rpm.ci95
    assert low is not None
    assert high is not None
    assert low < expected < high
    assert found.viscous_percent_per_rpm.value == pytest.approx(expected, rel=0.05)


@pytest.mark.long
async def test_short_travel_is_gone_to_and_fro_and_says_no_ripple() -> None:
    asked = ASKED.model_copy(update={"travel_limit": 0.3, "speeds": 5})
    async with direct(SMOOTH) as b:
        home = await b.axis.position_raw()
        b.link.highest.update(low=home, high=home)
        found = await mapped(b.axis, b.session, asked)
        units = await b.axis.units()
        low, high = (units.position(b.link.highest[end] - home) for end in ("low", "high"))
    assert largest_error(found, SMOOTH) < 0.05
    assert {"ripple_needs_revolution", "fastest_by_travel"} <= codes(found)
    assert found.ripple_angle_deg == ()
    assert -0.3 <= low < -0.1 < 0.1 < high <= 0.3


@pytest.mark.long
async def test_a_torque_that_does_not_change_is_refused() -> None:
    async with direct(SMOOTH) as b:
        blocks = b.link.blocks

        def frozen(consumer):  # type: ignore[no-untyped-def]
            def without(block: ScopeBlock) -> None:
                column = next(i for i, n in enumerate(block.channels) if n.endswith("6077:00"))
                samples = block.samples.copy()
                samples[:, column] = 3.0
                consumer(replace(block, samples=samples))

            return blocks(without)

        b.link.blocks = frozen  # type: ignore[method-assign]
        with pytest.raises(NotAllowed, match="does not change during a reciprocating move"):
            await mapped(b.axis, b.session)


async def test_limits_that_leave_nothing_are_refused_before_the_map() -> None:
    asked = ASKED.model_copy(update={"slowest_rpm": 1000.0})
    async with direct(SMOOTH) as b:
        with pytest.raises(OutOfRange, match="lowest speed of the friction map"):
            await mapped(b.axis, b.session, asked)


@pytest.mark.long
@pytest.mark.parametrize("ending", ["cancelled", "fault"])
async def test_everything_is_as_before_however_it_ends(ending: str) -> None:
    async with direct(SMOOTH) as b:
        before = await settings_of(b.axis.drive, "6060:00")
        task = asyncio.current_task()
        assert task is not None

        def end() -> None:
            if ending == "fault":
                b.link.device.inject("over_temperature")  # type: ignore[attr-defined]
            else:
                running.cancel()

        at = At("both directions", end, 0.3)
        running = asyncio.ensure_future(mapped(b.axis, b.session, ASKED, at.progress))
        with pytest.raises((asyncio.CancelledError, NotAllowed)):
            await running
        assert at.done
        assert await settings_of(b.axis.drive, "6060:00") == before
        assert await b.axis.state() is not State.OPERATION_ENABLED


@pytest.mark.long
async def test_kept_raw_data_give_the_same_map_and_lost_samples_do_not_bend_it() -> None:
    """A busy computer loses samples in runs; the ripple in such a gap is not a straight line."""
    kept: dict[str, object] = {}
    async with direct(RIPPLED) as b:
        found = await _kept(b, kept)
    again = TOOL.reevaluate(kept["arrays"], kept["meta"])  # type: ignore[arg-type]
    assert again == found
    compensates(found)
    with pytest.raises(ValueError, match="not the raw data"):
        TOOL.reevaluate({}, {})

    arrays = dict(kept["arrays"])  # type: ignore[call-overload]
    plateau, valid = arrays["plateau"], arrays["valid"].copy()
    rng = np.random.default_rng(5)
    for number in np.unique(plateau[plateau != 0]):
        at = np.flatnonzero(plateau == number)
        run = round(0.15 * at.size)
        first = int(rng.integers(0, at.size - run))
        valid[at[first : first + run]] = False
    rows = np.column_stack([arrays["position_rad"], arrays["torque_nm"]])
    rows[~valid] = 0.0
    filled = bridged(rows, valid)
    arrays |= {"valid": valid, "position_rad": filled[:, 0], "torque_nm": filled[:, 1]}
    found = TOOL.reevaluate(arrays, kept["meta"])  # type: ignore[arg-type]
    assert isinstance(found, FrictionResult)
    assert largest_error(found, RIPPLED) < 0.02
    assert {1, 24} <= {each.order_per_rev for each in found.harmonics} <= {1, 24, 48}


def compensates(found: FrictionResult) -> None:
    """The table takes the ripple of the mechanics away, by place and by sign."""
    rows = [line.split(",") for line in str(found.compensation_csv()).splitlines()]
    assert rows[0] == ["position_rev", "torque_percent", "forward_percent", "backward_percent"]
    place, torque = np.array([[float(each) for each in row[:2]] for row in rows[1:]]).T
    assert (place[0], place[-1]) == (
        pytest.approx(0.5 / 360, abs=1e-6),
        pytest.approx(1 - 0.5 / 360),
    )
    truth = (
        RIPPLE.revolution_nm * np.sin(2 * np.pi * place + RIPPLE.phase_rad)
        + RIPPLE.cogging_nm * np.sin(24 * 2 * np.pi * place + RIPPLE.phase_rad)
        + RIPPLE.cogging_second_nm * np.sin(48 * 2 * np.pi * place + RIPPLE.phase_rad)
    )
    left = torque - 100.0 * truth / RATED_NM
    assert np.std(left) < 0.15 * np.std(100.0 * truth / RATED_NM)
    assert "compensation_in_controller" in codes(found)


async def _kept(b: DirectBench, kept: dict[str, object]) -> FrictionResult:
    def keep(_kind: str, arrays: object, meta: object) -> None:
        kept.update(arrays=arrays, meta=meta)

    asked = ASKED.model_copy(update={"speeds": 4})
    found = await TOOL.run(Run(b.axis, b.session, silent(), keep), asked)
    assert isinstance(found, FrictionResult)
    return found


@pytest.mark.long
async def test_over_ethercat_frames(namespace: Namespace) -> None:
    async with bench(namespace, RIPPLED, drive="r6l") as b:
        found = await mapped(b.axis, b.session, ASKED.model_copy(update={"speeds": 5}))
    assert largest_error(found, RIPPLED) < 0.05
    assert {1, 24} <= {each.order_per_rev for each in found.harmonics}
