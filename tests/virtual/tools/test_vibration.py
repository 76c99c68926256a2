"""Vibration over speed, and a dwell, on virtual axes whose mechanics the tools do not know.

The truth is analytic: orders are those of the ripple, the mode is that of motor and load, and at
one frequency speed over torque is the impedance of the chain, whatever the drive's loops do.
"""

from __future__ import annotations

import asyncio
import math
from typing import Any

import pytest

from backend.tools.moving.dwell.result import DwellResult
from backend.tools.moving.dwell.run import TOOL as DWELL
from backend.tools.moving.dwell.settings import DwellSettings
from backend.tools.tool import AnyTool, Run
from backend.tools.tuning.sweep import profile_speed
from backend.tools.watching.vibration.result import VibrationResult
from backend.tools.watching.vibration.run import TOOL as VIBRATION
from backend.tools.watching.vibration.settings import VibrationSettings
from drivers.cia402 import State
from drivers.errors import EnvelopeExceeded, NotAllowed, OutOfRange
from drivers.virtual.mechanics import MechanicsSpec, PlaceSpec, RippleSpec, analytic_response
from tests.virtual.tools.direct import DirectBench, direct
from tests.virtual.tools.rig import At, mechanics, settings_of, silent

RATED_NM = 1.27
#: 36 per revolution of the motor, and 7.3 of what the last inertia meets.
RIPPLE = RippleSpec(revolution_nm=0.002, cogging_nm=0.015, cogging_per_rev=36, phase_rad=0.4)
PLACE = PlaceSpec(torque_nm=0.012, period_rev=1 / 7.3)
STIFFNESS, MOTOR, LOAD = 30.0, 5e-5, 3e-5
CHAIN = mechanics((LOAD, STIFFNESS, 0.002), motor=MOTOR, viscous=3e-4)
#: Free motor and load against each other.
MODE_HZ = math.sqrt(STIFFNESS * (1 / MOTOR + 1 / LOAD)) / (2 * math.pi)
MAP = VibrationSettings(
    travel_limit=4.0,
    speed_limit=800.0,
    torque_limit=80.0,
    rated_torque_nm=RATED_NM,
    speeds=5,
    closer=5,
    slowest_rpm=200.0,
)
VIBRATE = DwellSettings(
    travel_limit=0.5, speed_limit=300.0, torque_limit=60.0, rated_torque_nm=RATED_NM,
    frequency_hz=60.0, by="torque", amplitude_percent=8.0, turn_rpm=60.0, duration_s=3.0,
)  # fmt: skip


async def asked(
    bench: DirectBench, tool: AnyTool, settings: Any, keep: Any = None, progress: Any = None
) -> Any:
    """As a job does it, and as the result is stored."""
    async with profile_speed.prepared(bench.axis, bench.session, settings.envelope, True):
        run = Run(bench.axis, bench.session, progress or silent(), keep)
        found = await tool.run(run, settings)
    return tool.result.model_validate(found.model_dump(mode="json"))


class Kept:
    """The raw data of one run."""

    def __call__(self, _name: str, arrays: Any, meta: Any) -> None:
        self.arrays, self.meta = arrays, meta


@pytest.mark.long
async def test_orders_and_the_mode_that_they_excite() -> None:
    spec = CHAIN.model_copy(update={"ripple": RIPPLE, "place": PLACE})
    kept = Kept()
    async with direct(spec, drive="r6l", settings={"2006:01": 60}) as bench:
        before, home = await settings_of(bench.axis.drive), await bench.axis.position_raw()
        found: VibrationResult = await asked(bench, VIBRATION, MAP, kept)
        away = (await bench.axis.units()).position(await bench.axis.position_raw() - home)
        after, state = await settings_of(bench.axis.drive), await bench.axis.state()
    orders = {round(each.order_per_rev, 1): each for each in found.orders}
    for order, place in ((36.0, "whole"), (7.3, "not_whole")):
        assert orders[order].order_per_rev == pytest.approx(order, abs=0.01)
        assert orders[order].place == place
    # A soft loop moves the mode by some percent at most.
    (mode,) = found.resonances
    assert mode.frequency_hz == pytest.approx(MODE_HZ, rel=0.03)
    low, high = mode.frequency_ci95_hz
    assert high - low < 0.1 * MODE_HZ
    avoid = next(each for each in mode.avoid if round(each.order_per_rev) == 36)
    assert avoid.low_rpm < 60.0 * MODE_HZ / 36 < avoid.high_rpm
    assert found.band_hz[1] == pytest.approx(400.0)
    assert {"band", "highest_order", "motor_side", "listen"} <= {e.code for e in found.findings}
    assert after == before
    assert state is not State.OPERATION_ENABLED
    assert abs(away) < 0.05
    assert VIBRATION.reevaluate(kept.arrays, kept.meta) == found


