"""Ends of motions in the loop of an axis: no setpoint but those of this motion and its ramp."""

from __future__ import annotations

import array
import itertools

import pytest

from drivers.cia402 import Mode, State
from drivers.errors import NotAllowed
from drivers.halt import HaltCause, Halted
from drivers.motion.playback import STOP_S, AxisLoop
from drivers.motion.setpoint_plan import (
    ACTUAL_POSITION,
    CONTROL,
    MODE_SHOWN,
    POSITION,
    STATUS,
    TORQUE,
    VELOCITY,
    Limits,
    Motion,
    Phase,
)
from drivers.texts.message import text

OUT = {CONTROL: 0, POSITION: 1, VELOCITY: 2, TORQUE: 3, 0x60B2: 4}
ENABLED, DISABLED, FAULT, FAULT_REACTION, QUICK_STOP = 0x0237, 0x0250, 0x0218, 0x021F, 0x0217
RAMP = round(STOP_S / 0.001)
RELEASED = Halted(HaltCause.COMMANDED)


class Bench:
    """An enabled axis of a drive that follows each word of the test."""

    def __init__(self, position: int, mode: Mode) -> None:
        self.axis = AxisLoop(
            1,
            inputs={STATUS: 0, ACTUAL_POSITION: 1, MODE_SHOWN: 2},
            outputs=OUT,
            output_count=len(OUT),
            cycle_s=0.001,
            report=lambda _station, _why: None,
        )
        self.status, self.position, self.mode = DISABLED, position, mode
        self.step()
        self.axis.drive_to(State.OPERATION_ENABLED, None)
        for self.status in (DISABLED, 0x0231, 0x0233, ENABLED):
            self.step()

    def step(self, cycles: int = 1) -> None:
        for _ in range(cycles):
            self.axis.step((self.status, self.position, int(self.mode)))

    def out(self, index: int) -> int:
        return self.axis.outputs[OUT[index]]

    def play(self, target: int, values: list[int], limits: Limits | None = None) -> None:
        steps = [abs(b - a) for a, b in itertools.pairwise(values)]
        longest = max(steps, default=0)
        self.axis.play(Motion(target, array.array("q", values), limits or Limits(), 5000, longest))


@pytest.mark.parametrize("by", ["command", "envelope"])
def test_a_velocity_that_ends_before_its_first_value_takes_no_earlier_setpoint(by: str) -> None:
    bench = Bench(1_000_000, Mode.CSP)
    bench.play(POSITION, [1_000_000] * 2)
    bench.step(3)
    bench.axis.pause()
    bench.step(RAMP + 1)
    assert bench.axis.phase is Phase.IDLE
    bench.mode = Mode.CSV
    bench.step()
    bench.play(VELOCITY, [0] * 50, Limits(position_max=900_000 if by == "envelope" else None))
    if by == "command":
        bench.axis.stop(RELEASED)
    seen = set()
    for _ in range(RAMP + 2):
        bench.step()
        seen.add(bench.out(VELOCITY))
    assert seen == {0}


def test_a_limit_of_the_following_error_without_anything_to_compute_it_from_is_refused() -> None:
    bench = Bench(0, Mode.CSV)
    with pytest.raises(NotAllowed, match="60F4h is not mapped"):
        bench.play(VELOCITY, [0] * 50, Limits(following_error_max=50))
    bench.mode = Mode.CSP
    bench.step()
    bench.play(POSITION, [0] * 50, Limits(following_error_max=50))
    assert bench.axis.phase is Phase.PLAYING


@pytest.mark.parametrize(
    ("limits", "english", "chinese"),
    [
        (Limits(position_max=1), "the travel limit", "无法监视行程限值"),
        (Limits(position_min=1), "the travel limit", "无法监视行程限值"),
        (Limits(speed_max=1), "the speed limit", "无法监视速度限值"),
        (Limits(torque_max=1), "the torque limit", "无法监视转矩限值"),
        (Limits(following_error_max=1), "the following error limit", "无法监视跟随误差限值"),
    ],
)
def test_a_limit_that_cannot_be_watched_is_named_in_the_readers_language(
    limits: Limits, english: str, chinese: str
) -> None:
    """The Chinese sentence had the English name of the limit in it."""
    with pytest.raises(NotAllowed) as refused:
        limits.require_watched((), text("link.station", station=1))
    assert f"station 1: {english} cannot be watched, 60" in refused.value.text.words()
    assert chinese in refused.value.text.words("zh")


