"""A design that only hums is tried again with less gain before a much slower one is."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from backend.analysis.loop.design import Candidate
from backend.analysis.loop.loop_goals import Goals
from backend.analysis.loop.loop_structure import Gains, LoopFilters
from backend.analysis.loop.margins import Margins
from backend.foundation.work.jobs import Progress
from backend.tools.tuning.autotune import apply as tune_apply
from backend.tools.tuning.autotune.time_budget import TimeLeft
from backend.tools.tuning.autotune.verification.verify import TorqueRipples
from drivers.cia402 import State
from drivers.errors import OutOfRange
from drivers.texts.message import Text, text

GOALS = Goals(9.0, 48.0, 1.8)
HUMS = text("autotune.hums", rms_percent=5.0)
#: More gain than this makes the torque hum with more than 4 % of the rated.
QUIET_NMS = 6.0


def design(speed_nms: float, speed_filter_hz: float = 1000.0) -> Candidate:
    nominal = Margins(50.0, 60.0, 50.0, 12.0, 300.0, 1.5, 100.0, stable=True)
    return Candidate(
        (), Gains(speed_nms, 5.0, 20.0, 50.0), 60.0, 10.0, nominal, GOALS, 0.0, 5.0, 0.1,
        filters=LoopFilters(speed_filter_hz),
    )  # fmt: skip


async def kept_of(
    monkeypatch: pytest.MonkeyPatch,
    rows: list[Candidate],
    *,
    soft: bool = True,
    time_left: TimeLeft | None = None,
    meanwhile: Callable[[], None] = lambda: None,
    shown_nms: float | None = None,
    at_standstill: bool = False,
) -> tuple[list[float], float | None]:
    """The speed gains that were verified, in turn, and the one that stayed."""
    seen: list[float] = []

    async def verify(_axis: Any, _session: Any, _check: Any, candidate: Candidate, *_: Any) -> Any:
        gain = candidate.gains.speed_nms
        seen.append(gain)
        meanwhile()
        kept = gain <= (shown_nms or QUIET_NMS)
        hum = None if kept or shown_nms else 4.0 * gain / QUIET_NMS
        share = None if kept or not shown_nms else 0.84
        if hum and at_standstill:
            raise TorqueRipples(hum)
        return SimpleNamespace(
            kept=kept, why=None if kept else HUMS, hum_percent=hum, share_to_show=share
        )

    async def softer(candidate: Candidate, share: float) -> Candidate | None:
        gains = replace(candidate.gains, speed_nms=share * candidate.gains.speed_nms)
        return replace(candidate, gains=gains) if soft else None

    async def nothing(*_: Any) -> dict[str, int]:
        return {}

    @contextmanager
    def temporary(_earlier: dict[str, int]) -> Iterator[None]:
        yield

    for name in ("plan", "write_settings", "put_back_in_time"):
        monkeypatch.setattr(tune_apply, name, nothing)
    monkeypatch.setattr(tune_apply, "verify", verify)

    async def state() -> State:
        return State.SWITCH_ON_DISABLED

    axis: Any = SimpleNamespace(
        drive=SimpleNamespace(name="X", pending_restores=SimpleNamespace(temporary=temporary)),
        state=state,
    )
    check: Any = SimpleNamespace(inertia_kgm2=1e-4, motor_inertia_kgm2=None)
    tried: list[Text] = []
    session: Any = None
    applied = await tune_apply.first_kept(
        axis, session, check, rows, GOALS, tried, Progress(lambda: None), None, softer, time_left
    )
    assert len(tried) == len(seen) - (applied is not None)
    if not at_standstill:
        assert tried == [HUMS] * len(tried)
    return seen, None if applied is None else applied.candidate.gains.speed_nms


@pytest.mark.parametrize("at_standstill", [False, True])
async def test_a_hum_costs_as_much_gain_as_it_must(
    monkeypatch: pytest.MonkeyPatch, at_standstill: bool
) -> None:
    # 0.85 of the gain at which the hum, which goes by the gain, would be at its limit.
    rows = [design(10.0), design(8.0), design(2.0)]
    seen, kept = await kept_of(monkeypatch, rows, at_standstill=at_standstill)
    assert kept == pytest.approx(0.85 * QUIET_NMS)
    # With the same filters 8 Nms would hum, too, and is not tried.
    assert seen == [10.0, pytest.approx(0.85 * QUIET_NMS)]


async def test_other_filters_may_be_quiet_with_more_gain(monkeypatch: pytest.MonkeyPatch) -> None:
    seen, kept = await kept_of(monkeypatch, [design(10.0), design(5.5, 500.0), design(2.0)])
    assert kept == 5.5
    assert seen == [10.0, 5.5]


async def test_where_less_gain_keeps_no_margins_the_next_design_is_tried(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seen, kept = await kept_of(monkeypatch, [design(10.0), design(2.0)], soft=False)
    assert (seen, kept) == ([10.0, 2.0], 2.0)


async def test_a_design_that_the_drive_holds_with_more_gain_only_is_left_out_and_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def plan(_axis: Any, candidate: Candidate, *_: Any) -> dict[str, int]:
        raise OutOfRange("autotune.gain-below-least", drive="X", parameter="P", gain="G", more=2.0)

    async def never(*_: Any) -> Any:
        raise AssertionError("written or verified")

    monkeypatch.setattr(tune_apply, "plan", plan)
    monkeypatch.setattr(tune_apply, "write_settings", never)
    monkeypatch.setattr(tune_apply, "verify", never)
    tried: list[Text] = []
    nothing: Any = None
    check: Any = SimpleNamespace(inertia_kgm2=1e-4, motor_inertia_kgm2=None)
    rows = [design(6.0), design(3.0)]
    found = await tune_apply.first_kept(
        nothing, nothing, check, rows, GOALS, tried, Progress(lambda: None), None
    )
    assert found is None
    assert [each.code for each in tried] == ["autotune.candidate"] * len(rows)
    assert "2 times the designed gain" in tried[0].words()


async def test_what_no_raised_gain_shows_is_tried_with_the_share_that_it_needs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Before designs that are slower than that, and instead of those that are not."""
    rows = [design(10.0), design(9.0), design(2.0)]
    seen, kept = await kept_of(monkeypatch, rows, shown_nms=8.5)
    assert kept == pytest.approx(8.4)
    assert seen == [10.0, pytest.approx(8.4)]
