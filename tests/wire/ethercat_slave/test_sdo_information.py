"""SDO information service (ETG.1000.6 clause 5.6.3)."""

from __future__ import annotations

import struct

import pytest

from .frames import Wire

OWN = [0x1600, 0x1603, 0x1A00, 0x1A03, 0x1C00, 0x1C12, 0x1C13, 0x1C32, 0x1C33]


@pytest.fixture
def wire() -> Wire:
    made = Wire()
    made.to_preop()
    return made


def information(wire: Wire, opcode: int, data: bytes) -> bytes:
    """One request; fragments joined, headers checked. Returns opcode and data."""
    answer = wire.coe(8, struct.pack("<BBH", opcode, 0, 0) + data)
    assert answer[:2] == b"\x00\x80"
    joined, code, left = answer[6:], answer[2], struct.unpack_from("<H", answer, 4)[0]
    while left:
        assert code & 0x80
        answer = wire.fetch()
        code, now_left = answer[2], struct.unpack_from("<H", answer, 4)[0]
        assert now_left == left - 1
        left = now_left
        joined += answer[6:]
    assert not code & 0x80
    return bytes([code & 0x7F]) + joined


def test_list_of_all_objects(wire: Wire) -> None:
    answer = information(wire, 1, b"\x01\x00")
    assert answer[:3] == b"\x02\x01\x00"
    listed = struct.unpack(f"<{(len(answer) - 3) // 2}H", answer[3:])
    assert list(listed) == sorted(OWN + list(wire.device.indices()))


def test_lists_of_mappable_objects_and_their_lengths(wire: Wire) -> None:
    assert information(wire, 1, b"\x02\x00")[3:] == struct.pack("<3H", 0x6040, 0x6060, 0x607A)
    transmit = struct.pack("<4H", 0x603F, 0x6041, 0x6061, 0x6064)
    assert information(wire, 1, b"\x03\x00")[3:] == transmit
    everything = len(OWN) + len(wire.device.indices())
    assert information(wire, 1, b"\x00\x00") == b"\x02" + struct.pack(
        "<6H", 0, everything, 3, 4, 0, 0
    )


def test_a_long_list_comes_in_fragments() -> None:
    wire = Wire()
    wire.to_preop()
    many = [0x3000 + n for n in range(400)]
    wire.device.indices = lambda: many  # type: ignore[method-assign]
    answer = information(wire, 1, b"\x01\x00")
    listed = struct.unpack(f"<{(len(answer) - 3) // 2}H", answer[3:])
    assert [i for i in listed if i >= 0x3000] == many


@pytest.mark.parametrize(
    ("index", "kind", "highest", "code"),
    [
        (0x1000, 0x0007, 0, 7),  # VAR of UINT32
        (0x2001, 0x0000, 3, 9),  # RECORD
        (0x1603, 0x0007, 12, 8),  # ARRAY of UINT32
        (0x1C12, 0x0006, 2, 8),
        (0x1008, 0x0009, 0, 7),
    ],
)
def test_object_descriptions(wire: Wire, index: int, kind: int, highest: int, code: int) -> None:
    answer = information(wire, 3, struct.pack("<H", index))
    assert answer[0] == 4
    assert struct.unpack_from("<HHBB", answer, 1) == (index, kind, highest, code)


def test_object_description_ends_with_the_name(wire: Wire) -> None:
    assert information(wire, 3, struct.pack("<H", 0x6041))[7:] == b"Object 6041:00"


@pytest.mark.parametrize(
    ("index", "subindex", "kind", "bits", "access"),
    [
        (0x6040, 0, 0x06, 16, 0x007F),  # read and write in all states, RxPDO
        (0x6064, 0, 0x04, 32, 0x0087),  # read only, TxPDO
        (0x2003, 0, 0x06, 16, 0x0038),  # write only
        (0x1603, 1, 0x07, 32, 0x000F),  # written in Pre-Op only
        (0x1C32, 2, 0x07, 32, 0x0007),
    ],
)
def test_entry_descriptions(
    wire: Wire, index: int, subindex: int, kind: int, bits: int, access: int
) -> None:
    answer = information(wire, 5, struct.pack("<HBB", index, subindex, 7))
    assert answer[0] == 6
    assert struct.unpack_from("<HBBHHH", answer, 1) == (index, subindex, 7, kind, bits, access)


def test_entry_description_gives_the_printed_default_on_request(wire: Wire) -> None:
    answer = information(wire, 5, struct.pack("<HBB", 0x2001, 3, 0x77))
    head = struct.unpack_from("<HBBHHH", answer, 1)
    # Limits are not printed for this entry: only the default is there.
    assert head[2] == 0x17
    assert answer[11:] == struct.pack("<I", 0x44556677) + b"Object 2001:03"


@pytest.mark.parametrize(
    ("opcode", "data", "code"),
    [
        (3, b"\x55\x55", 0x06020000),
        (5, b"\x01\x20\x09\x07", 0x06090011),
        (1, b"\x09\x00", 0x06010000),
        (9, b"\x00\x00", 0x06010000),
    ],
)
def test_errors_are_reported_by_opcode_7(wire: Wire, opcode: int, data: bytes, code: int) -> None:
    assert information(wire, opcode, data) == b"\x07" + struct.pack("<I", code)
