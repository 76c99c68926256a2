"""Injected causes on a virtual CAN bus, for `benchmarks.doctor` and the tests.

``how`` as in `benchmarks.doctor`: "real" trouble of the bus or the node, or only the emergency
"code" that CiA 301 (table 26) gives the cause.
"""

from __future__ import annotations

import asyncio
import itertools
import struct
import tempfile
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from pathlib import Path

import can

from backend.station.doctor import examined
from drivers.canopen.adapters.slcan import ERROR_ACKNOWLEDGE, ERROR_PROTOCOL
from drivers.canopen.link import CanopenLink
from drivers.link import Address, LinkEvent
from drivers.virtual.wires.can_wire import CanWire, PythonCanSide
from drivers.virtual.wires.canopen import CanopenNode
from drivers.virtual.wires.slcan import SlcanSide
from profiles.schema import Profile
from tests.wire.canopen.small_device import SmallDevice, small_profile

NODE = 5
_numbers = itertools.count()
_NOT_MAPPABLE, _NOT_NOW = 0x06040041, 0x08000022
_STATUS = Address(0x6041, 0, "UINT16")


class Rig:
    """The bus of one case: wire, link, and a way to send as somebody else."""

    def __init__(self, wire: CanWire, link: CanopenLink, channel: str) -> None:
        self.wire = wire
        self.link = link
        self.events: list[LinkEvent] = []
        self._channel = channel
        link.listen(self.events.append)

    @property
    def node(self) -> CanopenNode:
        return self.wire.nodes[0]

    async def write(self, node: int, index: int, subindex: int, data: bytes) -> None:
        kind = {1: "UINT8", 2: "UINT16", 4: "UINT32"}[len(data)]
        await self.link.write(node, Address(index, subindex, kind), data)  # type: ignore[arg-type]

    async def until(self, kind: str) -> None:
        """Wait for an event of the link."""
        deadline = time.monotonic() + 5.0
        while not any(event.kind == kind for event in self.events):
            if time.monotonic() > deadline:
                raise TimeoutError(f"no event {kind!r}")
            await asyncio.sleep(0.01)

    def send(self, cob_id: int, data: bytes = b"") -> None:
        """A frame of another device."""
        with can.Bus(interface="virtual", channel=self._channel) as other:
            other.send(can.Message(arbitration_id=cob_id, is_extended_id=False, data=data))

    def add(self, node: int, device: SmallDevice | None = None) -> None:
        new = CanopenNode(device or SmallDevice(), node, time.monotonic_ns)
        self.wire.do(lambda: self.wire.nodes.append(new))


Prepare = Callable[[Rig], Awaitable[None]]


@dataclass(frozen=True)
class CanCase:
    """One injected cause; ``options`` are of the bus URL."""

    cause: str
    name: str
    prepare: Prepare
    how: str = "real"
    options: str = "timeout_ms=100"
    slcan: bool = False
    device: Callable[[], SmallDevice] = SmallDevice
    number: int = NODE
    profile: Callable[[], Profile] = small_profile
    as_it_is: bool = False
    """Examined as a running server does it, without a start."""


class LocalDevice(SmallDevice):
    """Under control of its panel: bit 9 of 6041h is 0 (CiA 402-2 clause 8.4.2)."""

    def read(self, index: int, subindex: int) -> bytes:
        value = super().read(index, subindex)
        if (index, subindex) == (0x6041, 0):
            return (int.from_bytes(value, "little") & ~0x0200).to_bytes(2, "little")
        return value


class FaultyDevice(SmallDevice):
    """With an error that lasts: bit 0 of 1001h (CiA 301 clause 7.5.2.2)."""

    def read(self, index: int, subindex: int) -> bytes:
        return b"\x01" if (index, subindex) == (0x1001, 0) else super().read(index, subindex)


class InputsOutputs(SmallDevice):
    """A node of CiA 401."""

    def read(self, index: int, subindex: int) -> bytes:
        if (index, subindex) == (0x1000, 0):
            return struct.pack("<I", 0x00030191)
        return super().read(index, subindex)


def _with(**changes: object) -> Profile:
    profile = small_profile()
    fields = {name: getattr(profile, name) for name in Profile.model_fields}
    return Profile(**(fields | changes))


def _identity(**other: int) -> Callable[[], Profile]:
    return lambda: _with(identity=small_profile().identity.model_copy(update=other))


def _cyclic() -> Profile:
    """With a cyclic mode, so that outputs travel in PDOs too."""
    return _with(supported_modes=(1, 3, 8))


