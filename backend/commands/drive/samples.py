"""Decoding of scope blocks of the live connection; format: `backend.api.live.messages`."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from backend.api.live.scope_blocks import BASES, HEADER, MAGIC, TRUE_TIMES
from drivers.errors import ProtocolError


@dataclass(frozen=True, slots=True)
class Samples:
    """Times [n] in s and values [n, k]; ``dropped``: number of samples lost before them."""

    times_s: npt.NDArray[np.float64]
    values: npt.NDArray[np.float64]
    dropped: int


def decode(frame: bytes) -> list[Samples]:
    """The blocks of one binary frame.

    Raises:
        ProtocolError: the frame does not consist of scope blocks.
    """
    blocks: list[Samples] = []
    at = 0
    while at < len(frame) or not blocks:
        block, at = _decode(frame, at)
        blocks.append(block)
    return blocks


def _decode(frame: bytes, begin: int) -> tuple[Samples, int]:
    """The block at ``begin``, and the offset of the next one."""
    try:
        magic, _sub, _seq, dropped, rows, columns, flags, t0_s, dt_s = HEADER.unpack_from(
            frame, begin
        )
        at = begin + HEADER.size if magic == MAGIC else len(frame) + 1
        times = t0_s + dt_s * np.arange(rows, dtype=np.float64)
        if flags & TRUE_TIMES:
            times, at = np.frombuffer(frame, "<f8", rows, at), at + 8 * rows
        bases = np.zeros(columns)
        if flags & BASES:
            bases, at = np.frombuffer(frame, "<f8", columns, at), at + 8 * columns
        values = np.frombuffer(frame, "<f4", rows * columns, at).reshape(rows, columns)
    except (struct.error, ValueError) as error:
        raise ProtocolError("command.server-sent-something-no", cause=str(error)) from error
    at += 4 * rows * columns
    return Samples(times, values.astype(np.float64) + bases, dropped), at