@pytest.mark.parametrize("sign", [1, -1])
def test_a_ramp_ends_at_the_limit_of_the_type_and_the_axis_is_disabled(sign: int) -> None:
    begin = sign * (2**31 - 1 - 20_000)
    bench = Bench(begin, Mode.CSP)
    path = [begin + sign * 1000 * n for n in range(20)]
    bench.play(POSITION, path)
    bench.step(len(path) - 1)
    bench.axis.stop(RELEASED)
    seen = []
    for _ in range(RAMP + 5):
        bench.position = bench.out(POSITION)
        bench.step()
        seen.append(bench.out(POSITION))
    assert all(-(2**31) <= value < 2**31 for value in seen), "it fits its object"
    assert bench.out(CONTROL) == 0x06


def test_a_reset_of_a_fault_leaves_an_axis_without_fault_as_it_is() -> None:
    bench = Bench(0, Mode.CSP)
    bench.play(POSITION, [10 * n for n in range(200)])
    bench.step(10)
    bench.axis.reset_fault()
    bench.step()
    assert bench.out(CONTROL) == 0x0F
    assert bench.axis.phase is Phase.PLAYING


def test_a_fault_that_stays_is_not_reset_by_itself_long_after_the_command() -> None:
    bench = Bench(0, Mode.CSP)
    bench.status = FAULT
    bench.step(5)
    bench.axis.reset_fault()
    words = []
    for _ in range(10_000):
        bench.step()
        words.append(bench.out(CONTROL) & 0x80)
    assert 0x80 in words[:10]
    assert not any(words[5000:])
    bench.axis.reset_fault()
    bench.step()
    assert bench.out(CONTROL) & 0x80, "another command resets it again"


def test_a_fault_whose_reaction_takes_long_is_reset_after_it() -> None:
    bench = Bench(0, Mode.CSP)
    bench.status = FAULT_REACTION
    bench.step(5)
    bench.axis.reset_fault()
    bench.step(5000)
    bench.status = FAULT
    bench.step()
    assert bench.out(CONTROL) & 0x80


def test_an_offset_of_an_earlier_motion_does_not_stay_in_the_next() -> None:
    bench = Bench(0, Mode.CSP)
    some = array.array("q", [0] * 50)
    offsets = array.array("q", [70] * 50)
    bench.axis.play(Motion(POSITION, some, Limits(), 5000, 0, 0x60B2, offsets))
    bench.step(10)
    assert bench.out(0x60B2) == 70
    bench.play(POSITION, [0] * 50)
    bench.step()
    assert bench.out(0x60B2) == 0


@pytest.mark.parametrize("goal", [State.SWITCH_ON_DISABLED, State.OPERATION_ENABLED])
@pytest.mark.parametrize("reached", [False, True])
def test_a_goal_given_during_a_quick_stop_waits_until_the_axis_rests(
    goal: State, reached: bool
) -> None:
    """Disabled in the middle of it, the axis would coast."""
    bench = Bench(0, Mode.CST)
    bench.play(TORQUE, [100] * 500)
    for _ in range(50):
        bench.position += 20
        bench.step()
    bench.axis.stop(RELEASED)
    if reached:
        bench.step()
        bench.status = QUICK_STOP
        bench.step()
    bench.axis.drive_to(goal, None)
    for _ in range(200):
        bench.position += 10
        bench.step()
        assert bench.out(CONTROL) == 0x02, "it still turns"
        bench.status = QUICK_STOP
    bench.step(60)
    assert bench.out(CONTROL) == 0x00


def test_no_motion_begins_during_a_quick_stop_that_the_drive_does_not_show_yet() -> None:
    bench = Bench(0, Mode.CST)
    bench.play(TORQUE, [100] * 500)
    bench.step(50)
    bench.axis.stop(RELEASED)
    bench.axis.drive_to(State.OPERATION_ENABLED, None)
    bench.step()
    with pytest.raises(NotAllowed, match="brak"):
        bench.play(TORQUE, [100] * 500)


def test_a_change_to_csp_of_an_enabled_axis_does_not_pull_it_back() -> None:
    """Enabled without torque it was turned by hand; the target was still where it was enabled."""
    bench = Bench(0, Mode.CST)
    for _ in range(100):
        bench.position += 1000
        bench.step()
    assert bench.axis.state is State.OPERATION_ENABLED
    bench.axis.drive_to(State.OPERATION_ENABLED, Mode.CSP)
    bench.step()
    assert bench.out(POSITION) == bench.position
    bench.mode = Mode.CSP
    bench.step()
    bench.position += 7
    bench.step()
    assert bench.out(POSITION) == bench.position - 7, "from now on it is held there"
