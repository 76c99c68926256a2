"""Frames of a network interface, collected by the Linux kernel into memory shared with it.

The kernel writes each frame with its time into a block of the shared memory and closes the block
when it is full or ``_CLOSED_MS`` old. So the recording process does nothing per frame: it copies
closed blocks a few times a second. Receiving 2000 frames/s one by one took 3 % of a core, next to
the cycle of an EtherCAT exchange.

Source: packet(7); ``Documentation/networking/packet_mmap.rst`` (TPACKET_V3) and
``include/uapi/linux/if_packet.h`` of Linux; filters: ``networking/filter.rst``.
"""

from __future__ import annotations

import ctypes
import mmap
import socket
import struct
from collections.abc import Iterator

from drivers.computer.network.sockets import AF_PACKET

_ALL, _ETHERCAT = 0x0003, 0x88A4
_SOL_PACKET, _RX_RING, _STATISTICS, _VERSION, _TPACKET_V3 = 263, 5, 6, 10, 2
_SO_ATTACH_FILTER = 26

BLOCK_BYTES, BLOCKS = 1 << 15, 256
"""8 MiB: two thirds of a second at 4000 cycles/s with frames of 1500 bytes in both directions; with
few frames ``BLOCKS`` times ``_CLOSED_MS``, 7.7 s.
"""
_CLOSED_MS = 30
CLOSED_S = _CLOSED_MS / 1000
_LONGEST = 2048
"""Maximum bytes of a frame with its header, required by the kernel; blocks hold as many as fit."""

_OF_KERNEL, _OF_USER, _STATUS_AT = 0, 1, 8
_BLOCK = struct.Struct("=IIIIIIQIIII")
"""tpacket_block_desc: version, private, status, frames, first frame, bytes, number, first and last
time in s and ns.
"""


class PacketRing:
    """All EtherCAT frames of an interface, sent and received.

    Raises:
        OSError: no permission for raw sockets, no such interface, or another system than Linux.
    """

    def __init__(self, interface: str) -> None:
        self._socket = socket.socket(AF_PACKET, socket.SOCK_RAW, 0)
        try:
            _only_ethercat(self._socket)
            self._socket.setsockopt(_SOL_PACKET, _VERSION, _TPACKET_V3)
            size = BLOCK_BYTES * BLOCKS
            request = (BLOCK_BYTES, BLOCKS, _LONGEST, size // _LONGEST, _CLOSED_MS, 0, 0)
            self._socket.setsockopt(_SOL_PACKET, _RX_RING, struct.pack("=7I", *request))
            self._memory = mmap.mmap(self._socket.fileno(), size)
            # Frames sent by this computer are only delivered to sockets for all protocols.
            self._socket.bind((interface, _ALL))
        except OSError:
            self._socket.close()
            raise
        self._next = 0

    def close(self) -> None:
        """Release the shared memory; frames that were not taken are lost."""
        self._memory.close()
        self._socket.close()

    def take(self) -> Iterator[tuple[int, int, bytes]]:
        """Iterate over the closed blocks not yet taken.

        For each: time of the last frame (ns, Unix), number of frames, the block (tpacket_block_desc
        and its frames).
        """
        for _ in range(BLOCKS):
            at = self._next * BLOCK_BYTES
            head = _BLOCK.unpack_from(self._memory, at)
            _, _, status, frames, _, held, _, _, _, last_s, last_ns = head
            if not status & _OF_USER:
                return
            block = self._memory[at : at + held]
            struct.pack_into("=I", self._memory, at + _STATUS_AT, _OF_KERNEL)
            self._next = (self._next + 1) % BLOCKS
            if frames:
                yield last_s * 1_000_000_000 + last_ns, frames, block

    def lost(self) -> int:
        """Return the frames dropped since the last call, as blocks were not taken in time.

        Raises:
            OSError: the interface went down or disappeared.
        """
        error = self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        if error:
            raise OSError(error, "the interface of the recording is down")
        counted = self._socket.getsockopt(_SOL_PACKET, _STATISTICS, 12)
        return int(struct.unpack("=III", counted)[1])


def _only_ethercat(wire: socket.socket) -> None:
    """Make the kernel filter out other frames, so that they take no room."""
    program = b"".join(
        struct.pack("=HBBI", *line)
        for line in (
            (0x28, 0, 0, 12),  # load the half word at 12, the EtherType
            (0x15, 0, 1, _ETHERCAT),  # if it differs, skip one line
            (0x06, 0, 0, 0xFFFF),  # keep up to 64 kB of the frame
            (0x06, 0, 0, 0),  # keep nothing
        )
    )
    held = ctypes.create_string_buffer(program, len(program))
    filter_ = struct.pack("@HP", len(program) // 8, ctypes.addressof(held))
    wire.setsockopt(socket.SOL_SOCKET, _SO_ATTACH_FILTER, filter_)
