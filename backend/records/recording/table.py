"""All streams of a recording merged into rows of equal time, one time window after the other."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from backend.records.recording.chunks import Samples
from backend.records.recording.reader import BlockRef, RecordingReader

WINDOW_S = 1.0


@dataclass(frozen=True, slots=True)
class Rows:
    """Rows of one time window.

    ``time_ns`` [n]: time since the first sample; ``values`` [n, k]: one column for each channel.
    ``present`` [n, k]: False where a channel has no sample at this time. ``valid`` [n, s]: 1 or 0
    for each stream; -1 without a sample or a mark.
    """

    time_ns: npt.NDArray[np.int64]
    values: npt.NDArray[np.float64]
    present: npt.NDArray[np.bool_]
    valid: npt.NDArray[np.int8]


def merged(reader: RecordingReader) -> Iterator[Rows]:
    """All samples in the order of time; memory is bounded by the time window."""
    refs = reader.index()
    if not refs:
        return
    base = min(ref.t0_s for ref in refs)
    windows: dict[int, list[BlockRef]] = {}
    for ref in refs:
        first, last = _window(ref.t0_s, base), _window(ref.last_s, base)
        for number in range(first, last + 1):
            windows.setdefault(number, []).append(ref)
    places: dict[int, list[int]] = {}
    for place, channel in enumerate(reader.channels):
        places.setdefault(channel.stream, []).append(place)
    for number in sorted(windows):
        parts = []
        for ref in windows[number]:
            block = reader.block(ref)
            inside = np.floor((block.times_s - base) / WINDOW_S).astype(int) == number
            if inside.any():
                parts.append((block, inside))
        if parts:  # nothing may have been sampled for a second
            yield _merge(parts, base, places, len(reader.channels))


def _window(t_s: float, base: float) -> int:
    return int(np.floor((t_s - base) / WINDOW_S))


def _merge(
    parts: list[tuple[Samples, npt.NDArray[np.bool_]]],
    base: float,
    places: dict[int, list[int]],
    channels: int,
) -> Rows:
    found = []
    #: Samples of one stream in the same nanosecond, which keep separate rows.
    same = 1
    for stream in places:
        mine = [(b, inside) for b, inside in parts if b.stream == stream]
        if not mine:
            continue
        times = np.concatenate([b.times_s[inside] for b, inside in mine])
        values = np.concatenate([b.values[inside] for b, inside in mine])
        valid = np.concatenate([_marks(b)[inside] for b, inside in mine])
        ns = np.rint((times - base) * 1e9).astype(np.int64)
        order = np.argsort(ns, kind="stable")
        ns, values, valid = ns[order], values[order], valid[order]
        _, first, counts = np.unique(ns, return_index=True, return_counts=True)
        again = np.arange(len(ns)) - np.repeat(first, counts)
        same = max(same, int(counts.max()))
        found.append((stream, ns, again, values, valid))
    keyed = [
        (stream, ns * same + again, values, valid) for stream, ns, again, values, valid in found
    ]
    keys = np.unique(np.concatenate([key for _, key, _, _ in keyed]))
    table = np.full((len(keys), channels), np.nan)
    present = np.zeros((len(keys), channels), dtype=bool)
    marks = np.full((len(keys), max(places) + 1), -1, dtype=np.int8)
    for stream, key, values, valid in keyed:
        rows, columns = np.searchsorted(keys, key), np.array(places[stream])
        table[np.ix_(rows, columns)] = values
        present[np.ix_(rows, columns)] = True
        marks[rows, stream] = valid
    return Rows(keys // same, table, present, marks)


def _marks(block: Samples) -> npt.NDArray[np.int8]:
    if block.valid is None:
        return np.full(len(block.times_s), -1, dtype=np.int8)
    return block.valid.astype(np.int8)
