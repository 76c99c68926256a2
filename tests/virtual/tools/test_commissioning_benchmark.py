"""A smoke test; the figures are printed by ``python -m benchmarks commissioning``."""

from __future__ import annotations

import math

import pytest

from benchmarks._figures import at_least, at_most, print_figures, share
from benchmarks.commissioning import measured


def test_one_item_of_the_smallest_size(capsys: pytest.CaptureFixture[str]) -> None:
    found = measured(["brake"], small=True)
    assert print_figures(found)
    table = capsys.readouterr().out
    assert "torque at the slip, off by" in table
    assert "verdict: all 4 aims met" in table


def test_a_missed_aim_is_in_the_table_and_in_the_verdict(
    capsys: pytest.CaptureFixture[str],
) -> None:
    figures = [
        at_most("speed", math.inf, 2.0, "s"),
        at_most("nothing measured", math.nan, 2.0, "s"),
        at_least("share", 94.0, 95.0, "%"),
        share("none", [], 0.9),
        share("all", [True, True], 1.0),
    ]
    assert [each.met for each in figures] == [False, False, False, False, True]
    assert not print_figures({"item": figures})
    assert "4 of 4 NOT MET" in capsys.readouterr().out
