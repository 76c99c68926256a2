"""Alignment: the row of a sequence that each recorded sample belongs to, despite losses.

Each sample contains a read-back of the setpoint sent in its cycle. Where cycles are missing between
two runs of samples, the loop skipped them (the sequence then continued later), or the samples were
lost (it continued meanwhile), or some of each; the losses may be at the beginning. The read-back
setpoints decide.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from backend.tools.thresholds import measuring_alignment as threshold
from drivers.errors import LinkLost

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
Run: TypeAlias = tuple[int, FloatArray, BoolArray]
"""Number of missing cycles before it, samples [n, k], validity [n]."""

_IntArray = npt.NDArray[np.int64]


def aligned(
    sent: FloatArray, runs: list[Run], drive: str, *, ended_early: bool = False
) -> tuple[FloatArray, BoolArray]:
    """Align the runs to the sequence: rows [n, k], row i belonging to row i of ``sent`` [n, m].

    The last m columns of each run are the setpoints read back. Rows after a gap, lost rows and rows
    whose setpoints differ are not valid. Where the setpoints are constant over a gap and cannot
    decide, the loop is assumed to have skipped the cycles, which is what happens on a busy
    computer. With ``ended_early`` the rows end where the sequence was aborted.

    Raises:
        LinkLost: the sequence cannot be found.
    """
    wide = sent.shape[1]
    table = np.zeros((len(sent), runs[0][1].shape[1] if runs else wide))
    valid = np.zeros(len(sent), dtype=np.bool_)
    of_sent, *echoes = _keys([sent, *(samples[:, -wide:] for _, samples, _ in runs)])
    moves = int(np.count_nonzero(np.diff(of_sent)))
    needed = threshold.SURE if moves >= threshold.SURE else min(1, moves)
    # Rows that the next sample may belong to. Recording begins before the sequence does.
    low, high, found = -sum(missing + len(samples) for missing, samples, _ in runs), 0, False
    for (missing, samples, good), echo in zip(runs, echoes, strict=True):
        high += missing
        if low != high:
            low, high, hits = _places(of_sent, echo, low, high)
            if not moves:  # no setpoint changes: assume that the sequence began with the recording
                low = high
            found = found or hits >= needed
        rows = np.arange(low, low + len(samples))
        inside = found & (rows >= 0) & (rows < len(sent))
        right = good & (echo == of_sent[np.clip(rows, 0, len(sent) - 1)])
        if missing:
            right[:1] = False
        table[rows[inside]] = samples[inside]
        valid[rows[inside]] = right[inside]
        low, high = low + len(samples), high + len(samples)
    last = np.flatnonzero(valid)
    if last.size < 0.5 * (0 if ended_early else len(sent)) or not last.size:
        raise LinkLost("measuring.setpoints-not-come", drive=drive)
    count = int(last[-1]) + 1 if ended_early else len(sent)
    return table[:count], valid[:count]


def _keys(parts: list[FloatArray]) -> list[_IntArray]:
    """Number for each row [n, m] of each part; equal rows have equal numbers."""
    _, keys = np.unique(np.concatenate(parts), axis=0, return_inverse=True)
    return np.split(keys.reshape(-1), np.cumsum([len(part) for part in parts])[:-1])


def _places(sent: _IntArray, echo: _IntArray, low: int, high: int) -> tuple[int, int, int]:
    """First and last row from ``low`` to ``high`` that the first of ``echo`` may belong to.

    The third value is the number of changed setpoints that agree there. Every changed setpoint that
    agrees counts for a place; every one that differs, and every change before the sequence began or
    after it ended, counts against it.
    """
    moved = np.diff(echo, prepend=echo[:1]) != 0
    begin = max(0, int(np.argmax(moved)) - 1)
    window = slice(begin, begin + threshold.COMPARED)
    places = np.arange(low, high + 1)
    hits, score = _score(sent, echo[window], moved[window], places + begin)
    best = np.flatnonzero(score == np.max(score))
    return int(places[best[0]]), int(places[best[-1]]), int(hits[best[0]])


def _score(
    sent: _IntArray, echo: _IntArray, moved: BoolArray, places: _IntArray
) -> tuple[_IntArray, _IntArray]:
    """Changed setpoints that agree at each place, and their number less the contradictions."""
    hits = np.zeros(len(places), dtype=np.int64)
    against = np.zeros(len(places), dtype=np.int64)
    for offset, (value, moves) in enumerate(zip(echo, moved, strict=True)):
        rows = places + offset
        inside = (rows >= 0) & (rows < len(sent))
        same = inside & (sent[np.clip(rows, 0, len(sent) - 1)] == value)
        if moves:
            hits += same
            against += ~same
        else:
            against += inside & ~same
    return hits, hits - against
