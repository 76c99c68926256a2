"""Answers of foreign nodes at bad moments: adapter lost, segments without an end, cancelled."""

from __future__ import annotations

import asyncio
import threading
from typing import Any

import can
import pytest

from drivers.canopen.frames import Frame
from drivers.canopen.link import CanopenLink
from drivers.canopen.nodes import NodeWatch, emergency_text
from drivers.canopen.sdo import transfers as sdo
from drivers.canopen.sdo.channel import SdoChannel
from drivers.canopen.sdo.scanning import probe
from drivers.errors import LinkLost, LinkTimeout, ProtocolError


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


def test_a_node_that_is_silent_for_long_is_silent_and_no_defect() -> None:
    """After 262 time-outs (two minutes without power) each access was an internal error.

    It stayed one when the node was back, and a stop was no longer sent.
    """
    sent: list[bytes] = []
    channel = SdoChannel(5, sent.append)
    for _ in range(600):
        with pytest.raises(LinkTimeout):
            channel.read(0x6041, 0, 0.0001)
    sent.clear()
    with pytest.raises(LinkTimeout):
        channel.write(0x6040, 0, b"\x02\0", 0.0001, at_any_rate=True)
    assert sent[-1] == bytes.fromhex("2b40600002000000")

    def back(request: bytes) -> None:
        if request[0] == 0x40:
            missing = request[1:4] != b"\x41\x60\x00"
            data = bytes.fromhex("00000206" if missing else "37020000")
            channel.deliver(bytes([0x80 if missing else 0x4B]) + request[1:4] + data)

    channel._send = back
    assert channel.read(0x6041, 0, 1.0) == b"\x37\x02"


def test_the_request_that_shows_a_node_is_back_is_the_oldest_possible() -> None:
    """Of 255 requests, so that only an answer as old could be taken for its own."""
    requests: list[bytes] = []

    def send(data: bytes) -> None:
        if data[0] == 0x40:
            requests.append(data[1:4])

    channel = SdoChannel(5, send)
    for _ in range(1000):
        with pytest.raises(LinkTimeout):
            channel.read(0x6041, 0, 0.0001)
    last = requests[-600:]
    assert all(last[n] not in last[max(n - 254, 0) : n] for n in range(600))


@pytest.mark.parametrize("end", [Frame(0x85, bytes(8)), Frame(0x705, b"\0")])
def test_a_collision_of_identifiers_is_shown_until_it_is_withdrawn(end: Frame) -> None:
    """Emergency 8150h was shown as the node's state for ever, also after its restart."""
    watch = NodeWatch()
    watch.observe(Frame(0x705, b"\x05"), 0.0)
    watch.observe(Frame(0x85, bytes.fromhex("5081110000000000")), 1.0)
    record = watch.record(5)
    assert record.shown_state == emergency_text(0x8150)
    watch.observe(end, 2.0)
    assert record.conflict is None


def test_a_withdrawn_emergency_is_no_sign_against_two_nodes_with_one_number() -> None:
    watch = NodeWatch()
    watch.stray_answer(5, 0.0)
    assert watch.stray_answer(5, 1.0) is not None
    watch.observe(Frame(0x85, bytes(8)), 2.0)
    assert watch.record(5).conflict is not None


@pytest.mark.parametrize("announced", [None, 4])
def test_more_than_was_announced_or_is_accepted_is_said_with_a_number(
    announced: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without an announced size the text was "more than the  bytes it announced"."""
    monkeypatch.setattr(sdo, "_MAX_BYTES", 5)
    transfer = sdo.upload(0x1008, 0)
    next(transfer)
    begin = b"\x41\x08\x10\0\4\0\0\0" if announced else b"\x40\x08\x10\0\0\0\0\0"
    assert transfer.send(begin).send[0][0] == 0x60
    assert transfer.send(b"\0" + bytes(7)).send == (sdo.abort_frame(b"\x08\x10\0", 0x06070010),)
    with pytest.raises(ProtocolError) as refused:
        transfer.send(b"")
    text = refused.value.text
    en, zh = ("the 4 bytes", "4 字节") if announced else ("5 bytes", "5 字节")
    assert f"more than {en}" in text.words()
    assert zh in text.words("zh")
