"""The adapter: missing, in use, pulled and plugged in again; turns on the bus; two threads."""

from __future__ import annotations

import asyncio
import threading
import time
from pathlib import Path
from typing import cast

import pytest
import serial

from drivers.errors import LinkLost, OutOfRange
from drivers.link import Address, LinkEvent
from drivers.mlink.bus import BUS
from drivers.modbus.line import Line
from drivers.modbus.link import RegisterLink, modbus_link
from drivers.modbus.port import LineSettings, SerialPort
from drivers.modbus.search import search_line_settings
from drivers.urls import link_for, parse_url
from drivers.virtual.wires.modbus import Trouble
from drivers.virtual.wires.pty import PtyWire, WireTime
from tests.support.machine import OwnTime

from .conftest import OpenLink
from .shelf import ShelfDevice, serving

STATUS = Address(0x6041, 0, "UINT16")
CONTROL = Address(0x6040, 0, "UINT16")


async def until(condition, deadline_s: float = 60.0) -> None:  # type: ignore[no-untyped-def]
    end = time.monotonic() + deadline_s
    while not condition():
        assert time.monotonic() < end, "did not happen in time"
        await asyncio.sleep(0.01)


async def test_missing_port_names_those_that_exist(tmp_path: Path) -> None:
    link = link_for(f"mlink://{tmp_path}/nothing")
    with pytest.raises(LinkLost, match="there is no serial port") as caught:
        await link.open()
    assert "ports found now" in (caught.value.remedy or "")
    await link.close()


async def test_port_in_use(port: Path, opened: OpenLink) -> None:
    with serving(port, {1: ShelfDevice()}):
        await opened(f"mlink://{port}")
        with pytest.raises(LinkLost, match="in use by another program"):
            await link_for(f"mlink://{port}").open()


async def test_impossible_line_setting(port: Path) -> None:
    with serving(port, {1: ShelfDevice()}), pytest.raises(OutOfRange, match="cannot be set to"):
        await modbus_link("modbus://x", LineSettings(str(port), baudrate=-1)).open()


async def test_closed_link_says_so(port: Path) -> None:
    link = link_for(f"mlink://{port}")
    with pytest.raises(LinkLost, match="not open"):
        await link.read(1, STATUS)
    await link.close()


async def test_cable_pulled_and_put_back(port: Path, opened: OpenLink) -> None:
    with serving(port, {1: ShelfDevice()}) as slave:
        link = await opened(f"mlink://{port}")
        events: list[LinkEvent] = []
        stop_listening = link.listen(events.append)
        await link.read(1, STATUS)
        slave.wire.pull()
        assert not slave.wire.is_open
        with pytest.raises(LinkLost, match="disappeared"):
            await link.read(1, STATUS)
        results = await link.read_many(1, [STATUS, CONTROL])
        assert all(isinstance(r, LinkLost) for r in results)
        await until(lambda: [e.kind for e in events] == ["lost"])
        assert not link.quality().connected
        slave.wire.heal()
        await until(lambda: [e.kind for e in events] == ["lost", "back"])
        assert await link.read(1, STATUS) == b"\0\0"
        assert link.quality().connected
        stop_listening()


async def test_cable_pulled_in_the_middle_of_a_long_read(port: Path, opened: OpenLink) -> None:
    shelf = ShelfDevice()
    with serving(port, {1: shelf}) as slave:
        link = await opened(f"mlink://{port}")
        addresses = [Address(0x2070, s, "UINT16") for s in (1, 2, 3)] + [STATUS, CONTROL]
        reads = 0

        def pull_at_third() -> None:
            nonlocal reads
            reads += 1
            if reads == 3:
                threading.Thread(target=slave.wire.pull).start()

        shelf.hook = pull_at_third
        slave.trouble(Trouble("delay"), Trouble("delay"), Trouble("delay", seconds=0.1))
        results = await link.read_many(1, addresses)
    assert sum(isinstance(r, bytes) for r in results) == 2
    assert sum(isinstance(r, LinkLost) for r in results) == 3


async def test_client_may_come_and_go(port: Path) -> None:
    with serving(port, {1: ShelfDevice()}):
        for _ in range(3):
            link = link_for(f"mlink://{port}")
            await link.open()
            assert await link.read(1, STATUS) == b"\0\0"
            await link.close()
            await link.close()


async def test_write_overtakes_waiting_reads(port: Path, opened: OpenLink) -> None:
    """A stop must not wait for two thousand parameters that somebody reads."""
    shelf = ShelfDevice()
    accesses = 0

    def slowly() -> None:
        nonlocal accesses
        accesses += 1
        time.sleep(0.004)

    with serving(port, {1: shelf}):
        link = await opened(f"mlink://{port}")
        await link.read(1, STATUS)
        shelf.hook = slowly
        addresses = [Address(0x2070, s, "UINT16") for s in (1, 2, 3)] + [STATUS, CONTROL]
        readers = [asyncio.create_task(link.read_many(1, addresses)) for _ in range(5)]
        await asyncio.sleep(0)
        await link.write(1, CONTROL, b"\x06\0")
        before = accesses
        await asyncio.gather(*readers)
    # A turn is two of these slow reads; five readers' turns would be ten.
    assert before <= 6
    assert accesses == 26


