"""A notch is tried again where samples were lost."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from backend.tools.tuning.notch import effect as notch_effect
from backend.tools.tuning.notch import in_loop as notch_in_loop
from drivers.errors import NotAllowed

LINES = np.array([2, 3, 5])


def beside(monkeypatch: pytest.MonkeyPatch, whole: list[int]) -> tuple[Any, list[int]]:
    """A trial whose recordings have so many whole periods each; the second list is what is left."""
    sent = SimpleNamespace(
        excitation=SimpleNamespace(
            samples=np.random.default_rng(1).normal(size=64),
            first_sample=0,
            period_samples=32,
            lines=LINES,
        )
    )

    async def played(*_: object) -> list[tuple[object, None]]:
        return [(sent, None)]

    def periods(*_: object) -> tuple[Any, Any]:
        count = whole.pop(0)
        return np.ones((count, LINES.size), complex), np.ones((count, LINES.size), complex)

    monkeypatch.setattr(notch_in_loop, "play_fitting", played)
    monkeypatch.setattr(notch_in_loop, "periods_of", periods)
    axis = SimpleNamespace(drive=SimpleNamespace(name="X"))
    nothing = cast(Any, None)
    trial = notch_in_loop._ClosedLoopTrial(cast(Any, axis), nothing, nothing, nothing, nothing, 0)
    return trial, whole


async def test_one_that_lost_samples_is_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    trial, left = beside(monkeypatch, [0, 2, 9])
    lines = (await trial._played(None, lambda _: None))[2]
    assert lines.torque.shape == LINES.shape
    assert left == [9], "once more, and no more than that"


async def test_whole_periods_of_two_tries_are_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    trial, left = beside(monkeypatch, [1, 0, 1, 9])
    lines = (await trial._played(None, lambda _: None))[2]
    assert lines.torque.shape == LINES.shape
    assert left == [9]


async def test_a_line_that_loses_samples_each_time_is_reported(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    trial, left = beside(monkeypatch, [0, 1, 0, 9])
    with pytest.raises(NotAllowed, match="X: samples were lost in 3 consecutive tries") as reported:
        await trial._played(None, lambda _: None)
    assert reported.value.remedy
    assert left == [9]


async def test_without_a_loop_too_with_the_sign_turned_each_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A whole trial leaves a free axis a turn away; the next one leads it back."""
    signs: list[int] = []
    whole = [0, 0, 1, 9]

    async def played(axis: object, session: object, play: Any, *_: object) -> None:
        signs.append(int(np.sign(play.values[0])))

    async def nothing(*_: object) -> None: ...

    @asynccontextmanager
    async def enabled(*_: object) -> AsyncIterator[None]:
        yield

    async def units() -> Any:
        return SimpleNamespace(torque=lambda _raw: 0.1)

    def periods(*_: object) -> tuple[Any, Any]:
        count = whole.pop(0)
        return np.full((count, LINES.size), 2.0 + 0j), None

    for name, made in (("play", played), ("bus_limits", nothing), ("enabled", enabled)):
        monkeypatch.setattr(notch_effect, name, made)
    monkeypatch.setattr(notch_effect, "periods_of", periods)
    axis = SimpleNamespace(drive=SimpleNamespace(name="X"), units=units)
    sequence = SimpleNamespace(excitation=SimpleNamespace(samples=np.ones(8)))
    facts = SimpleNamespace(rated_torque_nm=1.0)
    none = cast(Any, None)
    free = notch_effect._Free(
        cast(Any, axis), none, none, cast(Any, facts), none, cast(Any, sequence), 0
    )
    spectrum = await free._torque(lambda _: None)
    assert signs == [1, -1, 1]
    assert np.all(spectrum == 2.0)
    assert whole == [9]
