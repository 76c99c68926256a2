"""Samples from the cyclic loop to the server: a preallocated ring in shared memory.

One writer, one reader, no locks: the writer fills a slot and then advances the count; the reader
copies and then checks that the writer has not overwritten the slots meanwhile. The first page also
holds the keep-alive times of both sides.
"""

from __future__ import annotations

import contextlib
import mmap
import os
import struct
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from drivers.computer.network.sockets import shared_memory_file

RING_BYTES = 16 << 20
_PAGE = 4096
_U64 = struct.Struct("<Q")
_COUNT, _HOST_DEADLINE, _SERVER_ALIVE, _SLOT_SIZE, _SLOTS = 0, 64, 128, 192, 200
_BUSY_TEXT, _BUSY_ROOM = 256, 120

SLOT = struct.Struct("<QqqiiII")
"""Cycle counter, monotonic time [ns], DC time [ns], WKC, expected WKC, flags, lateness [µs]."""

VALID = 1
"""Working counter as expected, and frame back in time."""
RESYNCED = 2
"""Grid points were skipped before this cycle: the computer was late."""
_LOST, _LOST_PLACES = 8, 24


def lost_flag(place: int) -> int:
    """Return the flag for a lost station, whose inputs are old, by its place in the exchange.

    Stations beyond the available flags share the last one.
    """
    return 1 << _LOST + min(place, _LOST_PLACES - 1)


_HEADER_FIELDS = {
    "cycle": ("<u8", 0),
    "time_ns": ("<i8", 8),
    "dc_ns": ("<i8", 16),
    "wkc": ("<i4", 24),
    "expected": ("<i4", 28),
    "flags": ("<u4", 32),
    "late_us": ("<u4", 36),
}


