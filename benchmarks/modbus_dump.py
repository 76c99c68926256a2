"""A full DS_C dump over Modbus RTU: neighbouring registers in one request against one by one.

A virtual DS_C, in a process of its own, answers at an emulated 115200 baud (8N1, 10 bits a
character). The dump is `Drive.read_many` of every register that can be read, as the page and the
command line do it. The aim is four times the speed of one request for each value; pymodbus'
synchronous client, one request for each value, is shown next to them.

Run it: ``python -m benchmarks modbus_dump``.
"""

from __future__ import annotations

import asyncio
import logging
import multiprocessing
import statistics
import tempfile
import time
from multiprocessing.synchronize import Event

from pymodbus.client import ModbusSerialClient

from backend.axes.drive.drive import Drive
from backend.axes.drive.ports import Port
from drivers.modbus.line_url import line_settings
from drivers.modbus.link import modbus_link
from drivers.modbus.registers import words_of
from drivers.urls import parse_url
from drivers.virtual.firmware.factory import make_device
from drivers.virtual.wires.modbus import ModbusSlave, TableRegisters
from drivers.virtual.wires.pty import PtyWire, WireTime
from profiles.loader import load_profile
from profiles.schema import Profile

BAUDRATE = 115_200
BITS_PER_CHAR = 10
RUNS = 5
AIM = 4.0


def serve(path: str, ready: Event, stop: Event) -> None:
    """The virtual drive's process."""
    first = make_device("ds_c")
    for t_ns in (0, 1_000_000):
        first.advance(t_ns)  # compiles the kernel where it is not in the cache yet
    device = make_device("ds_c")
    wire = PtyWire(path, WireTime(BAUDRATE, BITS_PER_CHAR))
    slave = ModbusSlave(wire, {1: (device, TableRegisters(device))})
    slave.start()
    ready.set()
    stop.wait()
    slave.stop()


def without_blocks(profile: Profile) -> Profile:
    """The profile as it would be if one request could read one value only."""
    links = tuple(
        spec.model_copy(update={"max_registers": None, "max_gap": None})
        if spec.kind == "modbus"
        else spec
        for spec in profile.links
    )
    return profile.model_copy(update={"links": links})


async def dump(path: str, profile: Profile) -> tuple[float, int]:
    """Seconds of one dump (median) and the number of values in it."""
    url = f"modbus://{path}?baudrate={BAUDRATE}&parity=N"
    link = modbus_link(url, line_settings(parse_url(url)))
    link.attach(1, profile)
    await link.open()
    try:
        drive = Drive("z", "Z", profile, [Port(link, 1, profile.link("modbus"))])
        keys = [
            p.key for p in profile.parameters if p.modbus_register is not None and p.access != "wo"
        ]
        seconds = []
        for _ in range(RUNS):
            begun = time.perf_counter()
            readings = await drive.read_many(keys)
            seconds.append(time.perf_counter() - begun)
            failed = [r.error for r in readings.values() if r.error]
            assert not failed, failed[:3]
        return statistics.median(seconds), len(keys)
    finally:
        await link.close()


def theirs(path: str, profile: Profile) -> float:
    """Seconds of one dump (median) by pymodbus' synchronous client."""
    client = ModbusSerialClient(path, baudrate=BAUDRATE, timeout=0.5)
    assert client.connect()
    places = [
        (p.modbus_register, words_of(p.type))
        for p in profile.parameters
        if p.modbus_register is not None and p.access != "wo"
    ]
    try:
        seconds = []
        for _ in range(RUNS):
            begun = time.perf_counter()
            for start, count in places:
                assert not client.read_holding_registers(start, count=count).isError()
            seconds.append(time.perf_counter() - begun)
        return statistics.median(seconds)
    finally:
        client.close()  # type: ignore[no-untyped-call]


def main() -> None:
    """Measure and print the table."""
    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)
    context = multiprocessing.get_context("spawn")
    profile = load_profile("ds_c")
    with tempfile.TemporaryDirectory() as folder:
        path = f"{folder}/ttyV0"
        ready, stop = context.Event(), context.Event()
        drive = context.Process(target=serve, args=(path, ready, stop))
        drive.start()
        try:
            assert ready.wait(60), "the virtual drive did not start"
            single, count = asyncio.run(dump(path, without_blocks(profile)))
            merged, _ = asyncio.run(dump(path, profile))
            other = theirs(path, profile)
        finally:
            stop.set()
            drive.join(10)
    print(f"{count} values of a virtual DS_C at an emulated {BAUDRATE} baud, 8N1\n")
    for client, seconds in (
        ("servodeck, merged", merged),
        ("servodeck, one by one", single),
        ("pymodbus sync, one by one", other),
    ):
        print(f"{client:<28}{seconds * 1e3:8.0f} ms{count / seconds:8.0f} values/s")
    factor = single / merged
    verdict = "reached" if factor >= AIM else "missed"
    print(f"\nmerging: {factor:.1f} times one by one (aim {AIM:g}: {verdict})")


if __name__ == "__main__":
    main()
