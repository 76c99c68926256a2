"""SYNC0 is started in time, whatever is lost on the way (ETG.1000.4 clause 6.7.3)."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field

import pytest

from drivers.errors import LinkLost
from drivers.ethercat.exchange.mapping import Pdo, alone
from drivers.ethercat.exchange.setup import StationSetup, start_sync0
from drivers.ethercat.process.stations.station import Station
from drivers.ethercat.wire.steps import Read, Step, Write

CYCLE_NS = 250_000
SETUP = StationSetup(
    alone(Pdo(0x1600, (), True)), alone(Pdo(0x1A00, (), True)), CYCLE_NS, True, 50.0
)
NEVER = 1 << 63


@dataclass
class Chip:
    """The clock unit of an ESC: the pulse comes only if its start is still ahead on activation."""

    lose: set[int] = field(default_factory=set)
    """Numbers of frames that do not arrive."""
    unheard: set[int] = field(default_factory=set)
    """Numbers of frames that arrive, but do not come back."""
    stalls: dict[int, int] = field(default_factory=dict)
    """Nanoseconds that this computer stands still before a frame."""
    wide: bool = True
    now_ns: int = 0x1_0000_0000 - 50_000_000
    frames: int = 0
    start_ns: int = 0
    cycle_ns: int = 0
    first_pulse_ns: int | None = None

    def access(self, step: Step) -> bytes | None:
        number, self.frames = self.frames, self.frames + 1
        self.now_ns += 60_000 + self.stalls.get(number, 0)
        if number in self.lose:
            return None
        answer = self._do(step)
        return None if number in self.unheard else answer

    def _do(self, step: Step) -> bytes:
        if isinstance(step, Read):
            assert step.register == 0x910
            shown = self.now_ns if self.wide else self.now_ns & 0xFFFF_FFFF
            return struct.pack("<Q", shown)[: step.size]
        assert isinstance(step, Write)
        if step.register == 0x990:
            self.start_ns = int.from_bytes(step.data, "little")
        elif step.register == 0x9A0:
            self.cycle_ns = int.from_bytes(step.data, "little")
        elif step.register == 0x981:
            self.first_pulse_ns = self._first() if step.data[0] & 3 == 3 else None
        return b""

    def _first(self) -> int:
        bits = 64 if self.wide else 32
        ahead = (self.start_ns - self.now_ns) % (1 << bits)
        return self.now_ns + ahead if ahead < 1 << bits - 1 else NEVER

    def start(self) -> None:
        steps = start_sync0(Station(2), SETUP, lambda: self.now_ns * 1e-9)
        step = next(steps)
        try:
            while True:
                step = steps.send(self.access(step))
        except StopIteration:
            return

    def pulses(self) -> bool:
        """On the grid that all stations share, and soon."""
        first = self.first_pulse_ns
        soon = first is not None and 0 < first - self.now_ns <= 100_000_000
        return soon and self.start_ns % CYCLE_NS == 0 and self.cycle_ns == CYCLE_NS


@pytest.mark.parametrize("wide", [True, False], ids=["64 bits", "32 bits about to wrap"])
def test_it_pulses_on_the_shared_grid(wide: bool) -> None:
    chip = Chip(wide=wide)
    chip.start()
    assert chip.pulses()
    assert chip.frames == 7, "nothing is done twice"


@pytest.mark.parametrize("number", range(7))
@pytest.mark.parametrize("how", ["lose", "unheard"])
def test_a_lost_frame_costs_time_only(number: int, how: str) -> None:
    chip = Chip(**{how: {number}})  # type: ignore[arg-type]
    chip.start()
    assert chip.pulses()


@pytest.mark.parametrize("number", range(7))
def test_a_computer_that_stands_still_does_not_set_a_start_in_the_past(number: int) -> None:
    chip = Chip(stalls={number: 300_000_000})
    chip.start()
    assert chip.pulses()


def test_a_dead_line_is_reported_with_its_remedy() -> None:
    with pytest.raises(LinkLost, match="station 2: its SYNC0 could not be started") as raised:
        Chip(lose=set(range(10**6))).start()
    assert raised.value.remedy
