"""SYNC jitter and completeness at 1 kHz: one node, two inputs and one output PDO.

    python benchmarks/canopen_sync.py [--seconds 5] [--json FILE]

Prints how late the SYNC is sent against its absolute deadline (µs) and how many samples are
incomplete. Client and virtual node share one process here, so the figures are pessimistic.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import sys
import time
from pathlib import Path

import can

sys.path.insert(0, str(Path(__file__).parents[1]))

from drivers.canopen.link import CanopenLink
from drivers.link import Address, CyclicSignal, ScopeBlock
from drivers.virtual.wires.can_wire import CanWire, PythonCanSide
from drivers.virtual.wires.canopen import CanopenNode
from tests.wire.canopen.small_device import SmallDevice

INPUTS = [
    CyclicSignal(5, Address(0x6041, 0, "UINT16"), "status"),
    CyclicSignal(5, Address(0x6064, 0, "INT32"), "position"),
    CyclicSignal(5, Address(0x606C, 0, "INT32"), "speed"),
]
OUTPUTS = [CyclicSignal(5, Address(0x607A, 0, "INT32"), "target")]


async def measure(seconds: float) -> dict[str, float | int | str]:
    bus = can.Bus(interface="virtual", channel="benchmark-sync")
    node = CanopenNode(SmallDevice(), 5, time.monotonic_ns)
    with CanWire(PythonCanSide(bus), [node]):
        link = CanopenLink("canopen://virtual/benchmark-sync")
        await link.open()
        assert link.cyclic is not None
        blocks: list[ScopeBlock] = []
        link.cyclic.blocks(blocks.append)
        await link.cyclic.configure(INPUTS, OUTPUTS, 0.001)
        await link.cyclic.start()
        await asyncio.sleep(seconds)
        details = dict(link.quality().details)
        await link.cyclic.stop()
        await link.close()
    details["samples"] = sum(len(b.samples) for b in blocks)
    details["dropped"] = sum(b.dropped for b in blocks)
    return details


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    details = asyncio.run(measure(options.seconds))
    for name, value in details.items():
        print(f"{name:28} {value}")
    if options.json:
        options.json.write_text(json.dumps(details, indent=1))


if __name__ == "__main__":
    main()
