"""Modbus RTU by a register table. Word order and registers in the style of manual 003."""

from __future__ import annotations

from pathlib import Path
from typing import cast

import pytest

from drivers.errors import DriveError, LinkLost, NotAllowed, Rejected
from drivers.link import Address, Found
from drivers.modbus.framing import EXCEPTION_TEXTS
from drivers.modbus.layout import TableLayout
from drivers.modbus.link import RegisterLink, _again
from drivers.texts.message import text
from drivers.virtual.wires.modbus import Trouble
from profiles.schema import DataType

from .conftest import OpenLink
from .shelf import ShelfDevice, serving, small_profile


def register(number: int, kind: DataType = "UINT16", index: int | None = None) -> Address:
    return Address(index, 0, kind, register=number)


def shelf_with(registers: dict[int, int]) -> ShelfDevice:
    shelf = ShelfDevice()
    shelf.registers = dict(registers)
    return shelf


async def test_high_word_comes_first(port: Path, opened: OpenLink) -> None:
    shelf = shelf_with({0x60: 0x1234, 0x61: 0x5678, 0x38: 7})
    with serving(port, {1: shelf}, by_table=True):
        link = await opened(f"modbus://{port}?silence_us=0")
        assert await link.read(1, register(0x60, "UINT32", 0x607A)) == b"\x78\x56\x34\x12"
        await link.write(1, register(0x60, "INT32"), b"\xfe\xff\xff\xff")
        assert (shelf.registers[0x60], shelf.registers[0x61]) == (0xFFFF, 0xFFFE)
        await link.write(1, register(0x38), b"\x2c\x01")
        assert shelf.registers[0x38] == 300


async def test_word_order_is_the_profiles(port: Path, opened: OpenLink) -> None:
    with serving(port, {1: shelf_with({0x60: 0x5678, 0x61: 0x1234})}, by_table=True):
        link = cast("RegisterLink", await opened(f"modbus://{port}?silence_us=0"))
        link.attach(1, small_profile(("6041:00", "UINT16"), kind="modbus", word_order="low_first"))
        assert await link.read(1, register(0x60, "UINT32")) == b"\x78\x56\x34\x12"


async def test_neighbours_come_in_one_request(port: Path, opened: OpenLink) -> None:
    shelf = shelf_with({r: r for r in range(0x30, 0x60)})
    with serving(port, {1: shelf}, by_table=True) as slave:
        link = await opened(f"modbus://{port}?silence_us=0")
        got = await link.read_many(1, [register(r) for r in (0x35, 0x33, 0x34, 0x50)])
        assert got == [b"\x35\0", b"\x33\0", b"\x34\0", b"\x50\0"]
        assert slave.requests == 2


async def test_block_limits_are_the_profiles(port: Path, opened: OpenLink) -> None:
    shelf = shelf_with({r: r for r in range(0x30, 0x60)})
    with serving(port, {1: shelf}, by_table=True) as slave:
        link = cast("RegisterLink", await opened(f"modbus://{port}?silence_us=0"))
        profile = small_profile(("6041:00", "UINT16"), kind="modbus", max_registers=8, max_gap=2)
        link.attach(1, profile)
        numbers = [0x30, 0x31, 0x34, 0x37, 0x38, 0x3C]
        got = await link.read_many(1, [register(n) for n in numbers])
        assert got == [bytes((n, 0)) for n in numbers]
        assert slave.requests == 3  # 30…37 with gaps of 2; 38; 3C is 3 away


async def test_hole_in_a_bridged_gap_falls_back_to_single_reads(
    port: Path, opened: OpenLink
) -> None:
    shelf = shelf_with({0x30: 1, 0x32: 2})
    with serving(port, {1: shelf}, by_table=True) as slave:
        link = cast("RegisterLink", await opened(f"modbus://{port}?silence_us=0"))
        link.attach(
            1, small_profile(("6041:00", "UINT16"), kind="modbus", max_registers=8, max_gap=2)
        )
        for requests in (3, 2):  # once in vain, then known
            before = slave.requests
            assert await link.read_many(1, [register(0x30), register(0x32)]) == [
                b"\x01\0",
                b"\x02\0",
            ]
            assert slave.requests - before == requests


