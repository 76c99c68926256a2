"""Frame rings for each bus: link type, and which frames belong to which station."""

from __future__ import annotations

import struct
from collections.abc import Iterator

from drivers.flight.pcapng import CAN_SOCKETCAN, ETHERNET, SERIAL_USER
from drivers.flight.ring import FrameRing, Unpack, one_frame

_ETHERTYPE, _FIRST_STATION = 0x88A4, 0x1000
_NODE_COMMANDS = (4, 5, 6, 14)
"""FPRD, FPWR, FPRW and FRMW use the configured station address (ETG.1000.4 table 5)."""

_LOGICAL_COMMANDS = (10, 11, 12)
_CAN_REMOTE = 1 << 30
_BROADCAST_IDS = (0x000, 0x080, 0x100)


def ethercat_ring(interface: str, unpack: Unpack = one_frame) -> FrameRing:
    """Create a ring for the Ethernet frames of a segment; ``unpack`` decodes its contents."""
    return FrameRing(ETHERNET, interface, _of_slave, unpack=unpack)


def can_ring(channel: str) -> FrameRing:
    """Create a ring for CAN frames in SocketCAN format."""
    return FrameRing(CAN_SOCKETCAN, channel, _of_node)


def serial_ring(device: str) -> FrameRing:
    """Create a ring for the bytes of a serial line; see `pcapng.SERIAL_USER`."""
    return FrameRing(SERIAL_USER, device, _of_address, answers_follow=True)


def can_data(cob_id: int, data: bytes, remote: bool) -> bytes:
    """Return a frame of LINKTYPE_CAN_SOCKETCAN: identifier and flags, length, data."""
    return struct.pack(">IB3x", cob_id | (_CAN_REMOTE if remote else 0), len(data)) + data


def _of_slave(frame: bytes, station: int) -> bool:
    return any(
        command in _LOGICAL_COMMANDS
        or (command in _NODE_COMMANDS and address == _FIRST_STATION + station)
        for command, address in _datagrams(frame)
    )


def _datagrams(frame: bytes) -> Iterator[tuple[int, int]]:
    """Iterate over command and address of each datagram in a frame (ETG.1000.4 clause 5.4)."""
    if len(frame) < 28 or int.from_bytes(frame[12:14], "big") != _ETHERTYPE:
        return
    at, more = 16, True
    while more and at + 10 <= len(frame):
        command, _index, address, _offset, length = struct.unpack_from("<BBHHH", frame, at)
        yield command, address
        more = bool(length & 0x8000)
        at += 12 + (length & 0x07FF)


def _of_node(frame: bytes, station: int) -> bool:
    identifier = int.from_bytes(frame[:4], "big") & 0x7FF
    if identifier == 0:
        return len(frame) > 9 and frame[9] in (0, station)
    return identifier in _BROADCAST_IDS or identifier & 0x7F == station


def _of_address(frame: bytes, station: int) -> bool:
    return bool(frame) and frame[0] in (0, station)
