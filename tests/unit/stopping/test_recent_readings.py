"""What STOP knows without asking the drive is what was read a moment ago."""

from __future__ import annotations

import asyncio
import math
import time
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import pytest

from backend.axes.axis.stop import braking
from backend.axes.axis.stop.facts import Verdict
from backend.axes.drive.drive import Drive
from backend.axes.drive.readings import Reading
from backend.axes.stopping.watch import StopWatch
from tests.support.servo import POSITION, Place, Servo, bench_with

ENABLED = 0x237
VELOCITY: Place = (0x606C, 0)


@pytest.mark.parametrize(("age_s", "counts"), [(0.1, True), (3600.0, False), (-3600.0, False)])
def test_a_reading_counts_where_its_age_is_known_and_small(age_s: float, counts: bool) -> None:
    """A clock that was set back makes an old reading lie in the future: its age is not known."""
    reading = Reading("6041:00", ENABLED, ENABLED, time.time() - age_s)
    drive = cast(Drive, SimpleNamespace(readings={"6041:00": reading}))
    assert (braking._seen(drive, "6041:00") == ENABLED) is counts


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("swings", [False, True])
async def test_an_axis_that_swings_through_its_old_place_is_not_at_rest(
    swings: bool, tmp_path: Path
) -> None:
    """An identification by the drive itself turns the axis there and back.

    Where it turns round, it has the position that was read before it began, and no speed. Its
    status word shows no power in some drives.
    """
    servo = Servo()
    bench, connected = await bench_with(servo, tmp_path)
    axis = connected.axis
    units = await axis.units()
    drive = connected.drive
    await drive.read_many([drive.require(r) for r in ("status_word", "position_actual")])
    await asyncio.sleep(0.1)
    counts = units.counts_per_rev
    assert counts is not None
    began_s, period_s = time.monotonic(), 1.0

    def swing(place: Place) -> None:
        # 300 rpm at most. STOP comes at a reversal: the position is the old one, the speed 0.
        phase = 2 * math.pi * (time.monotonic() - began_s) / period_s
        peak_rev_s = 5.0
        if place == POSITION:
            travel_rev = peak_rev_s * period_s / (2 * math.pi) * (1 - math.cos(phase))
            servo.set(POSITION, round(travel_rev * counts))
        elif place == VELOCITY:
            servo.set(VELOCITY, round(peak_rev_s * 60 * math.sin(phase) / units.velocity(1)))

    if swings:
        servo.on_read = swing
    try:
        found = await StopWatch(axis).run()
    finally:
        servo.on_read = lambda _place: None
        await bench.close()
    assert (found.verdict is Verdict.STOPPED) is not swings
