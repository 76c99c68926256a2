"""The file format of recordings (``.sdrec``): conversion between bytes and values, without I/O.

A file is the magic ``SDREC\\x01\\r\\n`` followed by chunks, which are only appended. A chunk is

====== ====== ==============================================================
offset bytes  meaning (little endian)
====== ====== ==============================================================
0      4      marker ``CHNK``
4      1      kind: 1 header (JSON), 2 samples, 3 event (JSON), 4 end (JSON)
5      3      zero
8      4      length of the payload
12     4      CRC-32 of bytes 4..11 and the payload
16     n      payload
====== ====== ==============================================================

The first chunk is the header. A truncated file is valid up to its last complete chunk. A file that
was closed ends with an end chunk and 16 bytes: ``SDRECEND`` and the offset of the end chunk, so
that its summary is found without reading the samples.
docs/recording.md describes the same for users.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drivers.link import ScopeBlock

MAGIC = b"SDREC\x01\r\n"
SUFFIX = ".sdrec"
HEADER, SAMPLES, EVENT, END = 1, 2, 3, 4
TRAILER = struct.Struct("<8sQ")
TRAILER_MAGIC = b"SDRECEND"
FRAME = struct.Struct("<4sB3xII")
_MARKER = b"CHNK"
#: Part that the CRC covers before the payload: kind and length.
_CHECKED = struct.Struct("<B3xI")
#: stream, rows, columns, flags, sequence, lost samples before this block, t0, dt
BLOCK = struct.Struct("<HHIIIIdd")
_TIMES, _VALID = 1, 2
Part = bytes | memoryview
#: Largest payload of a chunk; a greater length indicates damage.
MAX_PAYLOAD = 1 << 28


def frame(kind: int, payload: bytes) -> bytes:
    """A chunk."""
    head = _CHECKED.pack(kind, len(payload))
    return FRAME.pack(_MARKER, kind, len(payload), zlib.crc32(payload, zlib.crc32(head))) + payload


def json_chunk(kind: int, content: Mapping[str, object]) -> bytes:
    """A chunk of JSON."""
    return frame(kind, json.dumps(content, ensure_ascii=False).encode())


def frame_head(data: bytes) -> tuple[int, int, int] | None:
    """Kind, length and CRC from a chunk's first 16 bytes; None where there is no chunk."""
    if len(data) < FRAME.size:
        return None
    marker, kind, length, crc = FRAME.unpack(data[: FRAME.size])
    if marker != _MARKER or kind not in (HEADER, SAMPLES, EVENT, END) or length > MAX_PAYLOAD:
        return None
    return kind, length, crc


def intact(kind: int, payload: bytes, crc: int) -> bool:
    """Whether a chunk's CRC agrees."""
    head = _CHECKED.pack(kind, len(payload))
    return zlib.crc32(payload, zlib.crc32(head)) == crc


@dataclass(frozen=True, slots=True)
class Samples:
    """One block of one stream: ``values`` [n, k], ``valid`` [n].

    ``times_s`` [n]: sample times on the recording's sample clock (`Clock.sample_s`).
    """

    stream: int
    sequence: int
    lost: int
    times_s: npt.NDArray[np.float64]
    values: npt.NDArray[np.float64]
    valid: npt.NDArray[np.bool_] | None


def samples_chunk(stream: int, block: ScopeBlock) -> bytes:
    """A block as a chunk; every value keeps its 64 bits."""
    return b"".join(samples_parts(stream, block))


def samples_parts(stream: int, block: ScopeBlock) -> list[Part]:
    """The parts that make up the chunk of a block, in order, without a copy of the samples."""
    rows, columns = block.samples.shape
    flags = (_TIMES if block.times_s is not None else 0) | (
        _VALID if block.valid is not None else 0
    )
    parts: list[Part] = [
        BLOCK.pack(
            stream, flags, rows, columns, block.sequence & 0xFFFFFFFF, block.dropped,
            block.t0_s, block.dt_s,
        )
    ]  # fmt: skip
    if block.times_s is not None:
        parts.append(_raw(np.ascontiguousarray(block.times_s, dtype="<f8")))
    if block.valid is not None:
        parts.append(_raw(np.ascontiguousarray(block.valid, dtype="u1")))
    parts.append(_raw(np.ascontiguousarray(block.samples, dtype="<f8")))
    length = sum(map(len, parts))
    crc = zlib.crc32(_CHECKED.pack(SAMPLES, length))
    for part in parts:
        crc = zlib.crc32(part, crc)
    return [FRAME.pack(_MARKER, SAMPLES, length, crc), *parts]


def _raw(array: npt.NDArray[np.float64] | npt.NDArray[np.uint8]) -> memoryview:
    """The bytes of a contiguous array."""
    return array.reshape(-1).view(np.uint8).data


@dataclass(frozen=True, slots=True)
class BlockHead:
    """The fixed part of a samples chunk, before its arrays."""

    stream: int
    rows: int
    columns: int
    lost: int
    t0_s: float
    dt_s: float


def block_head(payload: bytes) -> BlockHead:
    """The fixed part of a samples payload; needs its first ``BLOCK.size`` bytes only.

    Raises:
        ValueError: the payload is shorter.
    """
    _require_head(payload)
    stream, _, rows, columns, _, lost, t0_s, dt_s = BLOCK.unpack(payload[: BLOCK.size])
    return BlockHead(stream, rows, columns, lost, t0_s, dt_s)


def _require_head(payload: bytes) -> None:
    if len(payload) < BLOCK.size:
        raise ValueError(f"samples chunk of {len(payload)} bytes")


def read_samples(payload: bytes) -> Samples:
    """The block of a samples chunk.

    Raises:
        ValueError: the arrays do not fill the payload (written by another version).
    """
    _require_head(payload)
    stream, flags, rows, columns, sequence, lost, t0_s, dt_s = BLOCK.unpack(payload[: BLOCK.size])
    times_bytes = 8 * rows if flags & _TIMES else 0
    valid_bytes = rows if flags & _VALID else 0
    if len(payload) != BLOCK.size + times_bytes + valid_bytes + 8 * rows * columns:
        raise ValueError(f"samples chunk of {len(payload)} bytes for {rows} × {columns} values")
    at = BLOCK.size
    if flags & _TIMES:
        times = np.frombuffer(payload, "<f8", rows, at)
    else:
        times = t0_s + dt_s * np.arange(rows)
    at += times_bytes
    valid = np.frombuffer(payload, "u1", rows, at).astype(bool) if flags & _VALID else None
    at += valid_bytes
    values = np.frombuffer(payload, "<f8", rows * columns, at).reshape(rows, columns)
    return Samples(stream, sequence, lost, times, values, valid)
