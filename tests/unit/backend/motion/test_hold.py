"""The held button of a jog under a clock that the test owns: gaps, late signs, releases."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass

import pytest

from backend.tools.moving.jog.hold import CONFIRM_S, GAP_S, RESUME_S, Hold
from backend.tools.moving.jog.release import END_OF_JOG
from drivers.texts.message import text

#: A page sends a sign every 40 ms; a motion looks at its hold as often.
PERIOD_S = 0.04


class Clock:
    """Seconds; the page's own clock began at another time."""

    def __init__(self) -> None:
        self.s = 100.0

    def __call__(self) -> float:
        return self.s

    @property
    def page_s(self) -> float:
        return self.s - 93.25


@dataclass(frozen=True)
class Sign:
    """Sent at a time of this computer's clock, arrived ``late_s`` after that."""

    number: int
    at_s: float
    late_s: float = 0.0
    silent_s: float = 0.0
    pressed: bool = True

    @property
    def arrives_s(self) -> float:
        return self.at_s + self.late_s


class Held:
    """A hold with its clock, and what the motion does: 'moves', 'brakes' or 'ended'."""

    def __init__(self) -> None:
        self.clock = Clock()
        self.gaps: list[bool] = []
        self.hold = Hold(1, self.clock, lambda braking, _s: self.gaps.append(braking))
        self.began = self.clock.s
        self.reported: list[tuple[float, str]] = []

    def look(self) -> str:
        state = "ended" if self.hold.ended() else "brakes" if self.hold.braking() else "moves"
        self.reported.append((self.clock.s - self.began, state))
        return state

    def sign(self, sign: Sign) -> None:
        self.hold.renew(
            1,
            sign.number,
            sent_s=self.began + sign.at_s - 93.25,
            silent_s=sign.silent_s,
            pressed=sign.pressed,
        )

    def play(self, signs: Iterable[Sign], until_s: float, release_at_s: float = 1e9) -> None:
        """Everything in the order of its arrival, with a look at the hold every millisecond."""
        coming = sorted(signs, key=lambda sign: sign.arrives_s)
        while self.clock.s - self.began < until_s:
            now_s = self.clock.s - self.began
            while coming and coming[0].arrives_s <= now_s:
                self.sign(coming.pop(0))
            if now_s >= release_at_s:
                self.hold.release(END_OF_JOG["released"], 1)
                release_at_s = 1e9
            self.look()
            self.clock.s += 0.001

    def states(self) -> list[str]:
        """One after the other, each once."""
        return [state for state, _ in itertools.groupby(state for _, state in self.reported)]

    def first(self, state: str, after_s: float = 0.0) -> float:
        return next(at for at, each in self.reported if each == state and at >= after_s)


def steady(begin_s: float, end_s: float, first: int = 1) -> list[Sign]:
    count = round((end_s - begin_s) / PERIOD_S)
    return [Sign(first + n, begin_s + n * PERIOD_S) for n in range(count)]


def test_a_steady_hold_moves_until_it_is_released() -> None:
    held = Held()
    held.play(steady(0.0, 3.0), 2.5, release_at_s=2.0)
    assert held.states() == ["moves", "ended"]
    assert held.hold.ended() == END_OF_JOG["released"]
    assert held.first("ended") == pytest.approx(2.0, abs=0.002)


def test_a_gap_brakes_after_200_ms_and_ends_where_it_is_alive_again_within_500() -> None:
    held = Held()
    # The last sign at 0.96 s; then nothing until 1.40 s.
    held.play(steady(0.0, 1.0) + steady(1.40, 3.0, first=100), 2.0)
    assert held.states() == ["moves", "brakes", "moves"]
    assert held.first("brakes") == pytest.approx(0.96 + GAP_S, abs=0.003)
    # Two signs prove it: those at 1.40 s and, as 40 ms are not yet enough, at 1.48 s.
    assert held.first("moves", 1.2) == pytest.approx(1.48, abs=0.003)
    assert held.gaps == [True, False]


@pytest.mark.parametrize("back_s", [0.96 + RESUME_S + 0.01, 2.0])
def test_beyond_500_ms_a_new_press_is_needed(back_s: float) -> None:
    held = Held()
    held.play(steady(0.0, 1.0) + steady(back_s, 4.0, first=100), 3.5)
    assert held.states() == ["moves", "brakes", "ended"]
    assert held.hold.ended() == text("jog.end-no-sign-of-life", silent_ms=500.0)
    assert held.first("ended") == pytest.approx(0.96 + RESUME_S, abs=0.003)


@pytest.mark.parametrize("back_s", [0.96 + 0.25, 0.96 + RESUME_S - 0.01])
def test_both_ends_of_the_time_in_which_it_goes_on(back_s: float) -> None:
    held = Held()
    held.play(steady(0.0, 1.0) + steady(back_s, 3.0, first=100), 2.5)
    assert held.states() == ["moves", "brakes", "moves"]


