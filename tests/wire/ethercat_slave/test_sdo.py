"""SDO transfers byte by byte (ETG.1000.6 clause 5.6.2)."""

from __future__ import annotations

import struct

import pytest

from .frames import PREOP, SAFEOP, Wire

DATA = bytes(range(256)) * 3


@pytest.fixture
def wire() -> Wire:
    made = Wire()
    made.to_preop()
    return made


def abort_of(answer: bytes) -> tuple[int, int, int, int]:
    """Command, index, subindex, code of an answer with its CoE header in front."""
    assert answer[:2] == b"\x00\x20", "an abort is a CoE service 2"
    return struct.unpack("<BHBI", answer[2:10])


def test_expedited_upload(wire: Wire) -> None:
    # 1000h is UINT32: e=1, s=1, n=0.
    answer = wire.coe(2, struct.pack("<BHBI", 0x40, 0x1000, 0, 0))
    assert answer == b"\x00\x30" + b"\x43\x00\x10\x00" + b"\x92\x01\x02\x00"


@pytest.mark.parametrize(
    ("index", "subindex", "command", "data"),
    [(0x2001, 1, 0x4B, b"\x22\x11\0\0"), (0x2001, 2, 0x4F, b"\x33\0\0\0")],
)
def test_expedited_upload_says_how_many_bytes_are_unused(
    wire: Wire, index: int, subindex: int, command: int, data: bytes
) -> None:
    answer = wire.sdo(struct.pack("<BHBI", 0x40, index, subindex, 0))
    assert answer == struct.pack("<BHB", command, index, subindex) + data


def test_normal_upload_gives_the_size_and_the_data(wire: Wire) -> None:
    answer = wire.sdo(struct.pack("<BHBI", 0x40, 0x1008, 0, 0))
    assert answer == b"\x41\x08\x10\x00" + struct.pack("<I", 12) + b"DICT-1 drive"


def test_an_empty_value_is_a_normal_upload_of_size_0(wire: Wire) -> None:
    assert wire.sdo(struct.pack("<BHBI", 0x40, 0x2002, 0, 0)) == b"\x41\x02\x20\x00" + bytes(4)


def test_expedited_download(wire: Wire) -> None:
    assert wire.download(0x2001, 1, b"\x05\x06") == b"\x60\x01\x20\x01" + bytes(4)
    assert wire.device.values[0x2001, 1] == b"\x05\x06"
    # Without the size bit all four bytes are data.
    assert wire.sdo(b"\x22\x01\x20\x03" + b"\x01\x02\x03\x04")[0] == 0x60
    assert wire.device.values[0x2001, 3] == b"\x01\x02\x03\x04"


def test_normal_download(wire: Wire) -> None:
    body = b"\x21\x02\x20\x00" + struct.pack("<I", 7) + b"seven!!"
    assert wire.sdo(body) == b"\x60\x02\x20\x00" + bytes(4)
    assert wire.device.values[0x2002, 0] == b"seven!!"


@pytest.mark.parametrize(
    ("body", "index", "subindex", "code"),
    [
        (b"\x40\x55\x55\x00", 0x5555, 0, 0x06020000),
        (b"\x40\x01\x20\x09", 0x2001, 9, 0x06090011),
        (b"\x40\x03\x20\x00", 0x2003, 0, 0x06010001),
        (b"\x23\x00\x10\x00", 0x1000, 0, 0x06010002),
        (b"\x23\x01\x20\x01", 0x2001, 1, 0x06070012),
        (b"\x2f\x01\x20\x03", 0x2001, 3, 0x06070013),
        (b"\xe0\x01\x20\x03", 0x2001, 3, 0x05040001),
        (b"\x60\x01\x20\x03", 0x2001, 3, 0x05040001),  # a segment without a transfer
        (b"\x00\x01\x20\x03", 0x2001, 3, 0x05040001),
    ],
)
def test_refusals_are_aborts_with_command_80h(
    wire: Wire, body: bytes, index: int, subindex: int, code: int
) -> None:
    answer = wire.coe(2, body.ljust(8, b"\0"))
    assert abort_of(answer) == (0x80, index, subindex, code)


