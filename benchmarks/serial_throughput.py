"""Parameters per second over a serial line, compared with minimalmodbus and pymodbus.

The same virtual MMS7, in a process of its own, answers all clients one after the other in one
run: at the full speed of the pty, and with the wire time of 115200 baud and of 2.5 Mbaud emulated
(8E1, 11 bits a character). The wire's own limit counts what each client's requests need: question,
answer and 3.5 characters of silence before each question; nothing for drive, adapter or computer.

Run it: ``python -m benchmarks.serial_throughput``.
"""

from __future__ import annotations

import asyncio
import logging
import multiprocessing
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from multiprocessing.synchronize import Event

import minimalmodbus  # type: ignore[import-untyped]
from pymodbus.client import ModbusSerialClient

from drivers.errors import DriveError
from drivers.link import Address
from drivers.mlink.link import MlinkLayout, mlink_link
from drivers.modbus.line_url import line_settings
from drivers.modbus.registers import Place, plan_blocks
from drivers.urls import parse_url
from drivers.virtual.firmware.factory import make_device
from drivers.virtual.wires.modbus import ModbusSlave, ObjectRegisters
from drivers.virtual.wires.pty import PtyWire, WireTime
from profiles.loader import load_profile

BITS_PER_CHAR = 11
SECONDS_EACH = 2.0
#: Speeds: label and emulated baud rate (None: as fast as the pty carries it).
SPEEDS: tuple[tuple[str, int | None], ...] = (
    ("full pty speed", None),
    ("115200 baud", 115_200),
    ("2.5 Mbaud", 2_500_000),
)


@dataclass(frozen=True)
class Rate:
    """One cell of the table. ``limit`` is what the wire allows this client's requests."""

    client: str
    per_second: float
    limit: float | None


def serve(path: str, baudrate: int | None, ready: Event, stop: Event) -> None:
    """The virtual drive's process."""
    first = make_device("mms7")
    for t_ns in (0, 1_000_000):
        first.advance(t_ns)  # compiles the kernel where it is not in the cache yet
    device = make_device("mms7")
    wire_time = WireTime(baudrate, BITS_PER_CHAR) if baudrate else None
    slave = ModbusSlave(PtyWire(path, wire_time), {1: (device, ObjectRegisters(device))})
    slave.start()
    ready.set()
    stop.wait()
    slave.stop()


def readable() -> tuple[list[Address], list[Place]]:
    """Every parameter of the drive that MLink reaches."""
    profile = load_profile("mms7")
    layout = MlinkLayout()
    layout.configure(1, profile)
    addresses: list[Address] = []
    places: list[Place] = []
    for parameter in profile.parameters:
        if parameter.index is None or parameter.access == "wo":
            continue
        address = Address(parameter.index, parameter.subindex or 0, parameter.type)
        try:
            places.append(layout.place(1, address))
        except DriveError:
            continue
        addresses.append(address)
    return addresses, places


def wire_limit(counts: Sequence[int], values: int, baudrate: int | None) -> float | None:
    """Values per second if nothing but the wire took time; ``counts`` are registers per request."""
    if baudrate is None:
        return None
    chars = sum(8 + 5 + 2 * count + 3.5 for count in counts)
    return values / (chars * BITS_PER_CHAR / baudrate)


def measure(read_all: Callable[[], int]) -> float:
    """Values per second of a function that reads many and says how many."""
    read_all()
    begun = time.perf_counter()
    values = 0
    while time.perf_counter() - begun < SECONDS_EACH:
        values += read_all()
    return values / (time.perf_counter() - begun)


async def ours(path: str, baudrate: int | None, addresses: list[Address], blocks: bool) -> float:
    """servodeck's link, with or without blocks."""
    url = f"mlink://{path}?baudrate={baudrate or 5_000_000}"
    link = mlink_link(url, line_settings(parse_url(url)))
    profile = load_profile("mms7")
    spec = profile.link("mlink")
    assert spec is not None
    others = tuple(s for s in profile.links if s.kind != "mlink")
    chosen = spec.model_copy(update={"max_registers": 125 if blocks else None})
    link.attach(1, profile.model_copy(update={"links": (*others, chosen)}))
    await link.open()
    try:
        results = await link.read_many(1, addresses)
        failed = [str(r) for r in results if isinstance(r, DriveError)]
        assert not failed, failed[:3]
        begun = time.perf_counter()
        values = 0
        while time.perf_counter() - begun < SECONDS_EACH:
            results = await link.read_many(1, addresses)
            values += sum(isinstance(r, bytes) for r in results)
        return values / (time.perf_counter() - begun)
    finally:
        await link.close()


