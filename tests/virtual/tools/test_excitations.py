"""Chirp, PRBS and stepped sine measure what the multisine does; files of them open again."""

from __future__ import annotations

from datetime import UTC, datetime

import pytest

from backend.records.library.measurements import pack, unpack
from backend.station.evaluation import recompute
from backend.tools.measuring.waveform import Waveform
from backend.tools.tuning.sweep.evaluation import Loop, SweepSettings
from backend.tools.tuning.sweep.run import sweep
from backend.tools.tuning.sweep.stored import answer_of
from drivers.errors import OutOfRange
from tests.virtual.tools.direct import direct
from tests.virtual.tools.rig import WIDE, errors, mechanics, silent

ONE = mechanics((1e-4, 60.0, 0.006))


@pytest.mark.long
@pytest.mark.parametrize(
    ("waveform", "loop", "drive"),
    [("chirp", "none", "mms7"), ("prbs", "none", "mms7"), ("stepped", "auto", "r6l")],
)
async def test_mechanics(waveform: Waveform, loop: Loop, drive: str) -> None:
    kept: list[tuple] = []
    async with direct(ONE, drive=drive) as b:
        found = await sweep(
            b.axis,
            b.session,
            SweepSettings(WIDE, loop=loop, excitation=waveform),
            silent(),
            lambda *raw: kept.append(raw),
        )
        file = pack(*[kept[0][0], b.axis.drive, *kept[0][1:]], datetime.now(UTC))
    near = errors(found.direct, ONE, 5, 250)
    assert near.magnitude_db < 0.3
    assert near.phase_deg < 2.0
    assert near.covered >= 0.9
    # 2·pi·f = sqrt(k/J_load), sqrt(k·(1/J_motor + 1/J_load)): 123.3 and 213.5 Hz.
    assert [r.kind for r in found.resonances] == ["antiresonance", "resonance"]
    assert found.resonances[0].frequency_hz == pytest.approx(123.3, rel=0.01)
    assert found.resonances[1].frequency_hz == pytest.approx(213.5, rel=0.01)
    assert recompute(unpack(file)) == answer_of(found).model_dump(mode="json")


@pytest.mark.long
async def test_a_loop_from_its_reference() -> None:
    widths = []
    async with direct(ONE) as b:
        for waveform in ("multisine", "stepped"):
            found = await sweep(
                b.axis,
                b.session,
                SweepSettings(WIDE, kind="position_loop", excitation=waveform),
                silent(),
            )
            widths.append(found.margins["bandwidth_90deg_hz"])
    assert widths[1] == pytest.approx(widths[0], rel=0.05)


async def test_a_stepped_sine_needs_a_loop() -> None:
    async with direct(ONE) as b:
        with pytest.raises(OutOfRange, match="without a closed loop"):
            await sweep(
                b.axis, b.session, SweepSettings(WIDE, loop="none", excitation="stepped"), silent()
            )
