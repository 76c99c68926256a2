"""The axis in the loop against CiA 402-2 and the rules of `drivers.link.Trajectory`."""

from __future__ import annotations

import array
import itertools

import pytest

from drivers.cia402 import State
from drivers.errors import NotAllowed
from drivers.halt import HaltCause, Halted, LeftBy
from drivers.motion.playback import LET_GO_S, RUNS_ON_S, STOP_S, AxisLoop
from drivers.motion.setpoint_plan import Limits, Motion, Phase
from drivers.objects.feedback import FeedbackScale

IN = {0x6041: 0, 0x6064: 1, 0x606C: 2, 0x6077: 3, 0x6061: 4}
OUT = {0x6040: 0, 0x607A: 1, 0x60FF: 2, 0x6071: 3, 0x60B2: 4, 0x6060: 5}
DISABLED, READY, ON, ENABLED, FAULT = 0x0250, 0x0231, 0x0233, 0x0237, 0x0218
CYCLE_S = 0.001
RELEASED = Halted(HaltCause.COMMANDED)


class Bench:
    """An axis whose drive does at once what its control word says."""

    def __init__(self, position: int = 500, cycle_s: float = CYCLE_S) -> None:
        self.reported: list[str] = []
        self.axis = AxisLoop(
            1,
            inputs=IN,
            outputs=OUT,
            output_count=6,
            cycle_s=cycle_s,
            report=lambda _station, why: self.reported.append(why.words()),
        )
        self.status, self.position, self.speed, self.torque, self.mode = DISABLED, position, 0, 0, 8

    def step(self, cycles: int = 1, late_s: float = 0.0) -> None:
        for _ in range(cycles):
            self.axis.step((self.status, self.position, self.speed, self.torque, self.mode), late_s)

    def obey(self, cycles: int = 6) -> None:
        for _ in range(cycles):
            self.step()
            word = self.axis.outputs[0]
            if self.status == FAULT:
                self.status = DISABLED if word & 0x80 else FAULT
            elif word & 0x02 == 0:
                self.status = DISABLED
            elif word == 0x06:
                self.status = READY
            elif word == 0x07 and self.status != DISABLED:
                self.status = ON
            elif word == 0x0F and self.status in (ON, ENABLED):
                self.status = ENABLED

    def enabled(self, mode: int = 8) -> Bench:
        self.mode = mode
        self.step()
        self.axis.drive_to(State.OPERATION_ENABLED, mode)
        self.obey()
        assert self.axis.state is State.OPERATION_ENABLED
        return self

    def play(
        self,
        values: list[int],
        target: int = 0x607A,
        renew: int = 200,
        limits: Limits | None = None,
    ) -> None:
        steps = [abs(b - a) for a, b in itertools.pairwise(values)]
        self.axis.play(
            Motion(
                target, array.array("q", values), limits or Limits(), renew, max(steps, default=0)
            )
        )


def test_enabling_walks_through_the_states_and_does_not_move() -> None:
    bench = Bench(position=500)
    words = []
    bench.axis.drive_to(State.OPERATION_ENABLED, 8)
    for _ in range(5):
        bench.obey(1)
        words.append(bench.axis.outputs[0])
        assert bench.axis.outputs[1] == 500, "the target waits where the axis is"
    assert [w for n, w in enumerate(words) if n == 0 or w != words[n - 1]] == [0x06, 0x07, 0x0F]


def test_the_target_follows_the_axis_until_it_is_enabled() -> None:
    bench = Bench(position=500)
    bench.step()
    bench.position = 730
    bench.step()
    assert bench.axis.outputs[1] == 730


def test_one_value_per_cycle() -> None:
    bench = Bench().enabled()
    values = [500, 503, 509, 518]
    bench.play(values)
    seen = []
    for _ in values:
        bench.step()
        seen.append(bench.axis.outputs[1])
    assert seen == values
    assert bench.axis.phase is Phase.HOLDING


