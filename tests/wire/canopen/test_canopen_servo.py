"""The whole virtual CiA 402 servo behind the CANopen node: enable, move, cyclic position."""

from __future__ import annotations

import asyncio
import itertools
import math
import time
from collections.abc import AsyncIterator

import can
import numpy as np
import pytest

from drivers.canopen.exchange.cyclic import CanopenCyclic
from drivers.canopen.link import CanopenLink
from drivers.cia402 import State
from drivers.link import Address, CyclicSignal, Envelope, LinkEvent, ScopeBlock, Trajectory
from drivers.virtual.device import Device
from drivers.virtual.firmware.factory import make_device
from drivers.virtual.wires.can_wire import CanWire, PythonCanSide
from drivers.virtual.wires.canopen import CanopenNode
from tests.wire.canopen.conftest import until

CONTROL = Address(0x6040, 0, "UINT16")
STATUS = Address(0x6041, 0, "UINT16")
MODE = Address(0x6060, 0, "INT8")
POSITION = Address(0x6064, 0, "INT32")
TARGET = Address(0x607A, 0, "INT32")
_numbers = itertools.count()


class Servo:
    """One generic servo as node 3 and a link to it."""

    def __init__(self, link: CanopenLink, wire: CanWire, device: Device) -> None:
        self.link = link
        self.wire = wire
        self.device = device

    async def number(self, address: Address) -> int:
        signed = address.type.startswith("INT")
        return int.from_bytes(await self.link.read(3, address), "little", signed=signed)

    async def command(self, *words: int) -> None:
        for word in words:
            await self.link.write(3, CONTROL, word.to_bytes(2, "little"))

    async def state(self, mask: int, wanted: int) -> None:
        deadline = time.monotonic() + 5
        while await self.number(STATUS) & mask != wanted:
            assert time.monotonic() < deadline, f"status {await self.number(STATUS):#06x}"
            await asyncio.sleep(0.005)


@pytest.fixture
async def servo() -> AsyncIterator[Servo]:
    channel = f"servo-{next(_numbers)}"
    device = make_device("generic402", station=3)
    # Compiles the physics before anybody waits for an answer.
    device.advance(time.monotonic_ns())
    device.advance(time.monotonic_ns() + 10_000_000)
    wire = CanWire(
        PythonCanSide(can.Bus(interface="virtual", channel=channel)),
        [CanopenNode(device, 3, time.monotonic_ns)],
    )
    link = CanopenLink(f"canopen://virtual/{channel}")
    with wire:
        await link.open()
        yield Servo(link, wire, device)
        await link.close()


async def test_it_is_enabled_and_moves_to_a_position(servo: Servo) -> None:
    await servo.link.write(3, MODE, b"\x01")
    await servo.command(0x06, 0x07, 0x0F)
    await servo.state(0x6F, 0x27)
    start = await servo.number(POSITION)
    await servo.link.write(3, TARGET, (start + 1000).to_bytes(4, "little", signed=True))
    await servo.command(0x1F)
    await servo.state(0x1000, 0x1000)
    await servo.command(0x0F)
    await servo.state(0x0400, 0x0400)
    assert abs(await servo.number(POSITION) - start - 1000) <= 30
    await servo.command(0x00)
    await servo.state(0x4F, 0x40)


async def test_a_fault_comes_as_an_emergency_and_is_reset(servo: Servo) -> None:
    events: list[LinkEvent] = []
    servo.link.listen(events.append)
    await servo.command(0x06, 0x07, 0x0F)
    await servo.state(0x6F, 0x27)
    servo.wire.do(lambda: servo.device.inject("over_current"))
    await until(lambda: any(e.kind == "emergency" for e in events))
    emergency = next(e for e in events if e.kind == "emergency")
    assert emergency.code is not None
    assert emergency.code >> 12 == 2  # CiA 301 table 26: current
    await servo.state(0x4F, 0x08)
    servo.wire.do(lambda: servo.device.inject("over_current", 0.0))
    await servo.command(0x00, 0x80, 0x00)
    await servo.state(0x4F, 0x40)


async def test_cyclic_position_follows_and_losing_us_stops_it(servo: Servo) -> None:
    cyclic = servo.link.cyclic
    assert isinstance(cyclic, CanopenCyclic)
    blocks: list[ScopeBlock] = []
    cyclic.blocks(blocks.append)
    inputs = [CyclicSignal(3, STATUS, "status"), CyclicSignal(3, POSITION, "position")]
    outputs = [CyclicSignal(3, CONTROL, "control"), CyclicSignal(3, TARGET, "target")]
    await cyclic.configure(inputs, outputs, 0.005)
    await cyclic.start()
    await cyclic.drive_to(3, State.OPERATION_ENABLED, 8)
    await servo.state(0x6F, 0x27)
    await until(lambda: cyclic.axis_state(3)[0] == State.OPERATION_ENABLED.value)
    start = int.from_bytes(servo.device.read(0x607A, 0), "little", signed=True)
    # A smooth move of 2000 increments in half a second.
    ramp = (1 - np.cos(np.linspace(0, math.pi, 100))) / 2
    values = start + np.round(2000 * ramp).astype(np.int64)
    await cyclic.play([Trajectory(3, TARGET, values, Envelope(), renew_s=5.0)])
    await until(
        lambda: bool(blocks) and abs(blocks[-1].samples[-1][1] - start - 2000) < 40, seconds=5
    )
    servo.link._port.close()  # this computer dies
    deadline = time.monotonic() + 3
    while servo.device.read(0x6041, 0)[0] & 0x6F == 0x27:
        assert time.monotonic() < deadline
        await asyncio.sleep(0.01)
