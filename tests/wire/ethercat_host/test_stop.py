"""A stop by mailbox goes before everything, and nothing that enables may follow it."""

from __future__ import annotations

import asyncio
import struct
import time
from collections.abc import Callable, Sequence
from typing import Any

import pytest

from drivers import cia402
from drivers.errors import DriveError, LinkTimeout, NotAllowed
from drivers.ethercat.process.stations.station import Station
from drivers.ethercat.wire import coe
from drivers.ethercat.wire.frames import Request
from drivers.ethercat.wire.lanes import GRACE_S, Lanes, Urgency
from drivers.ethercat.wire.reading import read_items
from drivers.ethercat.wire.steps import Read, Write
from drivers.link import Address, CyclicSignal
from tests.support.machine import OwnTime
from tests.wire.ethercat_host.conftest import Rig, until
from tests.wire.ethercat_host.scripted import OUT, ScriptedSlave
from tests.wire.ethercat_host.scripted import coe as coe_mail

QUICK_STOP, ENABLE = b"\x02\0", b"\x0f\0"
STOP_MAIL = struct.pack("<HBHB", 0x2000, 0x2B, 0x6040, 0) + QUICK_STOP + b"\0\0"
"""CoE SDO request, expedited download of two bytes (ETG.1000.6 table 33)."""
ENABLE_MAIL = STOP_MAIL[:6] + ENABLE + b"\0\0"


class OneSlave:
    """The scripted slave as station 1 of `Lanes`; its clock is the lanes' clock."""

    def __init__(self, react: Callable[[bytes], list[bytes]], timeout_s: float = 1.0) -> None:
        self.slave = ScriptedSlave(react)
        self.station = Station(1, mailbox=self.slave.box(timeout_s))
        self.lanes = Lanes(self, lambda: self.slave.now)
        self.ended: list[tuple[str, Any, DriveError | None]] = []
        self.sent: list[tuple[float, bytes]] = []

    def exchange(self, requests: Sequence[Request]) -> list[bytes | None]:
        return [self._access(access) for _, access in requests]

    def _access(self, access: Read | Write) -> bytes | None:
        if isinstance(access, Write) and access.register == OUT:
            length = int.from_bytes(access.data[:2], "little")
            self.sent.append((self.slave.now, access.data[6 : 6 + length]))
        return self.slave.frame(access)

    def submit(self, name: str, steps: Any, urgency: Urgency = Urgency.NORMAL) -> None:
        def done(result: Any, error: DriveError | None) -> None:
            self.ended.append((name, result, error))

        self.lanes.submit(1, "mailbox", steps, done, urgency)

    def stop(self) -> None:
        self.station.box.stopping = True
        self.submit("stop", coe.stop_write(self.station.box, 0x6040, 0, QUICK_STOP), Urgency.STOP)

    def write_word(self, word: bytes) -> None:
        steps = coe.download(self.station.box, 0x6040, 0, word)
        self.submit("write", steps, Urgency.WRITE)

    def read_batch(self, count: int = 32) -> None:
        items = [(0x2000 + n, 0, 2) for n in range(count)]
        self.submit("batch", read_items(self.station, items, lambda _n: None))

    def run(self, seconds: float) -> None:
        end = self.slave.now + seconds
        while self.slave.now < end:
            if not self.lanes.step():
                wake = self.lanes.wake_s()
                self.slave.now = end if wake is None else min(max(wake, self.slave.now), end)

    def when(self, mail: bytes) -> list[float]:
        return [at for at, sent in self.sent if sent == mail]


def answer(payload: bytes) -> list[bytes]:
    """Every read is answered by 1234h, every write accepted."""
    mux = payload[3:6]
    if payload[2] & 0xE0 == 0x40:
        return [coe_mail(3, b"\x4b" + mux + b"\x34\x12\0\0")]
    return [coe_mail(3, b"\x60" + mux + bytes(4))]


def mute(_payload: bytes) -> list[bytes]:
    return []


