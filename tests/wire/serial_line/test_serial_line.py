"""The master of a line against scripted bytes, on a clock that only the script moves."""

from __future__ import annotations

import pytest

from drivers.errors import LinkLost, LinkTimeout, ProtocolError, Rejected
from drivers.modbus.framing import (
    EXCEPTION_TEXTS,
    exception_response,
    read_query,
    read_response,
    write_one_query,
)
from drivers.modbus.line import Line
from drivers.modbus.port import LineSettings

Reaction = list[tuple[float, bytes]]
MUTE: Reaction = []


class ScriptedPort:
    """Each request sent takes the next reaction: bytes and how long after the request they come."""

    def __init__(self, *script: Reaction) -> None:
        self.now_s = 0.0
        self.script = list(script)
        self.sent: list[bytes] = []
        self.sent_at: list[float] = []
        self.due: list[tuple[float, bytes]] = []
        self.broken = False

    def clock(self) -> float:
        return self.now_s

    def sleep(self, seconds: float) -> None:
        self.now_s += seconds

    def read(self, timeout_s: float) -> bytes:
        if self.broken:
            raise LinkLost("gone")
        until = self.now_s + max(0.0, timeout_s)
        if self.due and self.due[0][0] <= until:
            at, data = self.due.pop(0)
            self.now_s = max(self.now_s, at)
            return data
        self.now_s = until
        return b""

    def write(self, data: bytes) -> None:
        if self.broken:
            raise LinkLost("gone")
        self.sent.append(data)
        self.sent_at.append(self.now_s)
        reaction = self.script.pop(0) if self.script else MUTE
        self.due.extend((self.now_s + delay, answer) for delay, answer in reaction)
        self.due.sort(key=lambda item: item[0])

    def close(self) -> None:
        self.broken = True


SETTINGS = LineSettings("scripted", baudrate=115_200, timeout_s=0.1, gap_s=0.03)


def line_on(port: ScriptedPort, settings: LineSettings = SETTINGS) -> Line:
    line = Line(settings, clock=port.clock, sleep=port.sleep, opener=lambda _: port)
    line.open()
    return line


def answer(*words: int, station: int = 1) -> bytes:
    return read_response(station, words)


def test_question_and_answer() -> None:
    port = ScriptedPort([(0.002, answer(0x1234))])
    line = line_on(port)
    assert line.read(1, 0x6410, 1) == b"\x12\x34"
    assert port.sent == [read_query(1, 0x6410, 1).frame]
    assert line.quality(1).transactions == 1
    assert line.quality(1).round_trip_ms == pytest.approx(2.0)


def test_answer_in_portions() -> None:
    whole = answer(1, 2, 3)
    port = ScriptedPort([(0.01, whole[:2]), (0.026, whole[2:5]), (0.042, whole[5:])])
    assert line_on(port).read(1, 0, 3) == b"\0\x01\0\x02\0\x03"


def test_mute_drive_times_out_after_wire_time_and_patience() -> None:
    port = ScriptedPort(MUTE)
    line = line_on(port)
    with pytest.raises(LinkTimeout, match="station 1 did not answer within 100 ms"):
        line.read(1, 0, 1)
    # 8 + 7 characters of 10 bits at 115200 baud, then 100 ms.
    assert port.now_s - port.sent_at[0] == pytest.approx(0.1 + 15 * 10 / 115_200)
    assert line.quality(1).timeouts == 1
    assert line.quality(2).timeouts == 0


def test_an_address_that_was_only_searched_is_no_fault_of_the_line() -> None:
    line = line_on(ScriptedPort(MUTE, MUTE, [(0.002, answer(7))], MUTE))
    for station in (2, 3):
        with pytest.raises(LinkTimeout):
            line.seek(station, 0, 1, 0.03)
    assert (line.quality(None).timeouts, line.quality(None).transactions) == (0, 0)
    # What has answered and then does not is a time-out, also where it was searched.
    assert line.seek(1, 0, 1, 0.03) == b"\0\x07"
    with pytest.raises(LinkTimeout):
        line.seek(1, 0, 1, 0.03)
    assert (line.quality(1).timeouts, line.quality(None).transactions) == (1, 2)


