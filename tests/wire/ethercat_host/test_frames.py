"""Our own EtherCAT frames against bytes put together by hand (ETG.1000.4 clauses 5.3 and 5.4)."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from drivers.ethercat.wire.frames import ROOM_BYTES, Request, answers, build, bytes_of
from drivers.ethercat.wire.lanes import Lanes
from drivers.ethercat.wire.steps import Pause, Read, Steps, Write

ETHERNET = bytes.fromhex("ffffffffffff 010101010101 88a4")
TWO: list[Request] = [(1, Read(0x0130, 2)), (3, Write(0x0120, b"\x04\x00"))]
SENT = ETHERNET + bytes.fromhex(
    "1c10"  # 28 bytes of datagrams, type 1
    "04 85 0110 3001 0280 0000 0000 0000"  # FPRD 1001h:0130h, 2 bytes, another follows
    "05 85 0310 2001 0200 0000 0400 0000"  # FPWR 1003h:0120h, the last one
)


def back(*changes: tuple[int, int]) -> bytes:
    """The frame as slaves send it back, with bytes of the EtherCAT part changed."""
    frame = bytearray(build(TWO, 0x85))
    frame[6] |= 0x02
    for at, value in changes:
        frame[at] = value
    return bytes(frame)


def test_two_accesses_make_one_frame() -> None:
    frame = build(TWO, 0x85)
    assert frame[: len(SENT)] == SENT
    assert len(frame) == 60, "the shortest frame of Ethernet, without its check sum"
    assert sum(bytes_of(access) for _, access in TWO) == 28


def test_data_and_counters_come_back_in_their_places() -> None:
    answer = back((26, 0x12), (27, 0x00), (28, 1), (42, 1))
    assert answers(TWO, build(TWO, 0x85), answer) == [b"\x12\x00", b""]


def test_nobody_answered() -> None:
    assert answers(TWO, build(TWO, 0x85), back()) == [None, None]
    maybe: list[Request] = [(1, Read(0x1080, 2, may_be_empty=True))]
    sent = build(maybe, 0x85)
    assert answers(maybe, sent, sent) == [b""], "an empty mailbox and no lost frame"


@pytest.mark.parametrize("at", [12, 14, 16, 17, 18, 20, 22, 30, 33, 35, 37])
def test_a_frame_of_something_else_is_no_answer(at: int) -> None:
    """Another index above all, and another command, address or length of any datagram."""
    answer = back((28, 1), (42, 1))
    assert answers(TWO, build(TWO, 0x85), answer) is not None
    other = bytearray(answer)
    other[at] ^= 0x01
    assert answers(TWO, build(TWO, 0x85), other) is None


def test_a_short_frame_is_no_answer() -> None:
    assert answers(TWO, build(TWO, 0x85), back()[:40]) is None


def test_a_frame_that_went_round_for_ever_is_marked_and_still_an_answer() -> None:
    """Bit 14 of the length: the frame has circulated (ETG.1000.4 table 11)."""
    assert answers(TWO, build(TWO, 0x85), back((23, 0x80 | 0x40), (28, 1))) is not None


class Frames:
    """Counts accesses per frame, and answers all of them."""

    def __init__(self) -> None:
        self.sizes: list[int] = []
        self.counts: list[int] = []

    def exchange(self, requests: Sequence[Request]) -> list[bytes | None]:
        self.sizes.append(sum(bytes_of(access) for _, access in requests))
        self.counts.append(len(requests))
        return [bytes(a.size) if isinstance(a, Read) else b"" for _, a in requests]


@pytest.mark.parametrize(("mailbox", "frames"), [(128, 1), (512, 2), (1024, 4), (1486, 4)])
def test_lanes_share_a_frame_as_far_as_it_reaches(mailbox: int, frames: int) -> None:
    wire = Frames()
    lanes = Lanes(wire, lambda: 0.0)

    def job() -> Steps[None]:
        for _ in range(3):
            yield Write(0x1000, bytes(mailbox))
        yield Pause(1.0)

    for station in range(1, 5):
        lanes.submit(station, "mailbox", job(), lambda _r, _e: None)
    while lanes.step():
        pass
    assert sum(wire.counts) == 12
    assert max(wire.sizes) <= ROOM_BYTES
    assert len(wire.counts) == 3 * frames


def test_with_little_time_a_frame_carries_one_access() -> None:
    wire = Frames()
    lanes = Lanes(wire, lambda: 0.0)

    def job() -> Steps[None]:
        yield Write(0x1000, bytes(128))
        yield Write(0x1000, bytes(128))

    for station in range(1, 4):
        lanes.submit(station, "mailbox", job(), lambda _r, _e: None)
    while lanes.step(10):
        pass
    assert sum(wire.counts) == 6
    assert max(wire.counts) == 1
