"""Addressing and working counters (ETG.1000.4 clause 5.4)."""

from __future__ import annotations

import struct

import pytest

from .frames import (
    APRD,
    APRW,
    APWR,
    ARMW,
    BRD,
    BRW,
    BWR,
    FPRD,
    FPRW,
    FPWR,
    FRMW,
    Wire,
    frame,
    parse,
)


def test_broadcast_read_counts_slaves_increments_position_and_ors_data() -> None:
    wire = Wire(4)
    for position in range(4):
        wire.one(APWR, -position & 0xFFFF, 0x0010, struct.pack("<H", 1 << position))
    answer = wire.one(BRD, 0, 0x0010, b"\0\0")
    assert (answer.wkc, answer.adp, answer.data) == (4, 4, b"\x0f\x00")


def test_broadcast_read_also_ors_what_the_master_sent() -> None:
    wire = Wire(1)
    wire.one(APWR, 0, 0x0010, b"\x01\x00")
    assert wire.one(BRD, 0, 0x0010, b"\x80\x00").data == b"\x81\x00"


def test_auto_increment_reaches_the_slave_whose_position_becomes_zero() -> None:
    wire = Wire(3)
    answer = wire.one(APWR, 0xFFFF, 0x0010, b"\x34\x12")
    assert (answer.wkc, answer.adp) == (1, 2)
    assert [slave.controller.station for slave in wire.slaves] == [0, 0x1234, 0]
    answer = wire.one(APRD, 0xFFFE, 0x0010, b"\0\0")
    assert (answer.wkc, answer.adp, answer.data) == (1, 1, b"\0\0")


def test_a_station_that_is_not_there_leaves_the_datagram_alone() -> None:
    wire = Wire(2)
    answer = wire.one(FPRD, 0x2222, 0x0010, b"\xaa\xbb")
    assert (answer.wkc, answer.adp, answer.data) == (0, 0x2222, b"\xaa\xbb")


def test_configured_address_is_not_incremented() -> None:
    wire = Wire(2)
    wire.number()
    answer = wire.one(FPRD, 0x1002, 0x0010, b"\0\0")
    assert (answer.wkc, answer.adp, answer.data) == (1, 0x1002, b"\x02\x10")


def test_alias_answers_only_while_the_master_has_switched_it_on() -> None:
    wire = Wire(1)
    wire.number()
    wire.slaves[0].controller.memory[0x12:0x14] = b"\x07\x00"
    assert wire.one(FPRD, 7, 0x0010, b"\0\0").wkc == 0
    wire.one(FPWR, 0x1001, 0x0103, b"\x01")
    assert wire.one(FPRD, 7, 0x0010, b"\0\0").wkc == 1


@pytest.mark.parametrize(("command", "adp"), [(APRW, 0), (FPRW, 0x1001), (BRW, 0)])
def test_read_write_counts_one_for_reading_and_two_for_writing(command: int, adp: int) -> None:
    wire = Wire(1)
    wire.number()
    wire.one(FPWR, 0x1001, 0x0020, b"\x01\x00")
    answer = wire.one(command, adp, 0x0020, b"\x40\x00")
    assert answer.wkc == 3
    # The old value comes back (with BRW ORed), the sent one is stored.
    assert answer.data == (b"\x41\x00" if command == BRW else b"\x01\x00")
    assert wire.read(0x0020, 2).data == b"\x40\x00"


@pytest.mark.parametrize(("command", "adp"), [(FRMW, 0x1002), (ARMW, 0xFFFF)])
def test_read_multiple_write_reads_one_and_writes_all_others(command: int, adp: int) -> None:
    wire = Wire(3)
    wire.number()
    for n, value in enumerate((b"\x01", b"\x02", b"\x03")):
        wire.one(FPWR, 0x1001 + n, 0x0020, value)
    answer = wire.one(command, adp, 0x0020, b"\x7f")
    assert answer.wkc == 3
    assert answer.data == b"\x02"
    # The first slave lies before the source and got what the master sent.
    assert [wire.read(0x0020, 1, 0x1001 + n).data for n in range(3)] == [b"\x7f", b"\x02", b"\x02"]
    assert answer.adp == (0x1002 if command == FRMW else 2)


def test_several_datagrams_in_one_frame_are_executed_in_order() -> None:
    wire = Wire(1)
    wire.number()
    answers = wire.send(
        (FPWR, 0x1001, 0x0020, b"\x11\x22"), (FPRD, 0x1001, 0x0020, b"\0\0"), (BRD, 0, 0, b"\0")
    )
    assert [a.wkc for a in answers] == [1, 1, 1]
    assert answers[1].data == b"\x11\x22"


def test_the_reply_has_the_same_length_and_a_locally_administered_source() -> None:
    wire = Wire(1)
    sent = frame((BRD, 0, 0x0130, b"\0\0"))
    got = wire.segment.process_frame(sent)
    assert got is not None
    assert len(got) == len(sent)
    assert got[6] == sent[6] | 0x02
    assert got[:6] + got[7:16] == sent[:6] + sent[7:16]


def test_other_protocols_and_runts_are_not_answered() -> None:
    wire = Wire(1)
    assert wire.segment.process_frame(b"\xff" * 12 + b"\x08\x00" + bytes(46)) is None
    assert wire.segment.process_frame(b"\xff" * 12 + b"\x88") is None


def test_a_datagram_that_is_cut_off_is_left_alone() -> None:
    wire = Wire(1)
    good = frame((BRD, 0, 0, b"\0"))
    broken = bytearray(good)
    struct.pack_into("<H", broken, 16 + 6, 700)  # says 700 bytes, 60 are there
    got = wire.segment.process_frame(bytes(broken))
    assert got is not None
    assert got[16:] == bytes(broken)[16:]


def test_unknown_commands_and_nop_do_nothing() -> None:
    wire = Wire(1)
    for command in (0, 15, 77):
        answer = wire.one(command, 0, 0x0010, b"\x55")
        assert (answer.wkc, answer.adp, answer.data) == (0, 0, b"\x55")


def test_read_only_registers_keep_their_value() -> None:
    wire = Wire(1)
    before = wire.one(BRD, 0, 0x0000, bytes(10)).data
    wire.one(BWR, 0, 0x0000, b"\xff" * 10)
    assert wire.one(BRD, 0, 0x0000, bytes(10)).data == before
    # 4 FMMUs, 4 sync managers, 8 KB, ports 0 and 1 MII, distributed clocks 64 bits wide.
    assert before[4:9] == bytes([4, 4, 8, 0x0F, 0x0C])


def test_working_counter_wraps_at_16_bits() -> None:
    wire = Wire(1)
    raw = bytearray(frame((BRD, 0, 0, b"\0")))
    raw[27:29] = b"\xff\xff"
    got = wire.segment.process_frame(bytes(raw))
    assert got is not None
    assert parse(got)[0].wkc == 0