def test_slow_baud_rate_extends_the_deadline() -> None:
    # 125 registers at 9600 baud: (8 + 255) * 10 / 9600 = 274 ms on the wire alone.
    words = tuple(range(125))
    port = ScriptedPort([(0.36, answer(*words))])
    line = line_on(port, LineSettings("scripted", baudrate=9600, timeout_s=0.1))
    assert len(line.read(1, 0, 125)) == 250


@pytest.mark.parametrize("keep", [1, 2, 3, 6])
def test_truncated_answer(keep: int) -> None:
    port = ScriptedPort([(0.001, answer(7)[:keep])])
    line = line_on(port)
    with pytest.raises(ProtocolError, match="damaged answer"):
        line.read(1, 0, 1)
    assert line.quality(1).framing_errors == 1


def test_corrupted_answer_is_counted_and_ends_early() -> None:
    bad = bytearray(answer(7))
    bad[3] ^= 1
    port = ScriptedPort([(0.001, bytes(bad))])
    line = line_on(port)
    with pytest.raises(ProtocolError) as caught:
        line.read(1, 0, 1)
    assert "parity, shield, termination" in (caught.value.remedy or "")
    assert line.quality(1).crc_errors == 1
    assert port.now_s < 0.05  # one gap, not the whole time-out


def test_noise_before_the_answer_is_skipped() -> None:
    port = ScriptedPort([(0.001, b"\x00\xff\x01"), (0.005, answer(9))])
    line = line_on(port)
    assert line.read(1, 0, 1) == b"\0\x09"
    assert line.quality(1).framing_errors == 1


def test_doubled_answer_does_not_answer_the_next_question() -> None:
    first = answer(1)
    port = ScriptedPort([(0.001, first + first[:3]), (0.004, first[3:])], [(0.001, answer(2))])
    line = line_on(port)
    assert line.read(1, 0, 1) == b"\0\x01"
    assert line.read(1, 5, 1) == b"\0\x02"
    assert port.sent_at[1] > 0.004 + 0.02  # waited until the line was silent


def test_late_answer_before_the_next_question_is_thrown_away() -> None:
    port = ScriptedPort([(0.2, answer(111))], [(0.001, answer(2, 2))], [(0.001, answer(222))])
    line = line_on(port)
    with pytest.raises(LinkTimeout):
        line.read(1, 0, 1)
    port.now_s = 0.25
    assert line.read(1, 5, 1) == b"\0\xde"


def test_late_answer_during_the_next_question_is_not_taken_for_its_answer() -> None:
    # The old answer comes 150 ms after its question, while the drive is asked the next thing.
    port = ScriptedPort(
        [(0.15, answer(111))],
        [(0.06, answer(0, 0))],  # the check: two registers, so it cannot be mistaken
        [(0.01, answer(222))],
    )
    line = line_on(port)
    with pytest.raises(LinkTimeout):
        line.read(1, 0, 1)
    assert line.read(1, 5, 1) == b"\0\xde"
    assert port.sent[1] == read_query(1, 5, 2).frame
    assert line.quality(1).details["late_checks"] == 1
    # All is clear now: no further check.
    port.script = [[(0.01, answer(333))]]
    line.read(1, 5, 1)
    assert len(port.sent) == 4


def test_late_echo_of_a_write_does_not_confirm_the_same_write_again() -> None:
    write = write_one_query(1, 0x6400, 15).frame
    port = ScriptedPort(
        [(0.001, answer(0))],
        [(0.13, write)],  # too late
        [(0.05, answer(0))],  # the check: the read that is known to work
        MUTE,
    )
    line = line_on(port)
    line.read(1, 0, 1)
    for _ in range(2):
        with pytest.raises(LinkTimeout):
            line.write(1, 0x6400, (15,))
    assert port.sent == [read_query(1, 0, 1).frame, write, read_query(1, 0, 1).frame, write]