@pytest.mark.long
@pytest.mark.parametrize("drive", ["m6l"])
async def test_an_axis_without_ripple_has_no_order_and_no_resonance(drive: str) -> None:
    brief = MAP.model_copy(update={"closer": 0, "slowest_rpm": 300.0})
    async with direct(CHAIN, drive=drive) as bench:
        found: VibrationResult = await asked(bench, VIBRATION, brief)
    assert (found.orders, found.resonances) == ((), ())
    assert found.findings[0].code in ("nothing_seen", "orders_only")


async def test_limits_without_room_or_time_are_refused() -> None:
    async with direct(CHAIN) as bench:
        with pytest.raises(OutOfRange, match="more than the time limit"):
            await asked(bench, VIBRATION, MAP.model_copy(update={"time_limit_s": 10.0}))
        with pytest.raises(OutOfRange, match="too narrow for a series of speeds"):
            await asked(bench, VIBRATION, MAP.model_copy(update={"slowest_rpm": 790.0}))


@pytest.mark.long
@pytest.mark.parametrize("drive", ["r6l", "mms7"])
async def test_a_dwell_shows_the_impedance_of_the_chain(drive: str) -> None:
    kept = Kept()
    async with direct(CHAIN, drive=drive) as bench:
        before, home = await settings_of(bench.axis.drive), await bench.axis.position_raw()
        seen = At("vibrating at 60 Hz", lambda: None, 0.5)
        found: DwellResult = await asked(bench, DWELL, VIBRATE, kept, seen.progress)
        away = (await bench.axis.units()).position(await bench.axis.position_raw() - home)
        after, state = await settings_of(bench.axis.drive), await bench.axis.state()
    assert seen.done
    assert found.seen
    assert found.findings[0].code == "excited"
    speed_rad_s = found.speed_rpm.value * 2 * math.pi / 60.0
    torque_nm = found.torque_percent.value / 100.0 * RATED_NM
    impedance = abs(complex(analytic_response(CHAIN, 60.0)))
    assert speed_rad_s / torque_nm == pytest.approx(impedance, rel=0.06)
    assert found.position_deg.value == pytest.approx(
        found.speed_rpm.value * 6.0 / (2 * math.pi * 60.0), rel=1e-6
    )
    assert after == before
    assert state is not State.OPERATION_ENABLED
    assert abs(away) < 0.05
    assert DWELL.reevaluate(kept.arrays, kept.meta) == found


async def test_a_dwell_that_friction_holds_is_not_called_a_vibration() -> None:
    held = mechanics((LOAD, STIFFNESS, 0.002), motor=MOTOR, coulomb=0.1)
    still = VIBRATE.model_copy(
        update={"by": "speed", "amplitude_rpm": 3.0, "turn_rpm": 0.0, "duration_s": 2.0}
    )
    async with direct(held, drive="r6l") as bench:
        found: DwellResult = await asked(bench, DWELL, still)
    assert not found.seen
    assert found.phase_deg is None
    assert [each.code for each in found.findings][:2] == ["not_seen", "turn_slowly"]


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"frequency_hz": 400.0}, "form a sine of at most"),
        ({"turn_rpm": 290.0}, "more than the"),
        ({"amplitude_percent": 55.0}, "of the torque limit"),
        ({"time_limit_s": 3.0}, "more than the time limit"),
        ({"by": "speed", "amplitude_rpm": 1e-6}, "resolution of the setpoint"),
    ],
)
async def test_a_dwell_beyond_the_envelope_is_refused(changed: dict[str, Any], words: str) -> None:
    async with direct(CHAIN) as bench:
        home = await bench.axis.position_raw()
        with pytest.raises(OutOfRange, match=words):
            await asked(bench, DWELL, VIBRATE.model_copy(update=changed))
        assert await bench.axis.position_raw() == home


@pytest.mark.long
@pytest.mark.parametrize("ending", ["cancelled", "fault", "envelope"])
async def test_a_dwell_ends_and_everything_is_as_before(ending: str) -> None:
    settings = VIBRATE.model_copy(update={"duration_s": 20.0})
    if ending == "envelope":
        # At the mode the chain answers with far more speed than the limit permits.
        settings = settings.model_copy(
            update={
                "frequency_hz": round(MODE_HZ, 1),
                "amplitude_percent": 45.0,
                "speed_limit": 90.0,
                "turn_rpm": 20.0,
            }
        )
    spec: MechanicsSpec = CHAIN
    async with direct(spec, drive="r6l") as bench:
        before = await settings_of(bench.axis.drive, "6060:00")

        def end() -> None:
            if ending == "fault":
                bench.link.device.inject("over_temperature")  # type: ignore[attr-defined]
            elif ending == "cancelled":
                running.cancel()

        at = At("vibrating", end, 0.2)
        running = asyncio.ensure_future(asked(bench, DWELL, settings, None, at.progress))
        kind = EnvelopeExceeded if ending == "envelope" else (asyncio.CancelledError, NotAllowed)
        with pytest.raises(kind):
            await running
        assert at.done or ending == "envelope"
        assert await settings_of(bench.axis.drive, "6060:00") == before
        assert await bench.axis.state() is not State.OPERATION_ENABLED