def test_a_stop_to_a_mute_slave_goes_out_at_once() -> None:
    wire = OneSlave(mute)
    for _ in range(5):
        wire.read_batch()
    wire.run(0.2)
    began = wire.slave.now
    wire.stop()
    wire.run(8)
    assert wire.when(STOP_MAIL)[0] - began < GRACE_S + 0.002
    name, _, error = wire.ended[0]
    assert name == "stop", "it does not wait for the reads to end"
    assert isinstance(error, LinkTimeout)
    assert [name for name, _, _ in wire.ended[1:]] == ["batch"] * 5


def test_a_stop_to_a_slow_slave_lets_the_read_go_on() -> None:
    wire = OneSlave(answer)
    wire.slave.delay_s = 0.2
    wire.read_batch(4)
    wire.run(0.05)
    wire.stop()
    wire.run(6)
    stop, batch = wire.ended
    assert stop == ("stop", None, None)
    assert batch == ("batch", [b"\x34\x12"] * 4, None), "each value read, none made up"


def test_a_stop_goes_between_two_reads_of_a_quick_slave() -> None:
    wire = OneSlave(answer)
    wire.read_batch()
    wire.run(0.001)
    before = len(wire.sent)
    wire.stop()
    wire.run(1)
    place = [sent for _, sent in wire.sent].index(STOP_MAIL)
    assert place <= before + 1, "at most the read that was under way came before it"
    assert wire.ended[0][0] == "stop"
    assert wire.ended[1][1] == [b"\x34\x12"] * 32


def test_no_write_that_waits_follows_a_stop() -> None:
    wire = OneSlave(mute)
    wire.read_batch(1)
    wire.run(0.1)
    wire.write_word(ENABLE)
    wire.stop()
    wire.run(6)
    name, _, error = wire.ended[0]
    assert name == "write"
    assert isinstance(error, NotAllowed)
    assert "a stop was sent first" in error.message
    assert not wire.when(ENABLE_MAIL)


def test_a_write_whose_frame_was_lost_is_not_repeated_after_a_stop() -> None:
    wire = OneSlave(mute)
    original = wire.slave._access

    def full(step: Read | Write) -> bytes | None:
        # The mailbox is full: nothing is taken until the stop has been asked for.
        if isinstance(step, Write) and step.register == OUT and not stopping:
            return None
        return original(step)

    stopping: list[bool] = []
    wire.slave._access = full  # type: ignore[method-assign]
    wire.write_word(ENABLE)
    wire.run(0.1)
    stopping.append(True)
    wire.stop()
    wire.run(3)
    assert ENABLE_MAIL not in wire.slave.requests, "the axis would be enabled after the stop"
    assert STOP_MAIL in wire.slave.requests
    error = next(error for name, _, error in wire.ended if name == "write")
    assert isinstance(error, LinkTimeout), "whether it arrived is unknown"


def test_a_write_that_is_answered_before_the_stop_succeeds() -> None:
    wire = OneSlave(answer)
    wire.slave.delay_s = 0.05
    wire.submit("write", coe.download(wire.station.box, 0x2005, 3, b"\x01\0"), Urgency.WRITE)
    wire.run(0.001)
    wire.stop()
    wire.run(1)
    assert [(name, error) for name, _, error in wire.ended] == [("stop", None), ("write", None)]
    assert sum(sent[3:6] == b"\x05\x20\x03" for _, sent in wire.sent) == 1, "sent once only"


