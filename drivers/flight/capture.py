"""Decoding of the blocks that `drivers.computer.network.packet_ring` collects: pure, no I/O.

Source: ``include/uapi/linux/if_packet.h`` of Linux (TPACKET_V3); packet(7).
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

from drivers.flight.pcapng import Frame

_OUTGOING = 4
"""sll_pkttype: sent by this computer."""
_BLOCK = struct.Struct("=12xII")
"""tpacket_block_desc: number of frames, offset of the first."""
_FRAME = struct.Struct("=IIIIIIHH")
"""tpacket3_hdr: offset of the next, s, ns, bytes kept, bytes, status, offsets of the frame."""
_FRAME_HEAD = 48
"""Size of a tpacket3_hdr; the sockaddr_ll follows it."""
_TYPE_AT = _FRAME_HEAD + 10


def frames_of_block(block: bytes) -> Iterator[Frame]:
    """Iterate over the frames of a block, in the order of their times."""
    frames, at = _BLOCK.unpack_from(block)
    for _ in range(frames):
        following, seconds, nanoseconds, kept, _, _, frame_at, _ = _FRAME.unpack_from(block, at)
        data = block[at + frame_at : at + frame_at + kept]
        yield Frame(seconds * 1_000_000_000 + nanoseconds, block[at + _TYPE_AT] == _OUTGOING, data)
        at += following
