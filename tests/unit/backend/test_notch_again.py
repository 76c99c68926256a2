"""A notch that is tried beside the loop is tried again where samples were lost."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from backend.tools import notch_in_loop
from drivers.errors import NotAllowed

LINES = np.array([2, 3, 5])


def beside(monkeypatch: pytest.MonkeyPatch, whole: list[int]) -> tuple[Any, list[int]]:
    """A trial whose recordings have so many whole periods each; the second list is what is left."""
    sent = SimpleNamespace(
        excitation=SimpleNamespace(
            samples=np.random.default_rng(1).normal(size=64), first_sample=0, period_samples=32,
            lines=LINES,
        )
    )  # fmt: skip

    async def played(*_: object) -> list[tuple[object, None]]:
        return [(sent, None)]

    def periods(*_: object) -> tuple[Any, Any]:
        count = whole.pop(0)
        return np.ones((count, LINES.size), complex), np.ones((count, LINES.size), complex)

    monkeypatch.setattr(notch_in_loop, "play_fitting", played)
    monkeypatch.setattr(notch_in_loop, "periods_of", periods)
    axis = SimpleNamespace(drive=SimpleNamespace(name="X"))
    nothing = cast(Any, None)
    trial = notch_in_loop._Beside(cast(Any, axis), nothing, nothing, nothing, nothing, 0)
    return trial, whole


async def test_one_that_lost_samples_is_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    trial, left = beside(monkeypatch, [1, 2, 9])
    lines = (await trial._played(None, lambda _: None))[2]
    assert lines.torque.shape == LINES.shape
    assert left == [9], "once more, and no more than that"


async def test_a_line_that_loses_samples_each_time_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    trial, left = beside(monkeypatch, [1, 1, 1, 9])
    with pytest.raises(NotAllowed, match="X: samples were lost in all but one period") as told:
        await trial._played(None, lambda _: None)
    assert told.value.remedy
    assert left == [9]