def test_without_renewal_it_brakes_and_leaves_operation_enabled() -> None:
    bench = Bench().enabled()
    bench.play(list(range(500, 5000, 10)), renew=200)
    bench.step(200)
    assert bench.axis.phase is Phase.PLAYING
    before = bench.axis.outputs[1]
    assert before == 500 + 199 * 10
    bench.step()
    assert bench.axis.phase is Phase.BRAKING
    cycles = round(STOP_S / CYCLE_S)
    track = [before, bench.axis.outputs[1]]
    for _ in range(cycles):
        bench.step()
        track.append(bench.axis.outputs[1])
    speeds = [b - a for a, b in itertools.pairwise(track)]
    assert all(b <= a + 1 for a, b in itertools.pairwise(speeds)), "it only gets slower"
    # From 10 counts per cycle linearly to zero in n cycles: 10·n/2 counts, less the last half step.
    assert track[-1] - before == pytest.approx(10 * cycles / 2, rel=0.03)
    assert speeds[-1] == 0
    bench.obey(3)
    assert bench.axis.state is not State.OPERATION_ENABLED
    assert bench.axis.halted == Halted(HaltCause.EXPIRED)


def test_renewal_keeps_it_going() -> None:
    bench = Bench().enabled()
    bench.play(list(range(500, 900)), renew=50)
    for _ in range(350):
        bench.axis.renew()
        bench.step()
    assert bench.axis.phase is Phase.PLAYING
    assert bench.reported == []


@pytest.mark.parametrize(
    ("limits", "halt", "word"),
    [
        (
            Limits(position_max=1000),
            Halted(HaltCause.POSITION, "position", 1001, 1000),
            "position 1001 is beyond the limit of 1000",
        ),
        (
            Limits(position_min=400),
            Halted(HaltCause.POSITION, "position", 399, 400),
            "position 399 is beyond the limit of 400",
        ),
        (
            Limits(speed_max=100),
            Halted(HaltCause.SPEED, "speed", -101, 100),
            "speed -101 is beyond",
        ),
        (
            Limits(torque_max=300),
            Halted(HaltCause.TORQUE, "torque", 301, 300),
            "torque 301 is beyond",
        ),
    ],
)
def test_the_envelope_stops_in_the_very_cycle(limits: Limits, halt: Halted, word: str) -> None:
    bench = Bench().enabled()
    bench.play([500] * 400, limits=limits)
    bench.step(3)
    assert bench.axis.phase is Phase.PLAYING
    assert halt.quantity is not None
    setattr(bench, halt.quantity, halt.value)
    bench.step()
    assert bench.axis.phase is Phase.BRAKING
    assert bench.axis.halted == halt
    assert bench.reported
    assert bench.reported[0].startswith(word)


def test_following_error_is_computed_where_the_drive_does_not_tell_it() -> None:
    bench = Bench().enabled()
    bench.play(list(range(500, 900)), limits=Limits(following_error_max=50))
    bench.step(51)
    assert bench.axis.phase is Phase.PLAYING
    bench.step(2)
    assert bench.axis.halted is not None
    assert bench.axis.halted.cause is HaltCause.FOLLOWING
    assert bench.axis.halted.limit == 50


def test_a_limit_that_cannot_be_watched_is_refused() -> None:
    bench = Bench()
    bench.axis = AxisLoop(
        1,
        inputs={0x6041: 0, 0x6064: 1},
        outputs=OUT,
        output_count=6,
        cycle_s=CYCLE_S,
        report=lambda *_: None,
    )
    bench.enabled()
    with pytest.raises(NotAllowed, match="606Ch is not mapped"):
        bench.play([500], limits=Limits(speed_max=1))


def test_a_jump_at_the_beginning_is_refused() -> None:
    bench = Bench().enabled()
    with pytest.raises(NotAllowed, match="begins at 700, the axis is held at 500"):
        bench.play([700, 701, 702])


def test_a_trajectory_for_another_mode_is_refused() -> None:
    bench = Bench().enabled(mode=8)
    with pytest.raises(NotAllowed, match=r"mode 8, this setpoint needs mode 9"):
        bench.play([0, 1], target=0x60FF)


def test_velocity_ramps_down_to_zero() -> None:
    bench = Bench().enabled(mode=9)
    bench.play([1000] * 1000, target=0x60FF, renew=10)
    bench.step(11)
    speeds = []
    for _ in range(round(STOP_S / CYCLE_S)):
        speeds.append(bench.axis.outputs[2])
        bench.step()
    assert speeds == sorted(speeds, reverse=True)
    assert bench.axis.outputs[2] == 0