def upload_in_segments(wire: Wire) -> tuple[bytes, list[int]]:
    answer = wire.sdo(struct.pack("<BHBI", 0x40, 0x2002, 0, 0))
    assert answer[:4] == b"\x41\x02\x20\x00"
    assert struct.unpack_from("<I", answer, 4)[0] == len(DATA)
    data, commands, toggle = answer[8:], [], 0
    while len(data) < len(DATA):
        part = wire.sdo(bytes([0x60 | toggle]) + bytes(7))
        commands.append(part[0])
        unused = part[0] >> 1 & 7
        data += part[1 : len(part) - unused]
        toggle ^= 0x10
    return data, commands


def test_segmented_upload_toggles_and_marks_the_last(wire: Wire) -> None:
    wire.device.values[0x2002, 0] = DATA
    data, commands = upload_in_segments(wire)
    assert data == DATA
    # 256 - 6 - 2 - 8 = 240 bytes come first, then 247 per segment: 768 = 240 + 247 + 247 + 34.
    assert commands == [0x00, 0x10, 0x01]


def test_a_short_last_segment_tells_its_unused_bytes(wire: Wire) -> None:
    wire.device.values[0x2002, 0] = DATA[:243]
    wire.sdo(struct.pack("<BHBI", 0x40, 0x2002, 0, 0))
    last = wire.sdo(b"\x60" + bytes(7))
    assert last == bytes([0x01 | 4 << 1]) + DATA[240:243] + bytes(4)


def test_a_wrong_toggle_bit_ends_the_upload(wire: Wire) -> None:
    wire.device.values[0x2002, 0] = DATA
    wire.sdo(struct.pack("<BHBI", 0x40, 0x2002, 0, 0))
    answer = wire.coe(2, b"\x70" + bytes(7))
    assert abort_of(answer) == (0x80, 0x2002, 0, 0x05030000)
    assert abort_of(wire.coe(2, b"\x60" + bytes(7)))[3] == 0x05040001


def test_segmented_download(wire: Wire) -> None:
    first, rest = DATA[:240], DATA[240:]
    head = b"\x21\x02\x20\x00" + struct.pack("<I", len(DATA))
    assert wire.sdo(head + first)[0] == 0x60
    assert wire.device.values[0x2002, 0] == b""
    assert wire.sdo(b"\x00" + rest[:247])[0] == 0x20
    assert wire.sdo(b"\x10" + rest[247:494])[0] == 0x30
    assert wire.sdo(b"\x01" + rest[494:])[0] == 0x20
    assert wire.device.values[0x2002, 0] == DATA


def test_a_short_last_download_segment(wire: Wire) -> None:
    wire.sdo(b"\x21\x02\x20\x00" + struct.pack("<I", 242) + DATA[:240])
    wire.sdo(bytes([0x01 | 5 << 1]) + DATA[240:242] + bytes(5))
    assert wire.device.values[0x2002, 0] == DATA[:242]


def test_a_download_of_the_wrong_length_is_refused_and_changes_nothing(wire: Wire) -> None:
    wire.sdo(b"\x21\x02\x20\x00" + struct.pack("<I", 300) + DATA[:240])
    answer = wire.coe(2, b"\x01" + DATA[240:299])
    assert abort_of(answer) == (0x80, 0x2002, 0, 0x06070010)
    assert wire.device.values[0x2002, 0] == b""


def test_an_abort_of_the_master_ends_the_transfer_without_an_answer(wire: Wire) -> None:
    wire.device.values[0x2002, 0] = DATA
    wire.sdo(struct.pack("<BHBI", 0x40, 0x2002, 0, 0))
    wire.post(struct.pack("<HBHBI", 0x2000, 0x80, 0x2002, 0, 0x05040000))
    assert wire.read(0x1100, 256).wkc == 0
    assert abort_of(wire.coe(2, b"\x60" + bytes(7)))[3] == 0x05040001


def test_a_slave_that_dies_in_the_middle_of_a_segmented_upload(wire: Wire) -> None:
    wire.device.values[0x2002, 0] = DATA
    wire.slaves[0].mailbox.die_after_segments = 1
    wire.sdo(struct.pack("<BHBI", 0x40, 0x2002, 0, 0))
    wire.sdo(b"\x60" + bytes(7))
    assert wire.post(b"\x00\x20\x70" + bytes(7)).wkc == 1
    wire.clock.time_ns += 10_000_000_000
    assert wire.read(0x1100, 256).wkc == 0


# -- complete access --------------------------------------------------------------------------


