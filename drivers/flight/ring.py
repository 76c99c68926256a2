"""The last frames of a bus in bounded memory, with remarks of our own."""

from __future__ import annotations

import struct
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator

from drivers.flight.pcapng import Frame, Note, file_of

KEPT_NS = 60_000_000_000
MAX_BYTES = 64 << 20
_MAX_NOTES = 2000
_HEAD = struct.Struct("<qB")
_OVERHEAD = 152
"""Bytes of the Python objects and their place in the ring, next to the frames themselves."""

Belongs = Callable[[bytes, int], bool]
"""Whether a frame has to do with a station."""

Unpack = Callable[[bytes], Iterator[Frame]]
"""The frames of what `FrameRing.put_packed` was given."""


def one_frame(packed: bytes) -> Iterator[Frame]:
    """The frame that `FrameRing.put` packed."""
    time_ns, sent = _HEAD.unpack_from(packed)
    yield Frame(time_ns, bool(sent), packed[_HEAD.size :])


class FrameRing:
    """Frames of at most a minute and at most ``max_bytes``; putting one in never blocks on I/O.

    Safe for one thread that records and another that takes a file.
    """

    def __init__(
        self,
        link_type: int,
        name: str,
        belongs: Belongs,
        max_bytes: int = MAX_BYTES,
        unpack: Unpack = one_frame,
    ) -> None:
        self.link_type = link_type
        self.name = name
        self.dropped = 0
        """Frames that went before a minute was over, because memory is bounded."""
        self._belongs = belongs
        self._max_bytes = max_bytes
        self._unpack = unpack
        self._held: deque[tuple[int, int, bytes]] = deque()
        """Time of the last frame, number of frames, the frames."""
        self._bytes = 0
        self._notes: deque[Note] = deque(maxlen=_MAX_NOTES)
        self._lock = threading.Lock()

    @property
    def bytes_held(self) -> int:
        """Memory of the frames, about."""
        return self._bytes

    def put(self, time_ns: int, sent: bool, data: bytes) -> None:
        """Keep a frame; ``time_ns`` since the Unix epoch. For a ring of single frames."""
        self.put_packed(time_ns, 1, _HEAD.pack(time_ns, sent) + data)

    def put_packed(self, last_ns: int, frames: int, packed: bytes) -> None:
        """Keep ``frames`` that this ring's ``unpack`` reads, the last of ``last_ns``."""
        with self._lock:
            self._held.append((last_ns, frames, packed))
            self._bytes += len(packed) + _OVERHEAD
            oldest_ns = last_ns - KEPT_NS
            while self._held and (self._bytes > self._max_bytes or self._held[0][0] < oldest_ns):
                first_ns, lost, first = self._held.popleft()
                self._bytes -= len(first) + _OVERHEAD
                self.dropped += lost if first_ns >= oldest_ns else 0

    def note(self, text: str, station: int | None = None, time_ns: int | None = None) -> None:
        """Keep a remark for the next frame."""
        with self._lock:
            self._notes.append(Note(time_ns or time.time_ns(), text, station))

    def file(self, station: int | None = None) -> bytes:
        """What is held now as a pcapng file; of one station only what has to do with it."""
        with self._lock:
            held, notes = list(self._held), list(self._notes)
        frames = [
            frame
            for _, _, packed in held
            for frame in self._unpack(packed)
            if station is None or self._belongs(frame.data, station)
        ]
        oldest_ns = time.time_ns() - KEPT_NS
        chosen = [
            note
            for note in notes
            if note.time_ns >= oldest_ns and (station is None or note.station in (None, station))
        ]
        return file_of(frames, chosen, self.link_type, self.name)
