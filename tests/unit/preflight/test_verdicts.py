"""Verdicts follow from counted cycles; bounds from published statistics."""

from __future__ import annotations

import pytest

from backend.foundation.preflight.findings import Code, Effect, Finding
from backend.foundation.preflight.texts import verdict_words
from backend.foundation.preflight.verdicts import Grade, Purpose, verdicts
from drivers.computer.timing.lateness import (
    EDGES_US,
    Histogram,
    Measured,
    broadcast_read,
    missed_bound,
)


def run(period_us: int, cycles: int, missed: int) -> dict[int, Measured]:
    empty = Histogram.empty()
    return {period_us: Measured(period_us, cycles, missed, True, True, empty, None)}


def grade(purpose: Purpose, measured: dict[int, Measured], *found: Finding) -> Grade:
    return next(one.grade for one in verdicts(found, measured) if one.purpose is purpose)


def test_none_missed_of_n_bounds_the_share_by_three_over_n() -> None:
    """Hanley and Lippman-Hand, JAMA 249 (1983) 1743."""
    assert missed_bound(0, 300) == pytest.approx(0.01)
    assert missed_bound(0, 0) == 1.0


@pytest.mark.parametrize(
    ("missed", "cycles", "exact"),
    # One-sided 95 % limits by Clopper and Pearson (beta quantiles).
    [(1, 1000, 0.004735), (10, 1000, 0.016902), (5, 50, 0.199)],
)
def test_the_bound_is_near_the_exact_one(missed: int, cycles: int, exact: float) -> None:
    assert missed_bound(missed, cycles) == pytest.approx(exact, rel=0.15)


def test_a_response_needs_fewer_misses_than_a_scope() -> None:
    measured = run(1000, 10_000, 30)  # at most 0.4 %
    assert grade(Purpose.SCOPE_1_KHZ, measured) is Grade.SUITABLE
    assert grade(Purpose.RESPONSE_1_KHZ, measured) is Grade.LIMITED
    assert grade(Purpose.RESPONSE_4_KHZ, measured) is Grade.NOT_MEASURED
    assert grade(Purpose.PARAMETERS, measured) is Grade.SUITABLE


def test_too_few_cycles_prove_nothing() -> None:
    assert grade(Purpose.RESPONSE_1_KHZ, run(1000, 500, 0)) is Grade.LIMITED
    assert grade(Purpose.RESPONSE_1_KHZ, run(1000, 5000, 0)) is Grade.SUITABLE


def test_what_lets_no_frame_through_makes_everything_unsuitable() -> None:
    blocked = Finding(Code.WIRELESS, Effect.BLOCKS)
    for one in verdicts([blocked], run(1000, 10_000, 0)):
        assert (one.grade, one.blocked_by) == (Grade.UNSUITABLE, Code.WIRELESS)
        assert verdict_words(one, "en").startswith("not suitable")
        assert verdict_words(one, "zh").startswith("不适合")


def test_the_histogram_counts_by_its_edges() -> None:
    histogram = Histogram.empty()
    for value in (0.3, 1.0, 1.4, 9.9, 1e7):
        histogram.add(value)
    assert histogram.counts[:2] == [2, 1]
    assert histogram.counts[EDGES_US.index(10.0)] == 1
    assert histogram.counts[-1] == 1
    assert histogram.most_us == 1e7
    assert histogram.below_us(0.5) == pytest.approx(1.47)


def test_the_frame_reads_register_0_of_all_and_writes_nothing() -> None:
    """ETG.1000.4, table 8 and clause 5.4.1: BRD is command 7; 60 bytes without check sum."""
    frame = broadcast_read(5)
    assert len(frame) == 60
    assert frame[12:14] == bytes.fromhex("88a4")
    assert frame[16:26] == bytes.fromhex("07 05 0000 0000 0200 0000")
