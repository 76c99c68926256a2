"""The brake test on virtual axes whose brake's holding torque is set, and who may be tested.

What the shaft carries is brake and bearing friction together: 0.9·T + Coulomb and so on.
"""

from __future__ import annotations

import asyncio
import contextvars
import math
from collections.abc import Mapping

import pytest

from backend.commands.measuring.tools import lines_of
from backend.tools.mechanics.brake.run import TOOL
from backend.tools.mechanics.brake.settings import BrakeSettings
from backend.tools.tool import Run
from backend.tools.tuning.sweep import profile_speed
from drivers.cia402 import State
from drivers.errors import Busy, NotAllowed, OutOfRange
from drivers.virtual.defects import SLIPS, planted
from drivers.virtual.firmware.kernel import layout as k
from tests.virtual.tools.can_rig import can_bench, incremental
from tests.virtual.tools.direct import direct
from tests.virtual.tools.rig import At, settings_of, silent
from tests.virtual.tools.set_ups.brake import (
    ASKED,
    COULOMB_NM,
    CUT,
    M6L,
    RATED_NM,
    WINDUP_REV,
    brake_of,
    braked,
    on,
)


@pytest.mark.long
@pytest.mark.parametrize(
    ("drive", "asked", "settings"), [("m6l", ASKED, M6L), ("r6l", CUT, {}), ("ep3e", CUT, {})]
)
async def test_a_good_brake_holds_and_its_windup_is_no_slip(
    drive: str, asked: BrakeSettings, settings: Mapping[str, int]
) -> None:
    spec = braked(2.0 * RATED_NM, windup_rev=2 * WINDUP_REV, supplied=asked is ASKED)
    found, _ = await on(drive, spec, asked, settings)
    assert found.verdict == "held"
    assert found.means == ("output" if asked is ASKED else "supply")
    assert [way.direction for way in found.ways] == [1, -1]
    for way in found.ways:
        assert way.torque_percent == pytest.approx(100.0, rel=0.05)
        low, high = way.torque_ci95_percent
        assert low < 100.0 < high
        # 0.008 rev at twice the rated torque: 90 % from preload to test torque, bearings included.
        assert way.windup_rev == pytest.approx(0.9 * WINDUP_REV, rel=0.1)
        assert way.slip_rev < 0.0004
        assert way.travel_rev <= 0.02


@pytest.mark.long
@pytest.mark.parametrize(
    ("drive", "asked", "settings"), [("m6l", ASKED, M6L), ("r6l", CUT, {}), ("ep3e", CUT, {})]
)
async def test_a_worn_brake_is_found_and_the_torque_is_gone_in_time(
    drive: str, asked: BrakeSettings, settings: Mapping[str, int]
) -> None:
    worn_nm = SLIPS * RATED_NM
    good = braked(2.0 * RATED_NM, windup_rev=WINDUP_REV, supplied=asked is ASKED)
    spec = planted(good, "brake_slips")
    found, _ = await on(drive, spec, asked, settings)
    truth = 100.0 * (worn_nm + COULOMB_NM) / RATED_NM
    assert found.verdict == "slipped"
    words = lines_of(TOOL, found)[0]
    assert words.startswith(f"The brake slipped at {found.torque_percent:.3g} %")
    assert "secure the load, and have the brake repaired or replaced" in words
    assert found.torque_percent == pytest.approx(truth, rel=0.05)
    assert len(found.ways) == 2
    for way in found.ways:
        assert way.verdict == "slipped"
        assert way.torque_percent == pytest.approx(truth, rel=0.05)
        assert way.abort_ms is not None
        assert way.abort_ms <= 20.0
        assert way.slip_rev > 0.01
        assert way.travel_rev < 0.05


async def test_the_shaft_itself_after_the_limit_was_passed() -> None:
    """By the mechanics, not by what the drive reports: from the limit to no more torque."""
    spec = braked(0.6 * RATED_NM)
    async with direct(spec, drive="m6l", settings=M6L) as bench:
        seen: list[tuple[float, float, float]] = []
        core = bench.link.device.axis  # type: ignore[attr-defined]
        advance = bench.link.device.advance

        def watched(t_ns: int) -> None:
            advance(t_ns)
            turned = core._x[0] / (2 * math.pi)
            seen.append((t_ns / 1e6, turned, float(core.s[k.S_TORQUE])))

        bench.link.device.advance = watched  # type: ignore[method-assign]
        await brake_of(bench.axis, bench.session)
    passed = next(at for at, turned, _ in seen if turned >= 0.02)
    gone = next(at for at, _, nm in seen if at > passed and abs(nm) < 0.05 * RATED_NM)
    assert gone - passed <= 20.0


