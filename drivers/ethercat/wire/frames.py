"""EtherCAT frames built here: register accesses of several stations in one frame.

SOEM distinguishes answers by an index of four bits alone, so that a late frame may be mistaken for
the answer to a later request. These frames carry an index that SOEM never uses (0 to 15 are its
own), and an answer is accepted only if everything that slaves do not change is as it was sent.
Source: ETG.1000.4 clauses 5.3 (frame) and 5.4 (datagrams).
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

from drivers.ethercat.wire.steps import Read, Write

ETHERTYPE = b"\x88\xa4"
FIRST_INDEX, INDICES = 0x80, 0x80
"""Indices of our frames; SOEM uses 0 to 15 and drops frames with another one."""

ROOM_BYTES = 1498
"""Room for datagrams in one Ethernet frame, after the two bytes of the EtherCAT header."""

_STATION_BASE = 0x1000
"""SOEM gives the first slave the address 1001h, and so on (its EC_NODEOFFSET)."""

_FPRD, _FPWR = 4, 5
_ETHERNET, _HEADER, _OVERHEAD = 14, 2, 12
_MORE, _LENGTH = 0x8000, 0x07FF
_BROADCAST, _SOURCE = b"\xff" * 6, b"\x01" * 6
_SHORTEST = 60

Request = tuple[int, Read | Write]
"""A station, counted from 1, and the access to it."""


def bytes_of(access: Read | Write) -> int:
    """Return the bytes that an access occupies in a frame."""
    return _OVERHEAD + (access.size if isinstance(access, Read) else len(access.data))


def build(requests: Sequence[Request], index: int) -> bytes:
    """Build one frame; the requests together must fit `ROOM_BYTES`."""
    parts = []
    last = len(requests) - 1
    for number, (station, access) in enumerate(requests):
        reads = isinstance(access, Read)
        data = bytes(access.size) if isinstance(access, Read) else access.data
        parts.append(
            struct.pack(
                "<BBHHHH",
                _FPRD if reads else _FPWR,
                index,
                _STATION_BASE + station,
                access.register,
                len(data) | (_MORE if number < last else 0),
                0,
            )
        )
        parts += (data, b"\0\0")
    body = b"".join(parts)
    header = _BROADCAST + _SOURCE + ETHERTYPE + struct.pack("<H", len(body) | 0x1000)
    return (header + body).ljust(_SHORTEST, b"\0")


def answers(
    requests: Sequence[Request], sent: bytes, frame: bytes | bytearray | memoryview
) -> list[bytes | None] | None:
    """Return the answer to each request; None if this frame does not belong to them.

    An answer is the data of a read that a station answered, or ``b""`` for a write that was
    accepted. Without an answer: None, or ``b""`` for a read that ``may_be_empty``.
    """
    at = _ETHERNET
    if len(frame) < len(sent) or frame[at - 2 : at + _HEADER] != sent[at - 2 : at + _HEADER]:
        return None
    at += _HEADER
    found: list[bytes | None] = []
    for _, access in requests:
        # Command, index, address and length: slaves leave these unchanged except for one bit.
        if frame[at : at + 7] != sent[at : at + 7] or (frame[at + 7] ^ sent[at + 7]) & ~0x40:
            return None
        size = bytes_of(access) - _OVERHEAD
        data = frame[at + 10 : at + 10 + size]
        counter = frame[at + 10 + size] | frame[at + 11 + size] << 8
        at += _OVERHEAD + size
        if isinstance(access, Write):
            found.append(b"" if counter else None)
        elif counter:
            found.append(bytes(data))
        else:
            found.append(b"" if access.may_be_empty else None)
    return found
