"""A tuning never makes an axis slower than it was without need, nor without saying so."""

from __future__ import annotations

from dataclasses import replace

import pytest

from backend.tools.measuring.temporary import put_back, write_settings
from backend.tools.tuning.autotune.design.candidates import plan
from backend.tools.tuning.autotune.present import KEPT
from backend.tools.tuning.notch.meaning import meaning_of
from tests.virtual.tools.rig import silent
from tests.virtual.tools.test_wrong_situations import (
    _FOUND,
    MMS7,
    ONE,
    apply,
    dump,
    found_of,
    unharmed,
)


@pytest.mark.long
async def test_gains_that_are_sound_and_faster_than_every_design_stay() -> None:
    found = await found_of(MMS7)
    best = next(c for c in found.candidates if "balanced" in c.marks)
    slow = replace(
        found.candidates[-1],
        marks=("balanced",),
        bandwidth_hz=0.5 * (best.bandwidth_hz or 0.0),
        gains=replace(
            best.gains,
            speed_nms=0.5 * best.gains.speed_nms,
            speed_bandwidth_hz=0.5 * best.gains.speed_bandwidth_hz,
        ),
    )
    inertia = found.inertia.result.inertia_kgm2.value
    async with unharmed(ONE, MMS7) as b:
        raw = await plan(b.axis, best, inertia)
        earlier = await write_settings(b.axis, raw)
        before = await dump(b)
        whole = _FOUND[MMS7.drive]
        try:
            _FOUND[MMS7.drive] = replace(found, candidates=(slow,)), meaning_of(b.axis.drive)
            result = await apply(b, MMS7, silent())
        finally:
            _FOUND[MMS7.drive] = whole
        assert await dump(b) == before
        await put_back(b.axis, earlier)
    assert result.before == {}
    assert KEPT in result.notes
    assert result.applied is not None
    assert abs(result.applied.gains.speed_nms / best.gains.speed_nms - 1) < 0.02
    # The loop was measured as it is, and shows what the design that was written guaranteed.
    assert result.verified is not None
    assert result.verified.kept
    measured, predicted = result.verified.measured_bandwidth_hz, best.bandwidth_hz
    assert measured is not None
    assert predicted is not None
    assert abs(measured / predicted - 1) < 0.1


@pytest.mark.long
async def test_gains_without_margins_make_way_for_a_slower_design_that_says_so() -> None:
    await found_of(MMS7)
    async with unharmed(ONE, MMS7, settings=MMS7.wild) as b:
        result = await apply(b, MMS7, silent())
        assert result.before
        await put_back(b.axis, result.before)
    assert result.verified is not None
    assert result.verified.kept
    (note,) = (note for note in result.notes if note.code == "autotune.slower-than-it-was")
    assert "margin is too small" in note.words()
