"""Requests as strangers send them: whole frames that contradict themselves are answered, not lost.

Codes are those of MODBUS Application Protocol V1.1b3 (clauses 6.3, 6.6, 6.12 and 7).
"""

from __future__ import annotations

import pytest

from drivers.modbus.framing import RequestParser, seal
from drivers.virtual.wires.modbus import TableRegisters, _execute

from .shelf import ShelfDevice

ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE = 1, 2, 3


def answers(request: str) -> list[str]:
    """What a drive with registers 30h to 3Fh says, without CRC."""
    shelf = ShelfDevice()
    shelf.registers = {r: r for r in range(0x30, 0x40)}
    parser = RequestParser()
    found = parser.feed(seal(bytes.fromhex(request))) + parser.end_of_frame()
    return [_execute(TableRegisters(shelf), each)[:-2].hex(" ") for each in found]


@pytest.mark.parametrize(
    ("request_", "code"),
    [
        ("01 03 0030 0000", ILLEGAL_VALUE),
        ("01 03 0030 007e", ILLEGAL_VALUE),
        ("01 03 0030 0011", ILLEGAL_ADDRESS),
        ("01 03 ffff 0002", ILLEGAL_ADDRESS),
        ("01 10 0030 0000 00", ILLEGAL_VALUE),
        ("01 10 0030 0002 03 0001 0002", ILLEGAL_VALUE),
        ("01 10 0030 0003 04 0001 0002", ILLEGAL_VALUE),
        ("01 10 003f 0002 04 0001 0002", ILLEGAL_ADDRESS),
        ("01 04 0030 0001", ILLEGAL_FUNCTION),
        ("01 08 0000 a537", ILLEGAL_FUNCTION),
        ("01 11", ILLEGAL_FUNCTION),
        ("01 17 0030 0001 0030 0001 02 0000", ILLEGAL_FUNCTION),
    ],
)
def test_refusals_have_the_standards_codes(request_: str, code: int) -> None:
    function = int(request_[3:5], 16) | 0x80
    assert answers(request_) == [f"01 {function:02x} {code:02x}"]


@pytest.mark.parametrize("at", range(1, 8))
def test_a_request_may_come_in_two_pieces(at: int) -> None:
    frame = seal(bytes.fromhex("010300300001"))
    parser = RequestParser()
    assert parser.feed(frame[:at]) == []
    assert len(parser.feed(frame[at:])) == 1


def test_a_damaged_request_does_not_take_the_next_one_with_it() -> None:
    frame = seal(bytes.fromhex("010300300001"))
    assert len(RequestParser().feed(frame[:-1] + bytes([frame[-1] ^ 1]) + frame)) == 1
    assert len(RequestParser().feed(frame * 3)) == 3