async def _nothing(_rig: Rig) -> None:
    return None


def _broken(kind: int) -> Prepare:
    async def prepare(rig: Rig) -> None:
        rig.wire.broken = kind

    return prepare


def _set(**attributes: object) -> Prepare:
    async def prepare(rig: Rig) -> None:
        for name, value in attributes.items():
            setattr(rig.node, name, value)

    return prepare


def _emergency(code: int) -> Prepare:
    async def prepare(rig: Rig) -> None:
        rig.wire.do(lambda: rig.node.device.inject(f"{code:04X}"))
        await rig.until("emergency")

    return prepare


async def _bus_off(rig: Rig) -> None:
    await rig.link.read(NODE, _STATUS)  # opening the adapter has ended: that would clear bus-off
    rig.wire.side.bus_off()
    if isinstance(rig.wire.side, SlcanSide):
        return
    await rig.until("fault")


async def _unplugged(rig: Rig) -> None:
    assert isinstance(rig.wire.side, SlcanSide)
    rig.wire.side.unplug()
    await rig.until("lost")


async def _heartbeat(rig: Rig) -> None:
    await rig.write(NODE, 0x1017, 0, struct.pack("<H", 50))
    await asyncio.sleep(0.3)


async def _heartbeat_lost(rig: Rig) -> None:
    await _heartbeat(rig)
    rig.node.mute = True
    await rig.until("lost")


async def _guarding_lost(rig: Rig) -> None:
    await rig.link.read(NODE, _STATUS)
    await asyncio.sleep(0.4)
    rig.node.mute = True
    await rig.until("lost")


async def _sdo_silent(rig: Rig) -> None:
    await _heartbeat(rig)
    rig.node.silent_sdo = True


async def _restarts(rig: Rig) -> None:
    for _ in range(4):
        rig.wire.do(rig.node.reboot)
        await asyncio.sleep(0.05)


async def _second_of_the_number(rig: Rig) -> None:
    rig.add(NODE, SmallDevice(serial=43))


async def _collision(rig: Rig) -> None:
    rig.add(6)
    for cob_id in (0x80000185, 0x00000185):
        await rig.write(6, 0x1800, 1, struct.pack("<I", cob_id))


async def _other_sync_identifier(rig: Rig) -> None:
    await rig.write(NODE, 0x1005, 0, struct.pack("<I", 0x90))


async def _two_sync(rig: Rig) -> None:
    rig.send(0x080)


async def _other_master(rig: Rig) -> None:
    rig.send(0x600 + NODE, bytes.fromhex("4018100100000000"))


async def _own_number(rig: Rig) -> None:
    await rig.link.read(NODE, _STATUS)


async def _fault_and_short_pdo(rig: Rig) -> None:
    """A receive PDO of one byte where two are mapped (6040h)."""
    rig.send(0x000, bytes([0x01, NODE]))
    rig.send(0x200 + NODE, b"\x00")
    await rig.until("emergency")


async def _stopped(rig: Rig) -> None:
    await _heartbeat(rig)
    rig.send(0x000, bytes([0x02, NODE]))
    await asyncio.sleep(0.1)


async def _master_gone(rig: Rig) -> None:
    await rig.write(NODE, 0x1016, 1, struct.pack("<I", 0x007F0032))
    rig.send(0x77F, b"\x05")
    await rig.until("emergency")


