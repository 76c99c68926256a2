"""An axis with play: said in words, and nothing is shown or designed that is not so."""

from __future__ import annotations

from backend.tools.sweep.evaluation import SweepSettings
from backend.tools.sweep.run import sweep
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
