"""The last frames of a bus in bounded memory, with annotations."""

from __future__ import annotations

import struct
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator

from drivers.flight.pcapng import Frame, Note, file_of

KEPT_NS = 60_000_000_000
MAX_BYTES = 64 << 20
_MAX_NOTES = 2000
_HEAD = struct.Struct("<qB")
_OVERHEAD = 152
"""Bytes of the Python objects and their place in the ring, in addition to the frames."""

Belongs = Callable[[bytes, int], bool]
"""Returns whether a frame concerns a station."""

Unpack = Callable[[bytes], Iterator[Frame]]
"""Decodes the frames in data passed to `FrameRing.put_packed`."""


def one_frame(packed: bytes) -> Iterator[Frame]:
    """Decode the frame packed by `FrameRing.put`."""
    time_ns, sent = _HEAD.unpack_from(packed)
    yield Frame(time_ns, bool(sent), packed[_HEAD.size :])


class FrameRing:
    """Frames of at most a minute and at most ``max_bytes``; adding one never blocks on I/O.

    Safe for one recording thread and another that requests a file.
    """

    def __init__(
        self,
        link_type: int,
        name: str,
        belongs: Belongs,
        max_bytes: int = MAX_BYTES,
        unpack: Unpack = one_frame,
        *,
        answers_follow: bool = False,
    ) -> None:
        """``answers_follow``: what is received belongs to the station of the last request.

        On a serial line only the first portion of an answer shows whose it is.
        """
        self.link_type = link_type
        self.name = name
        self.dropped = 0
        """Number of frames removed before a minute was over, because memory is bounded."""
        self._belongs = belongs
        self._max_bytes = max_bytes
        self._unpack = unpack
        self._answers_follow = answers_follow
        self._held: deque[tuple[int, int, bytes]] = deque()
        """Time of the last frame, number of frames, the frames."""
        self._bytes = 0
        self._notes: deque[Note] = deque(maxlen=_MAX_NOTES)
        self._lock = threading.Lock()

    @property
    def bytes_held(self) -> int:
        """Approximate memory of the frames [bytes]."""
        return self._bytes

    def put(self, time_ns: int, sent: bool, data: bytes) -> None:
        """Add a frame; ``time_ns`` since the Unix epoch. For a ring of single frames."""
        self.put_packed(time_ns, 1, _HEAD.pack(time_ns, sent) + data)

    def put_packed(self, last_ns: int, frames: int, packed: bytes) -> None:
        """Add ``frames`` in the format of this ring's ``unpack``, the last one from ``last_ns``."""
        with self._lock:
            self._held.append((last_ns, frames, packed))
            self._bytes += len(packed) + _OVERHEAD
            oldest_ns = last_ns - KEPT_NS
            while self._held and (self._bytes > self._max_bytes or self._held[0][0] < oldest_ns):
                first_ns, lost, first = self._held.popleft()
                self._bytes -= len(first) + _OVERHEAD
                self.dropped += lost if first_ns >= oldest_ns else 0

    def note(self, text: str, station: int | None = None, time_ns: int | None = None) -> None:
        """Add an annotation for the next frame."""
        with self._lock:
            self._notes.append(Note(time_ns or time.time_ns(), text, station))

    def file(self, station: int | None = None) -> bytes:
        """Return the present contents as a pcapng file; with a station, only what concerns it."""
        with self._lock:
            held, notes = list(self._held), list(self._notes)
        every = (frame for _, _, packed in held for frame in self._unpack(packed))
        frames = list(every if station is None else self._of_station(every, station))
        oldest_ns = time.time_ns() - KEPT_NS
        chosen = [
            note
            for note in notes
            if note.time_ns >= oldest_ns and (station is None or note.station in (None, station))
        ]
        return file_of(frames, chosen, self.link_type, self.name)

    def _of_station(self, frames: Iterable[Frame], station: int) -> Iterator[Frame]:
        asked: bool | None = None
        for frame in frames:
            if frame.sent or asked is None or not self._answers_follow:
                belongs = self._belongs(frame.data, station)
                asked = belongs if frame.sent else asked
            else:
                belongs = asked
            if belongs:
                yield frame
