"""What a design without notches is told to be for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from backend.analysis.frf import Frf
from backend.analysis.mechanical_model import MechanicalModel, Mode
from backend.tools.sweep_evaluation import SweepResult
from backend.tools.tune_notches import out_of_sight


def measured(*modes: tuple[float, float, float]) -> SweepResult:
    """A rigid axis of 1 kgm² with modes (Hz, damping, residue), seen to 400 Hz."""
    f = np.linspace(5.0, 400.0, 80)
    same = np.ones(f.size)
    model = MechanicalModel(1.0, 0.0, tuple(Mode(*each, 0.0) for each in modes))
    frf = Frf(f, model.response(f), same, same, same, same, same, 1000.0, (5.0, 400.0), 4, 0)
    return SweepResult(
        "mechanics", "none", frf, frf, model, True, "1", (), {}, 0.0, 1.0, 0.0
    )  # fmt: skip


def test_a_resonance_above_the_lines_is_named_with_what_helps() -> None:
    words = out_of_sight(measured((590.0, 0.02, 9.0)))
    assert "near 590 Hz" in words
    assert "up to 400 Hz" in words
    assert "a shorter cycle" in words


@pytest.mark.parametrize("modes", [(), ((300.0, 0.02, 9.0),), ((590.0, 0.9, 1.0),)])
def test_what_shows_and_what_hardly_rises_bounds_nothing_unseen(
    modes: tuple[tuple[float, float, float], ...],
) -> None:
    assert out_of_sight(measured(*modes)) == ""
    assert out_of_sight(replace(measured(*modes), model=None)) == ""
