"""Time, input and output of a table: selection of the columns, and checks before evaluation."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from backend.analysis.response.foreign_recordings.foreign import LEAST_SAMPLES
from backend.analysis.signals.arrays import FloatArray
from backend.records.response_import.contents import Table
from backend.records.response_import.errors import BadRecording
from drivers.texts import limits
from drivers.texts.message import Text, text

#: Largest relative deviation of a time step from the median, as for a clock with few digits.
_JITTER = 0.1
#: Largest standard deviation of recorded times from an even clock, as a share of a step: the times
#: are those of the recorder, while the samples are even.
_SCATTER = 0.3
#: Magnitude of the correlation between successive deviations above which they are a pattern and not
#: scatter.
_PATTERN = 0.5
#: A sample is lost where the times after a step are later by this share of a step than those before
#: it, in the median over this number of samples on each side.
_LOST, _BESIDE = 0.5, 12
#: Columns that end before this share of the longest were sampled at another rate: one channel of a
#: scope ends some rows before another, half the rate ends at half the rows.
_SHORTER = 0.75
#: Range of plausible sampling rates for a recording of an axis.
_SLOWEST_HZ, _FASTEST_HZ = 10.0, 10e6
#: Factors to seconds.
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_TIME_UNIT = re.compile(r"[\[(/_ ]\s*(s|sec|ms|us|µs|μs|ns)\s*[\])]?\s*$", re.IGNORECASE)


@dataclass(frozen=True)
class Signals:
    """Input and output [n], evenly sampled. ``time_unit``: unit assumed for the time column."""

    signal_in: FloatArray
    signal_out: FloatArray
    sample_rate_hz: float
    input_name: str
    output_name: str
    time_unit: str
    repeated_rows: int = 0
    jitter: float = 0.0
    """Standard deviation of the recorded times from an even clock, as a share of a step."""


def column_of(table: Table, wanted: str, use: str, name: str) -> int:
    """Index of a column by its name, by its name without unit, or by its number from 1.

    Raises:
        BadRecording: no column, or several.
    """
    key = wanted.strip()
    lower = [n.lower() for n in table.names]
    for fits in (
        [i for i, n in enumerate(table.names) if n == key],
        [i for i, n in enumerate(lower) if n == key.lower()],
        [i for i, n in enumerate(lower) if _bare(n) == _bare(key.lower())],
    ):
        if len(fits) == 1:
            return fits[0]
        if fits:
            numbers = ", ".join(str(i + 1) for i in fits)
            raise BadRecording(
                "import.column-times",
                parameter=use,
                value=wanted,
                limit=text("limit.one-of-columns", numbers=numbers),
                name=name,
                fits=len(fits),
            )
    if key.isdigit() and 1 <= int(key) <= len(table.columns):
        return int(key) - 1
    listed = ", ".join(f"{i + 1} {n}" for i, n in enumerate(table.names[:24]))
    raise BadRecording(
        "import.no-column",
        parameter=use,
        value=wanted,
        limit=limits.between(1, len(table.columns)),
        name=name,
        listed=listed,
    )


def _bare(name: str) -> str:
    return re.sub(r"\s*[\[(].*?[\])]\s*$", "", name).strip()


def signals_of(
    table: Table, name: str, *, time: str | None, signal_in: str, signal_out: str,
    time_unit: str | None = None, sample_rate_hz: float | None = None,
) -> Signals:  # fmt: skip
    """Checked signals; ``sample_rate_hz`` is given where there is no time column.

    Raises:
        BadRecording: the signals are not usable; the error has column, row and value.
    """
    first, second = (
        column_of(table, signal_in, "input", name),
        column_of(table, signal_out, "output", name),
    )
    if first == second:
        raise BadRecording(
            "import.input-output-same-column",
            parameter="output",
            value=signal_out,
            name=name,
            names=table.names[first],
        )
    if (time is None) == (sample_rate_hz is None):
        raise BadRecording("import.give-either-time-column", parameter="time", name=name)
    at = None if time is None else column_of(table, time, "time", name)
    if at is not None and at in (first, second):
        raise BadRecording(
            "import.given-time-signal",
            parameter="time",
            value=time,
            name=name,
            names=table.names[at],
        )
    used = [i for i in (at, first, second) if i is not None]
    columns = _complete(table, used, name)
    _same_clock(table, at, (first, second), columns[-1].size, name)
    u, y = columns[-2], columns[-1]
    for use, values, column in (("input", u, first), ("output", y, second)):
        if float(np.ptp(values)) == 0.0:
            raise BadRecording(
                "import.column-constant-2",
                parameter=use,
                value=float(values[0]),
                remedy="import.give-column-of-excitation"
                if use == "input"
                else "import.give-column-of-motion",
                name=name,
                names=table.names[column],
            )
    if at is None:
        assert sample_rate_hz is not None
        _check_rate(sample_rate_hz, name, text("import.sample-rate"))
        return Signals(u, y, sample_rate_hz, table.names[first], table.names[second], "rate")
    unit = "s" if at in table.clock_texts else time_unit or unit_in(table.names[at])
    same = (np.diff(u) == 0.0) & (np.diff(y) == 0.0)
    rate, kept, jitter = _clock(columns[0] * TIME_UNITS[unit], same, name, table, at, unit)
    return Signals(
        u[kept], y[kept], rate, table.names[first], table.names[second], unit,
        int(columns[0].size - np.count_nonzero(kept)), jitter,
    )  # fmt: skip


def unit_in(name: str) -> str:
    """Unit at the end of a time column's name; seconds without one."""
    found = _TIME_UNIT.search(name)
    text = found.group(1).lower().replace("µ", "u").replace("μ", "u") if found else "s"
    return "s" if text == "sec" else text


