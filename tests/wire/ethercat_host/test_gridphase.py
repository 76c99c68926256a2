"""The grid of the cycles follows the reference clock, and only that."""

from __future__ import annotations

import random

import pytest

from drivers.ethercat.exchange.gridphase import GridPhase

CYCLE = 250_000
OFFSET = 77_000  # of the reference clock's cycles against ours


class Loop:
    """What the cyclic loop does with time: cycles are numbered, those that are over left out."""

    def __init__(self, rate: float = 1.0) -> None:
        self.phase = GridPhase(CYCLE)
        self.rate = rate
        self.number = 0
        self.planned_ns = 0
        self.passed_ns = 0

    def cycle(self, late_ns: int) -> int:
        """One cycle that wakes up late; returns the error that was found."""
        late = late_ns
        skipped = late // CYCLE
        self.planned_ns += skipped * CYCLE
        self.number += skipped
        self.passed_ns = self.planned_ns + late - skipped * CYCLE
        reference = round(self.passed_ns * self.rate) + OFFSET
        error = self.phase.error_ns(reference, late)
        self.number += 1
        self.planned_ns += CYCLE + self.phase.correction_ns(error)
        return error

    def settle(self, late_ns: int = 0) -> None:
        for _ in range(20_000):
            self.cycle(late_ns)


def middle(loop: Loop) -> float:
    """Where the last frame passed within the reference clock's cycle, 0.5 is wanted."""
    return ((round(loop.passed_ns * loop.rate) + OFFSET) % CYCLE) / CYCLE


@pytest.mark.parametrize("rate", [1.0, 1 + 50e-6, 1 - 50e-6])
def test_frames_pass_in_the_middle_between_two_sync0(rate: float) -> None:
    loop = Loop(rate)
    loop.settle()
    assert middle(loop) == pytest.approx(0.5, abs=0.01)


def test_a_lateness_that_is_usual_is_allowed_for() -> None:
    loop = Loop()
    loop.settle(late_ns=40_000)
    assert middle(loop) == pytest.approx(0.5, abs=0.01)


def test_a_computer_that_is_late_never_lets_the_grid_slip_against_its_counter() -> None:
    """Seen in a soak on two busy cores: eight samples more were counted than time had gone by."""
    loop = Loop()
    loop.settle()
    number, planned = loop.number, loop.planned_ns
    source = random.Random(7)
    for _ in range(100_000):
        loop.cycle(round(source.expovariate(1 / CYCLE)))
    went_by = (loop.planned_ns - planned) / CYCLE
    assert went_by == pytest.approx(loop.number - number, abs=0.3)


def test_one_frame_far_off_moves_the_grid_by_two_percent_at_most() -> None:
    loop = Loop()
    loop.settle()
    assert abs(loop.phase.correction_ns(CYCLE // 2)) <= CYCLE / 50