async def test_mute_station_holds_up_a_write_to_another_for_one_time_out_at_most(
    port: Path, opened: OpenLink
) -> None:
    with serving(port, {2: ShelfDevice()}):
        link = await opened(f"mlink://{port}?timeout_ms=100&retries=5")
        await link.read(2, STATUS)
        reader = asyncio.create_task(link.read(1, STATUS))
        await asyncio.sleep(0.02)
        with OwnTime() as took:
            await link.write(2, CONTROL, b"\x06\0")
        reader.cancel()
    assert took.s < 0.3  # five repetitions would be half a second


async def test_two_tasks_and_two_threads_get_their_own_answers(
    port: Path, opened: OpenLink
) -> None:
    shelves = {1: ShelfDevice(), 2: ShelfDevice()}
    for station, shelf in shelves.items():
        for subindex in (1, 2, 3):
            shelf.objects[0x2070, subindex] = bytes((subindex, station))
    with serving(port, shelves):
        link = await opened(f"mlink://{port}")
        loop = asyncio.get_running_loop()
        wrong: list[object] = []

        async def ask(station: int) -> None:
            for turn in range(60):
                subindex = 1 + turn % 3
                data = await link.read(station, Address(0x2070, subindex, "UINT16"))
                if data != bytes((subindex, station)):
                    wrong.append((station, subindex, data))

        def from_a_thread(station: int) -> None:
            asyncio.run_coroutine_threadsafe(ask(station), loop).result(20)

        await asyncio.gather(ask(1), ask(2), *(asyncio.to_thread(from_a_thread, s) for s in (1, 2)))
        assert wrong == []
        assert link.quality(1).transactions == link.quality(2).transactions == 120


async def test_echoing_adapter(port: Path, opened: OpenLink) -> None:
    shelf = ShelfDevice()
    with serving(port, {1: shelf}) as slave:
        slave.echo = True
        link = await opened(f"mlink://{port}?timeout_ms=40")
        await link.write(1, CONTROL, b"\x0f\0")
        assert await link.read(1, CONTROL) == b"\x0f\0"
        assert link.quality().details["echo"] == "yes"
        slave.mute = True
        with pytest.raises(Exception, match="only the adapter's echo"):
            await link.write(1, CONTROL, b"\x06\0")


async def test_search_of_line_settings_finds_the_rate_the_drive_has(port: Path) -> None:
    said: list[str] = []
    with serving(port, {1: ShelfDevice()}, client_baudrate=460_800):
        found = await search_line_settings(
            parse_url(f"mlink://{port}"),
            BUS,
            lambda _fraction, text: said.append(text),
            baudrates=(2_500_000, 115_200, 460_800, 9600),
            parities=("N",),
        )
    assert found is not None
    assert found.url.split("?")[1].split("&")[0] == "baudrate=460800"
    assert [f.station for f in found.drives] == [1]
    assert len(said) == 4  # three settings tried and the result: 9600 was not needed


async def test_search_that_finds_nothing(port: Path) -> None:
    with serving(port, {7: ShelfDevice()}):
        nothing = await search_line_settings(
            parse_url(f"mlink://{port}"),
            BUS,
            lambda *_: None,
            baudrates=(9600,),
            parities=("N",),
            stations=(1, 2),
        )
    assert nothing is None


# --- the wire ---


def test_wire_refuses_to_replace_a_file(port: Path) -> None:
    port.write_text("precious")
    with pytest.raises(LinkLost, match="not a virtual wire"):
        PtyWire(port).open()
    assert port.read_text() == "precious"


def test_wire_replaces_the_link_of_a_killed_predecessor(port: Path) -> None:
    port.symlink_to("/dev/pts/999999")
    wire = PtyWire(port)
    wire.open()
    assert port.exists()
    wire.close()
    assert not port.is_symlink()


@pytest.mark.parametrize("baudrate", [115_200, 2_500_000])
async def test_emulated_wire_is_never_faster_than_the_real_one(
    port: Path, opened: OpenLink, baudrate: int
) -> None:
    with serving(port, {1: ShelfDevice()}, wire_time=WireTime(baudrate, 11)):
        link = cast("RegisterLink", await opened(f"mlink://{port}?baudrate={baudrate}"))
        await link.read(1, STATUS)
        begun = time.monotonic()
        for _ in range(20):
            await link.read(1, STATUS)
        took = time.monotonic() - begun
    # A request of 8 and an answer of 7 characters of 11 bits.
    assert took / 20 >= 0.9 * 15 * 11 / baudrate


def test_port_without_file_descriptor(port: Path) -> None:
    """What Windows uses, here on the same pty."""
    with serving(port, {1: ShelfDevice()}):
        raw = SerialPort(serial.Serial(str(port), timeout=0), str(port))
        line = Line(LineSettings(str(port)), opener=lambda _: raw)
        line.open()
        assert line.read(1, 0x6410, 1) == b"\0\0"
        line.close()
