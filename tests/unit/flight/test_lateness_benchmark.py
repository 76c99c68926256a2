"""The arithmetic of the benchmark of the recorder's lateness."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.flight_recorder import Pair, growth_interval


def pairs(growth_percent: float, scatter: float, count: int = 40) -> list[Pair]:
    """Rounds that scatter, of a recorder that adds so much."""
    drawn = np.random.default_rng(7)
    return [
        Pair(base, base * (1 + growth_percent / 100) * float(np.exp(drawn.normal(0, scatter))), 1)
        for base in drawn.uniform(50, 400, count)
    ]


@pytest.mark.parametrize("growth", [0.0, 4.0, 30.0])
def test_the_interval_has_the_true_growth_whatever_the_level_of_the_rounds(growth: float) -> None:
    middle, low, high = growth_interval(pairs(growth, 0.05))
    assert low <= growth <= high
    assert low <= middle <= high
    assert high - low < 6.0


def test_few_rounds_that_scatter_prove_nothing() -> None:
    _, low, high = growth_interval(pairs(0.0, 0.5, 4))
    assert low < -5
    assert high > 5
