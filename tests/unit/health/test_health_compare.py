"""Comparison with a baseline: false alarms and changes found, over seeded draws.

The comparison assumes independent normal repeats. The noise here is none of that: heavy tails,
skew, runs that depend on the one before, days that differ, and now and then a wrong measurement.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from backend.tools.thresholds import trend_compare
from backend.tools.watching.health.result import HealthRound, HealthValue, Quantity
from backend.tools.watching.trend.compare import compare
from tests.unit.health.drawn_checks import (
    SPREAD,
    Noise,
    alarms,
    by_day,
    drawn,
    heavy,
    linked,
    normal,
    skewed,
    sometimes_wrong,
)


@pytest.mark.long
@pytest.mark.parametrize("noise", [normal, heavy, skewed, linked, by_day, sometimes_wrong])
@pytest.mark.parametrize("wider", [1.0, 4.0])
def test_at_most_one_false_alarm_in_a_hundred(
    noise: Noise, wider: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where repeats spread four times wider than on a good axis."""
    monkeypatch.setattr(
        "tests.unit.health.drawn_checks.SPREAD", {k: wider * v for k, v in SPREAD.items()}
    )
    rng, draws = np.random.default_rng(20261123), 2000
    count = sum(bool(alarms(compare(*drawn(rng, noise, 3, {})))) for _ in range(draws))
    assert count <= trend_compare.FALSE_ALARMS * draws


@pytest.mark.long(keep=4)
@pytest.mark.parametrize("noise", [normal, heavy, skewed, linked])
@pytest.mark.parametrize(
    ("what", "factor"),
    [
        (("resonance", 1), 1.05),
        (("resonance", 2), 0.95),
        (("friction", 1), 1.20),
        (("friction", 1), 0.80),
        (("inertia", 1), 1.20),
    ],
)
def test_the_change_that_is_looked_for_is_found(
    noise: Noise, what: tuple[Quantity, int], factor: float
) -> None:
    """With a baseline of five repeats; three find it less often, as the next test has it."""
    rng, draws = np.random.default_rng(7), 400
    found = [alarms(compare(*drawn(rng, noise, 5, {what: factor}))) for _ in range(draws)]
    assert np.mean([what in each for each in found]) >= 0.95


def test_nothing_else_is_blamed() -> None:
    rng = np.random.default_rng(11)
    factors: dict[tuple[Quantity, int], float] = {("resonance", 1): math.sqrt(0.7)}
    found = [alarms(compare(*drawn(rng, heavy, 5, factors))) for _ in range(300)]
    others = [each - {("resonance", 1)} for each in found]
    assert np.mean([bool(each) for each in others]) <= trend_compare.FALSE_ALARMS


def one(quantity: Quantity, *values: float, deviation: float = 0.0) -> list[HealthRound]:
    return [
        HealthRound(
            values=(
                HealthValue(
                    quantity=quantity,
                    value=value,
                    low=value * (1 - 1.96 * deviation) if deviation else None,
                    high=value * (1 + 1.96 * deviation) if deviation else None,
                ),
            )
        )
        for value in values
    ]


def test_the_change_and_its_interval_are_those_of_two_means() -> None:
    """By hand: logs differ by ln 1.2; s² of ±1 % repeats, t at 1 % two-sided with 3 of freedom."""
    (found,) = compare(one("friction", 9.9, 10.0, 10.1), one("friction", 11.9, 12.1))
    assert found.code == "changed"
    assert found.direction == "higher"
    assert found.change == pytest.approx(0.2, abs=1e-3)
    s = math.sqrt((2 * 0.01**2 + 2 * (0.1 / 12.0) ** 2) / 3)
    half = 5.8409 * s * math.sqrt(1 / 3 + 1 / 2)
    assert found.low == pytest.approx(math.expm1(math.log(1.2) - half), abs=2e-3)
    assert found.high == pytest.approx(math.expm1(math.log(1.2) + half), abs=2e-3)


def test_one_check_alone_is_suspected_and_no_more() -> None:
    (found,) = compare(one("friction", 9.9, 10.0, 10.1), one("friction", 13.0))
    assert found.code == "suspected"


def test_one_wrong_check_of_two_is_no_change() -> None:
    (found,) = compare(one("friction", 9.9, 10.0, 10.1), one("friction", 10.0, 15.0))
    assert found.code == "undecided"


def test_two_repeats_decide_nothing() -> None:
    (found,) = compare(one("friction", 10.0, 10.0), one("friction", 20.0, 20.0))
    assert found.code == "few_runs"
    assert found.change == pytest.approx(1.0)


def test_repeats_that_agree_by_chance_are_known_no_better_than_each() -> None:
    wide = compare(
        one("friction", 10.0, 10.0, 10.0, deviation=0.08),
        one("friction", 12.0, 12.0, deviation=0.08),
    )
    assert wide[0].code == "undecided"
    assert compare(one("friction", 10, 10, 10), one("friction", 12, 12))[0].code == "changed"


def test_a_drift_below_half_of_what_is_looked_for_is_none() -> None:
    (found,) = compare(one("friction", 10, 10, 10), one("friction", 10.8, 10.8))
    assert found.code == "same"


def test_a_resonance_that_is_gone_is_said_to_be() -> None:
    (found,) = compare(one("resonance", 60, 60.1, 59.9), one("resonance", 120, 121))
    assert found.code == "not_seen"
    assert found.now is None


def test_a_resonance_below_does_not_shift_those_above() -> None:
    """A check that sees one more low resonance counts the others from 2."""
    new = [
        HealthRound(
            values=(
                HealthValue(quantity="resonance", number=1, value=20.0),
                HealthValue(quantity="resonance", number=2, value=60.0),
            )
        )
    ] * 2
    (found,) = compare(one("resonance", 60, 60.1, 59.9), new)
    assert found.code == "same"


def test_without_a_check_nothing_is_said() -> None:
    (found,) = compare(one("friction", 10, 10, 10), [])
    assert found.code == "no_check"