def test_a_stop_goes_out_to_a_drive_that_cannot_be_heard() -> None:
    """Its answers do not come; it may hear all the same. The check before it is not waited for."""
    stop = write_one_query(1, 0x6400, 2).frame
    port = ScriptedPort(MUTE, MUTE, MUTE)
    line = line_on(port)
    with pytest.raises(LinkTimeout):
        line.read(1, 0, 1)
    with pytest.raises(LinkTimeout):
        line.write(1, 0x6400, (15,))
    assert stop not in port.sent
    assert len(port.sent) == 2, "what enables waits until the drive answers"
    with pytest.raises(LinkTimeout):
        line.write(1, 0x6400, (2,), at_any_rate=True)
    assert port.sent[-1] == stop


def test_a_stop_goes_out_on_a_line_that_never_falls_silent() -> None:
    port = ScriptedPort([(0.001, answer(0))], MUTE)
    line = line_on(port)
    line.read(1, 0, 1)
    port.due = [(port.now_s + 0.01 * n, b"\x55") for n in range(1000)]
    with pytest.raises(LinkTimeout):
        line.write(1, 0x6400, (15,))
    assert len(port.sent) == 1, "what enables waits until the line is silent"
    with pytest.raises(LinkTimeout):
        line.write(1, 0x6400, (2,), at_any_rate=True)
    assert port.sent[1:] == [write_one_query(1, 0x6400, 2).frame]


def test_repeated_read_may_take_the_late_answer_and_guards_the_next_one() -> None:
    port = ScriptedPort(
        [(0.15, answer(111))], [(0.1, answer(112))], [(0.06, answer(0, 0))], [(0.001, answer(3))]
    )
    line = line_on(port)
    with pytest.raises(LinkTimeout):
        line.read(1, 0, 1)
    assert line.read(1, 0, 1) == b"\0\x6f"  # asked again: the same question, so no check
    assert line.read(1, 5, 1) == b"\0\x03"
    assert len(port.sent) == 4


def test_refused_check_proves_nothing_if_the_late_answer_may_be_a_refusal() -> None:
    refused, unknown = exception_response(1, 3, 2), exception_response(1, 4, 1)
    port = ScriptedPort(
        [(0.12, refused)],  # nobody knows whether register 0 exists: it is refused too late
        [(0.06, refused)],  # the first check is refused as well
        [(0.06, unknown)],  # the second cannot be mistaken
        [(0.001, answer(5))],
    )
    line = line_on(port)
    with pytest.raises(LinkTimeout):
        line.read(1, 0, 1)
    assert line.read(1, 7, 1) == b"\0\x05"
    assert [frame[1] for frame in port.sent] == [3, 3, 4, 3]


def test_drive_that_cannot_be_distinguished_is_left_alone_for_a_while() -> None:
    refused = exception_response(1, 3, 2)
    port = ScriptedPort([(0.12, refused)], [(0.06, refused)], MUTE, [(0.001, answer(5))])
    line = line_on(port)
    for register in (0x6410, 7):
        with pytest.raises(LinkTimeout):
            line.read(1, register, 1)
    port.now_s += SETTINGS.late_s
    assert line.read(1, 7, 1) == b"\0\x05"


def test_late_answers_are_forgotten_in_time() -> None:
    port = ScriptedPort(MUTE, [(0.001, answer(5))])
    line = line_on(port)
    with pytest.raises(LinkTimeout):
        line.read(1, 0, 1)
    port.now_s += SETTINGS.late_s
    assert line.read(1, 9, 1) == b"\0\x05"
    assert line.quality(1).details["late_checks"] == 0


def test_other_stations_are_not_held_up_by_a_mute_one() -> None:
    port = ScriptedPort(MUTE, [(0.001, answer(5, station=2))])
    line = line_on(port)
    with pytest.raises(LinkTimeout):
        line.read(1, 0, 1)
    assert line.read(2, 0, 1) == b"\0\x05"
    assert len(port.sent) == 2


def test_exception_becomes_words() -> None:
    port = ScriptedPort([(0.001, exception_response(1, 3, 2))])
    with pytest.raises(Rejected, match="no such register") as caught:
        line_on(port).read(1, 0, 1)
    assert caught.value.abort_code == 2
    assert "manual" in (caught.value.remedy or "")


@pytest.mark.parametrize("code", [*EXCEPTION_TEXTS, 0x55])
def test_every_exception_says_what_to_do(code: int) -> None:
    port = ScriptedPort([(0.001, exception_response(1, 3, code))])
    with pytest.raises(Rejected) as caught:
        line_on(port).read(1, 0, 1)
    assert caught.value.remedy