async def test_object_without_register(port: Path, opened: OpenLink) -> None:
    with serving(port, {1: ShelfDevice()}, by_table=True):
        link = await opened(f"modbus://{port}")
        with pytest.raises(NotAllowed, match="1018:01 has no Modbus register"):
            await link.read(1, Address(0x1018, 1, "UINT32"))
        with pytest.raises(NotAllowed, match="no Modbus register"):
            await link.write(1, Address(0x1018, 1, "UINT32"), bytes(4))


async def test_read_only_register_is_refused_in_words(port: Path, opened: OpenLink) -> None:
    shelf = shelf_with({0x38: 7})
    shelf.read_only_registers = {0x38}
    with serving(port, {1: shelf}, by_table=True):
        link = await opened(f"modbus://{port}?silence_us=0")
        with pytest.raises(Rejected, match="refused to execute the request") as caught:
            await link.write(1, register(0x38), b"\x01\0")
        with pytest.raises(Rejected, match="no such register"):
            await link.read(1, register(0x999))
    assert caught.value.abort_code == 4


async def test_scan_takes_a_refusal_for_a_drive(port: Path, opened: OpenLink) -> None:
    with serving(port, {1: shelf_with({}), 2: shelf_with({0: 5})}, by_table=True):
        link = await opened(f"modbus://{port}?silence_us=0")
        found = await link.scan(lambda *_: None, (1, 2, 3))
    assert [f.station for f in found] == [1, 2]
    assert isinstance(found[0], Found)
    assert found[0].notes[0] == text("modbus.note-register-refused")
    assert found[1].notes[0] == text("modbus.note-register-holds", value=5)


def test_texts_of_the_manual() -> None:
    # 003:1160-1162: 2 illegal address, 3 illegal data, 4 refused to execute.
    assert "illegal address" in EXCEPTION_TEXTS[2].words()
    assert "illegal data" in EXCEPTION_TEXTS[3].words()
    assert "refused to execute" in EXCEPTION_TEXTS[4].words()


@pytest.mark.parametrize(
    "error", [LinkLost("x", remedy="y"), Rejected("x", abort_code=4, remedy="y"), NotAllowed("x")]
)
def test_copied_errors_keep_what_they_say(error: DriveError) -> None:
    copy = _again(error)
    assert (type(copy), copy.message, copy.remedy) == (type(error), error.message, error.remedy)
    assert copy is not error


def test_default_block_is_the_standards_longest() -> None:
    # V1.1b3 clause 6.3: at most 125 registers.
    assert TableLayout().limits(1).max_registers == 125


async def test_a_busy_drive_is_asked_again(port: Path, opened: OpenLink) -> None:
    """Exception 6: engaged for now, to be asked later (V1.1b3 clause 7); a block stays a block."""
    shelf = shelf_with({r: r for r in range(0x30, 0x40)})
    with serving(port, {1: shelf}, by_table=True) as slave:
        link = await opened(f"modbus://{port}?silence_us=0")
        slave.trouble(Trouble("refuse"), Trouble("refuse"))
        addresses = [register(r) for r in (0x30, 0x31, 0x32)]
        assert await link.read_many(1, addresses) == [b"\x30\0", b"\x31\0", b"\x32\0"]
        assert slave.requests == 3
        assert await link.read_many(1, addresses) == [b"\x30\0", b"\x31\0", b"\x32\0"]
        assert slave.requests == 4
        slave.trouble(*[Trouble("refuse")] * 3)
        with pytest.raises(Rejected, match="busy") as caught:
            await link.read(1, register(0x30))
        assert "try again" in (caught.value.remedy or "")
        slave.trouble(Trouble("refuse"))
        with pytest.raises(Rejected, match="busy"):
            await link.write(1, register(0x30), b"\x01\0")
        assert slave.requests == 8  # a write is never repeated