@pytest.mark.parametrize("released_s", [0.97, 1.1, 1.2, 1.35, 1.40, 1.42])
def test_a_release_in_a_gap_never_resumes(released_s: float) -> None:
    """Signs that come afterwards, sent before or after it, change nothing."""
    held = Held()
    held.play(steady(0.0, 1.0) + steady(1.40, 4.0, first=100), 3.5, release_at_s=released_s)
    assert "moves" not in [state for at, state in held.reported if at > 1.2]
    assert held.hold.ended() == END_OF_JOG["released"]


def test_a_burst_that_waited_in_the_network_is_as_old_as_it_was_sent() -> None:
    """The line stood still from 1.0 s to 1.44 s: all of it comes at once, a release at its end."""
    held = Held()
    waiting = [
        Sign(sign.number, sign.at_s, late_s=1.44 - sign.at_s) for sign in steady(1.0, 1.44, 100)
    ]
    let_go = Sign(200, 1.43, late_s=0.01, pressed=False)
    held.play([*steady(0.0, 1.0), *waiting, let_go], 3.0)
    assert "moves" not in [state for at, state in held.reported if at > 1.2]
    assert held.hold.ended() == END_OF_JOG["released"]


def test_a_burst_without_a_release_goes_on_only_with_what_comes_after_it() -> None:
    held = Held()
    waiting = [
        Sign(sign.number, sign.at_s, late_s=1.44 - sign.at_s) for sign in steady(1.0, 1.44, 100)
    ]
    held.play([*steady(0.0, 1.0), *waiting, *steady(1.44, 3.0, first=300)], 2.0)
    assert held.states() == ["moves", "brakes", "moves"]
    assert held.first("moves", 1.2) >= 1.44 + CONFIRM_S


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
def test_signs_and_a_release_in_whatever_order_they_arrive(order: tuple[int, ...]) -> None:
    """Three messages after a gap of 0.4 s, the one in the middle a release."""
    held = Held()
    signs = [
        Sign(100, 1.36, late_s=0.04),
        Sign(101, 1.38, late_s=0.02, pressed=False),
        Sign(102, 1.40),
    ]
    held.play(steady(0.0, 1.0), 1.40)
    for index in order:
        held.sign(signs[index])
        held.look()
    held.play(steady(1.44, 4.0, first=200), 3.0)
    assert "moves" not in [state for at, state in held.reported if at > 1.2]


def test_a_sign_that_was_overtaken_counts_for_nothing() -> None:
    held = Held()
    held.play(steady(0.0, 1.0, first=10), 1.0)
    held.clock.s = held.began + 1.17
    held.sign(Sign(5, 1.16))
    held.play([], 1.18)
    assert held.first("brakes") == pytest.approx(0.96 + GAP_S, abs=0.02)


def test_a_silent_page_brakes_though_its_worker_goes_on() -> None:
    """The worker's signs say since when the page was not heard; a frozen page proves nothing."""
    held = Held()
    frozen = [Sign(100 + n, 1.0 + n * PERIOD_S, silent_s=0.04 + n * PERIOD_S) for n in range(50)]
    held.play(steady(0.0, 1.0) + frozen, 3.0)
    assert held.states() == ["moves", "brakes", "ended"]
    assert held.first("brakes") == pytest.approx(0.96 + GAP_S, abs=0.01)


def test_a_page_that_was_busy_for_150_ms_is_not_noticed() -> None:
    held = Held()
    busy = [Sign(100 + n, 1.0 + n * PERIOD_S, silent_s=0.04 + n * PERIOD_S) for n in range(3)]
    held.play(steady(0.0, 1.0) + busy + steady(1.12, 3.0, first=200), 2.0)
    assert held.states() == ["moves"]
    assert held.gaps == []


def test_it_goes_once_more_only_with_the_next_sign_where_it_is_silent_again() -> None:
    """One sign ends no gap, and what it began with is still where 500 ms count from."""
    held = Held()
    held.play([*steady(0.0, 1.0), Sign(100, 1.40), *steady(1.75, 3.0, first=200)], 2.5)
    assert held.states() == ["moves", "brakes", "ended"]


def test_signs_of_an_earlier_press_are_no_matter_of_this_one() -> None:
    clock = Clock()
    hold = Hold(2, clock)
    clock.s += 0.19
    hold.renew(1, 50)
    hold.renew(1, 51, pressed=False)
    hold.release(END_OF_JOG["released"], 1)
    assert hold.ended() is None
    clock.s += 0.02
    assert hold.braking(), "the first sign of life was another press's"
    hold.release(END_OF_JOG["released"], 2)
    assert hold.ended() == END_OF_JOG["released"]


def test_signs_without_numbers_as_commands_give_them() -> None:
    clock = Clock()
    hold = Hold(0, clock)
    for _ in range(20):
        clock.s += 0.05
        hold.renew()
        assert hold.ended() is None
        assert not hold.braking()
    hold.release(END_OF_JOG["released"])
    hold.renew()
    assert hold.ended() == END_OF_JOG["released"]