class Ring:
    """Both ends of the ring over one memory file."""

    def __init__(self, descriptor: int) -> None:
        self._map = mmap.mmap(descriptor, RING_BYTES)
        self._view = memoryview(self._map)
        self._slot_size = 0
        self._slots = 0
        self._count = 0

    @staticmethod
    def create() -> int:
        """Create a memory file; it vanishes with the last process that holds it."""
        descriptor = shared_memory_file("servodeck-ethercat")
        try:
            os.ftruncate(descriptor, RING_BYTES)
        except OSError:
            os.close(descriptor)
            raise
        return descriptor

    @staticmethod
    def create_file() -> Path:
        """Create a file in the temporary folder, where a child inherits no descriptor.

        The caller removes it.
        """
        descriptor, name = tempfile.mkstemp(prefix="servodeck-ethercat-")
        try:
            os.ftruncate(descriptor, RING_BYTES)
        finally:
            os.close(descriptor)
        return Path(name)

    @classmethod
    def of_file(cls, path: Path) -> Ring:
        """Open one end of the ring in a file of `create_file`."""
        with path.open("r+b") as file:
            return cls(file.fileno())

    def close(self) -> None:
        """Release the memory."""
        self._view.release()
        # A reader being cancelled may still use it: the memory is then released with the reader.
        with contextlib.suppress(BufferError):
            self._map.close()

    # Signs of life -------------------------------------------------------------------------

    def host_lives_until(self, deadline_ns: int, doing: str = "") -> None:
        """Announce that the host comes back before ``deadline_ns`` (monotonic).

        ``doing`` is the code of what it does until then.
        """
        if doing:
            text = doing.encode()[: _BUSY_ROOM - 1].ljust(_BUSY_ROOM, b"\0")
            self._view[_BUSY_TEXT : _BUSY_TEXT + _BUSY_ROOM] = text
        _U64.pack_into(self._view, _HOST_DEADLINE, deadline_ns)

    def host_deadline_ns(self) -> int:
        """Return the host's deadline (monotonic); 0 before its first announcement."""
        return int(_U64.unpack_from(self._view, _HOST_DEADLINE)[0])

    def host_doing(self) -> str:
        """Return the code of what the host does until its deadline; empty if not reported."""
        raw = bytes(self._view[_BUSY_TEXT : _BUSY_TEXT + _BUSY_ROOM])
        return raw.split(b"\0", 1)[0].decode("utf-8", "replace")

    def server_lives(self, now_ns: int) -> None:
        """Record the server's keep-alive time."""
        _U64.pack_into(self._view, _SERVER_ALIVE, now_ns)

    def server_seen_ns(self) -> int:
        """Return the time of the server's last keep-alive (monotonic)."""
        return int(_U64.unpack_from(self._view, _SERVER_ALIVE)[0])

    # Writing (host) ------------------------------------------------------------------------

    def prepare(self, payload_size: int) -> None:
        """Lay the ring out for slots of ``payload_size`` bytes and touch every page."""
        self._slot_size = (SLOT.size + payload_size + 7) // 8 * 8
        self._slots = (RING_BYTES - _PAGE) // self._slot_size
        self._count = 0
        self._view[_PAGE:] = bytes(RING_BYTES - _PAGE)
        _U64.pack_into(self._view, _COUNT, 0)
        _U64.pack_into(self._view, _SLOT_SIZE, self._slot_size)
        _U64.pack_into(self._view, _SLOTS, self._slots)

    def put(self, header: tuple[int, int, int, int, int, int, int], payload: list[bytes]) -> None:
        """Add one sample."""
        start = _PAGE + self._count % self._slots * self._slot_size
        SLOT.pack_into(self._view, start, *header)
        start += SLOT.size
        for part in payload:
            self._view[start : start + len(part)] = part
            start += len(part)
        self._count += 1
        _U64.pack_into(self._view, _COUNT, self._count)

    # Reading (server) ----------------------------------------------------------------------

    def reader(self, fields: dict[str, tuple[str, int]]) -> RingReader:
        """Create a reader; ``fields`` map a name to (numpy type, offset in the payload)."""
        slot_size = int(_U64.unpack_from(self._view, _SLOT_SIZE)[0])
        slots = int(_U64.unpack_from(self._view, _SLOTS)[0])
        every = _HEADER_FIELDS | {
            name: (kind, offset + SLOT.size) for name, (kind, offset) in fields.items()
        }
        layout = np.dtype(
            {
                "names": list(every),
                "formats": [kind for kind, _ in every.values()],
                "offsets": [offset for _, offset in every.values()],
                "itemsize": slot_size,
            }
        )
        array = np.frombuffer(self._map, layout, count=slots, offset=_PAGE)
        return RingReader(self, array, self.count())

    def count(self) -> int:
        """Return the number of samples written since `prepare`."""
        return int(_U64.unpack_from(self._view, _COUNT)[0])


@dataclass
class RingReader:
    """The reading position of the server."""

    ring: Ring
    array: npt.NDArray[np.void]
    position: int

    def drain(self) -> tuple[npt.NDArray[np.void], int]:
        """Return all new samples [n], and how many were overwritten before they were read."""
        slots = len(self.array)
        count = self.ring.count()
        start = max(self.position, count - slots + 1)
        lost = start - self.position
        taken = self.array[np.arange(start, count) % slots]
        # The writer may have wrapped round during the copy: those slots cannot be trusted.
        overwritten = max(self.ring.count() - slots + 1 - start, 0)
        self.position = count
        return taken[overwritten:], lost + min(overwritten, len(taken))

    def newest(self) -> npt.NDArray[np.void] | None:
        """Return the last sample [1] without consuming it; None before the first."""
        count = self.ring.count()
        if not count or not len(self.array):
            return None
        # The writer is at another slot, and returns to this one only after all the others.
        place = (count - 1) % len(self.array)
        return self.array[place : place + 1].copy()

    def release(self) -> None:
        """Release the shared memory, so that it can be closed."""
        self.array = self.array[:0].copy()