def _complete(table: Table, used: list[int], name: str) -> list[FloatArray]:
    """The columns up to the end of the shortest, after a check that they have no gaps."""
    columns = [table.columns[i] for i in used]
    ends = []
    for i, values in zip(used, columns, strict=True):
        good = np.flatnonzero(np.isfinite(values))
        if not good.size:
            raise BadRecording("import.column-holds-no-numbers", value=table.names[i], name=name)
        ends.append(int(good[-1]) + 1)
    end = min(ends)
    if table.form != "MAT" and end < _SHORTER * max(ends):
        sizes = ", ".join(f"{table.names[i]} {size}" for i, size in zip(used, ends, strict=True))
        raise BadRecording("import.columns-differ-length", value=sizes, name=name)
    if table.form == "MAT" and len({v.size for v in columns}) > 1:
        sizes = ", ".join(f"{table.names[i]} {table.columns[i].size}" for i in used)
        raise BadRecording("import.vectors-differ-length", value=sizes, name=name)
    if end < LEAST_SAMPLES:
        raise BadRecording(
            "import.samples-record-longer",
            value=end,
            limit=limits.at_least(LEAST_SAMPLES),
            name=name,
        )
    for i, values in zip(used, columns, strict=True):
        bad = np.flatnonzero(~np.isfinite(values[:end]))
        if bad.size:
            row = int(bad[0])
            raise BadRecording(
                "import.column-holds-no-number",
                parameter=table.names[i],
                value=str(values[row]),
                name=name,
                place=_place(table, row),
                bad_size=bad.size,
            )
    return [np.asarray(v[:end], dtype=np.float64) for v in columns]


def _same_clock(
    table: Table, at: int | None, signals: tuple[int, int], rows: int, name: str
) -> None:
    """Check that both signals were sampled at the same times, where each has its own times."""
    if not table.clocks:
        return
    own = [table.clocks[i] for i in signals]
    time = table.columns[own[0] if at is None else at][:rows]
    usual = float(np.median(np.abs(np.diff(time))))
    for i, clock in zip(signals, own, strict=True):
        times = table.columns[clock][:rows]
        alike = times.size == rows and np.all(np.abs(times - time) <= _JITTER * usual)
        if clock != at and not alike:
            raise BadRecording(
                "import.other-times",
                parameter="time",
                value=table.names[i],
                limit=text("limit.one-of-columns", numbers=str(clock + 1)),
                name=name,
                names=table.names[i],
                clock=clock + 1,
            )


def _place(table: Table, row: int) -> Text:
    """The line of a row in a text file; its number in a file that has no lines."""
    if table.first_line:
        return text("import.line", number=table.first_line + row)
    return text("import.row", number=row + 1)


def _check_rate(rate: float, name: str, what: Text) -> None:
    if not (np.isfinite(rate) and _SLOWEST_HZ <= rate <= _FASTEST_HZ):
        raise BadRecording(
            "import.hz-give-unit",
            parameter="time",
            value=rate,
            limit=limits.between(_SLOWEST_HZ, _FASTEST_HZ, "Hz"),
            name=name,
            what=what,
        )


