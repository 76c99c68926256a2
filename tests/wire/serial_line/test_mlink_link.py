"""MLink against a slave on a real pty; the rule's examples are those of design/drives.md."""

from __future__ import annotations

import asyncio
import struct
from pathlib import Path
from typing import cast

import pytest

from drivers.errors import LinkTimeout, NotAllowed, ProtocolError, Rejected
from drivers.link import Address, Found, LinkQuality
from drivers.mlink.link import MlinkLayout, ambiguous_objects, register_of
from drivers.modbus.line_url import line_settings
from drivers.modbus.link import RegisterLink
from drivers.texts.message import text
from drivers.urls import parse_url
from drivers.virtual.wires.modbus import Trouble
from profiles.schema import DataType

from .conftest import OpenLink
from .shelf import ShelfDevice, serving, small_profile

STATUS = Address(0x6041, 0, "UINT16")
MODE = Address(0x6060, 0, "INT8")
TARGET = Address(0x607A, 0, "INT32")
POSITION = Address(0x6064, 0, "INT32")
CONTROL = Address(0x6040, 0, "UINT16")


@pytest.mark.parametrize(
    ("index", "subindex", "register"),
    [
        (0x6040, 0, 0x6400), (0x6099, 2, 0x6991), (0x2105, 0, 0x3050), (0x6041, 0, 0x6410),
        (0x60FF, 0, 0x6FF0), (0x2070, 1, 0x2700), (0x2070, 2, 0x2701), (0x60C5, 0, 0x6C50),
        (0x1018, 4, 0x1183),
    ],
)  # fmt: skip
def test_register_rule(index: int, subindex: int, register: int) -> None:
    # Beyond drives.md's three: constants printed in EZMotionMMS2 1.0.2 (FF0 = target velocity …).
    assert register_of(index, subindex) == register


def test_rule_ends_at_16_bits() -> None:
    with pytest.raises(NotAllowed, match="no register number"):
        register_of(0xFFFF, 0)


def test_objects_that_share_a_register_are_refused() -> None:
    # 2100h and 3000h both lead to 3000h; 6099h:00 leads to :01's register.
    profile = small_profile(
        ("2100:00", "UINT16"),
        ("3000:00", "UINT16"),
        ("6099:00", "UINT8"),
        ("6099:01", "UINT32"),
    )
    assert ambiguous_objects(profile) == {
        (0x2100, 0): "3000:00",
        (0x3000, 0): "2100:00",
        (0x6099, 0): "6099:01",
    }
    layout = MlinkLayout()
    layout.configure(1, profile)
    with pytest.raises(NotAllowed, match="6099:00 from 6099:01"):
        layout.place(1, Address(0x6099, 0, "UINT8"))
    assert layout.place(1, Address(0x6099, 1, "UINT32")).start == 0x6990


@pytest.mark.parametrize("kind", ["INT64", "STRING", "OCTETS"])
def test_long_values_are_not_for_mlink(kind: DataType) -> None:
    with pytest.raises(NotAllowed):
        MlinkLayout().place(1, Address(0x2000, 1, kind))


async def test_read_and_write_all_sizes(port: Path, opened: OpenLink) -> None:
    shelf = ShelfDevice()
    with serving(port, {1: shelf}):
        link = await opened(f"mlink://{port}")
        for address, data in (
            (CONTROL, b"\x0f\x01"),
            (MODE, b"\xfd"),
            (TARGET, struct.pack("<i", -70_000)),
            (Address(0x6099, 2, "UINT32"), struct.pack("<I", 0x12345678)),
        ):
            await link.write(1, address, data)
            assert await link.read(1, address) == data
    assert (0x6099, 2, b"\x78\x56\x34\x12") in shelf.writes
    assert shelf.objects[0x6099, 1] == bytes(4)


async def test_one_failure_does_not_spoil_the_others(port: Path, opened: OpenLink) -> None:
    shelf = ShelfDevice()
    shelf.objects[0x6041, 0] = b"\x50\x02"
    with serving(port, {1: shelf}):
        link = await opened(f"mlink://{port}")
        missing = Address(0x2999, 1, "UINT16")
        text = Address(0x1008, 0, "STRING")
        first, second, third, fourth = await link.read_many(1, [missing, STATUS, text, MODE])
    assert isinstance(first, Rejected)
    assert first.abort_code == 2
    assert second == b"\x50\x02"
    assert isinstance(third, NotAllowed)
    assert fourth == b"\0"


async def test_refusals_in_words(port: Path, opened: OpenLink) -> None:
    with serving(port, {1: ShelfDevice()}):
        link = await opened(f"mlink://{port}")
        with pytest.raises(Rejected, match="refused to execute") as read_only:
            await link.write(1, STATUS, b"\0\0")
        with pytest.raises(Rejected, match="illegal data") as too_high:
            await link.write(1, Address(0x2105, 0, "UINT8"), b"\xf8")
    assert (read_only.value.abort_code, too_high.value.abort_code) == (4, 3)


