"""A drive whose EDS file says that its PDOs cannot be mapped again: they are used as they are."""

from __future__ import annotations

import asyncio
import itertools
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import can
import pytest

from drivers.canopen.exchange.fixed_pdo import FixedPdo, fixed_pdos
from drivers.canopen.exchange.pdo import plan
from drivers.canopen.link import CanopenLink
from drivers.cia402 import State
from drivers.errors import NotAllowed
from drivers.link import Address, CyclicSignal, ScopeBlock
from drivers.virtual.wires.can_wire import CanWire, PythonCanSide
from drivers.virtual.wires.canopen import CanopenNode
from profiles.importer import import_file
from profiles.schema import Profile
from tests.wire.canopen.conftest import Bench, until
from tests.wire.canopen.small_device import SmallDevice
from tests.wire.canopen.test_canopen_cyclic import CSP, _cyclic, _run

_numbers = itertools.count()
CONTROL = CyclicSignal(5, Address(0x6040, 0, "UINT16"), "axis/6040:00")
TARGET = CyclicSignal(5, Address(0x607A, 0, "INT32"), "axis/607A:00")
STATUS = CyclicSignal(5, Address(0x6041, 0, "UINT16"), "status")
POSITION = CyclicSignal(5, Address(0x6064, 0, "INT32"), "position")
SPEED = CyclicSignal(5, Address(0x606C, 0, "INT32"), "speed")
TORQUE = CyclicSignal(5, Address(0x6077, 0, "INT16"), "torque")

_OBJECTS = (
    (0x6040, 6, "rww"), (0x6041, 6, "ro"), (0x6060, 2, "rww"), (0x6061, 2, "ro"),
    (0x6064, 4, "ro"), (0x606C, 4, "ro"), (0x607A, 4, "rww"), (0x60FF, 4, "rww"),
)  # fmt: skip


def _row(heading: str, kind: int, access: str, default: str = "") -> str:
    return (
        f"[{heading}]\nParameterName=x\nObjectType=0x7\nDataType={kind}\nAccessType={access}\n"
        f"PDOMapping=1\nDefaultValue={default}\n"
    )


def _pdo(index: int, cob: str, entries: list[int], cob_access: str = "rw") -> str:
    mapping = index + 0x200
    return (
        f"[{index:04X}]\nSubNumber=3\n[{mapping:04X}]\nSubNumber=9\n"
        + _row(f"{index:04X}sub0", 5, "const", "2")
        + _row(f"{index:04X}sub1", 7, cob_access, cob)
        + _row(f"{index:04X}sub2", 5, "rw", "255")
        + _row(f"{mapping:04X}sub0", 5, "const", str(len(entries)))
        + "".join(
            _row(f"{mapping:04X}sub{n}", 7, "const", f"0x{entry:08X}")
            for n, entry in enumerate(entries, 1)
        )
    )


def eds(cob_access: str = "rw") -> Profile:
    """Outputs with more than is asked for, inputs on identifiers of the maker's own."""
    text = (
        "[FileInfo]\nFileName=a.eds\n[DeviceInfo]\nVendorName=M\nProductName=Small\n"
        + "".join(_row(f"{index:04X}", kind, access) for index, kind, access in _OBJECTS)
        + _pdo(0x1400, "$NODEID+0x200", [0x60400010, 0x60600008, 0x607A0020])
        + _pdo(0x1800, "$NODEID+0x1A0", [0x60410010, 0x60610008, 0x60640020], cob_access)
        + _pdo(0x1801, "0x1C7", [0x606C0020], cob_access)
    )
    return import_file(text.encode(), "a.eds").profile


def _newest(block: ScopeBlock, channel: str) -> float:
    return float(block.samples[-1][block.channels.index(channel)])


@asynccontextmanager
async def linked(drive: Profile, known: Profile) -> AsyncIterator[tuple[Bench, CanopenLink]]:
    """``drive`` is what the node is, ``known`` is the file that was imported."""
    channel = f"fixed-{next(_numbers)}"
    device = SmallDevice()
    device.profile = drive
    device.power_cycle()
    node = CanopenNode(device, 5, time.monotonic_ns)
    with CanWire(PythonCanSide(can.Bus(interface="virtual", channel=channel)), [node]) as wire:
        link = CanopenLink(f"canopen://virtual/{channel}?timeout_ms=100")
        await link.open()
        link.attach(5, known)
        try:
            yield Bench(wire, ""), link
        finally:
            await link.close()


@pytest.mark.parametrize("cob_access", ["rw", "const"])
async def test_an_axis_moves_by_its_fixed_pdos(cob_access: str) -> None:
    profile = eds(cob_access)
    async with linked(profile, profile) as (bench, link):
        bench.device.write(0x6060, 0, b"\x01")
        before = [bytes([pdo.kind]) for pdo in bench.node._objects.pdos]
        blocks = await _run(link, [CONTROL, TARGET])
        used = {pdo.identifier for pdo in bench.node._objects.pdos if pdo.valid}
        assert {0x205, 0x1A5, 0x1C7} <= used
        # What the PDO holds next to the signals keeps the drive's own value.
        assert bench.device.value(0x6060) == 1
        cyclic = _cyclic(link)
        await cyclic.drive_to(5, State.OPERATION_ENABLED, CSP)
        await until(lambda: cyclic.axis_state(5)[0] == State.OPERATION_ENABLED.value)
        assert bench.device.value(0x6061) == CSP
        bench.device.turn_by_hand(123456)
        await until(lambda: bool(blocks) and _newest(blocks[-1], "position") == 123456)
        assert "axis/6060:00" in blocks[-1].channels
        await cyclic.drive_to(5, State.SWITCH_ON_DISABLED)
        await cyclic.stop()
        assert [bytes([pdo.kind]) for pdo in bench.node._objects.pdos] == before


async def test_a_drive_that_holds_something_else_than_its_file_is_refused() -> None:
    known = eds()
    assert known.pdo is not None
    sets = [
        each.model_copy(update={"entries": ("6040:00", "60FF:00")})
        if each.index == 0x1600
        else each
        for each in known.pdo.sets
    ]
    other = known.model_copy(update={"pdo": known.pdo.model_copy(update={"sets": tuple(sets)})})
    async with linked(other, known) as (bench, link):
        with pytest.raises(NotAllowed, match="60FF0020h"):
            await _run(link, [CONTROL, TARGET])
        assert {pdo.kind for pdo in bench.node._objects.pdos} == {255}
        await asyncio.sleep(0)


def test_signals_lie_where_the_file_says() -> None:
    """A dummy of the standard (0005h) fills a byte of the second PDO; 6077h is in none."""
    profile = eds()
    assert profile.pdo is not None
    fixed = fixed_pdos(profile, 5)
    assert [(each.direction, each.number, each.cob_id) for each in fixed] == [
        ("rx", 0, 0x205),
        ("tx", 0, 0x1A5),
        ("tx", 1, 0x1C7),
    ]
    padded = FixedPdo("tx", 1, 0x1C7, ((None, 1), (SPEED.address, 4)))
    pdos, left = plan([STATUS, POSITION, SPEED, TORQUE], [], {5: (*fixed[:2], padded)})
    assert left == (TORQUE,)
    assert [(pdo.cob_id, pdo.size) for pdo in pdos] == [(0x1A5, 7), (0x1C7, 5)]
    assert [(s.channel, start) for pdo in pdos for s, start in pdo.placed()] == [
        ("status", 0),
        ("position", 3),
        ("speed", 1),
    ]
