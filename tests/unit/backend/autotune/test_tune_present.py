"""What an axis had is measured in turn where the prediction of a slower design was wrong."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace
from typing import Any

import pytest

from backend.analysis.loop.design import Candidate
from backend.foundation.work.jobs import Progress
from backend.tools.tuning.autotune import apply as tune_apply
from backend.tools.tuning.autotune import present as tune_present
from backend.tools.tuning.autotune.apply import Applied
from drivers.texts.message import Text
from tests.unit.backend.autotune.test_tune_hum import GOALS, design

#: Raw values: of the axis as it was, and of the design.
WAS, NEW = {"2005:03": 700}, {"2005:03": 200}


async def outcome(
    monkeypatch: pytest.MonkeyPatch,
    *,
    measured_hz: float,
    as_it_was_keeps: bool,
    held: dict[str, int] | None = None,
    cancelled: bool = False,
) -> tuple[Applied, dict[str, int], list[Text], Text | None]:
    """What stays, what the drive holds then, what was tried, and what the result says.

    ``cancelled``: while the design is read, before it is undone.
    """
    held = dict(NEW) if held is None else held
    had = tune_present.Present(7.0, design(7.0), sound=False)
    slow: Any = SimpleNamespace(
        predicted_bandwidth_hz=60.0, measured_bandwidth_hz=measured_hz, kept=True, why=""
    )
    mine: Any = SimpleNamespace(
        kept=as_it_was_keeps, why="phase margin", sweep=SimpleNamespace(margins={"ms": 1.4})
    )

    async def present(*_: Any) -> tune_present.Present:
        return had

    async def first_kept(_a: Any, _s: Any, _c: Any, rows: list[Candidate], *_: Any) -> Any:
        return Applied(rows[0], slow, dict(WAS)) if rows else None

    async def verify(*_: Any) -> Any:
        assert held == WAS, "it is measured as it was"
        return mine

    async def take_back(_axis: Any, before: dict[str, int]) -> None:
        held.update(before)

    async def write_settings(_axis: Any, values: dict[str, int]) -> dict[str, int]:
        before = dict(held)
        held.update(values)
        return before

    for replaced in (present, first_kept, verify, take_back, write_settings):
        monkeypatch.setattr(tune_present, replaced.__name__, replaced)
    monkeypatch.setattr(tune_apply, "take_back", take_back)

    async def raw(key: str) -> int:
        if cancelled:
            raise asyncio.CancelledError
        return held[key]

    axis: Any = SimpleNamespace(drive=SimpleNamespace(name="X", raw=raw))
    check: Any = SimpleNamespace(facts=None, inertia_kgm2=1e-4)
    nothing: Any = None
    trials = tune_present.Trials(axis, nothing, check, GOALS, Progress(lambda: None), None)
    applied = await trials.first([design(2.0)], nothing)
    assert applied is not None
    return applied, held, trials.tried, trials.note(applied)


async def test_a_wrong_prediction_is_no_reason_against_it(monkeypatch: pytest.MonkeyPatch) -> None:
    applied, held, tried, note = await outcome(monkeypatch, measured_hz=90.0, as_it_was_keeps=True)
    assert (applied.candidate.gains.speed_nms, applied.before) == (7.0, {})
    assert held == WAS
    assert not tried
    assert note == tune_present.KEPT


async def test_without_margins_the_design_comes_back(monkeypatch: pytest.MonkeyPatch) -> None:
    applied, held, tried, note = await outcome(monkeypatch, measured_hz=90.0, as_it_was_keeps=False)
    assert (applied.candidate.gains.speed_nms, applied.before) == (2.0, WAS)
    assert held == NEW
    assert [each.words() for each in tried] == ["previous settings: phase margin"]
    assert "with 29% of the previous speed gain" in str(note)
    assert "did not confirm its prediction" in str(note)


async def test_a_prediction_that_was_right_is_believed(monkeypatch: pytest.MonkeyPatch) -> None:
    applied, held, _tried, note = await outcome(monkeypatch, measured_hz=61.0, as_it_was_keeps=True)
    assert (applied.candidate.gains.speed_nms, held) == (2.0, NEW)
    assert "margin is too small" in str(note)


async def test_cancelled_between_two_verifications_nothing_stays(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    held = dict(NEW)
    with pytest.raises(asyncio.CancelledError):
        await outcome(
            monkeypatch, measured_hz=90.0, as_it_was_keeps=True, held=held, cancelled=True
        )
    assert held == WAS
