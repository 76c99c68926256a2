"""The reason that is given for a design without notches, and with which loop notches are tried."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from backend.analysis.mechanics.mechanical_model import MechanicalModel, Mode
from backend.analysis.response.frf import Frf
from backend.foundation.work.jobs import Progress
from backend.tools.tuning.autotune.design import notches as tune_notches
from backend.tools.tuning.autotune.design.notches import out_of_sight
from backend.tools.tuning.autotune.time_budget import TimeLeft
from backend.tools.tuning.notch.meaning import NotchMeaning
from backend.tools.tuning.sweep.evaluation import SweepResult
from drivers.texts.message import Text


def measured(*modes: tuple[float, float, float]) -> SweepResult:
    """A rigid axis of 1 kgm² with modes (Hz, damping, residue), seen to 400 Hz."""
    f = np.linspace(5.0, 400.0, 80)
    same = np.ones(f.size)
    model = MechanicalModel(1.0, 0.0, tuple(Mode(*each, 0.0) for each in modes))
    frf = Frf(f, model.response(f), same, same, same, same, same, 1000.0, (5.0, 400.0), 4, 0)
    return SweepResult("mechanics", "none", frf, frf, model, True, "1", (), {}, 0.0, 1.0, 0.0)


def test_a_resonance_above_the_lines_is_named_with_what_helps() -> None:
    words = str(out_of_sight(measured((590.0, 0.02, 9.0))))
    assert "near 590 Hz" in words
    assert "up to 400 Hz" in words
    assert "a shorter cycle" in words


@pytest.mark.parametrize("modes", [(), ((300.0, 0.02, 9.0),), ((590.0, 0.9, 1.0),)])
def test_what_shows_and_what_hardly_rises_bounds_nothing_unseen(
    modes: tuple[tuple[float, float, float], ...],
) -> None:
    assert out_of_sight(measured(*modes)) is None
    assert out_of_sight(replace(measured(*modes), model=None)) is None


@pytest.mark.parametrize(
    ("loop", "scheme", "gravity_nm", "holds"),
    [
        ("none", "free", 0.0, False),
        ("none", "free", 0.2, True),
        # Friction ruled, so that its mechanics were measured with a closed loop.
        ("speed", "free", 0.0, True),
        # It trembles where it is; the loop was closed for its travel alone.
        ("speed", "limited", 0.0, False),
    ],
)
async def test_notches_are_tried_beside_a_loop_where_the_mechanics_were(
    loop: str, scheme: str, gravity_nm: float, holds: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    ways: list[bool] = []

    async def in_loop(*_: Any) -> NotchMeaning:
        ways.append(True)
        return NotchMeaning(120.0)

    async def free(*_: Any) -> NotchMeaning:
        ways.append(False)
        return NotchMeaning(120.0)

    monkeypatch.setattr(tune_notches, "measure_meaning_in_loop", in_loop)
    monkeypatch.setattr(tune_notches, "_learn_free", free)
    monkeypatch.setattr(tune_notches, "meaning_of", lambda _drive: None)
    monkeypatch.setattr(tune_notches, "remember", lambda *_: None)
    monkeypatch.setattr("backend.tools.tuning.notch.effect.unknown", lambda _drive: True)
    monkeypatch.setattr("backend.tools.tuning.notch.trials.least_s", lambda _drive: 11.6)

    assert await said_of(loop, scheme, gravity_nm) is None
    assert ways == [holds]


async def said_of(
    loop: str = "none",
    scheme: str = "free",
    gravity_nm: float = 0.0,
    time_left: TimeLeft | None = None,
) -> Text | None:
    """What learning says, of an axis with a resonance."""

    async def stands() -> int:
        return 0

    axis: Any = SimpleNamespace(drive=SimpleNamespace(name="X"), position_raw=stands)
    value = SimpleNamespace(value=gravity_nm)
    outcome: Any = SimpleNamespace(result=SimpleNamespace(gravity_nm=value, inertia_kgm2=value))
    mechanics: Any = SimpleNamespace(
        resonances=[SimpleNamespace(kind="resonance")], model=object(), loop=loop
    )
    how: Any = SimpleNamespace(loop="auto", envelope=None, scheme=scheme)
    facts: Any = SimpleNamespace(rated_torque_nm=1.27)
    return await tune_notches.learn_notches(
        axis, cast(Any, None), how, facts, outcome, mechanics, Progress(lambda: None), time_left
    )


@pytest.mark.parametrize(
    ("left_s", "before", "fits"),
    [
        (20.5, None, True),
        (20.0, None, False),
        (20.0, NotchMeaning(120.0, left_out=3), False),
        (20.5, NotchMeaning(120.0, left_out=3), True),
    ],
)
async def test_notches_are_learned_only_where_a_design_can_be_verified_after_it(
    left_s: float, before: NotchMeaning | None, fits: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """12 s are for the design and its verification; a free axis needs 8.1 of the 11.6 s."""
    known: list[NotchMeaning] = [] if before is None else [before]
    clock = SimpleNamespace(monotonic=lambda: 1000.0)
    monkeypatch.setattr("backend.tools.tuning.autotune.time_budget.time", clock)
    monkeypatch.setattr("backend.tools.measuring.repeats.time", clock)

    async def free(*given: Any) -> NotchMeaning:
        assert given[-1].by_s == pytest.approx(1000.0 + left_s - 12.0)
        return NotchMeaning(130.0, left_out=2)

    monkeypatch.setattr(tune_notches, "_learn_free", free)
    monkeypatch.setattr(tune_notches, "meaning_of", lambda _drive: known[-1] if known else None)
    monkeypatch.setattr(tune_notches, "remember", lambda _drive, meaning: known.append(meaning))
    monkeypatch.setattr("backend.tools.tuning.notch.effect.unknown", lambda _drive: True)
    monkeypatch.setattr("backend.tools.tuning.notch.trials.least_s", lambda _drive: 11.6)
    left = TimeLeft.of(left_s)
    said = await said_of(time_left=left)
    assert [meaning.centre_hz for meaning in known][-1:] == (
        [130.0] if fits else [120.0] if before else []
    )
    reported = " ".join(str(each) for each in [said, *left.given_up])
    assert ("designed without notches" in reported) is (not fits and before is None)
    assert ("at fewer settings" in reported) is (fits or before is not None)