def test_complete_access_pads_subindex_0_to_16_bits(wire: Wire) -> None:
    answer = wire.sdo(struct.pack("<BHBI", 0x50, 0x2001, 0, 0))
    # C=1, s=1; size 9: 03 00, UINT16, UINT8, UINT32 without gaps.
    assert answer == b"\x51\x01\x20\x00" + struct.pack("<I", 9) + b"\x03\x00\x22\x11\x33wfUD"


def test_complete_access_from_subindex_1_leaves_subindex_0_out(wire: Wire) -> None:
    answer = wire.sdo(struct.pack("<BHBI", 0x50, 0x2001, 1, 0))
    assert answer[4:] == struct.pack("<I", 7) + b"\x22\x11\x33wfUD"


def test_complete_access_gives_only_the_active_entries_of_a_mapping(wire: Wire) -> None:
    answer = wire.sdo(struct.pack("<BHBI", 0x50, 0x1603, 0, 0))
    assert answer[8:] == b"\x02\x00" + struct.pack("<II", 0x60400010, 0x607A0020)
    answer = wire.sdo(struct.pack("<BHBI", 0x50, 0x1C12, 0, 0))
    assert answer[8:] == b"\x01\x00\x03\x16"


def test_complete_access_begins_at_subindex_0_or_1(wire: Wire) -> None:
    answer = wire.coe(2, struct.pack("<BHBI", 0x50, 0x2001, 2, 0))
    assert abort_of(answer)[3] == 0x06010000


def test_a_drive_without_complete_access_says_so() -> None:
    wire = Wire(complete_access=False)
    wire.to_preop()
    answer = wire.coe(2, struct.pack("<BHBI", 0x50, 0x2001, 0, 0))
    assert abort_of(answer)[3] == 0x06010000


def test_complete_access_download_of_a_record(wire: Wire) -> None:
    data = b"\x03\x00" + b"\x01\x02" + b"\x03" + b"\x04\x05\x06\x07"
    answer = wire.sdo(b"\x31\x01\x20\x00" + struct.pack("<I", len(data)) + data)
    assert answer == b"\x70\x01\x20\x00" + bytes(4)
    assert [wire.device.values[0x2001, n] for n in (1, 2, 3)] == [
        b"\x01\x02",
        b"\x03",
        b"\x04\x05\x06\x07",
    ]


def test_complete_access_cannot_change_a_read_only_entry(wire: Wire) -> None:
    data = b"\x07\x00" + b"\x01\x02" + b"\x03" + b"\x04\x05\x06\x07"
    answer = wire.coe(2, b"\x31\x01\x20\x00" + struct.pack("<I", len(data)) + data)
    assert abort_of(answer)[3] == 0x06010002


def test_complete_access_download_of_a_mapping(wire: Wire) -> None:
    data = b"\x03\x00" + struct.pack("<III", 0x60400010, 0x60600008, 0x607A0020)
    assert wire.sdo(b"\x31\x03\x16\x00" + struct.pack("<I", len(data)) + data)[0] == 0x70
    assert wire.slaves[0].dictionary.assigned("rx") == (0x60400010, 0x60600008, 0x607A0020)


# -- slaves that do not keep to the standard ---------------------------------------------------


def test_complete_access_without_the_pad_byte(wire: Wire) -> None:
    wire.slaves[0].coe.oddities.unpadded_count = True
    answer = wire.sdo(struct.pack("<BHBI", 0x50, 0x2001, 0, 0))
    assert answer[4:] == struct.pack("<I", 8) + b"\x03\x22\x11\x33wfUD"


def test_aborts_with_more_bits_in_the_command(wire: Wire) -> None:
    wire.slaves[0].coe.oddities.abort_command = 0x8F
    answer = wire.coe(2, struct.pack("<BHBI", 0x40, 0x5555, 0, 0))
    assert abort_of(answer) == (0x8F, 0x5555, 0, 0x06020000)


def test_more_segments_than_announced(wire: Wire) -> None:
    wire.device.values[0x2002, 0] = DATA
    wire.slaves[0].coe.oddities.endless_segments = True
    wire.sdo(struct.pack("<BHBI", 0x40, 0x2002, 0, 0))
    for n in range(10):
        part = wire.sdo(bytes([0x60 | (n & 1) << 4]) + bytes(7))
        assert part[0] & 0x01 == 0


# -- mapping rules (004:1131-1145, ETG.1000.6 clause 5.6.7.4) ----------------------------------


