"""Whatever happens on the line, a read brings the right value or an error. Simulated time."""

from __future__ import annotations

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from drivers.errors import DriveError, LinkTimeout
from drivers.modbus.framing import RequestParser, exception_response, read_response, write_response
from drivers.modbus.line import Line
from drivers.modbus.port import LineSettings

from .test_serial_line import ScriptedPort

SETTINGS = LineSettings("scripted", baudrate=115_200, timeout_s=0.1, late_s=60.0)


class SlowSlave(ScriptedPort):
    """Answers every request in order, each after its own delay, some of them damaged.

    Register r holds r + 1000; register 9 does not exist. Like a drive it works on one request
    after the other, so that delays add up and answers come long after their time-out.
    """

    def __init__(self, troubles: list[tuple[float, str]]) -> None:
        super().__init__()
        self.troubles = list(troubles)
        self.free_at = 0.0
        self.written: list[tuple[int, int]] = []
        self.parser = RequestParser()

    def write(self, data: bytes) -> None:
        self.sent.append(data)
        for request in self.parser.feed(data) + self.parser.end_of_frame():
            delay, what = self.troubles.pop(0) if self.troubles else (0.001, "")
            registers = range(request.start, request.start + request.count)
            if not request.count:
                frame = exception_response(1, request.function, 1)
            elif 9 in registers:
                frame = exception_response(1, request.function, 2)
            elif request.values:
                self.written.append((request.start, request.values[0]))
                frame = write_response(request)
            else:
                frame = read_response(1, [r + 1000 for r in registers])
            self.free_at = max(self.now_s, self.free_at) + delay
            if what == "cut":
                frame = frame[: len(frame) // 2]
            elif what == "flip":
                frame = bytes((*frame[:3], frame[3] ^ 4, *frame[4:]))
            elif what == "noise":
                frame = b"\x01\x03" + frame
            if what != "lose":
                self.due.append((self.free_at, frame))


step = st.tuples(
    st.integers(0, 9),  # register
    st.integers(1, 2),  # how many
    st.sampled_from([0.0, 0.03, 0.15]),  # pause before
    st.sampled_from([0.001, 0.05, 0.11, 0.3]),  # the slave's delay
    st.sampled_from(["", "", "", "cut", "flip", "noise", "lose"]),
)


@settings(max_examples=150, deadline=None)
@given(st.lists(step, min_size=2, max_size=10))
@example([(0, 1, 0.0, 0.11, ""), (1, 1, 0.0, 0.001, ""), (2, 1, 0.0, 0.001, "")])
@example([(9, 1, 0.0, 0.11, ""), (1, 1, 0.0, 0.001, ""), (2, 1, 0.0, 0.001, "")])
def test_reads_are_right_or_fail(steps: list[tuple[int, int, float, float, str]]) -> None:
    slave = SlowSlave([(delay, what) for *_, delay, what in steps])
    line = Line(SETTINGS, clock=slave.clock, sleep=slave.sleep, opener=lambda _: slave)
    line.open()
    for register, count, pause, _, _ in steps:
        slave.sleep(pause)
        try:
            data = line.read(1, register, count)
        except DriveError:
            continue
        values = [int.from_bytes(data[i : i + 2], "big") for i in range(0, len(data), 2)]
        assert values == [r + 1000 for r in range(register, register + count)]


@settings(max_examples=100, deadline=None)
@given(st.lists(step, min_size=2, max_size=10))
def test_confirmed_writes_have_happened_as_often_as_confirmed(
    steps: list[tuple[int, int, float, float, str]],
) -> None:
    slave = SlowSlave([(0.001, ""), *((delay, what) for *_, delay, what in steps)])
    line = Line(SETTINGS, clock=slave.clock, sleep=slave.sleep, opener=lambda _: slave)
    line.open()
    line.read(1, 0, 1)
    asked = 0
    for register, value, pause, _, _ in steps:
        slave.sleep(pause)
        before = len(slave.written)
        sent = len(slave.sent)
        try:
            line.write(1, register, (value,))
        except DriveError:
            continue
        finally:
            asked += sum(frame[1] == 6 for frame in slave.sent[sent:])
        assert slave.written[before:] == [(register, value)]
    assert len(slave.written) <= asked <= len(steps)  # never repeated by itself


@settings(max_examples=150, deadline=None)
@given(st.lists(st.lists(st.tuples(st.floats(0, 0.2), st.binary(max_size=40)), max_size=4)))
def test_any_bytes_end_in_an_answer_or_an_error(
    script: list[list[tuple[float, bytes]]],
) -> None:
    port = ScriptedPort(*script)
    line = Line(SETTINGS, clock=port.clock, sleep=port.sleep, opener=lambda _: port)
    line.open()
    for number in range(len(script)):
        begun = port.now_s
        try:
            assert len(line.read(1, number, 2)) == 4
        except DriveError:
            assert line.is_open
        assert port.now_s - begun < 3


def test_slave_that_is_slower_than_the_time_out_is_never_believed() -> None:
    slave = SlowSlave([(0.12, "")] * 6)
    line = Line(SETTINGS, clock=slave.clock, sleep=slave.sleep, opener=lambda _: slave)
    line.open()
    for register in range(3):
        with pytest.raises(LinkTimeout):
            line.read(1, register, 1)
    assert line.quality(1).details["late_answers"] == 2
