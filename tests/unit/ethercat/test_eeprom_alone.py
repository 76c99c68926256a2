"""One access to the EEPROM of a station at a time, whatever lane it comes from."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import pytest

from drivers.errors import Busy, DriveError
from drivers.ethercat.process.stations.eeprom import EepromOperations
from drivers.ethercat.process.stations.station import Station, identify
from drivers.ethercat.wire.frames import Request
from drivers.ethercat.wire.lanes import Lanes
from drivers.ethercat.wire.steps import Read, Write
from tests.wire.ethercat_host.test_eeprom import Eeprom


class Slave(Eeprom):
    """The EEPROM and, all zero, the other registers of a slave in PREOP without mailbox."""

    def _access(self, step: Read | Write) -> bytes | None:
        if 0x500 <= step.register < 0x510:
            return super()._access(step)
        if step.register == 0x130:
            return b"\x02".ljust(6, b"\0")
        return bytes(step.size) if isinstance(step, Read) else b""

    def exchange(self, requests: Sequence[Request]) -> list[bytes | None]:
        return [self.frame(access) for _, access in requests]


class Segment:
    def __init__(self) -> None:
        self.slave, self.station = Slave(), Station(1)
        self.lanes = Lanes(self.slave, lambda: self.slave.now)
        self.held: set[int] = set()
        self.loading: set[int] = set()
        self.new_aliases: set[int] = set()
        roster: Any = SimpleNamespace(
            exchange=SimpleNamespace(loop=None),
            station=lambda _message: self.station,
            require_not_held=lambda: None,
            held=self.held,
            loading=self.loading,
            new_aliases=self.new_aliases,
        )
        self.operations = EepromOperations(roster, self.lanes, lambda _m: lambda _s, _t: None)
        self.results: list[tuple[Any, DriveError | None]] = []

    def identify(self) -> None:
        steps = identify(self.station, lambda: self.slave.now)
        self.lanes.submit(1, "mailbox", steps, lambda _result, _error: None)

    def done(self, result: object, error: DriveError | None) -> None:
        self.results.append((result, error))

    def run(self) -> None:
        while self.lanes.pending():
            if not self.lanes.step():
                self.slave.now += 1e-4

    @property
    def contents(self) -> bytes:
        return struct.pack(f"<{len(self.slave.words)}H", *self.slave.words)


@pytest.mark.parametrize("first", ["read", "identify"])
def test_an_image_is_right_although_the_station_is_identified_meanwhile(first: str) -> None:
    segment = Segment()
    if first == "identify":
        segment.identify()
        for _ in range(30):
            segment.lanes.step()
            segment.slave.now += 1e-4
    segment.operations.read({"station": 1, "size": 128}, segment.done)
    if first == "read":
        for _ in range(30):
            segment.lanes.step()
            segment.slave.now += 1e-4
        segment.identify()
    segment.run()
    assert segment.results == [(segment.contents, None)]
    assert segment.slave.owner == 1


def test_what_is_written_is_right_although_the_station_is_identified_meanwhile() -> None:
    segment = Segment()
    present = segment.contents
    target = bytearray(present)
    target[0x40:0x60] = bytes(range(0x20))
    message = {"station": 1, "present": present, "target": bytes(target)}
    segment.operations.write(message, segment.done)
    while segment.lanes.pending():
        if not segment.lanes.busy(1, "mailbox"):
            segment.identify()
        for _ in range(7):
            if not segment.lanes.step():
                segment.slave.now += 1e-4
        if segment.results:
            break
    assert segment.results == [(None, None)]
    assert segment.contents == bytes(target)


def test_no_eeprom_is_written_while_firmware_is_loaded_into_the_station() -> None:
    segment = Segment()
    segment.loading.add(1)
    with pytest.raises(Busy, match="being loaded with firmware"):
        segment.operations.write({"station": 1, "present": b"", "target": b""}, segment.done)