CASES: tuple[CanCase, ...] = (
    CanCase("can_no_acknowledge", "alone on the bus", _broken(ERROR_ACKNOWLEDGE)),
    CanCase("can_no_acknowledge", "alone on the bus, slcan adapter", _broken(ERROR_ACKNOWLEDGE),
            slcan=True),
    CanCase("can_other_bit_rate", "other bit rate", _broken(ERROR_PROTOCOL)),
    CanCase("can_bus_off", "bus-off", _bus_off),
    CanCase("can_bus_off", "bus-off, slcan adapter", _bus_off, slcan=True),
    CanCase("can_adapter_gone", "adapter pulled", _unplugged, slcan=True),
    CanCase("can_node_silent", "node off", _set(mute=True)),
    CanCase("can_other_node_id", "node-ID 9 in place of 5", _nothing, number=9),
    CanCase("can_duplicate_node", "two nodes of one number", _second_of_the_number),
    CanCase("can_other_master", "requests of another master", _other_master),
    CanCase("can_own_number", "node has our number", _own_number,
            options="timeout_ms=100&own_id=5", profile=_cyclic),
    CanCase("can_stopped", "NMT stop of another master", _stopped, as_it_is=True),
    CanCase("can_not_started", "nobody sent NMT start", _heartbeat, as_it_is=True),
    CanCase("can_sdo_silent", "SDO server dead", _sdo_silent),
    CanCase("can_boot_loop", "four restarts", _restarts),
    CanCase("can_heartbeat_lost", "heartbeat ends", _heartbeat_lost),
    CanCase("can_guarding_lost", "guarding ends", _guarding_lost,
            options="timeout_ms=100&guard_ms=50"),
    CanCase("can_stays_preoperational", "NMT start ignored", _set(stays_preoperational=True)),
    CanCase("can_mapping_refused", "objects not mappable", _set(refused={0x1A00: _NOT_MAPPABLE})),
    CanCase("can_mapping_refused", "outputs not mappable", _set(refused={0x1600: _NOT_NOW}),
            profile=_cyclic),
    CanCase("can_pdo_id_refused", "COB-ID locked", _set(refused={0x1800: _NOT_NOW})),
    CanCase("can_cob_id_collision", "another node sends 185h", _collision),
    CanCase("can_sync_wrong", "1005h = 90h", _other_sync_identifier),
    CanCase("can_two_sync", "a second SYNC", _two_sync),
    CanCase("can_sync_missing", "SYNC does not reach it", _set(deaf_to_sync=True)),
    CanCase("can_local_control", "panel control", _nothing, device=LocalDevice),
    CanCase("can_local_control", "writes refused by local control",
            _set(refused={0x1800: 0x08000021})),
    CanCase("can_bus_full", "10 kbit/s at 10 ms", _nothing,
            options="timeout_ms=100&bitrate=10000"),
    CanCase("can_no_drive", "a node of CiA 401", _nothing, device=InputsOutputs),
    CanCase("can_other_product", "profile of another product", _nothing,
            profile=_identity(product_code=0x57)),
    CanCase("can_other_revision", "profile of another revision",
            _set(refused={0x1A00: _NOT_MAPPABLE}), profile=_identity(revision=9)),
    CanCase("can_pdo_length", "PDO of one byte for two", _fault_and_short_pdo),
    CanCase("can_master_not_heard", "heartbeat of the master missing", _master_gone,
            as_it_is=True),
    CanCase("can_drive_fault", "emergency 7305h", _emergency(0x7305), "code",
            device=FaultyDevice),
    CanCase("can_drive_fault", "emergency 3210h", _emergency(0x3210), "code",
            device=FaultyDevice),
    CanCase("can_overrun", "emergency 8110h", _emergency(0x8110), "code",
            device=FaultyDevice),
    CanCase("can_error_passive", "emergency 8120h", _emergency(0x8120), "code",
            device=FaultyDevice),
    CanCase("can_node_bus_off", "emergency 8140h", _emergency(0x8140), "code",
            device=FaultyDevice),
    CanCase("can_cob_id_collision", "emergency 8150h", _emergency(0x8150), "code",
            device=FaultyDevice),
    CanCase("can_sync_wrong", "emergency 8240h", _emergency(0x8240), "code",
            device=FaultyDevice),
    CanCase("can_outputs_late", "emergency 8250h", _emergency(0x8250), "code",
            device=FaultyDevice),
)  # fmt: skip


async def causes_of(case: CanCase) -> list[str]:
    """What the doctor says, the likeliest first; empty where the node reaches Operational."""
    with tempfile.TemporaryDirectory() as folder:
        channel = f"doctor-{next(_numbers)}"
        if case.slcan:
            side: SlcanSide | PythonCanSide = SlcanSide(Path(folder) / "ttyCAN")
            url = f"canopen://slcan/{folder}/ttyCAN?{case.options}"
        else:
            side = PythonCanSide(can.Bus(interface="virtual", channel=channel))
            url = f"canopen://virtual/{channel}?{case.options}"
        node = CanopenNode(case.device(), case.number, time.monotonic_ns)
        with CanWire(side, [node]) as wire:
            link = CanopenLink(url)
            await link.open()
            try:
                link.attach(NODE, case.profile())
                await case.prepare(Rig(wire, link, channel))
                if case.as_it_is:
                    examination = await link.examination(NODE)
                    return [cause.code for cause in examination.causes]
                result = await examined(link, NODE)
            finally:
                await link.close()
    return [cause.code for cause in result.causes]
