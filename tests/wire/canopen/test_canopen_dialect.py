"""The axis in the loop on a drive with the words of DS_C (003:279-306)."""

from __future__ import annotations

import array
import itertools
from dataclasses import replace

import pytest

from drivers import cia402
from drivers.cia402 import State
from drivers.errors import NotAllowed
from drivers.halt import HaltCause, Halted
from drivers.motion.playback import AxisLoop
from drivers.motion.setpoint_plan import Limits, Motion, Phase
from drivers.objects.dialect import dialect_of
from profiles.loader import load_profile

IN = {0x6041: 0, 0x6064: 1, 0x606C: 2, 0x6077: 3, 0x6061: 4}
OUT = {0x6040: 0, 0x60FF: 1}
PV, CSV = 3, 9
#: "When 6040 = 6, the corresponding bit of 6041 is 001" and so on (003:300-303).
ECHO = {0: 0b000, 6: 0b001, 7: 0b011, 15: 0b111}


class Bench:
    """A DS_C that echoes its control word at once; 1 ms cycles."""

    def __init__(self) -> None:
        dialect = replace(dialect_of(load_profile("ds_c")), speed_mode=cia402.Mode.PV)
        self.axis = AxisLoop(
            3,
            inputs=IN,
            outputs=OUT,
            output_count=2,
            cycle_s=0.001,
            report=lambda _station, _text: None,
            dialect=dialect,
        )
        self.position, self.moving, self.mode = 0, 0, PV
        self.words: list[int] = []

    def step(self, cycles: int = 1) -> None:
        for _ in range(cycles):
            self.position += self.moving
            status = ECHO.get(self.axis.outputs[0], 0)
            self.axis.step((status, self.position, 0, 0, self.mode))
            self.words.append(self.axis.outputs[0])

    def enabled(self) -> Bench:
        self.step()
        self.axis.drive_to(State.OPERATION_ENABLED, CSV)
        self.step(60)
        assert self.axis.state is State.OPERATION_ENABLED
        return self

    def play(self, speeds: list[int]) -> None:
        self.axis.play(Motion(0x60FF, array.array("q", speeds), Limits(), 200, 100))


def test_it_is_enabled_by_6_7_and_15_ten_milliseconds_apart() -> None:
    words = Bench().enabled().words
    first = [words.index(word) for word in (6, 7, 15)]
    assert sorted(set(words)) == [0, 6, 7, 15]
    assert min(b - a for a, b in itertools.pairwise(first)) >= 10


def test_a_speed_asked_for_in_csv_is_given_in_profile_velocity() -> None:
    bench = Bench().enabled()
    bench.play([10, 20, 30])
    bench.step(3)
    assert bench.axis.outputs[1] == 30


def test_a_drive_in_another_mode_takes_no_speed() -> None:
    bench = Bench().enabled()
    bench.mode = 1
    bench.step()
    with pytest.raises(NotAllowed, match="needs mode 3"):
        bench.play([10])


def test_an_axis_that_goes_on_gets_the_printed_emergency_stop_until_it_rests() -> None:
    bench = Bench().enabled()
    bench.play([100] * 500)
    bench.moving = 50
    bench.step(10)
    bench.axis.stop(Halted(HaltCause.COMMANDED))
    bench.step(150)
    # 11 is the only stop that is printed (003:296); any other word would cut the power in motion.
    assert bench.axis.outputs[0] == 11
    bench.step(500)
    assert bench.axis.outputs[0] == 11
    bench.moving = 0
    bench.step(80)
    assert bench.axis.outputs[0] == 6


def test_a_silent_host_ramps_the_speed_to_zero_and_disables() -> None:
    bench = Bench().enabled()
    bench.play([100] * 50)
    bench.step(150)
    assert bench.axis.outputs[1] == 100
    bench.step(200)
    assert bench.axis.phase is Phase.IDLE
    assert bench.axis.halted == Halted(HaltCause.EXPIRED)
    assert bench.axis.outputs[1] == 0
    assert bench.axis.outputs[0] == 6


def test_a_blind_cycle_after_the_brake_stops_by_the_printed_word() -> None:
    bench = Bench().enabled()
    bench.axis.drive_to(State.READY, None)
    bench.axis.outputs[0] = 15
    bench.axis.blind()
    assert bench.axis.outputs[0] == 11