@pytest.mark.parametrize(
    ("turns", "reported"),
    [
        # Blocked: nothing is left to push with; turned back by its load: as well.
        (0, 0),
        (-300, 0),
        # It lags: braked from where it is. It overtakes: braked from what it was reported.
        (400, 400),
        (2500, 1000),
    ],
)
def test_an_axis_that_takes_too_much_torque_is_braked_from_its_own_speed(
    turns: int, reported: int
) -> None:
    bench = Bench().enabled(mode=9)
    bench.play([1000] * 500, target=0x60FF, limits=Limits(torque_max=300))
    bench.speed = turns
    bench.step(3)
    assert bench.axis.outputs[2] == 1000
    bench.torque = 301
    bench.step()
    assert bench.axis.halted == Halted(HaltCause.TORQUE, "torque", 301, 300)
    assert bench.axis.phase is Phase.BRAKING
    cycles = round(STOP_S / CYCLE_S)
    # The first step of the ramp that ends at standstill.
    assert bench.axis.outputs[2] == round(reported - reported / cycles)
    bench.step(cycles)
    assert bench.axis.outputs[2] == 0


def test_torque_ends_with_a_quick_stop_because_no_torque_does_not_stop_an_axis() -> None:
    bench = Bench().enabled(mode=10)
    bench.play([100] * 1000, target=0x6071)
    bench.step(5)
    bench.axis.stop(RELEASED)
    bench.step()
    assert bench.axis.outputs[3] == 0
    assert bench.axis.outputs[0] == 0x02


def test_against_a_closed_brake_a_torque_beyond_a_limit_only_becomes_zero() -> None:
    """A quick stop would push on; the power goes when no torque is left."""
    bench = Bench().enabled(mode=10)
    limits = Limits(position_max=600, torque_off_only=True)
    bench.play([100] * 1000, target=0x6071, limits=limits)
    bench.step(5)
    assert bench.axis.outputs[3] == 100
    bench.position = 601
    bench.step()
    assert bench.axis.outputs[3] == 0
    assert bench.axis.halted == Halted(HaltCause.POSITION, "position", 601, 600)
    words = []
    for _ in range(2 * round(LET_GO_S / CYCLE_S)):
        bench.obey(1)
        words.append(bench.axis.outputs[0])
    assert words.index(0x00) == pytest.approx(LET_GO_S / CYCLE_S, abs=2)
    assert 0x02 not in words
    assert bench.axis.state is State.SWITCH_ON_DISABLED
    assert bench.axis.outputs[3] == 0


@pytest.mark.parametrize(("slows_to", "stopped"), [(0.9, True), (0.3, False), (0.0, False)])
def test_a_shaft_that_no_brake_slows_down_gets_a_quick_stop(slows_to: float, stopped: bool) -> None:
    bench = Bench().enabled(mode=10)
    limits = Limits(position_max=600, torque_off_only=True, stopped_if_it_runs_on=True)
    bench.play([100] * 1000, target=0x6071, limits=limits)
    speed = 40
    bench.position = 561
    bench.step(3)
    bench.position += speed
    bench.step()
    assert bench.axis.outputs[3] == 0
    words = []
    for cycle in range(1, 2 * round(LET_GO_S / CYCLE_S)):
        bench.position += round(speed * (1.0 - (1.0 - slows_to) * min(cycle / 10, 1.0)))
        bench.step()
        words.append(bench.axis.outputs[0])
    if stopped:
        assert words.index(0x02) == pytest.approx(RUNS_ON_S / CYCLE_S, abs=2)
        assert 0x00 not in words
    else:
        assert words.index(0x00) == pytest.approx(LET_GO_S / CYCLE_S, abs=2)
        assert 0x02 not in words


def test_against_a_closed_brake_every_other_end_is_a_quick_stop() -> None:
    bench = Bench().enabled(mode=10)
    bench.play([100] * 1000, target=0x6071, limits=Limits(position_max=600, torque_off_only=True))
    bench.step(5)
    bench.axis.stop(RELEASED)
    bench.step()
    assert bench.axis.outputs[3] == 0
    assert bench.axis.outputs[0] == 0x02


