"""The mailbox: full and empty boxes, repeat, counters, errors (ETG.1000.4 clauses 6.7 and 7)."""

from __future__ import annotations

import struct

import pytest

from .frames import FPRD, INIT, MBX_IN, MBX_OUT, MBX_SIZE, PREOP, Wire

UPLOAD_DEVICE_TYPE = struct.pack("<HBHBI", 0x2000, 0x40, 0x1000, 0, 0)
FULL = 0x08


@pytest.fixture
def wire() -> Wire:
    made = Wire()
    made.to_preop()
    return made


def test_reading_an_empty_mailbox_counts_nothing_and_changes_nothing(wire: Wire) -> None:
    answer = wire.one(FPRD, 0x1001, MBX_IN, b"\xa5" * MBX_SIZE)
    assert (answer.wkc, answer.data) == (0, b"\xa5" * MBX_SIZE)
    assert wire.value(0x080D, 1) & FULL == 0


def test_writing_a_full_mailbox_counts_nothing(wire: Wire) -> None:
    wire.slaves[0].mailbox.delay_ns = 1_000_000
    assert wire.post(UPLOAD_DEVICE_TYPE).wkc == 1  # taken by the slave at once
    assert wire.value(0x0805, 1) & FULL == 0
    assert wire.post(UPLOAD_DEVICE_TYPE).wkc == 1  # waits in the box
    assert wire.value(0x0805, 1) & FULL == FULL
    assert wire.post(UPLOAD_DEVICE_TYPE).wkc == 0


def test_the_state_changes_on_the_last_byte_only(wire: Wire) -> None:
    message = struct.pack("<HHBB", 10, 0, 0, 0x13) + UPLOAD_DEVICE_TYPE
    message = message.ljust(MBX_SIZE, b"\0")
    assert wire.write(MBX_OUT, message[:100]).wkc == 1
    assert wire.read(MBX_IN, MBX_SIZE).wkc == 0
    assert wire.write(MBX_OUT + 100, message[100:]).wkc == 1
    assert wire.value(0x080D, 1) & FULL == FULL
    assert wire.read(MBX_IN, 16).wkc == 1
    assert wire.value(0x080D, 1) & FULL == FULL
    assert wire.read(MBX_IN + 16, MBX_SIZE - 16).wkc == 1
    assert wire.value(0x080D, 1) & FULL == 0


def test_a_mailbox_must_be_opened_at_its_first_byte(wire: Wire) -> None:
    assert wire.write(MBX_OUT + 4, bytes(MBX_SIZE - 4)).wkc == 0
    wire.post(UPLOAD_DEVICE_TYPE)
    assert wire.read(MBX_IN + 4, MBX_SIZE - 4).wkc == 0


def test_the_wrong_direction_is_refused(wire: Wire) -> None:
    assert wire.write(MBX_IN, bytes(MBX_SIZE)).wkc == 0
    assert wire.read(MBX_OUT, MBX_SIZE).wkc == 0


def test_status_and_pdi_control_are_not_the_masters(wire: Wire) -> None:
    wire.write(0x0805, b"\xff")
    wire.write(0x0807, b"\xff")
    assert wire.value(0x0805, 1) == 0
    assert wire.value(0x0807, 1) == 0
    assert wire.state() == (PREOP, 0)


def test_a_lost_answer_is_repeated_on_request(wire: Wire) -> None:
    wire.post(UPLOAD_DEVICE_TYPE)
    first = wire.fetch_raw()
    assert wire.read(MBX_IN, MBX_SIZE).wkc == 0
    # As SOEM does it: status and activation in one write, bit 1 of 80Eh toggled.
    wire.write(0x080D, struct.pack("<BB", 0, 0x03))
    assert wire.value(0x080F, 1) & 0x02 == 0x02
    assert wire.fetch_raw() == first
    # Without a new toggle nothing more comes.
    wire.write(0x080D, struct.pack("<BB", 0, 0x03))
    assert wire.read(MBX_IN, MBX_SIZE).wkc == 0
    wire.write(0x080D, struct.pack("<BB", 0, 0x01))
    assert wire.value(0x080F, 1) & 0x02 == 0
    assert wire.fetch_raw() == first


def test_a_request_that_comes_twice_is_carried_out_once(wire: Wire) -> None:
    wire.post(UPLOAD_DEVICE_TYPE, counter=5)
    wire.fetch()
    assert wire.post(UPLOAD_DEVICE_TYPE, counter=5).wkc == 1
    assert wire.read(MBX_IN, MBX_SIZE).wkc == 0
    wire.post(UPLOAD_DEVICE_TYPE, counter=6)
    wire.fetch()
    # Counter 0 means that the master does not count.
    for _ in range(2):
        wire.post(UPLOAD_DEVICE_TYPE, counter=0)
        wire.fetch()