@pytest.mark.parametrize(("drive", "furthest_rev"), [("r6l", 0.2), ("ep3e", 0.5)])
async def test_a_shaft_is_stopped_where_the_brake_lets_go_altogether(
    drive: str, furthest_rev: float
) -> None:
    """It opens at 90 % of the rated torque and does not close again; one direction is tested.

    In torque modes the quick stop of an EP3E only lets the torque fall (6087h): the shaft coasts.
    """
    spec = braked(2.0 * RATED_NM, windup_rev=WINDUP_REV, supplied=False)
    async with direct(spec, drive=drive) as bench:
        core = bench.link.device.axis  # type: ignore[attr-defined]
        advance = bench.link.device.advance
        opened = []

        def watched(t_ns: int) -> None:
            advance(t_ns)
            if not opened and abs(float(core.s[k.S_TORQUE])) > 0.9 * RATED_NM:
                opened.append(t_ns)
                core.p[k.P_BRAKE_TORQUE] = 0.0

        bench.link.device.advance = watched  # type: ignore[method-assign]
        found = await brake_of(bench.axis, bench.session, CUT)
        assert await bench.axis.state() is not State.OPERATION_ENABLED
        turned_rev = abs(core._x[0]) / (2 * math.pi)
        assert abs(core._x[1]) < 0.1 * 2 * math.pi
    assert opened
    assert turned_rev < furthest_rev
    assert found.verdict == "slipped"
    (way,) = found.ways
    assert way.direction == 1
    assert 0.05 < way.travel_rev < furthest_rev
    assert way.abort_ms is not None
    assert way.abort_ms <= 20.0


@pytest.mark.long
async def test_an_open_brake_moves_by_the_preload_alone() -> None:
    """Its output is another one than the drive was reported: it follows the power stage."""
    spec = braked(2.0 * RATED_NM)
    spec = spec.model_copy(update={"motor": spec.motor.model_copy(update={"brake_output": False})})
    found, _ = await on("m6l", spec, settings=M6L)
    assert found.verdict == "not_closed"
    (way,) = found.ways
    assert way.torque_ci95_percent[1] <= 12.0
    assert abs(way.travel_rev) < 0.3


@pytest.mark.long
async def test_a_supported_load_of_a_vertical_axis_adds_to_the_torque() -> None:
    """Positive is up: what lifts carries the load first, what lowers has it on its side."""
    pulls_nm = 0.2 * RATED_NM
    asked = ASKED.model_copy(update={"nothing_hangs": False, "load_supported": True})
    found, _ = await on("m6l", braked(0.6 * RATED_NM, gravity_nm=pulls_nm), asked, M6L)
    up, down = found.ways
    assert up.torque_percent == pytest.approx(100 * (0.8 + COULOMB_NM / RATED_NM), rel=0.05)
    assert down.torque_percent == pytest.approx(100 * (0.4 + COULOMB_NM / RATED_NM), rel=0.07)


@pytest.mark.long(keep=2)
@pytest.mark.parametrize(
    ("drive", "asked", "settings", "obstacle"),
    [
        ("mms7", ASKED, {}, "built_in"),
        ("mms7", CUT, {}, "built_in"),
        ("r6l", ASKED, {}, "fixed_output"),
        ("ep3e", ASKED, {}, "bus_bit"),
        ("m6l", ASKED, {}, "no_output"),
        ("m6l", ASKED, {**M6L, "2003:16": 1}, "output_inverted"),
    ],
)
async def test_where_a_drive_has_no_way_nothing_moves_and_the_result_says_why(
    drive: str, asked: BrakeSettings, settings: Mapping[str, int], obstacle: str
) -> None:
    found, bench = await on(drive, braked(2.0 * RATED_NM), asked, settings)
    assert (found.verdict, found.obstacle) == ("cannot_be_tested", obstacle)
    assert found.ways == ()
    assert bench.link.highest["torque"] == 0


