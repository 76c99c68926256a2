"""A tuning ends in its time: what cannot be verified any more is not applied, which is reported."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import pytest

from backend.foundation.work.jobs import Progress
from backend.tools.tuning.autotune import present as tune_present
from backend.tools.tuning.autotune import time_budget as tune_time
from backend.tools.tuning.autotune.apply import Applied
from backend.tools.tuning.autotune.time_budget import TimeLeft
from tests.unit.backend.autotune.test_tune_hum import GOALS, design, kept_of


@dataclass
class Clock:
    now_s: float = 1000.0

    def monotonic(self) -> float:
        return self.now_s

    def work(self, seconds: float) -> None:
        self.now_s += seconds


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    fake = Clock()
    monkeypatch.setattr(tune_time, "time", fake)
    return fake


#: All of them hum, and none may be made softer.
LOUD = [design(10.0), design(9.0), design(8.0), design(7.0)]


async def seen_of(
    monkeypatch: pytest.MonkeyPatch, clock: Clock, used_s: float, each_s: float
) -> tuple[list[float], TimeLeft]:
    """Speed gains that are verified, where so much of 60 s is used before, and by each."""
    left = TimeLeft.of(60.0)
    clock.work(used_s)
    seen, kept = await kept_of(
        monkeypatch, LOUD, soft=False, time_left=left, meanwhile=lambda: clock.work(each_s)
    )
    assert kept is None
    return seen, left


async def test_the_last_one_that_time_allows_is_the_most_careful(
    monkeypatch: pytest.MonkeyPatch, clock: Clock
) -> None:
    # 52 s after the first one of 9 s there is not even time for another one.
    seen, left = await seen_of(monkeypatch, clock, 43.0, 9.0)
    assert seen == [10.0]
    assert clock.now_s == 1052.0
    assert str(left.reported()).startswith("3 designs were not verified and not applied")
    # After 44 s one more fits, and it is not the next one.
    seen, left = await seen_of(monkeypatch, clock, 35.0, 9.0)
    assert seen == [10.0, 7.0]
    assert left.left_out == 2
    # After 37 s two more do.
    seen, left = await seen_of(monkeypatch, clock, 28.0, 9.0)
    assert seen == [10.0, 9.0, 7.0]
    assert str(left.reported()).startswith("one design was not verified")


async def test_without_a_limit_all_are_verified(
    monkeypatch: pytest.MonkeyPatch, clock: Clock
) -> None:
    left = TimeLeft()
    seen, _kept = await kept_of(
        monkeypatch, LOUD, soft=False, time_left=left, meanwhile=lambda: clock.work(1e4)
    )
    assert seen == [10.0, 9.0, 8.0, 7.0]
    assert left.reported() is None


async def test_the_first_is_verified_however_late_it_is(
    monkeypatch: pytest.MonkeyPatch, clock: Clock
) -> None:
    seen, _left = await seen_of(monkeypatch, clock, 70.0, 9.0)
    assert seen == [10.0]


@pytest.mark.parametrize(
    ("used_s", "pairs"),
    # A pair takes 7 s, and 4 s are for what comes around it.
    [(11.0, 4), (27.0, 4), (29.0, 3), (45.0, 1), (53.0, 0), (100.0, 0)],
)
def test_as_many_realisations_as_there_is_time_for(clock: Clock, used_s: float, pairs: int) -> None:
    left = TimeLeft.of(60.0)
    clock.work(used_s)
    assert left.pairs(7.0, 4) == pairs


@pytest.mark.parametrize(
    ("used_s", "pairs"),
    # Two further verifications take 22 s; where they do not fit, nothing is kept for them.
    [(5.0, 4), (12.0, 3), (27.0, 1), (34.0, 0), (36.0, 2), (100.0, 0)],
)
def test_time_is_kept_for_looking_again(clock: Clock, used_s: float, pairs: int) -> None:
    left = TimeLeft.of(60.0)
    clock.work(used_s)
    assert left.pairs(7.0, 4, 2) == pairs


def test_what_only_spare_time_is_spent_on_is_no_part_of_a_verification(clock: Clock) -> None:
    left = TimeLeft.of(60.0)
    with left.verifying():
        clock.work(9.0)
        with left.extra():
            clock.work(20.0)
    assert left.longest_s == 9.0
    assert left.verifications() == 3


async def test_what_it_had_is_not_measured_where_time_is_over(
    monkeypatch: pytest.MonkeyPatch, clock: Clock
) -> None:
    """The design that was verified stays."""
    slow: Any = SimpleNamespace(
        predicted_bandwidth_hz=60.0, measured_bandwidth_hz=90.0, kept=True, why=""
    )
    left = TimeLeft.of(60.0)

    async def present(*_: Any) -> tune_present.Present:
        return tune_present.Present(7.0, design(7.0), sound=False)

    async def first_kept(*given: Any) -> Any:
        with left.verifying():
            clock.work(9.0)
        return Applied(given[3][0], slow, {}) if given[3] else None

    monkeypatch.setattr(tune_present, "present", present)
    monkeypatch.setattr(tune_present, "first_kept", first_kept)
    check: Any = SimpleNamespace(facts=None, inertia_kgm2=1e-4)
    nothing: Any = None
    trials = tune_present.Trials(
        nothing, nothing, check, GOALS, Progress(lambda: None), None, time_left=left
    )
    clock.work(44.0)
    applied = await trials.first([design(2.0)], nothing)
    assert applied is not None
    assert applied.candidate.gains.speed_nms == 2.0