def write(wire: Wire, index: int, subindex: int, data: bytes) -> int:
    """Abort code, 0 if it worked."""
    command = 0x23 | (4 - len(data)) << 2
    answer = wire.coe(2, struct.pack("<BHB", command, index, subindex) + data.ljust(4, b"\0"))
    return 0 if answer[2] == 0x60 else abort_of(answer)[3]


def test_remapping_as_the_manual_describes_it(wire: Wire) -> None:
    assert write(wire, 0x1C12, 0, b"\x00") == 0
    assert write(wire, 0x1C12, 1, b"\x00\x16") == 0
    assert write(wire, 0x1C12, 0, b"\x01") == 0
    assert write(wire, 0x1600, 0, b"\x00") == 0
    assert write(wire, 0x1600, 1, struct.pack("<I", 0x60400010)) == 0
    assert write(wire, 0x1600, 2, struct.pack("<I", 0x60600008)) == 0
    assert write(wire, 0x1600, 0, b"\x02") == 0
    assert wire.upload(0x1600, 2) == struct.pack("<I", 0x60600008)
    wire.set_process_data(out_size=3)
    assert wire.request(SAFEOP) == (SAFEOP, 0)


@pytest.mark.parametrize(
    ("index", "subindex", "data", "code"),
    [
        (0x1603, 1, struct.pack("<I", 0x60400010), 0x06010003),  # count is not 0
        (0x1C12, 1, b"\x00\x16", 0x06010003),
        (0x1603, 0, b"\x0d", 0x06040042),  # more than 12
        (0x1603, 0, b"\x03", 0x06040041),  # entry 3 is empty
        (0x1C12, 0, b"\x03", 0x06040042),
        (0x1603, 13, bytes(4), 0x06090011),
        (0x1C00, 1, b"\x01", 0x06010002),
    ],
)
def test_mapping_writes_that_are_refused(
    wire: Wire, index: int, subindex: int, data: bytes, code: int
) -> None:
    assert write(wire, index, subindex, data) == code


@pytest.mark.parametrize(
    ("word", "code"),
    [
        (0x60410010, 0x06040041),  # a TxPDO object
        (0x10000020, 0x06040041),  # not mappable
        (0x60400020, 0x06040041),  # wrong length
        (0x55550010, 0x06020000),  # no such object
    ],
)
def test_only_mappable_objects_can_be_mapped(wire: Wire, word: int, code: int) -> None:
    write(wire, 0x1603, 0, b"\x00")
    assert write(wire, 0x1603, 1, struct.pack("<I", word)) == code


def test_only_receive_pdos_can_be_assigned_to_sync_manager_2(wire: Wire) -> None:
    write(wire, 0x1C12, 0, b"\x00")
    assert write(wire, 0x1C12, 1, b"\x03\x1a") == 0x06090030
    assert write(wire, 0x1C12, 1, b"\x01\x16") == 0x06090030


def test_mapping_is_locked_outside_pre_op(wire: Wire) -> None:
    wire.set_process_data()
    assert wire.request(SAFEOP) == (SAFEOP, 0)
    assert write(wire, 0x1603, 0, b"\x00") == 0x08000022
    assert write(wire, 0x1C13, 0, b"\x00") == 0x08000022
    wire.request(PREOP)
    assert write(wire, 0x1603, 0, b"\x00") == 0


def test_a_mapping_longer_than_the_drive_allows_is_refused(wire: Wire) -> None:
    write(wire, 0x1603, 0, b"\x00")
    for n in range(1, 13):
        assert write(wire, 0x1603, n, struct.pack("<I", 0x607A0020)) == 0
    # 32 bytes are the limit of this drive: 8 positions fit, 9 do not.
    assert write(wire, 0x1603, 0, b"\x09") == 0x06040042
    assert write(wire, 0x1603, 0, b"\x08") == 0


def test_a_drive_with_fixed_mapping_refuses_changes() -> None:
    wire = Wire(remappable=False)
    wire.to_preop()
    assert write(wire, 0x1603, 0, b"\x00") == 0x06010002
    assert write(wire, 0x1C12, 0, b"\x00") == 0


def test_sync_parameters_tell_the_mode(wire: Wire) -> None:
    assert wire.upload(0x1C32, 4) == b"\x06\x00"
    wire.to_op()
    assert wire.upload(0x1C32, 1) == b"\x01\x00"
    assert wire.upload(0x1C33, 1) == b"\x22\x00"
    assert write(wire, 0x1C32, 1, b"\x00\x00") == 0x06010002