def test_an_axis_that_cannot_follow_the_brake_ramp_is_not_left_to_coast() -> None:
    bench = Bench().enabled()
    bench.play([500 + 100 * n for n in range(1, 300)])
    for _ in range(50):
        bench.step()
        bench.position = bench.axis.outputs[1]
    bench.axis.stop(RELEASED)
    for _ in range(round(STOP_S / CYCLE_S) + 2):
        bench.position += 80  # too much inertia for its torque
        bench.step()
    assert bench.axis.phase is Phase.IDLE
    assert bench.axis.outputs[0] == 0x02, "Quick stop brakes on; Shutdown would cut the power"
    bench.status = DISABLED
    bench.obey()
    assert bench.status == READY


def test_an_axis_that_followed_the_brake_ramp_is_shut_down() -> None:
    bench = Bench().enabled()
    bench.play([500 + 100 * n for n in range(1, 300)])
    for _ in range(50 + 1):
        bench.step()
        bench.position = bench.axis.outputs[1]
    bench.axis.stop(RELEASED)
    for _ in range(round(STOP_S / CYCLE_S) + 1):
        bench.step()
        bench.position = bench.axis.outputs[1]
    bench.step()
    assert bench.axis.outputs[0] == 0x06


def test_a_fault_is_never_reset_by_enabling_nor_left_behind_enabled() -> None:
    bench = Bench().enabled()
    bench.play(list(range(500, 900)))
    bench.step(5)
    bench.status = FAULT
    bench.step(10)
    assert bench.axis.phase is Phase.IDLE
    assert bench.axis.outputs[0] & 0x80 == 0
    with pytest.raises(NotAllowed, match="has a fault"):
        bench.axis.drive_to(State.OPERATION_ENABLED, 8)
    bench.axis.reset_fault()
    bench.obey(4)
    assert bench.axis.state is State.SWITCH_ON_DISABLED
    bench.step(5)
    assert bench.axis.outputs[0] == 0, "it stays disabled"


def test_a_drive_that_leaves_operation_enabled_is_not_enabled_again_by_itself() -> None:
    bench = Bench().enabled()
    bench.status = DISABLED
    bench.obey(10)
    assert bench.status == DISABLED
    assert "left Operation enabled" in bench.reported[0]


@pytest.mark.parametrize(
    ("status", "by", "word"),
    [
        (0x0218, LeftBy.FAULT, "has a fault"),
        (0x021F, LeftBy.FAULT, "has a fault"),
        (0x0217, LeftBy.QUICK_STOP, "quick stop"),
        # CiA 402-2 table 30: bit 4 is 0 where no high voltage is applied to the drive.
        (0x0240, LeftBy.VOLTAGE, "main power"),
        (0x0223, LeftBy.VOLTAGE, "main power"),
        (0x0233, LeftBy.OTHERS, "another master"),
        (0x0250, LeftBy.OTHERS, "another master"),
    ],
)
def test_a_drive_that_left_operation_enabled_between_motions_has_a_cause(
    status: int, by: LeftBy, word: str
) -> None:
    """Between two motions, too: the next one is refused with it, in both languages."""
    bench = Bench().enabled()
    assert bench.axis.phase is Phase.IDLE
    bench.status = status
    bench.step(3)
    halted = bench.axis.halted
    assert halted is not None
    assert (halted.cause, halted.left_by) == (HaltCause.LEFT_ENABLED, by)
    assert Halted.from_wire(halted.to_wire()) == halted
    with pytest.raises(NotAllowed, match=word) as refused:
        bench.play([500])
    assert "enable the axis again" in refused.value.remedy
    for text_ in (refused.value.text, halted.text):
        assert text_.words("zh") != text_.words("en")


def test_a_quick_stop_of_the_drive_itself_keeps_its_power_until_the_axis_rests() -> None:
    """CiA 402-2: in Quick stop active the drive brakes; transition 12 takes the power away."""
    bench = Bench().enabled()
    bench.play(list(range(500, 50_000, 10)), renew=10_000)
    bench.step(50)
    bench.status = 0x0217
    for speed in (*range(40, 2, -1), *[0] * 40):
        bench.position += speed
        bench.step()
        if bench.axis.phase is Phase.IDLE:
            bench.axis.drive_to(State.READY, None)
        assert bench.axis.outputs[0] == 0x02, "neither without power nor enabled anew"
    bench.step(20)
    assert bench.axis.outputs[0] == 0x00


def test_a_quick_stop_that_does_not_end_is_left_after_a_time() -> None:
    bench = Bench().enabled()
    bench.status = 0x0217
    for _ in range(1510):
        bench.position += 40
        bench.step()
    assert bench.axis.outputs[0] == 0x00


