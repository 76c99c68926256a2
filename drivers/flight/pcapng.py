"""Frames as a pcapng file: pure, no I/O.

Source: draft-ietf-opsawg-pcapng; link types: the registry at tcpdump.org.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

ETHERNET, CAN_SOCKETCAN, SERIAL_USER = 1, 227, 147
"""LINKTYPE_ETHERNET, LINKTYPE_CAN_SOCKETCAN, and LINKTYPE_USER0 for serial lines: the bytes as
transferred, one packet for each request and each portion of an answer.
"""

_SECTION, _INTERFACE, _PACKET = 0x0A0D0D0A, 1, 6
_END, _COMMENT, _NAME, _RESOLUTION, _FLAGS, _APPLICATION = 0, 1, 2, 9, 2, 4
_INBOUND, _OUTBOUND = 1, 2
_NANOSECONDS = 9
_LONGEST = 0xFFFF


@dataclass(frozen=True, slots=True)
class Frame:
    """One frame; ``time_ns`` is in nanoseconds since the Unix epoch. ``sent``: by this computer."""

    time_ns: int
    sent: bool
    data: bytes


@dataclass(frozen=True, slots=True)
class Note:
    """An annotation: a change of state, a setpoint, a fault. ``station`` None: the bus."""

    time_ns: int
    text: str
    station: int | None = None


def file_of(frames: Sequence[Frame], notes: Iterable[Note], link_type: int, name: str) -> bytes:
    """Return the whole file. A note becomes the comment of the first frame that is not older.

    Without a later frame it becomes the comment of the last one; without any frame, of the section.
    """
    comments: dict[int, list[str]] = {}
    section: list[str] = []
    place = 0
    for note in sorted(notes, key=lambda n: n.time_ns):
        while place < len(frames) and frames[place].time_ns < note.time_ns:
            place += 1
        if frames:
            comments.setdefault(min(place, len(frames) - 1), []).append(note.text)
        else:
            section.append(note.text)
    parts = [_section(section), _interface(link_type, name)]
    parts += [_packet(frame, comments.get(n, ())) for n, frame in enumerate(frames)]
    return b"".join(parts)


def _section(comments: Sequence[str]) -> bytes:
    options = b"".join(_option(_COMMENT, text.encode()) for text in comments)
    options += _option(_APPLICATION, b"servodeck")
    body = struct.pack("<IHHq", 0x1A2B3C4D, 1, 0, -1) + _ended(options)
    return _block(_SECTION, body)


def _interface(link_type: int, name: str) -> bytes:
    options = _option(_NAME, name.encode()) + _option(_RESOLUTION, bytes([_NANOSECONDS]))
    return _block(_INTERFACE, struct.pack("<HHI", link_type, 0, 0) + _ended(options))


def _packet(frame: Frame, comments: Sequence[str]) -> bytes:
    options = b"".join(_option(_COMMENT, text.encode()) for text in comments)
    options += _option(_FLAGS, struct.pack("<I", _OUTBOUND if frame.sent else _INBOUND))
    size = len(frame.data)
    head = struct.pack("<IIIII", 0, frame.time_ns >> 32, frame.time_ns & 0xFFFFFFFF, size, size)
    return _block(_PACKET, head + _padded(frame.data) + _ended(options))


def _option(code: int, value: bytes) -> bytes:
    value = value[:_LONGEST]
    return struct.pack("<HH", code, len(value)) + _padded(value)


def _ended(options: bytes) -> bytes:
    return options + struct.pack("<HH", _END, 0)


def _padded(data: bytes) -> bytes:
    return data + bytes(-len(data) % 4)


def _block(kind: int, body: bytes) -> bytes:
    size = len(body) + 12
    return struct.pack("<II", kind, size) + body + struct.pack("<I", size)