def theirs_minimalmodbus(path: str, baudrate: int | None, places: list[Place]) -> float:
    """minimalmodbus, as EZmotion's package uses it: one object a request."""
    instrument = minimalmodbus.Instrument(path, 1)
    instrument.serial.baudrate = baudrate or 4_000_000
    instrument.serial.timeout = 0.5
    some = places[:40] if baudrate else places[:100]

    def read_all() -> int:
        for place in some:
            if place.count == 1:
                instrument.read_register(place.start)
            else:
                instrument.read_long(place.start, byteorder=minimalmodbus.BYTEORDER_LITTLE_SWAP)
        return len(some)

    try:
        return measure(read_all)
    finally:
        instrument.serial.close()


def theirs_pymodbus(path: str, baudrate: int | None, places: list[Place]) -> float:
    """pymodbus' synchronous client: one object a request."""
    client = ModbusSerialClient(path, baudrate=baudrate or 4_000_000, timeout=0.5)
    assert client.connect()
    some = places[:40] if baudrate else places[:100]

    def read_all() -> int:
        for place in some:
            assert not client.read_holding_registers(place.start, count=place.count).isError()
        return len(some)

    try:
        return measure(read_all)
    finally:
        client.close()  # type: ignore[no-untyped-call]


def compare(baudrate: int | None) -> list[Rate]:
    """All clients at one speed of the wire."""
    context = multiprocessing.get_context("spawn")
    addresses, places = readable()
    single = [place.count for place in places]
    grouped = [
        Place(p.start, p.count, p.type, p.word_order, a.index if p.count == 1 else None)
        for p, a in zip(places, addresses, strict=True)
    ]
    blocks = [block.count for block in plan_blocks(grouped, 125, 0)]
    with tempfile.TemporaryDirectory() as folder:
        path = f"{folder}/ttyV0"
        ready, stop = context.Event(), context.Event()
        drive = context.Process(target=serve, args=(path, baudrate, ready, stop))
        drive.start()
        try:
            assert ready.wait(60), "the virtual drive did not start"
            few = [p.count for p in places[:40]]
            return [
                Rate(
                    "servodeck",
                    asyncio.run(ours(path, baudrate, addresses, blocks=False)),
                    wire_limit(single, len(single), baudrate),
                ),
                Rate(
                    "servodeck, blocks",
                    asyncio.run(ours(path, baudrate, addresses, blocks=True)),
                    wire_limit(blocks, len(single), baudrate),
                ),
                Rate(
                    "minimalmodbus",
                    theirs_minimalmodbus(path, baudrate, places),
                    wire_limit(few, len(few), baudrate),
                ),
                Rate(
                    "pymodbus sync",
                    theirs_pymodbus(path, baudrate, places),
                    wire_limit(few, len(few), baudrate),
                ),
            ]
        finally:
            stop.set()
            drive.join(10)


def main() -> None:
    """Measure and print the table."""
    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)
    addresses, _ = readable()
    print(f"{len(addresses)} parameters of a virtual MMS7 over MLink\n")
    print(f"{'wire':<16}{'client':<20}{'params/s':>10}{'wire limit':>12}{'of limit':>10}")
    for label, baudrate in SPEEDS:
        rates = compare(baudrate)
        for rate in rates:
            limit = f"{rate.limit:>12.0f}" if rate.limit else f"{'-':>12}"
            share = f"{rate.per_second / rate.limit:>10.0%}" if rate.limit else f"{'-':>10}"
            print(f"{label:<16}{rate.client:<20}{rate.per_second:>10.0f}{limit}{share}")
        best_other = max(rates[2:], key=lambda rate: rate.per_second)
        factor = rates[0].per_second / best_other.per_second
        print(f"{'':<16}{factor:.1f} × {best_other.client}, the faster of the others\n")


if __name__ == "__main__":
    main()
