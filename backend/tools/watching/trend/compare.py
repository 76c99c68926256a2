"""Comparison of an axis with its baseline, with at most one false alarm in a hundred comparisons.

Values are compared as logarithms, so that a change is relative. A change is reported where all of
these conditions hold:

* Student's t for the difference of two means (baseline, newest checks; pooled variance of the
  repeats) excludes zero. The level is 1 % for all judged quantities of an axis together
  (Bonferroni), so that many quantities do not add up to alarms.
* The variance is that between repeats, or that of the results' own 95 % intervals where that is
  larger: three repeats that agree by chance are not more certain than each single result.
* The mean differs by at least half of the change to be detected (5 % of a resonance, 20 % of
  friction or inertia), and so does each single check, in the same direction. This excludes one bad
  measurement and a drift too small to act on.

With one check a change is at most *suspected*; a baseline of fewer than three repeats gives no
result.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import scipy

from backend.tools.thresholds import trend_compare as threshold
from backend.tools.watching.health.result import HealthRound, HealthValue, Quantity

Code = Literal["changed", "suspected", "same", "undecided", "not_seen", "few_runs", "no_check"]
Direction = Literal["", "higher", "lower"]
#: Relative change that must be detected, by quantity. Other quantities are shown but not judged.
LOOKED_FOR: dict[Quantity, float] = {"resonance": 0.05, "friction": 0.20, "inertia": 0.20}
_Z95 = 1.959964


@dataclass(frozen=True)
class Finding:
    """One quantity compared with its baseline.

    ``change`` and its interval ``low`` to ``high`` are relative (0.1 is 10 % more), None where
    nothing can be compared. ``before`` and ``now``: geometric means, in the quantity's unit.
    ``looked_for``: relative change to be detected, None where the quantity is not judged.
    """

    quantity: Quantity
    number: int
    code: Code
    direction: Direction = ""
    before: float | None = None
    now: float | None = None
    change: float | None = None
    low: float | None = None
    high: float | None = None
    looked_for: float | None = None


@dataclass(frozen=True)
class _Sample:
    log: float
    deviation: float
    """Standard deviation of ``log`` from its own 95 % interval; 0 where that is not known."""


def compare(baseline: Sequence[HealthRound], checks: Sequence[HealthRound]) -> list[Finding]:
    """Compare every quantity of the baseline with the newest two ``checks`` (oldest first)."""
    newest = checks[-threshold.CHECKS :]
    pairs = [
        (quantity, number, *_matched(baseline, newest, quantity, number))
        for quantity, number in _names(baseline)
    ]
    judged = [(quantity, number) for quantity, number, *_ in pairs if _is_judged(quantity, number)]
    level = threshold.FALSE_ALARMS / max(len(judged), 1)
    return [
        _finding(quantity, number, before, now, len(newest), level)
        for quantity, number, before, now in pairs
    ]


def _is_judged(quantity: Quantity, number: int) -> bool:
    return quantity in LOOKED_FOR and (quantity != "resonance" or number <= threshold.JUDGED)


def _names(baseline: Sequence[HealthRound]) -> list[tuple[Quantity, int]]:
    """Quantities that most of the baseline's rounds have."""
    seen: dict[tuple[Quantity, int], int] = {}
    for one in baseline:
        for each in one.values:
            seen[each.quantity, each.number] = seen.get((each.quantity, each.number), 0) + 1
    return [name for name, count in seen.items() if 2 * count > len(baseline)]


def _matched(
    baseline: Sequence[HealthRound], checks: Sequence[HealthRound], quantity: Quantity, number: int
) -> tuple[list[_Sample], list[_Sample]]:
    """Samples of one quantity in baseline and checks.

    Resonances are matched by the nearest frequency and not by number, as one that is missing in a
    round would shift the numbers of all above it.
    """
    own = [
        each
        for one in baseline
        for each in one.values
        if (each.quantity, each.number) == (quantity, number) and each.value > 0
    ]
    if not own:
        return [], []
    logs = sorted(math.log(each.value) for each in own)
    middle = logs[len(logs) // 2]

    def nearest(one: HealthRound) -> HealthValue | None:
        same = [each for each in one.values if each.quantity == quantity and each.value > 0]
        found = min(same, key=lambda each: abs(math.log(each.value) - middle), default=None)
        if found is None or quantity not in ("resonance", "antiresonance"):
            return found
        return found if abs(math.log(found.value) - middle) < math.log(threshold.ANOTHER) else None

    before = [found for one in baseline if (found := nearest(one)) is not None]
    now = [found for one in checks if (found := nearest(one)) is not None]
    return [_sample(each) for each in before], [_sample(each) for each in now]


def _sample(value: HealthValue) -> _Sample:
    known = value.low is not None and value.high is not None and value.low > 0
    if not known or value.low is None or value.high is None:
        return _Sample(math.log(value.value), 0.0)
    width = math.log(value.high / value.low)
    return _Sample(math.log(value.value), max(width, 0.0) / (2 * _Z95))


def _finding(
    quantity: Quantity,
    number: int,
    before: list[_Sample],
    now: list[_Sample],
    checks: int,
    level: float,
) -> Finding:
    looked_for = LOOKED_FOR[quantity] if _is_judged(quantity, number) else None
    if not before:
        return Finding(quantity, number, "few_runs", looked_for=looked_for)
    base = _mean(before)
    if len(now) < checks or not now:
        code: Code = "no_check" if checks == 0 else "not_seen"
        return Finding(quantity, number, code, before=math.exp(base), looked_for=looked_for)
    shift = _mean(now) - base
    direction: Direction = "higher" if shift > 0 else "lower"
    values = (math.exp(base), math.exp(_mean(now)), math.expm1(shift))
    if len(before) < threshold.LEAST_REPEATS:
        return Finding(quantity, number, "few_runs", direction, *values, looked_for=looked_for)
    half = _quantile(level, len(before) - 1 + len(now) - 1) * _error(before, now)
    low, high = shift - half, shift + half
    code = "undecided"
    if looked_for is not None:
        code = _code(low, high, [each.log - base for each in now], looked_for)
    return Finding(
        quantity, number, code, direction, *values, math.expm1(low), math.expm1(high), looked_for
    )


def _code(low: float, high: float, shifts: list[float], looked_for: float) -> Code:
    """Verdict from the interval of the change, and from each check's own change."""
    least = math.log1p(looked_for / 2)
    up, down = all(each >= least for each in shifts), all(each <= -least for each in shifts)
    if (up and low > 0) or (down and high < 0):
        return "changed" if len(shifts) >= threshold.CHECKS else "suspected"
    whole = math.log1p(looked_for)
    return "same" if -whole < low and high < whole else "undecided"


def _mean(samples: Sequence[_Sample]) -> float:
    return sum(each.log for each in samples) / len(samples)


def _error(before: Sequence[_Sample], now: Sequence[_Sample]) -> float:
    """Standard error of the difference of both means."""
    squares = sum((each.log - _mean(side)) ** 2 for side in (before, now) for each in side)
    between = squares / (len(before) + len(now) - 2)
    every = [*before, *now]
    within = sum(each.deviation**2 for each in every) / len(every)
    variance = max(between, within, threshold.FINEST**2)
    return math.sqrt(variance * (1 / len(before) + 1 / len(now)))


@lru_cache(maxsize=512)
def _quantile(level: float, freedom: int) -> float:
    return float(scipy.special.stdtrit(freedom, 1.0 - 0.5 * level))
