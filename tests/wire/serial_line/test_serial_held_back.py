"""A USB adapter with a latency timer is recognised; what is slow for another reason is not.

The chip follows FTDI AN232B-04: its timer runs freely, and delivers what has arrived by then.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable

import pytest

from drivers.errors import LinkTimeout
from drivers.modbus.framing import read_response
from drivers.modbus.line import Line
from drivers.modbus.port import LineSettings
from tests.wire.serial_line.test_serial_line import ScriptedPort

SETTINGS = LineSettings("scripted", baudrate=115_200, timeout_s=0.2)
CHAR_S = SETTINGS.char_s
TURNAROUND_S = 0.0008

Arrival = Callable[[float, int, random.Random], float]


class Adapter(ScriptedPort):
    """A drive behind an adapter: ``arrival`` gives the time at which an answer is delivered, by
    the time at which the request is on the wire in full and the number of characters."""

    def __init__(self, arrival: Arrival, seed: int) -> None:
        super().__init__()
        self.arrival = arrival
        self.chance = random.Random(seed)

    def write(self, data: bytes) -> None:
        answer = read_response(1, [7] * int.from_bytes(data[4:6], "big"))
        asked = self.now_s + len(data) * CHAR_S
        at = self.arrival(asked, len(answer), self.chance)
        # The computer is woken some 0.1 ms later.
        self.script = [[(at + self.chance.expovariate(10_000) - self.now_s, answer)]]
        super().write(data)


def turnaround(chance: random.Random) -> float:
    return TURNAROUND_S * chance.uniform(0.7, 1.5)


def timer(seconds: float) -> Arrival:
    def arrival(asked: float, count: int, chance: random.Random) -> float:
        ended = asked + turnaround(chance) + count * CHAR_S
        return math.ceil(ended / seconds) * seconds

    return arrival


def at_once(asked: float, count: int, chance: random.Random) -> float:
    return asked + turnaround(chance) + count * CHAR_S


def slow_drive(asked: float, count: int, chance: random.Random) -> float:
    return asked + chance.uniform(0.0118, 0.0122) + count * CHAR_S


def task_of_10_ms(asked: float, count: int, chance: random.Random) -> float:
    """A drive that answers from a task of its own: the answer starts with the next one."""
    return math.ceil((asked + turnaround(chance)) / 0.010) * 0.010 + count * CHAR_S


def bluetooth(asked: float, count: int, chance: random.Random) -> float:
    return asked + count * CHAR_S + chance.uniform(0.010, 0.030)


def used(arrival: Arrival, lengths: tuple[int, ...], seed: int = 1, count: int = 100) -> Line:
    port = Adapter(arrival, seed)
    line = Line(SETTINGS, clock=port.clock, sleep=port.sleep, opener=lambda _: port)
    line.open()
    for _ in range(count):
        line.read(1, 0, port.chance.choice(lengths))
    return line


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("ms", [16, 8])
def test_the_timer_is_named_with_its_time(ms: int, seed: int) -> None:
    quality = used(timer(ms / 1000), (1, 2, 4, 12), seed).quality(None)
    assert quality.details["held_back_ms"] == pytest.approx(ms, abs=0.5)
    assert quality.state is not None
    assert quality.state.code == "link.held-back"
    assert f"{ms} ms" in quality.state.words()


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("arrival", [at_once, timer(0.001), slow_drive, task_of_10_ms, bluetooth])
def test_what_is_slow_for_another_reason_is_not_a_timer(arrival: Arrival, seed: int) -> None:
    quality = used(arrival, (1, 2, 4, 12), seed).quality(None)
    assert "held_back_ms" not in quality.details
    assert quality.state is not None
    assert quality.state.code == "link.open"


def test_nothing_is_said_by_exchanges_of_one_length_or_by_few() -> None:
    assert "held_back_ms" not in used(timer(0.016), (2,)).quality(None).details
    assert "held_back_ms" not in used(timer(0.016), (1, 12), count=20).quality(None).details


def test_another_adapter_begins_anew() -> None:
    line = used(timer(0.016), (1, 12))
    assert "held_back_ms" in line.quality(None).details
    line.close()
    assert "held_back_ms" not in line.quality(None).details
    line.open()
    assert "held_back_ms" not in line.quality(None).details


def test_silence_adds_no_time() -> None:
    line = used(timer(0.016), (1, 12), count=39)
    port = line._opener(SETTINGS)
    assert isinstance(port, Adapter)
    port.arrival = lambda asked, _count, _chance: asked + 10.0
    with pytest.raises(LinkTimeout):
        line.read(1, 0, 1)
    assert "held_back_ms" not in line.quality(None).details
