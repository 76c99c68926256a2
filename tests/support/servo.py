"""A CiA 402 servo in memory behind the Link seam: states and modes, no mechanics.

Trouble on request: a mute or slow line, a drive that trips on being enabled, another drive at
the same place. Every write is kept in order in ``written``.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from pathlib import Path

from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from drivers.errors import DriveError, LinkTimeout
from drivers.link import Address
from drivers.objects.codec import size_of
from profiles import load_profile
from tests.support.memory_link import MemoryLink

URL = "mlink://virtual0"
Place = tuple[int, int]
CONTROL, STATUS, MODE, MODE_SHOWN = (0x6040, 0), (0x6041, 0), (0x6060, 0), (0x6061, 0)
POSITION, VELOCITY_TARGET, TARGET = (0x6064, 0), (0x60FF, 0), (0x607A, 0)

_DISABLED, _READY, _ON, _ENABLED, _QUICK, _FAULT = 0x250, 0x231, 0x233, 0x237, 0x217, 0x218


class Servo(MemoryLink):
    """Objects of a profile, zero unless its default says otherwise."""

    def __init__(self, family: str = "mms7") -> None:
        objects = {}
        for p in load_profile(family).parameters:
            if p.index is None:
                continue
            size = size_of(p.type) or 4
            number = p.default_raw if isinstance(p.default_raw, int) else 0
            objects[p.index, p.subindex or 0] = (number % 256**size).to_bytes(size, "little")
        super().__init__(objects)
        self.set(STATUS, _DISABLED)
        self.objects[0x1018, 4] = (7).to_bytes(4, "little")
        self.mute = False
        self.trips = False
        self.speed_inc = 0
        """Increments by which the position goes on with every reading."""
        self.gate = asyncio.Event()
        self.gate.set()
        self.on_write: Callable[[Place, int], None] = lambda _place, _value: None
        self.on_read: Callable[[Place], None] = lambda _place: None

    def number(self, place: Place) -> int:
        return int.from_bytes(self.objects[place], "little", signed=True)

    def set(self, place: Place, value: int) -> None:
        size = len(self.objects[place])
        self.objects[place] = (value % 256**size).to_bytes(size, "little")

    def words(self) -> list[int]:
        """Control words received, in order."""
        return [int.from_bytes(data, "little") for place, data in self.written if place == CONTROL]

    async def read(self, station: int, address: Address) -> bytes:
        await asyncio.sleep(0)
        if self.mute:
            raise LinkTimeout("no answer")
        self.on_read((address.index or 0, address.subindex))
        if (address.index, address.subindex) == POSITION:
            self.set(POSITION, self.number(POSITION) + self.speed_inc)
        return await super().read(station, address)

    async def read_many(
        self, station: int, addresses: Sequence[Address]
    ) -> list[bytes | DriveError]:
        return await super().read_many(station, addresses)

    async def write(self, station: int, address: Address, data: bytes) -> None:
        await self.gate.wait()
        await asyncio.sleep(0)
        if self.mute:
            raise LinkTimeout("no answer")
        await super().write(station, address, data)
        place = (address.index or 0, address.subindex)
        if place == MODE:
            self.set(MODE_SHOWN, self.number(MODE))
        if place == CONTROL:
            self._control(int.from_bytes(data, "little"))
        self.on_write(place, int.from_bytes(data, "little", signed=True))

    def _control(self, word: int) -> None:
        state = self.number(STATUS)
        if state == _FAULT:
            if word & 0x80:
                self.set(STATUS, _DISABLED)
        elif not word & 2:
            self.set(STATUS, _DISABLED)
        elif not word & 4:
            self.set(STATUS, _QUICK if state in (_ENABLED, _QUICK) else _DISABLED)
            self.speed_inc = 0
        elif word & 0xF == 6:
            self.set(STATUS, _READY)
        elif word & 0xF == 7 and state in (_READY, _ON, _ENABLED):
            self.set(STATUS, _ON)
        elif word & 0xF == 15 and state in (_ON, _ENABLED):
            self.set(STATUS, _FAULT if self.trips else _ENABLED)

    def enable(self) -> None:
        self.set(STATUS, _ENABLED)

    def trip(self) -> None:
        self.set(STATUS, _FAULT)


async def bench_with(servo: Servo, folder: Path) -> tuple[Bench, ConnectedDrive]:
    """A bench with this servo at station 1, its monitor at standstill."""
    bench = Bench(folder, {URL: lambda: servo})
    connected = await bench.connect(URL, 1, "mms7", "X")
    await connected.monitor.close()
    return bench, connected
