"""Command shaping on virtual axes whose mechanics the analysis does not assume.

The analysis knows one linear mode of the closed loop. The axes have friction at the motor,
backlash, a second mode and encoder noise, and each drive closes its loops by its own law. What the
load does is read from the virtual mechanics, which the tool does not see.
"""

from __future__ import annotations

import asyncio
import math
from typing import Any

import numpy as np
import pytest

from backend.axes.axis.axis import Axis
from backend.axes.drive.drive import Drive
from backend.axes.drive.ports import Port
from backend.tools.tool import Run
from backend.tools.tuning.shaping.run import TOOL
from drivers.cia402 import State
from drivers.errors import NotAllowed, OutOfRange
from drivers.virtual.firmware.factory import make_device
from profiles.loader import load_profile
from tests.virtual.tools.direct import STATION, DirectLink, direct
from tests.virtual.tools.rig import At, settings_of, silent
from tests.virtual.tools.set_ups.shaping import (
    ASKED,
    ROUGH,
    Load,
    arm,
    shape,
    zero_crossings_hz,
)


@pytest.mark.long
@pytest.mark.parametrize(
    ("drive", "frequency_hz", "acceleration_rpm_s"),
    [
        ("m6l", 8.0, 6000.0),
        ("mms7", 6.0, 6000.0),
        ("mms7", 15.0, 12000.0),
        ("ep3e", 8.0, 6000.0),
        ("r6l", 8.0, 6000.0),
    ],
)
async def test_a_shaper_halves_the_vibration_or_the_settling_time(
    drive: str, frequency_hz: float, acceleration_rpm_s: float
) -> None:
    asked = ASKED.model_copy(update={"acceleration": acceleration_rpm_s})
    kept: dict[str, Any] = {}

    def keep(name: str, arrays: dict[str, Any], meta: dict[str, object]) -> None:
        kept.update(name=name, arrays=arrays, meta=meta)

    async with direct(arm(frequency_hz, **ROUGH), drive=drive) as bench:
        before = await settings_of(bench.axis.drive)
        home = await bench.axis.position_raw()
        load = Load(bench)
        marks: list[int] = []
        progress = At("with the shaper", lambda: marks.append(len(load.speeds)))
        found = await shape(bench, asked, keep, progress.progress)
        units = await bench.axis.units()
        away = units.position(await bench.axis.position_raw() - home)
        after = await settings_of(bench.axis.drive)
        state = await bench.axis.state()
    assert found.verdict == "verified"
    assert found.comparison is not None
    assert found.mode is not None
    assert min(found.comparison.ratio, found.comparison.settling_ratio or 1.0) <= 0.5
    # The mechanics themselves: the load oscillates less, too, and at the frequency that was found.
    # Four periods of an oscillation that friction ends and backlash slows tell it to some percent.
    ends = load.ends()
    free, calm = [each for each in ends if each < marks[0]], [e for e in ends if e > marks[0]]
    assert min(len(free), len(calm)) >= 3
    truth = zero_crossings_hz(np.asarray(load.speeds)[free[0] + 100 : free[0] + 700])
    assert found.mode.frequency_hz == pytest.approx(truth, rel=0.05)
    left = [np.mean([load.left(each) for each in some]) for some in (calm, free)]
    assert left[0] <= 0.5 * left[1]
    assert abs(away) < 0.05
    assert after == before
    assert state is not State.OPERATION_ENABLED
    assert TOOL.reevaluate(kept["arrays"], kept["meta"]) == found


@pytest.mark.long
async def test_a_stiff_axis_shows_no_vibration_and_is_not_moved_again() -> None:
    async with direct(arm(400.0)) as bench:
        load = Load(bench)
        found = await shape(bench)
    assert found.verdict == "not_seen"
    assert (found.mode, found.comparison, found.shapers) == (None, None, ())
    assert "not_excited" in {each.code for each in found.findings}
    # Two moves out and back.
    assert len(load.ends()) == 4


@pytest.mark.long
async def test_a_stated_mode_that_the_motor_does_not_show_is_designed_for_and_not_tried() -> None:
    asked = ASKED.model_copy(update={"frequency_hz": 7.0, "damping": 0.02})
    async with direct(arm(400.0), drive="m6l") as bench:
        found = await shape(bench, asked)
    assert found.verdict == "stated"
    assert found.comparison is None
    zv = next(each for each in found.shapers if each.kind == "zv")
    assert zv.delay_s == pytest.approx(0.5 / (7.0 * math.sqrt(1 - 0.02**2)))
    # P09.26 in 0.1 Hz (000:3448); nothing is printed of what P09.27 means.
    values = {each.parameter: (each.raw, each.value, each.unit) for each in found.drive_values}
    assert values == {"P09.25": (0, 0.0, ""), "P09.26": (70, pytest.approx(7.0), "Hz")}
    unstated = [each.parameter for each in found.findings if each.code == "drive_unstated"]
    assert unstated == ["P09.27"]


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("ending", ["cancelled", "fault"])
async def test_everything_is_as_before_however_it_ends(ending: str) -> None:
    async with direct(arm(8.0)) as bench:
        before = await settings_of(bench.axis.drive, "6060:00")

        def end() -> None:
            if ending == "fault":
                bench.link.device.inject("over_temperature")  # type: ignore[attr-defined]
            else:
                running.cancel()

        at = At("without a shaper", end, 0.1)
        running = asyncio.ensure_future(shape(bench, progress=at.progress))
        with pytest.raises((asyncio.CancelledError, NotAllowed)):
            await running
        assert at.done
        assert await settings_of(bench.axis.drive, "6060:00") == before
        assert await bench.axis.state() is not State.OPERATION_ENABLED


@pytest.mark.parametrize(
    ("changed", "code"),
    [
        ({"size": 2.5}, "shaping.move-beyond-envelope"),
        ({"speed": 1000.0}, "shaping.move-beyond-envelope"),
        ({"time_limit_s": 3.0}, "shaping.takes-too-long"),
    ],
)
async def test_a_move_beyond_the_envelope_is_refused_before_anything_moves(
    changed: dict[str, float], code: str
) -> None:
    async with direct(arm(8.0)) as bench:
        with pytest.raises(OutOfRange) as refused:
            await shape(bench, ASKED.model_copy(update=changed))
        assert bench.link.highest["torque"] == 0.0
    assert refused.value.code == code


async def test_a_drive_without_cyclic_positions_is_refused_with_the_reason() -> None:
    profile = load_profile("ds_c")
    link = DirectLink(make_device("ds_c", arm(8.0)), profile)
    axis = Axis(Drive("x", "X", profile, [Port(link, STATION, profile.link("canopen"))]))
    with pytest.raises(NotAllowed) as refused:
        await TOOL.run(Run(axis, object(), silent()), ASKED)  # type: ignore[arg-type]
    assert refused.value.code == "shaping.no-cyclic-position"
