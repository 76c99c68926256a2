"""Whatever a master sends, the segment lives on and answers frames of the same length."""

from __future__ import annotations

import random
import struct

import pytest

from .frames import IN, LRD, OP, PREOP, SAFEOP, Wire, fmmu, frame
from .test_process_data import CYCLE, dc_wire, start_sync0

PLACES = (
    0x0000, 0x0010, 0x0100, 0x0110, 0x0120, 0x0130, 0x0300, 0x0400, 0x0420, 0x0500, 0x0502,
    0x0508, 0x0600, 0x0610, 0x0800, 0x0808, 0x080D, 0x0810, 0x0818, 0x0900, 0x0910, 0x0920,
    0x0980, 0x0990, 0x09A0, 0x0FFE, 0x1000, 0x1100, 0x1200, 0x1500, 0xFFF8,
)  # fmt: skip


@pytest.mark.parametrize("seed", range(10))
def test_random_datagrams(seed: int) -> None:
    source = random.Random(seed)
    wire = Wire(3)
    wire.to_op()
    for _ in range(400):
        parts = []
        for _ in range(source.randint(1, 4)):
            command = source.randint(0, 15)
            place = source.choice(PLACES)
            adp = source.choice((0, 0xFFFF, 0x1001, 0x1002, 0x1003))
            data = source.randbytes(source.choice((1, 2, 4, 6, 8, 16, 64, 256)))
            parts.append((command, adp, place, data))
        sent = frame(*parts)
        got = wire.segment.process_frame(sent)
        assert got is not None
        assert len(got) == len(sent)
        wire.clock.time_ns += source.choice((1, 1000, 1_000_000, 150_000_000))


@pytest.mark.parametrize("seed", range(4))
def test_random_mailbox_messages(seed: int) -> None:
    source = random.Random(seed)
    wire = Wire(foe=True)
    wire.to_preop()
    for _ in range(500):
        kind = source.choice((0, 2, 3, 3, 3, 3, 4, 15))
        payload = bytearray(source.randbytes(source.randint(0, 250)))
        if kind == 3 and len(payload) > 2:
            payload[1] = source.choice((0x20, 0x20, 0x80, 0x10))
            index = source.choice((0x1000, 0x1603, 0x1C12, 0x2001, 0x2002, 0x6040))
            payload[3:6] = struct.pack("<HB", index, source.randint(0, 4))
        assert wire.post(bytes(payload), kind=kind, counter=0).wkc == 1
        while wire.read(0x1100, 256).wkc:
            pass


def test_cut_off_and_random_bytes() -> None:
    source = random.Random(1)
    wire = Wire(2)
    head = b"\xff" * 6 + b"\x01" * 6 + b"\x88\xa4"
    for length in range(120):
        wire.segment.process_frame(head + source.randbytes(length))


def test_a_cycle_of_nothing_does_not_stall_the_segment() -> None:
    wire = Wire()
    wire.to_preop()
    wire.set_process_data()
    start_sync0(wire, 10_000_000, 1)
    assert wire.request(SAFEOP) == (PREOP | 0x10, 0x0035)


def test_changing_sync0_to_nonsense_in_op_drops_the_slave() -> None:
    wire = dc_wire(CYCLE)
    assert wire.state() == (OP, 0)
    start_sync0(wire, 20_000_000, 1)
    assert wire.state() == (PREOP | 0x10, 0x0035)
    assert len(wire.device.lost) == 1


def test_a_bitwise_mapping_far_longer_than_the_datagram_is_quick() -> None:
    wire = Wire()
    wire.to_safeop()
    raw = struct.pack("<IHBBHBBB3x", 0, 65535, 1, 6, IN, 1, 1, 1)
    wire.write(0x0620, raw)
    assert wire.one(LRD, 0x1000, 0, b"\0\0").wkc == 1
    wire.write(0x0620, fmmu(0, 65535, 0xFFF0, write=False))
    assert wire.one(LRD, 0x1000, 0, bytes(4)).wkc in (0, 1)