async def test_nothing_moves_before_somebody_said_what_hangs_and_what_torque_is_permitted() -> None:
    async with direct(braked(2.0 * RATED_NM), drive="m6l", settings=M6L) as bench:
        unsaid = ASKED.model_copy(update={"nothing_hangs": False})
        with pytest.raises(NotAllowed) as refused:
            await brake_of(bench.axis, bench.session, unsaid)
        assert refused.value.code == "brake.say-what-hangs"
        little = ASKED.model_copy(update={"torque_limit": 100.0})
        with pytest.raises(OutOfRange) as limited:
            await brake_of(bench.axis, bench.session, little)
        assert limited.value.code == "brake.torque-not-permitted"
        assert bench.link.highest["torque"] == 0


@pytest.mark.long
async def test_a_test_that_is_cancelled_puts_the_output_back_and_takes_the_power_off() -> None:
    async with direct(braked(2.0 * RATED_NM), drive="m6l", settings=M6L) as bench:
        axis, drive = bench.axis, bench.axis.drive
        before = await settings_of(drive, drive.require("mode"))
        seen: list[int] = []

        def cancel() -> None:
            seen.append(bench.link.device.od.number("2003:10"))  # type: ignore[attr-defined]
            task.cancel()

        at = At("forwards", cancel, fraction=0.3)
        run = Run(axis, bench.session, at.progress)

        async def work() -> None:
            async with profile_speed.prepared(axis, bench.session, ASKED.envelope, True):
                await TOOL.run(run, ASKED)

        task = asyncio.create_task(work())
        with pytest.raises(asyncio.CancelledError):
            await task
        assert seen == [28]
        assert await settings_of(drive, drive.require("mode")) == before
        assert await axis.state() is not State.OPERATION_ENABLED
        assert bench.link.highest["torque"] > 0


@pytest.mark.long
async def test_nobody_forces_outputs_meanwhile() -> None:
    """Function 28 lets 60FEh switch the brake's output on."""
    async with direct(braked(2.0 * RATED_NM), drive="m6l", settings=M6L) as bench:
        axis, refused = bench.axis, []

        def force() -> None:
            drive, name = axis.drive, axis.drive.name
            keys = frozenset({"60FE:01", "60FE:02"})
            try:
                # As `backend.axes.functions.forcing` asks, from work that holds no grant.
                context = contextvars.Context()
                context.run(
                    lambda: drive.authority.granted(
                        drive.id, name, "forcing", keys=keys
                    ).__enter__()
                )
            except Busy as error:
                refused.append(error.code)

        at = At("forwards", force, fraction=0.3)
        async with profile_speed.prepared(axis, bench.session, ASKED.envelope, True):
            await TOOL.run(Run(axis, bench.session, at.progress), ASKED)
        assert refused == ["motion.moved-already"]


async def test_a_drive_that_takes_no_torque_says_so() -> None:
    async with can_bench(incremental(braked(2.0 * RATED_NM)), pace=40.0) as bench:
        found = await TOOL.run(Run(bench.axis, bench.session, silent()), ASKED)
    assert (found.verdict, found.obstacle) == ("cannot_be_tested", "no_torque_mode")


async def test_kept_raw_data_give_the_same_result() -> None:
    kept: dict[str, object] = {}
    asked = ASKED.model_copy(update={"brake_rated_nm": 2.0, "test_torque_nm": 1.0})
    spec = braked(0.6 * RATED_NM, windup_rev=WINDUP_REV)
    async with direct(spec, drive="m6l", settings=M6L) as bench:
        found = await brake_of(bench.axis, bench.session, asked, kept)
    again = TOOL.reevaluate(kept["arrays"], kept["meta"])  # type: ignore[arg-type]
    assert again.model_dump() == found.model_dump()
    assert kept["name"] == "brake-test"
    assert found.of_brake_percent == pytest.approx(
        100 * (0.6 * RATED_NM + COULOMB_NM) / 2.0, rel=0.05
    )
    section = TOOL.report(found)
    assert section.notes[0].name == "verdict.slipped"
