"""CAN frames of CANopen: identifiers and wire time. Pure.

Sources: CiA 301 v4.2.0 clause 7.3.3 (pre-defined connection set), ISO 11898-1 for the bit count.
"""

from __future__ import annotations

from typing import NamedTuple

NMT = 0x000
SYNC = 0x080
EMERGENCY = 0x080
SDO_ANSWER = 0x580
SDO_REQUEST = 0x600
HEARTBEAT = 0x700
TPDO = (0x180, 0x280, 0x380, 0x480)
RPDO = (0x200, 0x300, 0x400, 0x500)

NMT_START, NMT_STOP, NMT_PREOPERATIONAL, NMT_RESET_NODE, NMT_RESET_COMMUNICATION = (
    0x01,
    0x02,
    0x80,
    0x81,
    0x82,
)

NMT_STATES = {0: "boot-up", 4: "stopped", 5: "operational", 127: "pre-operational"}


class Frame(NamedTuple):
    """One CAN data or remote frame with an 11-bit identifier."""

    cob_id: int
    data: bytes = b""
    remote: bool = False


def worst_case_bits(data_bytes: int) -> int:
    """Return the bits that a base frame occupies with the most stuff bits possible.

    34 + 8n bits are subject to stuffing (one more after every four at worst); 10 more (CRC
    delimiter, acknowledge, end of frame) and the 3 bits of interframe space are not.
    """
    stuffable = 34 + 8 * data_bytes
    return stuffable + (stuffable - 1) // 4 + 13


def exact_bits(frame: Frame) -> int:
    """Return the bits that this frame occupies, with the stuff bits of its contents.

    Source: ISO 11898-1 clauses 10.4.2 (frame format), 10.5 (stuffing) and 10.4.2.6 (CRC).
    """
    length = len(frame.data)
    header = frame.cob_id << 7 | frame.remote << 6 | length
    word = header << 8 * length | int.from_bytes(frame.data, "big")
    count = 19 + 8 * length
    crc = 0
    for position in range(count - 1, -1, -1):
        bit = word >> position & 1
        crc = (crc << 1 & 0x7FFF) ^ (0x4599 if bit ^ crc >> 14 else 0)
    word, count = word << 15 | crc, count + 15
    stuff, run, last = 0, 0, -1
    for position in range(count - 1, -1, -1):
        bit = word >> position & 1
        run = run + 1 if bit == last else 1
        last = bit
        if run == 5:
            stuff += 1
            run, last = 1, 1 - bit
    return count + stuff + 13