def test_an_axis_that_was_never_enabled_is_refused_without_such_a_cause() -> None:
    bench = Bench()
    bench.step()
    with pytest.raises(NotAllowed) as refused:
        bench.play([500])
    assert refused.value.remedy == "enable the axis first"


def test_an_axis_that_is_enabled_anew_no_longer_says_why_it_was_not() -> None:
    bench = Bench().enabled()
    bench.status = DISABLED
    bench.step(2)
    assert bench.axis.halted is not None
    bench.axis.drive_to(State.OPERATION_ENABLED, 8)
    assert bench.axis.halted is None


def test_cycles_without_trusted_inputs_go_on_but_conclude_nothing() -> None:
    bench = Bench().enabled()
    bench.play([500, 501, 502, 503, 504])
    bench.step(2)
    bench.axis.blind()
    assert bench.axis.outputs[1] == 502
    assert bench.axis.state is State.OPERATION_ENABLED


@pytest.mark.parametrize("last", range(60, 70))
def test_cycles_that_were_skipped_are_no_speed_beyond_its_limit(last: int) -> None:
    """The first inputs after 19 skipped cycles are those of the last frame, as from a drive that
    latches at the frame: 20 cycles of travel follow with 1 ms between. It goes at 5000 of 5500
    increments per second all the time."""
    bench = Bench().enabled()
    bench.play(
        [500 + 5 * n for n in range(300)],
        limits=Limits(speed_max=5500.0, feedback=FeedbackScale(1.0, 500.0)),
    )
    bench.speed = 5000
    for cycle in [c for c in range(150) if not last < c < last + 20]:
        late = cycle == last + 20
        if late:
            bench.axis.skip(19)
        bench.position = 500 + 5 * (last + 1 if late else cycle)
        bench.step()
    assert bench.axis.halted is None
    assert bench.axis.phase is Phase.PLAYING


@pytest.mark.parametrize("dated", [True, False])
def test_a_late_exchange_makes_no_speed(dated: bool) -> None:
    """5000 inc/s at a limit of 5050; for 20 of 40 cycles of 8 ms the samples are 7 ms late."""
    cycle_s = 0.008
    bench = Bench(cycle_s=cycle_s).enabled()
    bench.play(
        [500 + 40 * n for n in range(300)],
        limits=Limits(speed_max=5050.0, feedback=FeedbackScale(1.0, 50.0)),
        renew=300,
    )
    bench.speed = 5000
    for cycle in range(250):
        late_s = 0.007 if cycle // 20 % 2 else 0.0
        bench.position = 500 + round(5000 * (cycle * cycle_s + late_s))
        bench.step(late_s=late_s if dated else 0.0)
    assert (bench.axis.halted is None) is dated, "undated, the position seems to run too fast"


def test_setpoints_expire_in_cycles_without_trusted_inputs_too() -> None:
    bench = Bench().enabled()
    bench.play(list(range(500, 5000, 10)), renew=50)
    bench.step(10)
    for _ in range(39):
        bench.axis.blind()
    assert bench.axis.halted is None
    bench.axis.blind()
    bench.axis.blind()
    assert bench.axis.halted == Halted(HaltCause.EXPIRED)
    assert bench.axis.phase is Phase.BRAKING


def test_setpoints_grow_older_over_skipped_cycles() -> None:
    bench = Bench().enabled()
    bench.play(list(range(500, 5000, 10)), renew=50)
    bench.step(10)
    bench.axis.skip(40)
    bench.step()
    assert bench.axis.halted == Halted(HaltCause.EXPIRED)


def test_an_axis_that_braked_without_trusted_inputs_is_commanded_to_quick_stop() -> None:
    """CiA 402-2 table 29: quick stop is 0002h. It was left enabled for as long as nobody heard."""
    bench = Bench().enabled()
    bench.play(list(range(500, 5000, 10)))
    bench.step(10)
    bench.axis.stop(Halted(HaltCause.LOST))
    for _ in range(round(STOP_S / CYCLE_S)):
        bench.axis.blind()
    assert bench.axis.phase is Phase.IDLE
    bench.axis.blind()
    assert bench.axis.outputs[0] == 0x0002
    bench.status = DISABLED
    bench.obey()
    assert bench.axis.state is State.READY, "trusted again, it goes where it was going"