async def test_neighbouring_subindices_are_read_together_if_the_profile_allows(
    port: Path, opened: OpenLink
) -> None:
    shelf = ShelfDevice()
    for subindex in (1, 2, 3):
        shelf.objects[0x2070, subindex] = bytes((subindex, 0))
    addresses = [Address(0x2070, s, "UINT16") for s in (3, 1, 2)]
    with serving(port, {1: shelf}) as slave:
        link = cast("RegisterLink", await opened(f"mlink://{port}"))
        assert await link.read_many(1, addresses) == [b"\x03\0", b"\x01\0", b"\x02\0"]
        alone = slave.requests
        link.attach(1, small_profile(("6041:00", "UINT16"), max_registers=16))
        assert await link.read_many(1, addresses) == [b"\x03\0", b"\x01\0", b"\x02\0"]
        assert (alone, slave.requests - alone) == (3, 1)


async def test_drive_that_refuses_blocks_is_read_one_by_one(port: Path, opened: OpenLink) -> None:
    shelf = ShelfDevice()
    addresses = [Address(0x2070, s, "UINT16") for s in (1, 2, 3, 4)]  # no such subindex 4
    with serving(port, {1: shelf}) as slave:
        link = cast("RegisterLink", await opened(f"mlink://{port}"))
        link.attach(1, small_profile(("6041:00", "UINT16"), max_registers=16))
        for requests in (5, 4):  # the block and then each; later each at once
            before = slave.requests
            *good, bad = await link.read_many(1, addresses)
            assert good == [b"\0\0"] * 3
            assert isinstance(bad, Rejected)
            assert slave.requests - before == requests


# --- scan ---


async def test_scan_identifies_what_answers(port: Path, opened: OpenLink) -> None:
    plain, foreign = ShelfDevice(), ShelfDevice()
    plain.objects |= {
        (0x1018, 1): b"\x54\x09\0\0",
        (0x1018, 2): b"\x07\0\0\0",
        (0x1018, 3): b"\x02\0\0\0",
        (0x1018, 4): b"\x2a\0\0\0",
        (0x6041, 0): b"\x50\x02",
        (0x2105, 0): b"\x02",
        (0x6061, 0): b"\xff",
    }
    for key in [k for k in foreign.objects if k[0] != 0x6040]:
        del foreign.objects[key]
    said: list[float] = []
    with serving(port, {2: plain, 4: foreign}):
        link = await opened(f"mlink://{port}")
        found = await link.scan(lambda fraction, _text: said.append(fraction), range(1, 6))
    assert found[0] == Found(
        2,
        vendor_id=0x954,
        product_code=7,
        revision=2,
        serial=42,
        state=text("mlink.state", status="0x0250"),
        notes=(text("mlink.note-mode", mode=-1),),
    )
    assert found[1].station == 4
    assert found[1].vendor_id is None
    assert found[1].notes[0].code == "mlink.note-no-identity"
    assert said == sorted(said)
    assert said[-1] == 1.0


async def test_scan_stops_early_and_can_be_cancelled(port: Path, opened: OpenLink) -> None:
    with serving(port, {1: ShelfDevice(), 2: ShelfDevice()}) as slave:
        link = cast("RegisterLink", await opened(f"mlink://{port}"))
        found = await link.scan(lambda *_: None, stop_after=1)
        assert [f.station for f in found] == [1]
        begun = asyncio.Event()
        task = asyncio.create_task(link.scan(lambda *_: begun.set(), range(3, 248)))
        await begun.wait()
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        asked = slave.requests
        assert await link.read(1, STATUS) == b"\0\0"
        assert slave.requests <= asked + 2  # at most the question under way, and this read


async def test_scan_tells_of_damaged_answers(port: Path, opened: OpenLink) -> None:
    said: list[str] = []
    with serving(port, {1: ShelfDevice(), 2: ShelfDevice()}) as slave:
        link = await opened(f"mlink://{port}")
        slave.trouble(Trouble("corrupt"), Trouble("corrupt"))
        found = await link.scan(lambda _fraction, text: said.append(str(text)), (1, 2))
    assert [f.station for f in found] == [2]
    assert said[-1].startswith("1 found; damaged answers at 1: two drives with the same address")


# --- trouble ---


@pytest.mark.parametrize("kind", ["drop", "truncate", "corrupt"])
async def test_reads_are_repeated(port: Path, opened: OpenLink, kind: str) -> None:
    shelf = ShelfDevice()
    shelf.objects[0x6041, 0] = b"\x37\x02"
    with serving(port, {1: shelf}) as slave:
        link = await opened(f"mlink://{port}?timeout_ms=60")
        await link.read(1, STATUS)
        slave.trouble(Trouble(kind), Trouble(kind))  # type: ignore[arg-type]
        assert await link.read(1, STATUS) == b"\x37\x02"
        quality = link.quality(1)
    assert quality.retries == 2
    counted = {
        "drop": quality.timeouts,
        "truncate": quality.framing_errors,
        "corrupt": quality.crc_errors,
    }
    assert counted[kind] == 2


