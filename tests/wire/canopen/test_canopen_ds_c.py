"""DS_C on CANopen and Modbus RTU at the same time (manual 003).

Runs with an excerpt of its dictionary written here and, where it is installed, with the whole
profile.
"""

from __future__ import annotations

import asyncio
import itertools
import threading
import time
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import can
import pytest

from drivers.canopen.exchange.cyclic import CanopenCyclic
from drivers.canopen.link import CanopenLink
from drivers.errors import NotAllowed, Rejected
from drivers.link import Address, CyclicSignal, Link, LinkEvent, ScopeBlock
from drivers.modbus.link import RegisterLink
from drivers.urls import link_for
from drivers.virtual.firmware.factory import make_device
from drivers.virtual.shared import SharedDevice
from drivers.virtual.wires.can_wire import CanWire, PythonCanSide
from drivers.virtual.wires.canopen import CanopenNode
from drivers.virtual.wires.modbus import ModbusSlave, TableRegisters
from drivers.virtual.wires.pty import PtyWire
from profiles.loader import drive_names, load_profile
from profiles.schema import Identity, LinkSpec, Parameter, Profile, Signal, UnitSpec, Watchdog
from tests.wire.canopen.conftest import until

#: Key, type, access, register, manual line (003).
_ROWS: list[tuple[str, str, str, int, int]] = [
    ("2102:00", "UINT16", "ro", 0x0008, 488), ("2200:00", "UINT16", "rw", 0x0061, 489),
    ("2201:00", "UINT16", "rw", 0x0063, 490), ("2202:00", "UINT16", "rw", 0x0064, 491),
    ("2203:00", "UINT16", "rw", 0x0062, 492), ("2300:00", "UINT16", "rw", 0x0067, 493),
    ("2301:00", "UINT16", "rw", 0x0068, 494), ("603F:00", "UINT16", "ro", 0x0200, 622),
    ("6040:00", "UINT16", "rw", 0x0201, 623), ("6041:00", "UINT16", "ro", 0x0202, 624),
    ("6060:00", "INT8", "rw", 0x0204, 625), ("6061:00", "INT8", "ro", 0x0205, 626),
    ("6064:00", "INT32", "ro", 0x0206, 627), ("606C:00", "INT32", "ro", 0x0208, 629),
    ("607A:00", "INT32", "rw", 0x020A, 631), ("6081:00", "UINT32", "rw", 0x020C, 633),
    ("6083:00", "UINT32", "rw", 0x020E, 635), ("6084:00", "UINT32", "rw", 0x0210, 637),
    ("60FF:00", "UINT32", "rw", 0x0212, 645),
]  # fmt: skip
_MAPPABLE = {"6040:00": "rx", "6041:00": "tx", "6064:00": "tx", "606C:00": "tx", "607A:00": "rx"}


def _excerpt() -> Profile:
    rows: list[dict[str, Any]] = [
        {
            "key": key, "name": key, "group": "g", "type": kind, "access": access,
            "modbus_register": register, "source": f"003:{line}",
            "pdo": _MAPPABLE.get(key, "none"), "default_raw": 0 if key < "6" else None,
        }
        for key, kind, access, register, line in _ROWS
    ]  # fmt: skip
    rows.append(
        {
            "key": "PA_38",
            "name": "1st gain of position loop",
            "group": "g",
            "type": "UINT16",
            "modbus_register": 0x38,
            "source": "003:716",
        }
    )
    for row in rows:
        if row["key"] in ("2300:00", "2301:00"):
            row["default_raw"] = 1
    none = Watchdog(present=False)
    return Profile(
        drive="ds_c",
        title="Excerpt of DS_C",
        manual="003",
        identity=Identity(maker="Xinlichuan", model="DS_C"),
        links=(
            LinkSpec(kind="canopen", watchdog=none, source="003:1"),
            LinkSpec(kind="modbus", watchdog=none, word_order="high_first", source="003:1"),
        ),
        units=UnitSpec(
            counts_per_rev=10000, velocity="rpm", acceleration="ms", ramp_reference_rpm=1000
        ),
        supported_modes=(1, 3, 4, 6),
        parameters=tuple(Parameter.model_validate(row) for row in rows),
        signals=(Signal(role="error_code", key="2102:00"),),
    )


_PROFILES = {"excerpt": _excerpt} | (
    {"installed": lambda: load_profile("ds_c")} if "ds_c" in drive_names() else {}
)
_numbers = itertools.count()


class TwoPorts:
    """The same drive seen from both sides."""

    def __init__(self, profile: Profile, bus: CanopenLink, serial: Link, wire: CanWire) -> None:
        self.profile = profile
        self.bus = bus
        self.serial = serial
        self.wire = wire

    def address(self, key: str) -> Address:
        p = self.profile.by_key[key]
        return Address(p.index, p.subindex or 0, p.type, p.modbus_register)

    async def number(self, link: Link, key: str) -> int:
        address = self.address(key)
        data = await link.read(7, address)
        return int.from_bytes(data, "little", signed=address.type.startswith("INT"))

    async def set(self, link: Link, key: str, value: int) -> None:
        address = self.address(key)
        size = {"INT8": 1, "UINT8": 1, "INT16": 2, "UINT16": 2}.get(address.type, 4)
        await link.write(7, address, value.to_bytes(size, "little", signed=value < 0))

    async def enable(self, link: Link) -> None:
        """6, 7 and 15, about 10 ms apart (003:277)."""
        for word in (6, 7, 15):
            await self.set(link, "6040:00", word)
            await asyncio.sleep(0.01)


