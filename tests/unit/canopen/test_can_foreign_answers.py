"""Answers of foreign nodes at bad moments: adapter lost, segments without an end, cancelled."""

from __future__ import annotations

import asyncio
import threading
from typing import Any

import can
import pytest

from drivers.canopen import sdo
from drivers.canopen.channel import SdoChannel
from drivers.canopen.link import CanopenLink
from drivers.canopen.scanning import probe
from drivers.errors import LinkLost, ProtocolError


def test_a_lost_adapter_leaves_no_node_occupied() -> None:
    """A node may answer 1000h in segments, which are aborted; the adapter was gone by then."""
    lost = False
    channels: list[SdoChannel] = []

    def send(node: int, data: bytes) -> None:
        nonlocal lost
        if lost:
            raise LinkLost("canopen.bus-lost")
        if node == 2:
            lost = True
            channels[0].deliver(bytes.fromhex("4100100004000000"))

    channels += [SdoChannel(n, lambda data, n=n: send(n, data)) for n in (1, 2)]  # type: ignore[misc]
    assert list(probe(channels)) == [1]
    assert [channel._turn.locked() for channel in channels] == [False, False]


def test_segments_without_data_and_without_an_end_are_given_up() -> None:
    """A node that keeps sending empty segments held its transfer, and every later one, for ever."""
    transfer = sdo.upload(0x1008, 0)
    next(transfer)
    transfer.send(bytes.fromhex("4008100000000000"))

    def empty_segments() -> None:
        for turn in range(1000):
            transfer.send(bytes([0x0E | (turn & 1) << 4]) + bytes(7))

    with pytest.raises(ProtocolError):
        empty_segments()


def test_a_single_empty_segment_at_the_end_is_none_too_many() -> None:
    transfer = sdo.upload(0x1008, 0)
    next(transfer)
    transfer.send(bytes.fromhex("4008100000000000"))
    transfer.send(b"\0abcdefg")
    with pytest.raises(StopIteration) as ended:
        transfer.send(b"\x1f" + bytes(7))
    assert ended.value.value == b"abcdefg"


async def test_an_opening_that_is_cancelled_leaves_no_adapter_open() -> None:
    begun, go_on = threading.Event(), threading.Event()
    closed: list[bool] = []

    class Adapter:
        def recv(self, timeout: float) -> None:
            threading.Event().wait(timeout)

        def shutdown(self) -> None:
            closed.append(True)

    def opener(_url: Any) -> can.BusABC:
        begun.set()
        go_on.wait(5)
        return Adapter()  # type: ignore[return-value]

    link = CanopenLink("canopen://virtual/can0", opener)
    opening = asyncio.ensure_future(link.open())
    await asyncio.to_thread(begun.wait, 5)
    opening.cancel()
    await asyncio.sleep(0)
    go_on.set()
    with pytest.raises(asyncio.CancelledError):
        await opening
    assert closed == [True]
    await link.close()
