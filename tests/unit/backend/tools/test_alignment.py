"""Samples find their setpoints again, whatever part of the recording is missing."""

from __future__ import annotations

import numpy as np
import pytest

from backend.tools.measuring.alignment import FloatArray, Run, aligned
from drivers.errors import LinkLost

IDLE = 40
"""Samples before the sequence begins, and as many after it has ended."""


def noise(rows: int = 600) -> FloatArray:
    """A sequence [rows, 1] that never repeats."""
    return np.random.default_rng(5).integers(-1000, 1000, (rows, 1)).astype(np.float64)


def recorded(
    sent: FloatArray, lost: tuple[range, ...] = (), skipped: dict[int, int] | None = None
) -> list[Run]:
    """What is recorded of a sequence: a counter of the samples as position, and the setpoints.

    ``lost`` are samples of the recording that never came; before the setpoint at each row of
    ``skipped`` the loop left out so many cycles and played it later.
    """
    before, after = np.repeat(sent[:1] * 0, IDLE, axis=0), np.repeat(sent[-1:], IDLE, axis=0)
    echo = np.concatenate([before, sent, after])
    counter = np.arange(-IDLE, len(sent) + IDLE, dtype=np.float64)[:, None]
    table = np.hstack([counter, echo])
    gone = {row for part in lost for row in part}
    pauses = {IDLE + row: count for row, count in (skipped or {}).items()}
    runs: list[tuple[int, list[FloatArray]]] = [(0, [])]
    missing = 0
    for row, sample in enumerate(table):
        missing += pauses.get(row, 0) + (row in gone)
        if row in gone:
            continue
        if missing and runs[-1][1]:
            runs.append((missing, []))
        missing = 0
        runs[-1][1].append(sample)
    return [(m, np.array(rows), np.ones(len(rows), dtype=np.bool_)) for m, rows in runs]


def places(sent: FloatArray, runs: list[Run]) -> list[int]:
    """Rows that are valid; the counter next to each must be the row's own number."""
    table, valid = aligned(sent, runs, "X")
    rows = np.flatnonzero(valid)
    assert np.array_equal(table[rows, 0], rows), "each row has the sample that belongs to it"
    return [int(row) for row in rows]


def test_nothing_missing() -> None:
    assert len(places(noise(), recorded(noise()))) == 600


def test_samples_that_never_came_leave_their_rows_empty() -> None:
    rows = places(noise(), recorded(noise(), lost=(range(100, 107),)))
    # Samples 100..106 are rows 60..66; the row next to the gap is not trusted.
    assert set(range(600)) - set(rows) == set(range(60, 68))


def test_cycles_that_the_loop_skipped_cost_one_row() -> None:
    rows = places(noise(), recorded(noise(), skipped={200: 5, 300: 1}))
    assert set(range(600)) - set(rows) == {200, 300}


def test_a_gap_of_both_kinds() -> None:
    # Of nine missing cycles four were skipped and five samples were lost.
    rows = places(noise(), recorded(noise(), lost=(range(240, 245),), skipped={202: 4}))
    assert set(range(600)) - set(rows) == set(range(200, 206))


def test_the_beginning_may_be_lost() -> None:
    # Short runs around the start, as a computer leaves them that stalls when a motion begins.
    parts = (range(32, 34), range(42, 43), range(52, 57))
    rows = places(noise(), recorded(noise(), lost=parts))
    assert set(range(18, 600)) <= set(rows)


def test_many_gaps() -> None:
    random = np.random.default_rng(8)
    starts = np.arange(60, 560, 25)
    parts = tuple(range(s, s + int(random.integers(1, 6))) for s in starts)
    skipped = {int(s) - 30: int(random.integers(1, 4)) for s in starts}
    assert len(places(noise(), recorded(noise(), lost=parts, skipped=skipped))) > 450


def test_two_columns_are_distinguished_by_either() -> None:
    sent = np.hstack([np.zeros((600, 1)), noise()])
    assert len(places(sent, recorded(sent, lost=(range(30, 45),)))) >= 590


def test_a_step_is_found_by_its_edges() -> None:
    sent = np.zeros((300, 1))
    sent[50:200] = 7.0
    # What stood still before the gap may have been there three samples earlier or later.
    rows = places(sent, recorded(sent, lost=(range(80, 83),)))
    assert rows == list(range(44, 300))


def test_what_stands_still_begins_with_the_recording() -> None:
    sent = np.full((300, 1), 3.0)
    runs: list[Run] = [
        (
            0,
            np.hstack([np.arange(320.0)[:, None], np.full((320, 1), 3.0)]),
            np.ones(320, dtype=np.bool_),
        )
    ]
    assert len(places(sent, runs)) == 300


def test_period_after_period_keeps_the_place_that_the_edges_tell() -> None:
    period = noise(100)
    sent = np.concatenate([np.zeros((1, 1)), *[period] * 6])
    rows = places(sent, recorded(sent, skipped={250: 3}, lost=(range(400, 404),)))
    assert set(range(601)) - set(rows) == {250, *range(360, 365)}


def test_a_sequence_that_another_one_replaced_is_refused() -> None:
    with pytest.raises(LinkLost, match="X: the setpoints read back from the bus differ"):
        aligned(noise(), recorded(np.flipud(noise())), "X")


def test_most_of_it_missing_is_refused_unless_it_was_broken_off() -> None:
    runs = recorded(noise(), lost=(range(240, 680),))
    with pytest.raises(LinkLost):
        aligned(noise(), runs, "X")
    table, valid = aligned(noise(), runs, "X", ended_early=True)
    assert len(table) == len(valid) == 200
