"""A virtual drive's firmware as a link of any kind, without a wire; the drive's time is counted."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Sequence
from typing import Any

from drivers.errors import DriveError, Rejected
from drivers.link import Address, Found, LinkEvent, LinkQuality, Progress, Unsubscribe
from drivers.modbus.registers import Place, to_bytes, to_words
from drivers.objects.codec import size_of
from drivers.texts.message import Text
from drivers.urls import bus_kind
from drivers.virtual.device import SdoAbort
from drivers.virtual.firmware.factory import make_device
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.servo import VirtualServo
from profiles.schema import LinkKind

STATION = 1
#: What one access takes of the drive's time.
ACCESS_S = 0.0005


class FirmwareLink:
    """`drivers.link.Link` on one virtual drive. Time passes with accesses and `pass_s` only.

    With ``real_time`` an access comes as late for the drive as it does for the computer.
    """

    cyclic = doctor = frames = None

    def __init__(self, family: str, kind: LinkKind, *, real_time: bool = False) -> None:
        self._real_time, self._asked = real_time, time.monotonic()
        device = make_device(family)
        assert isinstance(device, VirtualServo)
        self.device: VirtualServo = device
        self.kind: LinkKind = kind
        self.traits = bus_kind(kind).traits
        self.url = f"{kind}://firmware-{family}"
        self._ns = 0
        spec = device.profile.link(kind)
        assert spec is not None
        self._word_order = spec.word_order or "high_first"
        self.device.advance(0)

    # --- what is true of the shaft --------------------------------------------------------

    @property
    def angle_rad(self) -> float:
        """The motor's angle, as physics has it."""
        return float(self.device.axis.s[k.S_THETA])

    def pass_s(self, seconds: float) -> None:
        """Let the drive's time pass without any access."""
        self._ns += round(seconds * 1e9)
        self.device.advance(self._ns)

    def _access(self) -> None:
        passed = time.monotonic() - self._asked
        self._asked += passed
        self.pass_s(max(ACCESS_S, passed) if self._real_time else ACCESS_S)

    # --- Link -----------------------------------------------------------------------------

    async def open(self) -> None:
        """Nothing to open."""

    async def close(self) -> None:
        """Nothing to close."""

    async def scan(self, progress: Progress, stations: Sequence[int] | None = None) -> list[Found]:
        del progress, stations
        return [Found(STATION)]

    async def read(self, station: int, address: Address) -> bytes:
        del station
        self._access()
        await asyncio.sleep(0)
        try:
            if self.kind == "modbus":
                place = self._place(address)
                words = self.device.read_register(place.start, place.count)
                return to_bytes(place, b"".join(word.to_bytes(2, "big") for word in words))
            assert address.index is not None
            return self.device.read(address.index, address.subindex)
        except SdoAbort as abort:
            raise Rejected(f"{address}: refused", abort_code=abort.code) from abort

    async def read_many(
        self, station: int, addresses: Sequence[Address]
    ) -> list[bytes | DriveError]:
        found: list[bytes | DriveError] = []
        for address in addresses:
            try:
                found.append(await self.read(station, address))
            except DriveError as error:
                found.append(error)
        return found

    async def write(self, station: int, address: Address, data: bytes) -> None:
        del station
        self._access()
        await asyncio.sleep(0)
        try:
            if self.kind == "modbus":
                place = self._place(address)
                self.device.write_registers(place.start, to_words(place, data))
                return
            assert address.index is not None
            self.device.write(address.index, address.subindex, data)
        except SdoAbort as abort:
            raise Rejected(f"{address}: refused", abort_code=abort.code) from abort

    def _place(self, address: Address) -> Place:
        assert address.register is not None
        size = size_of(address.type)
        assert size is not None
        return Place(address.register, max(1, size // 2), address.type, self._word_order)

    def quality(self, station: int | None = None) -> LinkQuality:
        del station
        return LinkQuality(connected=True)

    def listen(self, listener: Callable[[LinkEvent], None]) -> Unsubscribe:
        del listener
        return lambda: None

    def attach(self, station: int, facts: Any) -> None:
        """The family is known here."""
        del station, facts

    def unreachable(self, station: int, address: Address) -> Text | None:
        del station, address
        return None
