"""What a station reports of itself while frames are lost for longer than a moment."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, field

import pytest

from drivers.errors import LinkLost
from drivers.ethercat.process.stations.station import Station, identify
from drivers.ethercat.wire.registers import read_again
from drivers.ethercat.wire.steps import Pause, Read, Write
from tests.wire.ethercat_host.by_hand import ByHand
from tests.wire.ethercat_host.plain_slaves import Servo

#: ESC features supported: bit 2 is the distributed clock (ETG.1000.4 table 31).
FEATURES, WITH_CLOCK = 0x08, 0x0004


@dataclass
class Line(ByHand):
    """``answers`` gives what comes back of a read at a time; a frame takes 1 ms."""

    answers: Callable[[float, Read], bytes | None]
    now: float = 0.0
    asked: list[float] = field(default_factory=list)
    stands_still_s: float = 0.0
    """How long this computer stands still after its first frame."""

    def clock(self) -> float:
        return self.now

    def frame(self, step: Read | Write) -> bytes | None:
        assert isinstance(step, Read)
        self.asked.append(self.now)
        answer = self.answers(self.now, step)
        self.now += 1e-3 + self.stands_still_s
        self.stands_still_s = 0.0
        return answer


def test_frames_that_stay_away_for_a_moment_say_nothing_of_a_station() -> None:
    line = Line(lambda now, _read: None if now < 0.8 else b"\x0c\x00")
    assert line.run(read_again(FEATURES, 2, line.clock)) == b"\x0c\x00"


def test_a_computer_that_stands_still_asks_once_more_before_it_gives_up() -> None:
    line = Line(lambda now, _read: None if now < 0.1 else b"\x0c\x00", stands_still_s=5.0)
    assert line.run(read_again(FEATURES, 2, line.clock)) == b"\x0c\x00"


def test_a_line_without_answers_is_given_up_after_a_second() -> None:
    line = Line(lambda _now, _read: None)
    assert line.run(read_again(FEATURES, 2, line.clock)) is None
    assert 1.0 < line.now < 1.1


def test_a_frame_that_nobody_touched_is_certain_the_third_time() -> None:
    line = Line(lambda _now, _read: b"")
    assert line.run(read_again(FEATURES, 2, line.clock)) is None
    assert len(line.asked) == 3


@pytest.mark.parametrize("lost", [0, 3, 20, None], ids=["none", "three", "twenty", "all"])
def test_a_station_with_a_clock_is_never_taken_for_one_without(lost: int | None) -> None:
    """All that was lost: it is searched for again, and no parameter is asked for before that."""
    slave, station, now = Servo(), Station(1), 0.0
    slave.memory[FEATURES] |= WITH_CLOCK
    steps, reply, frames = identify(station, lambda: now), None, 0
    with contextlib.suppress(StopIteration):
        while True:
            step = steps.send(reply)
            now += step.seconds if isinstance(step, Pause) else 1e-3
            if isinstance(step, Read):
                reply = slave.read(step.register, step.size)
                if step.register == FEATURES:
                    frames += 1
                    if lost is None or frames <= lost:
                        reply = None
            elif isinstance(step, Write):
                reply = b"" if slave.write(step.register, step.data) else None
            else:
                reply = b""
    if lost is not None:
        assert station.distributed_clock
    else:
        assert station.badly_found
        with pytest.raises(LinkLost, match="in part"):
            _ = station.box
