"""Two axes of one machine in the loop: neither goes on alone, and their skew has a limit."""

from __future__ import annotations

import array

import pytest

from drivers.cia402 import Mode, State
from drivers.halt import HaltCause, Halted
from drivers.motion.pair_guard import PairGuard, SkewLimit
from drivers.motion.playback import AxisLoop
from drivers.motion.setpoint_plan import (
    ACTUAL_POSITION,
    CONTROL,
    MODE_SHOWN,
    STATUS,
    VELOCITY,
    Limits,
    Motion,
    Phase,
)

ENABLED = 0x0237
FAULT = 0x0218


def axis(station: int, limits: Limits | None = None) -> AxisLoop:
    made = AxisLoop(
        station,
        inputs={STATUS: 0, ACTUAL_POSITION: 1, MODE_SHOWN: 2},
        outputs={CONTROL: 0, VELOCITY: 1},
        output_count=2,
        cycle_s=0.001,
        report=lambda _station, _text: None,
    )
    made.drive_to(State.OPERATION_ENABLED, None)
    for _ in range(5):
        made.step([ENABLED, 0, int(Mode.CSV)])
    made.play(Motion(VELOCITY, array.array("q", [5] * 1000), limits or Limits(), 10_000, 0))
    return made


def pair(limit: float = 100.0, ratio: float = 1.0) -> tuple[AxisLoop, AxisLoop, PairGuard]:
    first, second = axis(1), axis(2)
    return first, second, PairGuard((first, second), SkewLimit((0, 0), ratio, limit))


def cycle(
    both: tuple[AxisLoop, AxisLoop],
    guard: PairGuard,
    places: tuple[int, int],
    status: int = ENABLED,
) -> None:
    both[0].step([ENABLED, places[0], int(Mode.CSV)])
    both[1].step([status, places[1], int(Mode.CSV)])
    guard.look()


def test_both_go_on_while_neither_is_stopped() -> None:
    first, second, guard = pair()
    for n in range(50):
        cycle((first, second), guard, (5 * n, 5 * n + 99))
    assert first.phase is second.phase is Phase.PLAYING
    assert first.halted is second.halted is None


@pytest.mark.parametrize("stopped", [0, 1])
def test_one_that_is_stopped_stops_the_other_in_the_same_cycle(stopped: int) -> None:
    first, second, guard = pair()
    cycle((first, second), guard, (0, 0))
    (first, second)[stopped].stop(Halted(HaltCause.COMMANDED))
    guard.look()
    other = (second, first)[stopped]
    assert other.phase is Phase.BRAKING
    assert other.halted is not None
    assert other.halted.cause is HaltCause.PARTNER
    assert (first, second)[stopped].halted is not None
    assert (first, second)[stopped].halted.cause is HaltCause.COMMANDED


def test_a_fault_of_one_stops_the_other() -> None:
    first, second, guard = pair()
    cycle((first, second), guard, (0, 0))
    cycle((first, second), guard, (0, 0), FAULT)
    assert second.halted is not None
    assert second.halted.cause is HaltCause.LEFT_ENABLED
    assert first.phase is Phase.BRAKING
    assert first.halted is not None
    assert first.halted.cause is HaltCause.PARTNER


@pytest.mark.parametrize(
    ("ratio", "places"), [(1.0, (151, 50)), (-1.0, (60, 60)), (2.0, (200, 49)), (1.0, (-101, 0))]
)
def test_a_skew_beyond_its_limit_stops_both(ratio: float, places: tuple[int, int]) -> None:
    first, second, guard = pair(ratio=ratio)
    cycle((first, second), guard, places)
    for each in (first, second):
        assert each.phase is Phase.BRAKING
        assert each.halted is not None
        assert each.halted.cause is HaltCause.SKEW
        assert each.halted.limit == 100.0


def test_it_watches_until_both_are_at_rest() -> None:
    first, second, guard = pair()
    first.stop(Halted(HaltCause.COMMANDED))
    guard.look()
    assert not guard.over
    for _ in range(500):
        cycle((first, second), guard, (0, 0))
    assert guard.over
