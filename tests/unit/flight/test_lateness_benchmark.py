"""The arithmetic of the benchmark of the recorder's cost."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.flight_recorder import Block, Measured, Pair, interval, report, verdict


def pairs(growth_percent: float, scatter: float, count: int = 40) -> list[Pair]:
    """Blocks that scatter, of a recorder that adds so much."""
    drawn = np.random.default_rng(7)
    return [
        Pair(
            Block(base, 80.0, 1),
            Block(
                base * (1 + growth_percent / 100) * float(np.exp(drawn.normal(0, scatter))), 83.0, 1
            ),
        )
        for base in drawn.uniform(50, 400, count)
    ]


@pytest.mark.parametrize("growth", [0.0, 4.0, 30.0])
def test_the_interval_has_the_true_growth_whatever_the_level_of_the_blocks(growth: float) -> None:
    middle, low, high = interval([pair.growth_percent for pair in pairs(growth, 0.05)])
    assert low <= growth <= high
    assert low <= middle <= high
    assert high - low < 6.0


def test_few_blocks_that_scatter_prove_nothing() -> None:
    _, low, high = interval([pair.growth_percent for pair in pairs(0.0, 0.5, 4)])
    assert low < -5
    assert high > 5


def test_an_aim_is_met_missed_or_open_by_the_whole_interval() -> None:
    assert verdict(-3.0, 5.0, 5.0) == "met"
    assert verdict(5.1, 9.0, 5.0) == "missed"
    assert verdict(-3.0, 5.1, 5.0).startswith("open")


def test_both_aims_must_be_met(capsys: pytest.CaptureFixture[str]) -> None:
    """3 µs more in the cycle's thread are 15 % of a 99th percentile of 20 µs, 1.5 % of 200 µs."""
    calm = [Pair(Block(200.0, 80.0, 1), Block(200.0, 83.0, 1))] * 4
    assert report(Measured(calm, 0.01, 1 << 20), 1000) == 0
    assert "+3.00 µs more, of that p99 +1.5 %" in capsys.readouterr().out
    short = [Pair(Block(20.0, 80.0, 1), Block(20.0, 83.0, 1))] * 4
    assert report(Measured(short, 0.01, 1 << 20), 1000) == 1
    assert "missed" in capsys.readouterr().out
