"""Encoding of a block of samples as a binary frame (format: `backend.api.live.messages`)."""

from __future__ import annotations

import struct

import numpy as np
import numpy.typing as npt

from drivers.link import ScopeBlock

MAGIC = 0x424B4353
HEADER = struct.Struct("<IIIIHHIdd")
"""Magic, subscription, sequence, dropped, rows, columns, flags, t0 [s], dt [s]."""

TRUE_TIMES, BASES = 1, 2
#: Above this magnitude not every integer has an exact float32.
_EXACT = 2.0**24


def encode_block(
    subscription: int, block: ScopeBlock, numbers: tuple[int, ...], count: int, place: int = 0
) -> bytes:
    """Encode a block as a binary frame; columns of channels in other streams are NaN.

    ``numbers`` are the columns of the block's channels among ``count``; ``place`` is
    the number of the stream.
    """
    rows = len(block.samples)
    values: npt.NDArray[np.float64] = np.full((rows, count), np.nan)
    values[:, list(numbers)] = block.samples
    if block.valid is not None:
        values[~block.valid] = np.nan
    flags, extra = place << 8, b""
    if block.times_s is not None:
        flags |= TRUE_TIMES
        extra = block.times_s.astype("<f8").tobytes()
    largest = np.abs(values, where=~np.isnan(values), out=np.zeros_like(values))
    if rows and largest.max() > _EXACT:
        # A multi-turn position: float32 represents its change within a block exactly,
        # but not the value itself.
        flags |= BASES
        bases = np.nan_to_num(values[0]).astype("<f8")
        values = values - bases
        extra += bases.tobytes()
    header = HEADER.pack(
        MAGIC, subscription, block.sequence, block.dropped, rows, count, flags, block.t0_s,
        block.dt_s,
    )  # fmt: skip
    return header + extra + values.astype("<f4").tobytes()
