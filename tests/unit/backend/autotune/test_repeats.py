"""Measuring again what is only known less well keeps to the time that a tuning has left."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from backend.analysis.loop.notch import Notch
from backend.analysis.loop.notch_effect import NotchEffect
from backend.axes.axis.axis import Envelope
from backend.axes.drive.drive import Drive
from backend.foundation.work.jobs import Progress
from backend.tools.measuring import repeats
from backend.tools.measuring.computing import meanwhile
from backend.tools.measuring.repeats import Repeats
from backend.tools.moving.moves import go_back as go_back_tool
from backend.tools.tuning.autotune import time_budget as tune_time
from backend.tools.tuning.autotune.time_budget import TimeLeft
from backend.tools.tuning.notch import effect as notch_effect
from backend.tools.tuning.sweep import play as sweep_play
from drivers.errors import NotAllowed
from profiles.loader import load_profile
from tests.unit.backend.autotune.test_tune_time import Clock

NOTHING: Any = None


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    fake = Clock()
    for module in (repeats, sweep_play, notch_effect, tune_time):
        monkeypatch.setattr(module, "time", fake)
    return fake


def test_what_would_end_too_late_is_left_out_and_counted(clock: Clock) -> None:
    again = Repeats(1010.0)
    assert again.allow(10.0)
    assert not again.allow(10.1)
    clock.work(8.0)
    assert not again.allow(2.3)
    assert again.left_out == 2
    assert Repeats().allow(1e9)


def test_each_part_leaves_time_for_those_behind_it(clock: Clock) -> None:
    left = TimeLeft.of(60.0)
    ends = [left.moving(), left.measuring(20.0), left.learning(), left.verifying_again()]
    assert [each.by_s - clock.now_s for each in ends] == [32.0, 28.0, 48.0, 56.0]
    # Half of the realisations lost samples, so the verification's will.
    left.lossy = 0.5
    assert left.learning().by_s - clock.now_s == 45.0


async def played(
    monkeypatch: pytest.MonkeyPatch, clock: Clock, whole: list[int], again: Repeats
) -> int:
    """How often realisations are played that come to so many whole periods each time."""
    count = 0

    async def one(*given: Any) -> Any:
        nonlocal count
        count += 1
        clock.work(2.5)
        return given[4], SimpleNamespace(valid=given[4])

    async def near(*_: Any) -> None: ...

    monkeypatch.setattr(sweep_play, "_play_one", one)
    monkeypatch.setattr(sweep_play, "_near_home", near)
    monkeypatch.setattr(sweep_play, "_kept", lambda sequence, _recording: (sequence, 0))
    monkeypatch.setattr(sweep_play, "_whole", lambda *_: False)
    sequences: Any = tuple(whole)
    await sweep_play.play_fitting(
        NOTHING, NOTHING, NOTHING, NOTHING, sequences, 0, Progress(lambda: None), len(whole),
        repeats=again,
    )  # fmt: skip
    return count


@pytest.mark.parametrize(
    ("whole", "left_s", "count", "left_out"),
    [
        # Each once more: 20 s. With 14 s the first is, and one second later no other.
        ([1, 1, 1, 1], 20.0, 8, 0),
        ([1, 1, 1, 1], 14.0, 6, 2),
        ([1, 1, 1, 1], 4.0, 4, 4),
        # Without any whole period nothing can be evaluated: twice again, whatever the time.
        ([0, 1, 1, 1], 0.0, 6, 3),
        ([0, 0, 0, 0], 0.0, 8, 0),
    ],
)
async def test_realisations_that_lost_samples(
    monkeypatch: pytest.MonkeyPatch,
    clock: Clock,
    whole: list[int],
    left_s: float,
    count: int,
    left_out: int,
) -> None:
    again = Repeats(clock.now_s + left_s)
    assert await played(monkeypatch, clock, whole, again) == count
    assert again.left_out == left_out
    assert again.lossy == pytest.approx((count - 4) / 4)


class Player:
    """Plays of 2.5 s on a drive whose notches are what their levels say."""

    def __init__(self, clock: Clock, lost: set[int]) -> None:
        self.clock, self.count, self.lost = clock, 0, lost

    async def plain(self, _reported: Any) -> float:
        self.clock.work(2.5)
        return 0.0

    async def notched(self, _reported: Any) -> NotchEffect:
        self.count += 1
        self.clock.work(2.5)
        if self.count in self.lost:
            raise notch_effect.samples_lost(NAMED, 1)
        return NotchEffect(Notch(120.0, 60.0, -20.0), 0.1)


NAMED: Any = SimpleNamespace(drive=SimpleNamespace(name="X"))


async def tried(
    monkeypatch: pytest.MonkeyPatch,
    clock: Clock,
    family: str,
    left_s: float,
    lost: set[int] | None = None,
) -> tuple[int, int]:
    """How many values of a family's notch are tried in this time; the others are named."""

    @asynccontextmanager
    async def inside(*_: Any) -> AsyncIterator[None]:
        yield

    async def nothing(*_: Any) -> dict[str, int]:
        return {}

    async def stands() -> int:
        return 0

    async def units() -> Any:
        return SimpleNamespace(position=float)

    for name in ("temporary", "stopping_hard"):
        monkeypatch.setattr(notch_effect, name, inside)
    for name in ("go_back", "plan_notches"):
        monkeypatch.setattr(notch_effect, name, nothing)
    monkeypatch.setattr(notch_effect, "cycle_s", lambda _session: 1e-3)
    drive = Drive("x", "X", load_profile(family), [])
    axis: Any = SimpleNamespace(drive=drive, position_raw=stands, units=units)
    envelope = Envelope(4.0, 1500.0, 100.0, 60.0)
    player = Player(clock, lost or set())
    meaning = await notch_effect.tried_with(
        player, axis, NOTHING, envelope, NOTHING, Progress(lambda: None), 0.0,
        Repeats(clock.now_s + left_s),
    )  # fmt: skip
    return player.count, meaning.left_out


