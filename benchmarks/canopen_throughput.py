"""SDO throughput of the CANopen link against canopen's own client, same node, same wire.

    python benchmarks/canopen_throughput.py [--json FILE]

Both read the same 16-bit object of the same virtual node, first over python-can's in-process bus,
then over slcan on a pty. Figures are reads per second, the median of five runs.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import can
import canopen

sys.path.insert(0, str(Path(__file__).parents[1]))

from drivers.canopen.link import CanopenLink
from drivers.link import Address
from drivers.virtual.wires.can_wire import CanWire, ClientSide, PythonCanSide
from drivers.virtual.wires.canopen import CanopenNode
from drivers.virtual.wires.slcan import SlcanSide
from tests.wire.canopen.small_device import SmallDevice

STATUS = Address(0x6041, 0, "UINT16")
READS = 1000
RUNS = 5


def per_second(run: Callable[[], None]) -> float:
    rates = []
    for _ in range(RUNS):
        started = time.perf_counter()
        run()
        rates.append(READS / (time.perf_counter() - started))
    return statistics.median(rates)


def ours(url: str) -> dict[str, float]:
    async def measure() -> dict[str, float]:
        link = CanopenLink(url)
        await link.open()
        await link.read(5, STATUS)

        async def batch() -> None:
            assert len(await link.read_many(5, [STATUS] * READS)) == READS

        async def one_by_one() -> None:
            for _ in range(READS):
                await link.read(5, STATUS)

        figures: dict[str, list[float]] = {"read_many": [], "read": []}
        for name, work in (("read_many", batch), ("read", one_by_one)):
            for _ in range(RUNS):
                started = time.perf_counter()
                await work()
                figures[name].append(READS / (time.perf_counter() - started))
        await link.close()
        return {name: statistics.median(rates) for name, rates in figures.items()}

    return asyncio.run(measure())


def theirs(interface: str, channel: str) -> float:
    network = canopen.Network()
    network.NOTIFIER_CYCLE = 0.02
    extra = {"sleep_after_open": 0} if interface == "slcan" else {}
    network.connect(interface=interface, channel=channel, bitrate=1_000_000, **extra)
    node = network.add_node(canopen.RemoteNode(5, canopen.ObjectDictionary()))

    def run() -> None:
        for _ in range(READS):
            node.sdo.upload(0x6041, 0)

    run()
    rate = per_second(run)
    network.disconnect()
    return rate


def compare(interface: str, channel: str, side: ClientSide) -> dict[str, float]:
    with CanWire(side, [CanopenNode(SmallDevice(), 5, time.monotonic_ns)]):
        figures = {"canopen RemoteNode": theirs(interface, channel)}
        figures |= {
            f"servodeck {k}": v for k, v in ours(f"canopen://{interface}/{channel}").items()
        }
    return figures


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    bus = can.Bus(interface="virtual", channel="benchmark")
    results = {"virtual": compare("virtual", "benchmark", PythonCanSide(bus))}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "tty"
        results["slcan"] = compare("slcan", str(path), SlcanSide(path))
    for wire, figures in results.items():
        for name, rate in figures.items():
            print(f"{wire:8} {name:22} {rate:8.0f} reads/s")
    if options.json:
        options.json.write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