def _clock(
    t: FloatArray, same: np.ndarray, name: str, table: Table, column: int, unit: str
) -> tuple[float, np.ndarray, float]:
    """Sampling rate [Hz], mask of the rows that count [n], and the clock's jitter.

    A row that repeats time and values (``same`` [n - 1]) counts once. A row that repeats only the
    time counts, as its time has few digits.
    """
    head = table.names[column]

    def place(row: int) -> Text:
        return _place(table, row)

    kept = np.ones(t.size, dtype=bool)
    steps = np.diff(t)
    if np.all(steps <= 0) or float(np.ptp(t)) == 0.0:
        raise BadRecording(
            "import.time-column-not-rise", parameter="time", value=float(t[0]), name=name, head=head
        )
    # Scattering times may decrease by less than a step.
    back = np.flatnonzero(steps < -float(np.median(steps)))
    if back.size:
        row = int(back[0]) + 1
        raise BadRecording(
            "import.time-goes-back",
            parameter="time",
            value=float(t[row]),
            name=name,
            place=place(row),
            head=head,
            t=t[row - 1],
            other_t=t[row],
        )
    kept[1:] = (steps != 0) | ~same
    again = np.flatnonzero(steps == 0)
    for row in again[:1]:
        if again.size > 0.01 * t.size:
            raise BadRecording(
                "import.time-stands-rows",
                parameter="time",
                value=float(t[row]),
                name=name,
                place=place(int(row) + 1),
                head=head,
                t=t[row],
                again_size=again.size,
            )
    steps = np.diff(t[kept])
    usual = float(np.median(steps))
    rows = np.flatnonzero(kept)
    uneven = np.abs(steps - usual) > _JITTER * usual
    # A clock with few digits has uneven steps but a constant mean rate.
    even = usual * np.arange(steps.size + 1)
    pace = float(np.polyfit(np.arange(even.size), t[kept], 1)[0])
    off = (t[kept] - pace * np.arange(even.size)) / pace
    drift = np.abs(off - np.median(off))
    # Scatter is temporary; a lost sample shifts all following times.
    lost, (jitter, pattern) = _lost(off), _scatter(off)
    wrong = lost if lost.size else np.flatnonzero(uneven)
    if (
        np.any(uneven)
        and float(np.max(drift)) > _JITTER
        and (lost.size or jitter > _SCATTER or pattern > _PATTERN)
    ):
        at = int(wrong[0])
        row = int(rows[at + 1])
        raise BadRecording(
            "import.ms-after-row-before",
            parameter="time",
            value=float(steps[at]),
            limit=text("limit.jitter", percent=100 * _JITTER, usual_ms=usual * 1e3),
            name=name,
            place=place(row),
            steps_ms=steps[at] * 1e3,
            usual_ms=usual * 1e3,
            count_nonzero=int(wrong.size),
        )
    rate = 1.0 / pace
    _check_rate(rate, name, text("import.sample-rate-in", unit=unit))
    # With a clock of few digits the rate most likely is an integer in hertz.
    nearest = round(rate)
    if nearest and abs(rate - nearest) < 1e-5 * rate:
        rate = float(nearest)
    return rate, kept, jitter


def _lost(off: FloatArray) -> np.ndarray:
    """Indices of steps after which all times are later.

    ``off`` [n]: deviation of the times from an even clock, in steps.
    """
    if off.size < 2 * _BESIDE + 1:
        return np.flatnonzero(np.abs(np.diff(off)) > _LOST)
    windows = np.median(np.lib.stride_tricks.sliding_window_view(off, _BESIDE), axis=1)
    # Before step i are the times up to i, after it those from i + 1.
    later = windows[_BESIDE:] - windows[:-_BESIDE]
    inner = np.flatnonzero(later > _LOST) + _BESIDE - 1
    steps = np.diff(off)
    # Of the steps around a lost sample the longest one is taken.
    found = set()
    for i in inner:
        first = max(int(i) - _BESIDE, 0)
        found.add(first + int(np.argmax(steps[first : int(i) + _BESIDE])))
    return np.array(sorted(found), dtype=np.int64)


def _scatter(off: FloatArray) -> tuple[float, float]:
    """Scatter of the times ``off`` [n], and the correlation of successive deviations.

    Deviations are taken from the median of the neighbours, as a clock may drift slowly. The first
    value is their standard deviation, the second the magnitude of the correlation.
    """
    width = min(4 * _BESIDE + 1, off.size)
    middle = np.median(np.lib.stride_tricks.sliding_window_view(off, width), axis=1)
    first = (width - 1) // 2
    left = off[first : first + middle.size] - middle
    power = float(np.sum(left**2))
    alike = abs(float(np.sum(left[1:] * left[:-1]))) / power if power > 0.0 else 0.0
    return float(np.std(left)), alike
