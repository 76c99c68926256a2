"""Both axes of a gantry come back, or it is said which one did not."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from backend.tools.tuning.gantry import run as gantry
from backend.tools.tuning.gantry.settings import GantrySettings
from drivers.errors import NotAllowed

SETTINGS = GantrySettings(travel_limit=3.0, speed_limit=600.0, torque_limit=60.0, partner="second")


@pytest.mark.parametrize("blocked", [None, 0, 1])
async def test_an_axis_that_does_not_come_back_is_named(
    monkeypatch: pytest.MonkeyPatch, blocked: int | None
) -> None:
    at = np.array([0.8, 0.8])

    async def play(_pair: Any, speeds_rpm: np.ndarray, *_: Any) -> None:
        went = speeds_rpm.sum(axis=1) / 60.0 / 1000.0
        if blocked is not None:
            went[blocked] = 0.0
        at[:] += went

    async def ways() -> tuple[float, float]:
        return float(at[0]), float(at[1])

    monkeypatch.setattr(gantry, "play_pair", play)
    monkeypatch.setattr(gantry, "cycle_s", lambda _session: 1e-3)
    names = ("first", "second")
    pair: Any = SimpleNamespace(
        axes=[SimpleNamespace(drive=SimpleNamespace(name=name)) for name in names],
        session=None,
        ways_rev=ways,
    )
    if blocked is None:
        await gantry._go_back(pair, SETTINGS)
        assert np.max(np.abs(at)) < 0.01
        return
    with pytest.raises(NotAllowed, match=f"{names[blocked]} did not come back"):
        await gantry._go_back(pair, SETTINGS)
