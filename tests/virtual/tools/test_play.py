"""An axis with backlash: said as text, and nothing is shown or designed that is not so."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np
import pytest

from backend.tools.tuning.sweep.evaluation import SweepSettings
from backend.tools.tuning.sweep.plan import check
from backend.tools.tuning.sweep.run import sweep
from backend.tools.tuning.sweep.stored import answer_of
from drivers.errors import OutOfRange
from tests.virtual.tools.direct import direct
from tests.virtual.tools.rig import WIDE, errors, mechanics, silent

LOOSE = mechanics((1e-4, 200.0, 0.01), backlash=0.002)


async def test_play_is_named_and_its_model_withheld() -> None:
    async with direct(LOOSE, drive="r6l") as b:
        found = await sweep(b.axis, b.session, SweepSettings(WIDE), silent())
    assert found.model is None
    assert found.resonances == ()
    assert any(each.code == "sweep.play" for each in found.warnings)
    assert found.frf.frequency_hz[-1] <= 250.0
    assert errors(found.frf, LOOSE, 5, 250).covered >= 0.9


@pytest.mark.long
async def test_odd_lines_tell_odd_from_even_distortion_and_measure_as_well() -> None:
    """Coulomb friction and play are odd. The limits are those of tuning.md at 1 kHz."""
    spec = mechanics((1e-4, 20.0, 0.002))
    async with direct(spec, drive="r6l") as b:
        found = await sweep(b.axis, b.session, SweepSettings(WIDE, odd_lines=True), silent())
    assert np.all(found.frf.frequency_hz * 0.65 % 2 == pytest.approx(1.0))
    off = errors(found.frf, spec, 5, 250)
    assert off.magnitude_db < 0.3
    assert off.phase_deg < 2.0
    assert off.covered >= 0.9
    assert found.detected is not None
    assert found.detected.odd > 2.0 * found.detected.even
    assert any(each.code == "sweep.distortion-detected" for each in found.warnings)
    published = answer_of(found).detected
    assert published is not None
    assert published.model_dump() == asdict(found.detected)
    with pytest.raises(OutOfRange) as refused:
        check(SweepSettings(WIDE, odd_lines=True, excitation="chirp"))
    assert refused.value.code == "sweep.odd-lines-need-multisine"
