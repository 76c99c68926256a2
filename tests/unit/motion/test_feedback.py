"""606Ch against differences of 6064h: what real drives do is no contradiction, wrong scales are.

The shaft's motion is given in rev/s as a function of time; 10 000 increments to the revolution, and
the expected unit of 606Ch is increments per second, so that one rpm is 10 000 / 60 of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from drivers.halt import HaltCause, Halted
from drivers.motion.guard import SpeedGuard
from drivers.objects.feedback import Disagreement, FeedbackScale

COUNTS, CYCLE_S = 10_000, 1e-3
RPM = COUNTS / 60.0
SCALE = FeedbackScale(1.0, 30.0 * RPM)

Turns = Callable[[float], float]


def ramp_to(rpm: float, in_s: float = 0.05) -> Turns:
    """Revolutions of a ramp to a speed that stays."""
    top = rpm / 60.0

    def turns(t: float) -> float:
        return 0.5 * top / in_s * t * t if t < in_s else top * (t - 0.5 * in_s)

    return turns


def swing(rpm: float, hz: float) -> Turns:
    return lambda t: rpm / 60.0 / (2 * math.pi * hz) * (1 - math.cos(2 * math.pi * hz * t))


def speed(turns: Turns, t: float, mean_s: float = 1e-4) -> float:
    """Mean increments per second over the time before ``t``."""
    return COUNTS * (turns(max(t, 0.0)) - turns(max(t - mean_s, 0.0))) / mean_s


def watched(
    turns: Turns,
    velocity: Callable[[float], float],
    *,
    limit_rpm: float | None = None,
    for_s: float = 1.0,
    start: int = 0,
) -> tuple[Halted | None, float]:
    """What ends the motion, and when [s]."""
    guard = SpeedGuard(SCALE, None if limit_rpm is None else limit_rpm * RPM)
    for cycle in range(round(for_s / CYCLE_S)):
        t = cycle * CYCLE_S
        position = start + round(COUNTS * turns(t))
        position = (position + 2**31) % 2**32 - 2**31
        halt = guard.look(position, round(velocity(t)), t)
        if halt is not None:
            return halt, t
    return None, for_s


MOTIONS = {
    "ramp": ramp_to(900.0),
    "slow": ramp_to(12.0),
    "jerk": ramp_to(2000.0, 0.005),
    "swing 3 Hz": swing(600.0, 3.0),
    "swing 20 Hz": swing(300.0, 20.0),
    "swing 100 Hz": swing(200.0, 100.0),
    "standstill": lambda _t: 0.25,
}
HARMLESS: dict[str, Callable[[Turns], Callable[[float], float]]] = {
    "exact": lambda turns: lambda t: speed(turns, t),
    "1 ms late": lambda turns: lambda t: speed(turns, t - 1e-3),
    "3 ms late": lambda turns: lambda t: speed(turns, t - 3e-3),
    "mean of 2 cycles": lambda turns: lambda t: speed(turns, t, 2e-3),
    "mean of 3 cycles": lambda turns: lambda t: speed(turns, t, 3e-3),
    "whole rpm": lambda turns: lambda t: RPM * round(speed(turns, t) / RPM),
    "10 rpm, cut off": lambda turns: lambda t: 10 * RPM * int(speed(turns, t) / RPM / 10),
    "noisy": lambda turns: lambda t: speed(turns, t) + 20 * RPM * math.sin(9e3 * t),
}


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("honest", HARMLESS)
def test_what_lags_averages_or_rounds_agrees(motion: str, honest: str) -> None:
    turns = MOTIONS[motion]
    halt, _ = watched(turns, HARMLESS[honest](turns), limit_rpm=2500.0)
    assert halt is None


@pytest.mark.parametrize(
    ("factor", "kind"),
    [
        (60.0 / COUNTS * 10.0, Disagreement.SCALE),  # 0.1 rpm instead of inc/s
        (60.0 / COUNTS, Disagreement.SCALE),  # rpm instead of inc/s
        (0.0, Disagreement.SPEED_STANDS),
        (-1.0, Disagreement.SIGN),
        (10.0, Disagreement.SCALE),
        (0.5, Disagreement.SCALE),
        (1.6, Disagreement.SCALE),
    ],
)
def test_another_scale_or_sign_ends_the_motion(factor: float, kind: Disagreement) -> None:
    turns = ramp_to(903.0)
    halt, at_s = watched(turns, lambda t: factor * speed(turns, t))
    assert halt is not None
    assert (halt.cause, halt.note) == (HaltCause.CONTRADICTION, kind.value)
    assert halt.limit == pytest.approx(903 * RPM, rel=0.2)
    assert at_s < 0.3


def test_a_position_that_stands_still_is_no_standstill() -> None:
    halt, _ = watched(lambda _t: 0.5, lambda _t: 300 * RPM)
    assert halt is not None
    assert halt.note == Disagreement.POSITION_STANDS.value


def test_a_speed_of_zero_does_not_hide_an_axis_that_is_too_fast() -> None:
    """The limit is 100 rpm; 606Ch says 0. By the position it is met within 50 ms of the speed."""
    turns = ramp_to(903.0)
    halt, at_s = watched(turns, lambda _t: 0.0, limit_rpm=100.0)
    assert halt is not None
    assert halt.cause is HaltCause.CONTRADICTION
    assert at_s < 0.05


def test_a_speed_ten_times_too_large_is_no_speed() -> None:
    """The limit trips by 606Ch; the position says that the axis hardly moves."""
    turns = ramp_to(60.0)
    halt, _ = watched(turns, lambda t: 10 * speed(turns, t), limit_rpm=100.0)
    assert halt is not None
    assert (halt.cause, halt.note) == (HaltCause.CONTRADICTION, Disagreement.SCALE.value)


@pytest.mark.parametrize("in_s", [0.002, 0.05])
def test_a_real_overspeed_stays_one(in_s: float) -> None:
    """Also where a blow makes it within two cycles."""
    turns = ramp_to(903.0, in_s)
    halt, _ = watched(
        lambda t: turns(max(t - 0.2, 0.0)), lambda t: speed(turns, t - 0.2), limit_rpm=300.0
    )
    assert halt is not None
    assert halt.cause is HaltCause.SPEED


def test_the_end_of_the_number_range_is_no_leap() -> None:
    turns = ramp_to(900.0)
    halt, _ = watched(turns, lambda t: speed(turns, t), limit_rpm=1200.0, start=2**31 - 5_000)
    assert halt is None


def test_cycles_that_the_computer_missed_are_no_leap() -> None:
    """The position goes on while nothing is exchanged: its speed is by time, not by samples."""
    turns, guard = ramp_to(900.0), SpeedGuard(SCALE, 1200 * RPM)
    for cycle in range(1000):
        t = cycle * CYCLE_S
        if cycle % 50 < 20:
            continue
        assert guard.look(round(COUNTS * turns(t)), round(speed(turns, t)), t) is None


def late_run(*, stale: bool, scale: float) -> Halted | None:
    """A computer 3 cycles late every 10; ``stale``: inputs are those of the last frame."""
    turns = ramp_to(300.0)
    guard = SpeedGuard(SCALE, None)
    cycle = frame = 0
    for sample in range(1000):
        if sample % 10 == 9:
            cycle += 3
            guard.gap()
        at = (frame + 1 if stale else cycle) * CYCLE_S
        halt = guard.look(
            round(COUNTS * turns(at)), round(scale * speed(turns, at)), cycle * CYCLE_S
        )
        if halt is not None:
            return halt
        frame, cycle = cycle, cycle + 1
    return None


@pytest.mark.parametrize("stale", [False, True])
def test_skipped_cycles_are_no_contradiction_and_hide_none(stale: bool) -> None:
    assert late_run(stale=stale, scale=1.0) is None
    wrong = late_run(stale=stale, scale=2.0)
    assert wrong is not None
    assert wrong.cause is HaltCause.CONTRADICTION


@pytest.mark.parametrize("last", range(500, 510))
def test_a_stall_whose_first_sample_is_stale_is_no_speed_beyond_its_limit(last: int) -> None:
    """20 cycles are missed; the drive then gives the position of its last frame, and a cycle later
    the one that it has: 20 cycles of travel with 1 ms between their times, at 300 of 330 rpm."""
    turns, guard = ramp_to(300.0), SpeedGuard(SCALE, 330.0 * RPM)
    for cycle in [c for c in range(1000) if not last < c < last + 20]:
        seen = cycle * CYCLE_S
        if cycle == last + 20:
            guard.gap()
            seen = (last + 1) * CYCLE_S
        halt = guard.look(round(COUNTS * turns(seen)), round(speed(turns, seen)), cycle * CYCLE_S)
        assert halt is None, (cycle, halt)


def test_a_speed_beyond_its_limit_right_after_a_gap_ends_the_motion() -> None:
    guard = SpeedGuard(SCALE, 100.0 * RPM)
    guard.gap()
    halt = guard.look(0, 101.0 * RPM, 0.0)
    assert halt is not None
    assert halt.cause is not HaltCause.CONTRADICTION
