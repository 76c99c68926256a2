"""Tables in JSON: arrays by name, rows, and signals with times of their own."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from backend.analysis.signals.arrays import FloatArray
from backend.records.response_import.clock_texts import ClockTexts
from backend.records.response_import.errors import BadRecording

#: Names of the parts of a signal or table, in the order in which they are looked for.
_TIMES = ("time", "times", "t", "timestamp", "timestamps", "x")
_VALUES = ("values", "value", "data", "samples", "points", "y", "v")
_NAMES = ("name", "label", "signal", "channel", "id", "key")
_TITLES = ("columns", "names", "header", "fields")
_LISTS = (
    "signals",
    "series",
    "channels",
    "traces",
    "data",
    "rows",
    "samples",
    "records",
    "columns",
)
#: Heads of other files begin with a bracket, too.
_BEGINS = re.compile(r"\s*(?:\{\s*\"|\[\s*[\[{])")
#: Depth to which the columns are looked for.
_DEEPEST = 4


class JsonTable:
    """Columns by name, the time column of each, and those that were clock texts."""

    def __init__(self) -> None:
        self.names: list[str] = []
        self.columns: list[FloatArray] = []
        self.clocks: list[int] = []
        self.clock_texts: set[int] = set()
        self.own_times = False
        """Whether signals have times of their own; else all columns belong together."""

    def add(self, name: str, values: Sequence[Any], clock: int | None = None) -> int:
        """Add a column; ``clock`` is that of its times, by default the first one."""
        at = len(self.columns)
        column, by_clock = _numbers(values, name)
        if by_clock:
            self.clock_texts.add(at)
        self.names.append(name)
        self.columns.append(column)
        self.clocks.append(at if clock is None else clock)
        return at


def is_json(text: str) -> bool:
    """Whether a text begins as an object or array of JSON."""
    return _BEGINS.match(text) is not None


def read_json(text: str, name: str) -> JsonTable:
    """Read the columns of a JSON text.

    Raises:
        BadRecording: damaged, or none of the known forms.
    """
    try:
        content = json.loads(text)
    except RecursionError as error:
        raise BadRecording("import.json-nested", value=name) from error
    except ValueError as error:
        where = error if isinstance(error, json.JSONDecodeError) else None
        raise BadRecording(
            "import.json-damaged",
            value=name,
            line=where.lineno if where else 1,
            column=where.colno if where else 1,
        ) from error
    table = JsonTable()
    try:
        _read(content, table, depth=0)
    except _NoColumn as error:
        raise BadRecording(
            "import.json-no-number", value=error.given, column=error.name, row=error.row, name=name
        ) from error
    if len(table.columns) < 2:
        raise BadRecording("import.json-no-table", value=name)
    return table


class _NoColumn(ValueError):
    def __init__(self, name: str, row: int, given: object) -> None:
        super().__init__(name)
        self.name, self.row, self.given = name[:80], row, str(given)[:40]


def _read(content: Any, table: JsonTable, depth: int) -> None:
    if isinstance(content, Mapping):
        _of_object(content, table, depth)
    elif isinstance(content, list) and content:
        first = content[0]
        if isinstance(first, Mapping) and _part(first, _VALUES, _is_array) is not None:
            for number, signal in enumerate(content, start=1):
                if isinstance(signal, Mapping):
                    _signal(signal, str(_named(signal) or f"signal {number}"), table)
        elif isinstance(first, Mapping):
            _rows_by_name(content, table)
        elif isinstance(first, list):
            _rows(content, None, table)


def _of_object(content: Mapping[str, Any], table: JsonTable, depth: int) -> None:
    titles = _part(content, _TITLES, lambda part: _is_array(part) and isinstance(part[0], str))
    rows = _part(content, ("data", "rows", "values"), lambda p: _is_array(p) and _is_array(p[0]))
    if titles is not None and rows is not None:
        _rows(rows, [str(title) for title in titles], table)
        return
    arrays = {
        k: v for k, v in content.items() if _is_array(v) and not isinstance(v[0], (list, dict))
    }
    if len(arrays) >= 2 and len({len(each) for each in arrays.values()}) == 1:
        _by_name(arrays, table)
        return
    signals = {
        k: v
        for k, v in content.items()
        if isinstance(v, Mapping) and _part(v, _VALUES, _is_array) is not None
    }
    if signals:
        for name, signal in signals.items():
            _signal(signal, str(_named(signal) or name), table)
        return
    part = _part(content, _LISTS, lambda part: isinstance(part, (list, Mapping)) and bool(part))
    if part is not None and depth < _DEEPEST:
        _read(part, table, depth + 1)
        if table.columns:
            return
    if arrays:
        # Of different lengths: the reader of the columns says which.
        _by_name(arrays, table)


def _by_name(arrays: Mapping[str, Sequence[Any]], table: JsonTable) -> None:
    """Columns of one clock, the times first."""
    ordered = sorted(arrays, key=lambda name: name.lower() not in _TIMES)
    for name in ordered:
        table.add(name, arrays[name], 0)


def _signal(signal: Mapping[str, Any], name: str, table: JsonTable) -> None:
    """A signal with its times, or with pairs of time and value."""
    values = _part(signal, _VALUES, _is_array)
    times = _part(signal, _TIMES, _is_array)
    if values is None:
        return
    if times is None and _is_array(values[0]) and len(values[0]) == 2:
        pairs = [pair if _is_array(pair) and len(pair) == 2 else (None, None) for pair in values]
        times, values = [pair[0] for pair in pairs], [pair[1] for pair in pairs]
    if times is None:
        table.add(name, values)
        return
    table.own_times = True
    column, _ = _numbers(times, "time")
    known = next(
        (i for i in sorted(set(table.clocks)) if np.array_equal(table.columns[i], column)), None
    )
    clock = table.add("time", times) if known is None else known
    table.add(name, values, clock)


def _rows_by_name(rows: Sequence[Any], table: JsonTable) -> None:
    names = [str(name) for name, each in rows[0].items() if not isinstance(each, (dict, list))]
    kept = [row if isinstance(row, Mapping) else {} for row in rows]
    _by_name({name: [row.get(name) for row in kept] for name in names}, table)


def _rows(rows: Sequence[Any], titles: list[str] | None, table: JsonTable) -> None:
    first = rows[0]
    if titles is None and first and all(isinstance(cell, str) for cell in first) and rows[1:]:
        second = rows[1]
        if _is_array(second) and not all(isinstance(cell, str) for cell in second):
            titles, rows = [str(cell) for cell in first], rows[1:]
    width = len(titles) if titles is not None else len(first)
    names = titles or [f"column {i + 1}" for i in range(width)]
    for i, name in enumerate(names):
        cells = [row[i] if _is_array(row) and i < len(row) else None for row in rows]
        table.add(name, cells, 0)


def _numbers(values: Sequence[Any], name: str) -> tuple[FloatArray, bool]:
    """A column, NaN where it holds nothing, and whether it was one of clock texts."""
    clock: ClockTexts | None = None
    if any(isinstance(each, str) for each in values[:8]):
        texts = ["" if each is None else str(each) for each in values]
        clock = ClockTexts(texts, len(texts))
        values = clock.lines
    out = np.full(len(values), np.nan)
    for row, each in enumerate(values):
        if each is None or each == "":
            continue
        try:
            out[row] = float(each)  # refuses arrays and objects
        except (TypeError, ValueError, OverflowError) as error:
            raise _NoColumn(name, row + 1, each) from error
    if clock is not None and clock.columns(0, [str(values[0])]):
        return clock.seconds(out), True
    return out, False


def _part(content: Mapping[str, Any], names: Sequence[str], fits: Any) -> Any:
    known = {str(key).lower(): value for key, value in content.items()}
    return next((known[name] for name in names if name in known and fits(known[name])), None)


def _is_array(part: object) -> bool:
    return isinstance(part, list) and bool(part)


def _named(signal: Mapping[str, Any]) -> Any:
    return _part(signal, _NAMES, lambda part: isinstance(part, (str, int)))