@pytest.fixture(params=sorted(_PROFILES))
async def ports(request: pytest.FixtureRequest, tmp_path: Path) -> AsyncIterator[TwoPorts]:
    profile = _PROFILES[request.param]()
    lock = threading.RLock()
    device = SharedDevice(make_device(profile, station=7), lock)
    device.advance(time.monotonic_ns())
    device.advance(time.monotonic_ns() + 10_000_000)
    channel = f"ds-c-{next(_numbers)}"
    wire = CanWire(
        PythonCanSide(can.Bus(interface="virtual", channel=channel)),
        [CanopenNode(device, 7, time.monotonic_ns)],
    )
    path = tmp_path / "serial"
    slave = ModbusSlave(PtyWire(path), {7: (device, TableRegisters(device))}, lock=lock)
    bus = CanopenLink(f"canopen://virtual/{channel}")
    serial = link_for(f"modbus://{path}?baudrate=115200&parity=N")
    slave.start()
    try:
        with wire:
            for link in (bus, serial):
                await link.open()
                assert isinstance(link, (CanopenLink, RegisterLink))
                link.attach(7, profile)
            yield TwoPorts(profile, bus, serial, wire)
            await bus.close()
            await serial.close()
    finally:
        slave.stop()


@pytest.mark.long(keep=1)
async def test_a_move_commanded_over_can_is_seen_over_modbus(ports: TwoPorts) -> None:
    await ports.set(ports.bus, "6060:00", 1)
    await ports.enable(ports.bus)
    assert await ports.number(ports.serial, "6041:00") & 7 == 7  # 003:300
    for key, value in (("607A:00", 123456), ("6081:00", 2000), ("6083:00", 50), ("6084:00", 50)):
        await ports.set(ports.bus, key, value)
    assert await ports.number(ports.serial, "607A:00") == 123456  # two registers, high word first
    await ports.set(ports.bus, "607A:00", 20000)
    await ports.set(ports.bus, "6040:00", 31)  # 15 -> 31: absolute positioning, 003:292
    assert await ports.number(ports.serial, "6041:00") & 1 << 12
    deadline = time.monotonic() + 5
    while not await ports.number(ports.serial, "6041:00") & 1 << 15:
        assert time.monotonic() < deadline
        await asyncio.sleep(0.01)
    over_can = await ports.number(ports.bus, "6064:00")
    assert abs(over_can - 20000) <= 100
    assert abs(await ports.number(ports.serial, "6064:00") - over_can) <= 100


async def test_both_ports_work_at_once(ports: TwoPorts) -> None:
    async def hammer(link: Link, value: int) -> None:
        for n in range(30):
            await ports.set(link, "6083:00", value + n)
            assert await ports.number(link, "6041:00") & 7 == 0

    await asyncio.gather(hammer(ports.bus, 100), hammer(ports.serial, 1000))
    assert await ports.number(ports.bus, "6083:00") in (129, 1029)
    assert ports.bus.quality(7).timeouts == 0


async def test_gains_exist_on_modbus_only(ports: TwoPorts) -> None:
    await ports.set(ports.serial, "PA_38", 77)
    assert await ports.number(ports.serial, "PA_38") == 77
    with pytest.raises(NotAllowed, match="only over Modbus"):
        await ports.bus.read(7, ports.address("PA_38"))


async def test_triggers_stay_until_they_are_returned(ports: TwoPorts) -> None:
    await ports.set(ports.bus, "2200:00", 1)
    assert await ports.number(ports.serial, "2200:00") == 1  # 003:411: "manually set to 0"
    await ports.set(ports.serial, "2200:00", 0)
    assert await ports.number(ports.bus, "2200:00") == 0


async def test_an_alarm_is_seen_on_both_and_cleared(ports: TwoPorts) -> None:
    events: list[LinkEvent] = []
    ports.bus.listen(events.append)
    device = ports.wire.nodes[0].device
    ports.wire.do(lambda: device.inject("over_current"))
    await until(lambda: any(e.kind == "emergency" for e in events))
    assert await ports.number(ports.serial, "6041:00") & 1 << 7
    assert await ports.number(ports.bus, "603F:00") == await ports.number(ports.serial, "2102:00")
    ports.wire.do(lambda: device.inject("over_current", 0.0))
    await ports.set(ports.serial, "2203:00", 1)
    assert not await ports.number(ports.bus, "6041:00") & 1 << 7
    await ports.set(ports.serial, "2203:00", 0)


async def test_it_has_no_watchdog_and_no_cyclic_mode(ports: TwoPorts) -> None:
    """So its scope is synchronous while its commands go by SDO."""
    with pytest.raises(Rejected, match="no such object"):
        await ports.bus.read(7, Address(0x1016, 1, "UINT32"))
    cyclic = ports.bus.cyclic
    assert isinstance(cyclic, CanopenCyclic)
    blocks: list[ScopeBlock] = []
    cyclic.blocks(blocks.append)
    inputs = [CyclicSignal(7, ports.address(k), k) for k in ("6041:00", "6064:00", "606C:00")]
    outputs = [CyclicSignal(7, ports.address("6040:00"), "control")]
    assert await cyclic.configure(inputs, outputs, 0.005) == tuple(inputs)
    await cyclic.start()
    await ports.set(ports.bus, "6060:00", 3)
    await ports.set(ports.bus, "6083:00", 50)
    await ports.enable(ports.bus)
    await ports.set(ports.bus, "60FF:00", 300)
    # rpm, not increments per second
    await until(lambda: bool(blocks) and abs(blocks[-1].samples[-1][2] - 300) <= 15, seconds=5)
    await ports.set(ports.bus, "60FF:00", 0)
    await ports.set(ports.bus, "6040:00", 0)
    await cyclic.stop()