def test_a_stop_in_the_middle_of_segments_reads_the_object_anew() -> None:
    """A new request ends the transfer in the drive (CiA 301 clause 7.2.4.3)."""
    whole, place = bytes(range(200)), [0]

    def react(payload: bytes) -> list[bytes]:
        command = payload[2]
        if command == 0x40:
            place[0] = 100
            head = b"\x41" + payload[3:6] + struct.pack("<I", 200)
            return [coe_mail(3, head + whole[:100])]
        if command & 0xE0 == 0x60:
            if not place[0]:
                return [coe_mail(2, b"\x80\0\0\0" + struct.pack("<I", 0x05040001))]
            part = whole[place[0] : place[0] + 50]
            place[0] += len(part)
            return [coe_mail(3, bytes([command & 0x10 | (place[0] == 200)]) + part)]
        place[0] = 0
        return [coe_mail(3, b"\x60" + payload[3:6] + bytes(4))]

    wire = OneSlave(react)
    wire.slave.delay_s = 0.03
    wire.submit("read", coe.upload(wire.station.box, 0x2002, 0))
    wire.run(0.04)
    wire.stop()
    wire.run(3)
    assert wire.ended[0] == ("stop", None, None)
    assert wire.ended[1] == ("read", whole, None)


def test_a_write_goes_before_reads_that_wait() -> None:
    wire = OneSlave(answer)
    wire.read_batch()
    wire.read_batch()
    wire.run(0.001)
    wire.write_word(b"\x06\0")
    wire.run(3)
    assert [name for name, _, _ in wire.ended] == ["write", "batch", "batch"]


@pytest.mark.parametrize(
    ("word", "stop"),
    [
        (cia402.QUICK_STOP, True),
        (cia402.DISABLE_VOLTAGE, True),
        (cia402.ENABLE_OPERATION | cia402.HALT, True),
        (cia402.ENABLE_OPERATION, False),
        (cia402.SHUTDOWN, False),
        (cia402.SWITCH_ON, False),
        (cia402.FAULT_RESET, False),
        (cia402.ENABLE_OPERATION | cia402.NEW_SET_POINT, False),
    ],
)
def test_which_control_words_stop(word: int, stop: bool) -> None:
    assert cia402.stops(word) is stop


async def test_on_a_real_wire_a_stop_does_not_wait_behind_reads(rig: Rig) -> None:
    control = Address(0x6040, 0, "UINT16")
    batch = [Address(0x2001, n, "UINT16") for n in (1, 2, 3)] * 10
    async with rig.link() as bus:
        rig.do("mute", slave=0)
        reading = [asyncio.create_task(bus.link.read_many(1, batch)) for _ in range(8)]
        await asyncio.sleep(0.3)
        with OwnTime(with_children=True) as took:
            neighbour = asyncio.create_task(bus.link.write(2, control, QUICK_STOP))
            with pytest.raises(LinkTimeout):
                await bus.link.write(1, control, QUICK_STOP)
        # One time-out of its own; behind the reads it would have been eight more.
        assert took.s < 2.0
        assert neighbour.done()
        await neighbour
        rig.do("mute", slave=0, on=False)
        await asyncio.gather(*reading)
        await bus.link.write(1, control, QUICK_STOP)
        await until(lambda: rig.do("read", slave=0, index=0x6040) == "0200", 30.0)


@pytest.mark.long
async def test_a_stop_does_not_wait_for_the_set_up_of_an_exchange(rig: Rig) -> None:
    """Nothing of ours moves meanwhile, but somebody else may turn the axis."""
    async with rig.link() as bus:
        signals = [CyclicSignal(1, Address(0x6064, 0, "INT32"), "position")]
        targets = [CyclicSignal(1, Address(0x607A, 0, "INT32"), "target")]
        rig.do("timing", al_s=0.002, sdo_s=0.1, eeprom_read_s=5e-5)
        set_up = asyncio.create_task(
            bus.link.process_data.configure(signals, targets, 0.001), name="set-up"
        )
        await asyncio.sleep(0.5)
        assert not set_up.done()
        began = time.monotonic()
        await bus.link.write(1, Address(0x6040, 0, "UINT16"), QUICK_STOP)
        assert time.monotonic() - began < 0.4, "one answer of the slave, and that of the set-up"
        with pytest.raises(NotAllowed, match="an axis is being stopped"):
            await set_up
        rig.do("timing", al_s=0.002, sdo_s=0.0003, eeprom_read_s=5e-5)
        assert rig.truth(0, 0x6040) == 2
        await bus.link.process_data.configure(signals, targets, 0.001)