def test_the_slave_counts_its_own_messages_from_1_to_7(wire: Wire) -> None:
    seen = []
    for _ in range(9):
        wire.post(UPLOAD_DEVICE_TYPE)
        seen.append(wire.fetch_raw()[5] >> 4)
    assert seen == [1, 2, 3, 4, 5, 6, 7, 1, 2]


@pytest.mark.parametrize(
    ("kind", "payload", "detail"),
    [
        (2, bytes(8), 0x0002),  # EoE: unsupported protocol
        (4, bytes(8), 0x0002),  # FoE where the drive has none
        (3, b"\x00", 0x0006),  # too short for a CoE header
        (3, b"\x00\x50" + bytes(8), 0x0004),  # RxPDO: service not supported
    ],
)
def test_what_the_slave_cannot_do_is_a_mailbox_error(
    wire: Wire, kind: int, payload: bytes, detail: int
) -> None:
    wire.post(payload, kind=kind)
    raw = wire.fetch_raw()
    assert raw[5] & 0x0F == 0
    assert struct.unpack_from("<HH", raw, 6) == (1, detail)


def test_a_length_beyond_the_mailbox_is_a_mailbox_error(wire: Wire) -> None:
    message = struct.pack("<HHBB", 300, 0, 0, 0x13) + UPLOAD_DEVICE_TYPE
    wire.write(MBX_OUT, message.ljust(MBX_SIZE, b"\0"))
    assert struct.unpack_from("<HH", wire.fetch_raw(), 6) == (1, 0x0008)


def test_answers_take_their_time(wire: Wire) -> None:
    wire.slaves[0].mailbox.delay_ns = 3_000_000
    wire.clock.time_ns = 10_000_000
    wire.post(UPLOAD_DEVICE_TYPE)
    wire.clock.time_ns = 12_999_999
    assert wire.read(MBX_IN, MBX_SIZE).wkc == 0
    wire.clock.time_ns = 13_000_000
    assert wire.read(MBX_IN, MBX_SIZE).wkc == 1


def test_a_mute_mailbox_takes_requests_and_never_answers(wire: Wire) -> None:
    wire.slaves[0].mailbox.muted = True
    assert wire.post(UPLOAD_DEVICE_TYPE).wkc == 1
    wire.clock.time_ns = 10_000_000_000
    assert wire.read(MBX_IN, MBX_SIZE).wkc == 0


def test_in_init_the_mailbox_is_locked_and_forgets(wire: Wire) -> None:
    wire.post(UPLOAD_DEVICE_TYPE)
    assert wire.request(INIT) == (INIT, 0)
    assert wire.read(MBX_IN, MBX_SIZE).wkc == 0
    assert wire.post(UPLOAD_DEVICE_TYPE).wkc == 0
    wire.request(PREOP)
    assert wire.read(MBX_IN, MBX_SIZE).wkc == 0


def test_emergencies_come_by_themselves_and_wait_for_a_free_box(wire: Wire) -> None:
    wire.post(UPLOAD_DEVICE_TYPE)
    wire.device.inject("emergency", 0x7305)
    wire.clock.time_ns += 2_000_000
    assert wire.fetch()[:2] == b"\x00\x30"  # the SDO answer was first
    payload = wire.fetch()
    # Service 1, error code, error register, five manufacturer bytes (ETG.1000.6 5.6.4).
    assert payload == b"\x00\x10" + b"\x05\x73" + b"\x01" + b"\x01\x02\x03\x04\x05"


def test_a_flood_of_emergencies_does_not_grow_without_end(wire: Wire) -> None:
    for _ in range(1000):
        wire.device.inject("emergency", 0x7305)
    wire.clock.time_ns += 2_000_000
    taken = 0
    while wire.read(MBX_IN, MBX_SIZE).wkc:
        taken += 1
    assert taken == 17  # one in the box and 16 waiting


def test_a_mailbox_that_another_fmmu_reports(wire: Wire) -> None:
    """FMMU2 is mapped to the mailbox status (004:947): one bit of 80Dh in the process image."""
    raw = struct.pack("<IHBBHBBB3x", 0x400, 1, 0, 0, 0x080D, 3, 1, 1)
    wire.write(0x0620, raw)
    assert wire.one(10, 0x400, 0, b"\0").data == b"\0"
    wire.post(UPLOAD_DEVICE_TYPE)
    answer = wire.one(10, 0x400, 0, b"\0")
    assert (answer.wkc, answer.data) == (1, b"\x01")