@pytest.mark.parametrize("kind", ["double", "noise"])
async def test_harmless_trouble_costs_nothing_but_a_count(
    port: Path, opened: OpenLink, kind: str
) -> None:
    shelf = ShelfDevice()
    shelf.objects |= {(0x6041, 0): b"\x37\x02", (0x6040, 0): b"\x0f\0"}
    with serving(port, {1: shelf}) as slave:
        link = await opened(f"mlink://{port}")
        await link.read(1, STATUS)
        slave.trouble(Trouble(kind))  # type: ignore[arg-type]
        assert await link.read(1, STATUS) == b"\x37\x02"
        assert await link.read(1, CONTROL) == b"\x0f\0"
        assert link.quality(1).framing_errors == 1
        assert link.quality(1).retries == 0


async def test_writes_are_never_repeated(port: Path, opened: OpenLink) -> None:
    shelf = ShelfDevice()
    with serving(port, {1: shelf}) as slave:
        link = await opened(f"mlink://{port}?timeout_ms=50")
        await link.read(1, CONTROL)
        slave.trouble(Trouble("drop"))
        with pytest.raises(LinkTimeout):
            await link.write(1, CONTROL, b"\x0f\0")
        assert shelf.writes == [(0x6040, 0, b"\x0f\0")]
        assert await link.read(1, CONTROL) == b"\x0f\0"  # and so one finds out


async def test_late_answer_is_not_the_next_value(port: Path, opened: OpenLink) -> None:
    shelf = ShelfDevice()
    shelf.objects |= {(0x6041, 0): b"\x11\x11", (0x6040, 0): b"\x22\x22"}
    with serving(port, {1: shelf}) as slave:
        link = await opened(f"mlink://{port}?timeout_ms=60&retries=0")
        await link.read(1, STATUS)
        slave.trouble(Trouble("delay", seconds=0.09))
        with pytest.raises(LinkTimeout):
            await link.read(1, STATUS)
        assert await link.read(1, CONTROL) == b"\x22\x22"


async def test_mute_drive_fails_fast_and_comes_back(port: Path, opened: OpenLink) -> None:
    shelf = ShelfDevice()
    with serving(port, {1: shelf}) as slave:
        link = await opened(f"mlink://{port}?timeout_ms=30")
        slave.mute = True
        addresses = [Address(0x2070, s, "UINT16") for s in (1, 2, 3)] * 40 + [STATUS, MODE]
        results = await link.read_many(1, addresses)
        assert all(isinstance(r, LinkTimeout) for r in results)
        assert link.quality(1).timeouts <= 5
        assert len({id(r) for r in results}) == len(results)  # each its own: callers fill them in
        slave.mute = False
        assert await link.read(1, STATUS) == b"\0\0"


async def test_one_mute_drive_on_the_line_leaves_the_others_as_they_are(
    port: Path, opened: OpenLink
) -> None:
    with serving(port, {1: ShelfDevice(), 2: ShelfDevice()}) as slave:
        link = await opened(f"mlink://{port}?timeout_ms=30&retries=0")
        slave.mute_stations.add(2)
        with pytest.raises(LinkTimeout):
            await link.read(2, STATUS)
        assert await link.read(1, STATUS) == b"\0\0"
        slave.mute_stations.clear()
        assert await link.read(2, STATUS) == b"\0\0"


async def test_power_cycle(port: Path, opened: OpenLink) -> None:
    shelf = ShelfDevice()
    with serving(port, {1: shelf}):
        link = await opened(f"mlink://{port}?timeout_ms=30&retries=0")
        await link.read(1, STATUS)
        shelf.powered = False
        with pytest.raises(LinkTimeout):
            await link.read(1, STATUS)
        shelf.powered = True
        assert await link.read(1, STATUS) == b"\0\0"
        assert link.quality().connected


async def test_value_that_is_no_8_bit_number_is_a_protocol_error(
    port: Path, opened: OpenLink
) -> None:
    shelf = ShelfDevice()
    shelf.objects[0x6041, 0] = b"\x37\x02"
    with serving(port, {1: shelf}):
        link = await opened(f"mlink://{port}")
        with pytest.raises(ProtocolError, match="not a valid UINT8"):
            await link.read(1, Address(0x6041, 0, "UINT8"))


async def test_quality_before_opening() -> None:
    link = RegisterLink(
        "mlink:///nowhere", line_settings(parse_url("mlink:///nowhere")), MlinkLayout()
    )
    quality: LinkQuality = link.quality()
    assert not quality.connected
    assert quality.state == text("link.no-adapter")
