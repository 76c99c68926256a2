"""The last frames of a bus in bounded memory, with remarks of our own."""

from __future__ import annotations

import struct
import threading
import time
from collections import deque
from collections.abc import Callable

from drivers.flight.pcapng import Frame, Note, file_of

KEPT_NS = 60_000_000_000
MAX_BYTES = 64 << 20
_MAX_NOTES = 2000
_HEAD = struct.Struct("<qB")
_OVERHEAD = 48
"""Bytes of a Python object and its place in the ring, next to the frame itself."""

Belongs = Callable[[bytes, int], bool]
"""Whether a frame has to do with a station."""


class FrameRing:
    """Frames of at most a minute and at most ``max_bytes``; putting one in never blocks on I/O.

    Safe for one thread that records and another that takes a file.
    """

    def __init__(
        self, link_type: int, name: str, belongs: Belongs, max_bytes: int = MAX_BYTES
    ) -> None:
        self.link_type = link_type
        self.name = name
        self.dropped = 0
        """Frames that went before a minute was over, because memory is bounded."""
        self._belongs = belongs
        self._max_bytes = max_bytes
        self._frames: deque[bytes] = deque()
        self._bytes = 0
        self._notes: deque[Note] = deque(maxlen=_MAX_NOTES)
        self._lock = threading.Lock()

    @property
    def bytes_held(self) -> int:
        """Memory of the frames, about."""
        return self._bytes

    def put(self, time_ns: int, sent: bool, data: bytes) -> None:
        """Keep a frame; ``time_ns`` since the Unix epoch."""
        packed = _HEAD.pack(time_ns, sent) + data
        with self._lock:
            self._frames.append(packed)
            self._bytes += len(packed) + _OVERHEAD
            oldest_ns = time_ns - KEPT_NS
            while self._frames and (
                self._bytes > self._max_bytes or _HEAD.unpack_from(self._frames[0])[0] < oldest_ns
            ):
                first = self._frames.popleft()
                self._bytes -= len(first) + _OVERHEAD
                self.dropped += _HEAD.unpack_from(first)[0] >= oldest_ns

    def note(self, text: str, station: int | None = None, time_ns: int | None = None) -> None:
        """Keep a remark for the next frame."""
        with self._lock:
            self._notes.append(Note(time_ns or time.time_ns(), text, station))

    def file(self, station: int | None = None) -> bytes:
        """What is held now as a pcapng file; of one station only what has to do with it."""
        with self._lock:
            held, notes = list(self._frames), list(self._notes)
        frames = []
        for packed in held:
            time_ns, sent = _HEAD.unpack_from(packed)
            data = packed[_HEAD.size :]
            if station is None or self._belongs(data, station):
                frames.append(Frame(time_ns, bool(sent), data))
        oldest_ns = time.time_ns() - KEPT_NS
        chosen = [
            note
            for note in notes
            if note.time_ns >= oldest_ns and (station is None or note.station in (None, station))
        ]
        return file_of(frames, chosen, self.link_type, self.name)