def test_an_enabled_axis_at_rest_stays_enabled_without_trusted_inputs() -> None:
    bench = Bench().enabled()
    for _ in range(10):
        bench.axis.blind()
    assert bench.axis.outputs[0] == 0x000F


def test_disabling_a_moving_axis_brakes_first() -> None:
    bench = Bench().enabled()
    bench.play(list(range(500, 5000, 10)))
    bench.step(10)
    bench.axis.drive_to(State.SWITCH_ON_DISABLED, None)
    bench.step()
    assert bench.axis.outputs[0] == 0x0F
    assert bench.axis.phase is Phase.BRAKING
    bench.step(round(STOP_S / CYCLE_S))
    bench.step()
    assert bench.axis.outputs[0] == 0x00


def test_play_while_braking_is_refused() -> None:
    bench = Bench().enabled()
    bench.play(list(range(500, 5000, 10)))
    bench.step(5)
    bench.axis.stop(Halted(HaltCause.COMMANDED))
    with pytest.raises(NotAllowed, match="braking: it was halted"):
        bench.play([550])


def test_a_goal_given_while_braking_is_kept() -> None:
    bench = Bench().enabled()
    bench.play([500 + 5 * n for n in range(200)])
    bench.step(50)
    bench.axis.stop(RELEASED)
    bench.step(5)
    assert bench.axis.phase is Phase.BRAKING
    bench.axis.drive_to(State.SWITCH_ON_DISABLED, None)
    bench.step(5)
    assert bench.axis.phase is Phase.BRAKING, "the brake ramp is not cut short"
    bench.obey(round(STOP_S / CYCLE_S) + 10)
    assert bench.axis.state is State.SWITCH_ON_DISABLED


def test_enabling_anew_is_not_taken_back_by_a_sample_from_before_the_disabling() -> None:
    bench = Bench().enabled()
    bench.axis.drive_to(State.SWITCH_ON_DISABLED, None)
    bench.step()
    # The drive is disabled by now, as its mailbox shows; samples on their way are older.
    bench.axis.drive_to(State.OPERATION_ENABLED, 8)
    bench.step()
    bench.status = DISABLED
    bench.obey(10)
    assert bench.axis.state is State.OPERATION_ENABLED


def test_a_pause_brakes_and_holds_enabled_and_the_next_motion_begins_there() -> None:
    bench = Bench().enabled()
    bench.play(list(range(500, 6500, 10)))
    bench.step(100)
    bench.axis.pause()
    bench.step(1 + round(STOP_S / CYCLE_S))
    held = bench.axis.outputs[1]
    assert bench.axis.phase is Phase.IDLE
    assert bench.axis.halted is None
    bench.obey(300)
    assert bench.axis.state is State.OPERATION_ENABLED
    assert bench.axis.outputs[1] == held
    bench.play(list(range(held, held + 1000, 10)))
    bench.step(10)
    assert bench.axis.outputs[1] == held + 90


def test_a_halt_while_it_brakes_to_hold_disables_it() -> None:
    """A release in a gap comes within the ramp: nothing may stay enabled by it."""
    bench = Bench().enabled()
    bench.play(list(range(500, 6500, 10)))
    bench.step(100)
    bench.axis.pause()
    bench.step(20)
    bench.axis.stop(RELEASED)
    bench.step(1 + round(STOP_S / CYCLE_S))
    bench.obey()
    assert bench.axis.halted == RELEASED
    assert bench.axis.state is not State.OPERATION_ENABLED


def test_a_pause_of_an_axis_that_does_not_come_to_rest_ends_in_a_quick_stop() -> None:
    bench = Bench().enabled()
    bench.play(list(range(500, 6500, 10)))
    for _ in range(100):
        bench.position += 10
        bench.step()
    bench.axis.pause()
    for _ in range(2 + 3 * round(STOP_S / CYCLE_S)):
        bench.position += 10
        bench.step()
    assert bench.axis.goal is State.QUICK_STOP_ACTIVE
    assert bench.axis.outputs[0] == 0x02
    assert bench.axis.halted is not None


def test_a_pause_of_what_does_not_move_changes_nothing() -> None:
    bench = Bench().enabled()
    bench.axis.pause()
    bench.obey()
    assert bench.axis.state is State.OPERATION_ENABLED
    assert bench.reported == []