@pytest.mark.parametrize(
    ("family", "left_s", "count", "left_out"),
    [
        ("r6l", 20.0, 7, 0),
        ("r6l", 16.0, 5, 2),
        ("r6l", 8.0, 4, 3),
        ("m6l", 7.5, 2, 0),
        ("m6l", 4.0, 1, 1),
    ],
)
async def test_fewer_values_of_a_notch_are_tried_where_time_is_short(
    monkeypatch: pytest.MonkeyPatch,
    clock: Clock,
    family: str,
    left_s: float,
    count: int,
    left_out: int,
) -> None:
    assert await tried(monkeypatch, clock, family, left_s) == (count, left_out)


async def test_no_value_is_tried_where_the_least_do_not_fit(
    monkeypatch: pytest.MonkeyPatch, clock: Clock
) -> None:
    with pytest.raises(NotAllowed, match="no time to try"):
        await tried(monkeypatch, clock, "r6l", 7.0)


async def test_a_value_that_loses_samples_ends_learning_only_where_too_few_are_known(
    monkeypatch: pytest.MonkeyPatch, clock: Clock
) -> None:
    assert await tried(monkeypatch, clock, "r6l", 1e9, {6}) == (6, 2)
    with pytest.raises(NotAllowed, match="no time to try"):
        await tried(monkeypatch, clock, "r6l", 1e9, {2})


@pytest.mark.parametrize(
    ("pull_rev", "share", "blocked"),
    [(0.15, 1.0, False), (0.0, 0.8, False), (0.0, 1.0, True)],
)
async def test_an_axis_that_a_load_pulls_comes_home(
    monkeypatch: pytest.MonkeyPatch, pull_rev: float, share: float, blocked: bool
) -> None:
    """Each move is short by the way that the load takes until the integral holds it."""
    at, asked = 0.6, list[float]()

    @asynccontextmanager
    async def enabled(*_: Any) -> AsyncIterator[int]:
        yield 0

    async def play(_axis: Any, _session: Any, sent: Any, *_: Any) -> None:
        nonlocal at
        asked.append(float(np.sum(sent.values)) / 1e6 / 1000.0 / 60.0)
        if not blocked:
            at += share * asked[-1] - pull_rev

    async def quiet(_axis: Any) -> None: ...

    async def limits(*_: Any) -> None: ...

    async def units() -> Any:
        return SimpleNamespace(position=lambda x: x / 1e4, velocity_raw=lambda x: round(1e6 * x))

    async def place() -> int:
        return round(1e4 * at)

    for name, made in (("enabled", enabled), ("play", play), ("quiet", quiet),
                       ("bus_limits", limits)):  # fmt: skip
        monkeypatch.setattr(go_back_tool, name, made)
    monkeypatch.setattr(go_back_tool, "cycle_s", lambda _session: 1e-3)
    axis: Any = SimpleNamespace(
        units=units, position_raw=place, drive=SimpleNamespace(name="X axis")
    )
    facts: Any = SimpleNamespace(rated_torque_nm=1.27)
    envelope = Envelope(4.0, 1500.0, 100.0, 60.0)
    going = go_back_tool.go_back(axis, NOTHING, 0, envelope, facts)
    if blocked:
        with pytest.raises(NotAllowed, match=r"X axis did not come back .* 0\.6 rev"):
            await going
        assert max(abs(each) for each in asked) < 0.6 + 0.3 + 1e-3, "never far beyond home"
        return
    await going
    assert abs(at) < 0.05
    assert len(asked) == (2 if pull_rev else 3)


async def test_an_axis_comes_home_before_anything_is_said_of_what_was_measured() -> None:
    done: list[str] = []

    async def home() -> None:
        await asyncio.sleep(0)
        done.append("home")

    def sound() -> int:
        return 7

    def short() -> int:
        raise ValueError("too short")

    assert await meanwhile(sound, home()) == 7
    with pytest.raises(ValueError, match="too short"):
        await meanwhile(short, home())
    assert done == ["home", "home"]


async def test_what_stops_an_axis_on_its_way_home_is_reported_first() -> None:
    async def stopped() -> None:
        raise NotAllowed("the drive left Operation enabled")

    def short() -> int:
        raise ValueError("too short")

    with pytest.raises(NotAllowed, match="Operation enabled"):
        await meanwhile(short, stopped())


def test_raised_gains_that_a_slow_cycle_needs_have_their_time(clock: Clock) -> None:
    """At 1 ms a loop is measured up to 250 Hz and may cross above; at 0.5 ms hardly any does."""
    slow, fast = TimeLeft.of(60.0, 1e-3), TimeLeft.of(60.0, 5e-4)
    ends = [slow.moving(), slow.measuring(20.0), slow.learning(), slow.verifying_again()]
    # Three steps of about 2 s each.
    assert [each.by_s - clock.now_s for each in ends] == pytest.approx([25.7, 21.7, 41.7, 49.7])
    assert fast.verifying_again().by_s - clock.now_s == 56.0
    slow.require_raising(0)
    assert slow.verifying_again().by_s - clock.now_s == 56.0
    slow.require_raising(4)
    assert slow.pairs(2.0, 30) == (60.0 - 4.0 - 8.4) // 2.0