def test_damaged_answer_to_a_write_leaves_it_unknown() -> None:
    port = ScriptedPort([(0.001, answer(0))], [(0.001, b"\x01\x06\x64")])
    line = line_on(port)
    line.read(1, 0, 1)
    with pytest.raises(LinkTimeout, match="it is not known whether"):
        line.write(1, 0x6400, (15,))
    assert len(port.sent) == 2


@pytest.mark.parametrize(
    ("settings", "pause_s"),
    [
        (LineSettings("x", baudrate=2_500_000, parity="E"), 3.5 * 11 / 2_500_000),
        (LineSettings("x", baudrate=9600), 3.5 * 10 / 9600),
        (LineSettings("x", silence_s=0.00175), 0.00175),
    ],
)
def test_silence_is_kept_before_each_request(settings: LineSettings, pause_s: float) -> None:
    port = ScriptedPort([(0.001, answer(1))], [(0.001, answer(1))])
    line = line_on(port, settings)
    line.read(1, 0, 1)
    line.read(1, 0, 1)
    assert port.sent_at[1] - (port.sent_at[0] + 0.001) == pytest.approx(pause_s, abs=1e-9)


def test_line_that_never_falls_silent_is_reported() -> None:
    port = ScriptedPort()
    line = line_on(port)
    port.due = [(i * 0.001, b"\x55") for i in range(3000)]
    with pytest.raises(ProtocolError, match="is never idle"):
        line.read(1, 0, 1)
    assert port.sent == []


# --- echo of two-wire adapters ---


def test_echo_is_found_and_discarded() -> None:
    read, write = read_query(1, 0, 1).frame, write_one_query(1, 0x6400, 6).frame
    port = ScriptedPort(
        [(0.0, read), (0.001, answer(3))], [(0.0, write[:3]), (0.001, write[3:] + write)]
    )
    line = line_on(port)
    assert line.read(1, 0, 1) == b"\0\x03"
    assert line.echo is True
    line.write(1, 0x6400, (6,))
    assert line.quality(1).framing_errors == 0


def test_echo_alone_does_not_confirm_a_write() -> None:
    read, write = read_query(1, 0, 1).frame, write_one_query(1, 0x6400, 6).frame
    port = ScriptedPort([(0.0, read), (0.001, answer(3))], [(0.0, write)])
    line = line_on(port)
    line.read(1, 0, 1)
    with pytest.raises(LinkTimeout, match="only the adapter's echo"):
        line.write(1, 0x6400, (6,))


def test_first_write_learns_about_echo_by_a_read() -> None:
    probe, write = read_query(1, 0x6400, 1).frame, write_one_query(1, 0x6400, 6).frame
    port = ScriptedPort([(0.0, probe + answer(0))], [(0.0, write)])
    line = line_on(port)
    with pytest.raises(LinkTimeout):
        line.write(1, 0x6400, (6,))
    assert port.sent == [probe, write]


def test_no_echo_write_is_confirmed_by_one_copy() -> None:
    write = write_one_query(1, 0x6400, 6).frame
    port = ScriptedPort([(0.001, answer(0))], [(0.001, write)])
    line = line_on(port)
    line.read(1, 0, 1)
    assert line.echo is False
    line.write(1, 0x6400, (6,))


# --- loss ---


def test_lost_adapter_is_reported_once_and_opened_again() -> None:
    port = ScriptedPort([(0.001, answer(1))])
    changes: list[bool] = []
    line = Line(
        SETTINGS,
        on_change=lambda up, _text: changes.append(up),
        clock=port.clock,
        sleep=port.sleep,
        opener=lambda _: port,
    )
    line.open()
    line.read(1, 0, 1)
    port.broken = True
    for _ in range(2):
        with pytest.raises(LinkLost):
            line.read(1, 0, 1)
    assert changes == [False]
    port.broken = False
    assert line.reopen()
    assert changes == [False, True]
    port.script = [[(0.001, answer(2))]]
    assert line.read(1, 0, 1) == b"\0\x02"
    assert line.quality(None).details["losses"] == 1
