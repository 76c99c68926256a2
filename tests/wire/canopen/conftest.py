from __future__ import annotations

import asyncio
import itertools
import time
from collections.abc import AsyncIterator, Callable, Iterator
from pathlib import Path

import can
import pytest

from drivers.canopen.link import CanopenLink
from drivers.virtual.wires.can_wire import CanWire, PythonCanSide
from drivers.virtual.wires.canopen import CanopenNode
from drivers.virtual.wires.slcan import SlcanSide
from tests.wire.canopen.small_device import SmallDevice

_numbers = itertools.count()


class Bench:
    """One small drive as node 5 on a wire, and the URL of its bus."""

    def __init__(self, wire: CanWire, url: str) -> None:
        self.wire = wire
        self.url = url

    @property
    def node(self) -> CanopenNode:
        return self.wire.nodes[0]

    @property
    def device(self) -> SmallDevice:
        assert isinstance(self.node.device, SmallDevice)
        return self.node.device


async def until(condition: Callable[[], object], seconds: float = 3.0) -> None:
    """Wait until ``condition``, at most ``seconds``."""
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "it did not happen in time"
        await asyncio.sleep(0.002)


@pytest.fixture
def bench() -> Iterator[Bench]:
    channel = f"test-{next(_numbers)}"
    node = CanopenNode(SmallDevice(), 5, time.monotonic_ns)
    wire = CanWire(PythonCanSide(can.Bus(interface="virtual", channel=channel)), [node])
    with wire:
        yield Bench(wire, f"canopen://virtual/{channel}?timeout_ms=250")


@pytest.fixture
def slcan_bench(tmp_path: Path) -> Iterator[Bench]:
    path = tmp_path / "ttyCAN"
    node = CanopenNode(SmallDevice(), 5, time.monotonic_ns)
    with CanWire(SlcanSide(path), [node]) as wire:
        yield Bench(wire, f"canopen://slcan/{path}?timeout_ms=250")


@pytest.fixture
async def link(bench: Bench) -> AsyncIterator[CanopenLink]:
    link = CanopenLink(bench.url)
    await link.open()
    yield link
    await link.close()
