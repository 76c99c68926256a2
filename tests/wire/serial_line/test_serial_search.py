"""A search on a line where answers come too late, on a clock that only the script moves."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from drivers.modbus.framing import read_response
from drivers.modbus.layout import TableLayout
from drivers.modbus.line import Line
from drivers.modbus.link import RegisterLink
from tests.wire.serial_line.test_serial_line import SETTINGS, ScriptedPort, answer, line_on

PROMPT_S, LATE_S = 0.002, 0.05
"""The search waits 30 ms for an answer."""


class Bus(ScriptedPort):
    """Stations that answer every read with zeros: each takes its next delay, the last for ever."""

    def __init__(self, stations: dict[int, list[float]], noise: bytes = b"") -> None:
        super().__init__()
        self.stations = stations
        self.noise = noise

    def write(self, data: bytes) -> None:
        self.script = [[]]
        station, count = data[0], int.from_bytes(data[4:6], "big")
        delays = self.stations.get(station)
        if delays is not None:
            delay = delays.pop(0) if len(delays) > 1 else delays[0]
            self.script = [[(delay, read_response(station, [0] * count))]]
        elif self.noise:
            self.script = [[(PROMPT_S, self.noise)]]
        super().write(data)


async def found(bus: Bus, stations: Sequence[int], stop_after: int | None = None) -> list[int]:
    link = RegisterLink(
        "modbus://scripted",
        SETTINGS,
        TableLayout(),
        line=lambda settings, on_change: Line(
            settings, on_change=on_change, clock=bus.clock, sleep=bus.sleep, opener=lambda _: bus
        ),
    )
    shares: list[float] = []
    await link.open()
    drives = await link.scan(lambda share, _: shares.append(share), stations, stop_after=stop_after)
    await link.close()
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    return [drive.station for drive in drives]


@pytest.mark.parametrize("late", [1, 2, 5, 6])
async def test_a_drive_whose_first_answer_came_late_is_found(late: int) -> None:
    others = {4: [PROMPT_S], late: [LATE_S, PROMPT_S]}
    assert await found(Bus(others), range(1, 7)) == sorted(others)


async def test_all_are_found_where_all_were_late_for_once() -> None:
    bus = Bus({station: [LATE_S, PROMPT_S] for station in (1, 2, 3)})
    assert await found(bus, range(1, 7)) == [1, 2, 3]


async def test_a_quiet_line_is_asked_once_for_each_address() -> None:
    bus = Bus({})
    assert await found(bus, range(1, 11)) == []
    assert [frame[0] for frame in bus.sent] == list(range(1, 11))
    assert bus.now_s < 9 * 0.03 + 0.1 + 0.05


async def test_noise_does_not_prolong_a_search_without_end() -> None:
    bus = Bus({3: [PROMPT_S]}, noise=b"\x55")
    assert await found(bus, range(1, 11)) == [3]
    assert len(bus.sent) < 4 * 10


async def test_the_search_for_one_drive_ends_with_it() -> None:
    bus = Bus({2: [LATE_S, PROMPT_S], 5: [PROMPT_S]})
    assert await found(bus, range(1, 7), stop_after=1) == [5]
    assert bus.sent[-1][0] == 5


class Stalling(ScriptedPort):
    """This computer stands still for a second after the first bytes of an answer."""

    def read(self, timeout_s: float) -> bytes:
        data = super().read(timeout_s)
        if data and self.due:
            self.now_s += 1.0
        return data


def test_what_came_while_this_computer_stood_still_is_taken() -> None:
    whole = answer(1, 2, 3)
    port = Stalling([(0.01, whole[:4]), (0.012, whole[4:])])
    line = line_on(port)
    assert line.read(1, 0, 3) == b"\0\x01\0\x02\0\x03"
    assert line.quality(1).timeouts == 0
