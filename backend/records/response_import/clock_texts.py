"""Times of day and dates of a text table as numbers: ``12:00:01.234``, ISO 8601, ``28.11.2026``."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import date

import numpy as np

from backend.analysis.signals.arrays import FloatArray

_DAY_NS = 86_400 * 10**9
#: A date with the year first or, with points, the day first: other orders differ by country.
_CLOCK = (
    r"(?<![\w:.,+\-])"
    r"(?:(?P<year>\d{4})[-/](?P<month>\d{1,2})[-/](?P<day>\d{1,2})(?:T| +)"
    r"|(?P<day_2>\d{1,2})\.(?P<month_2>\d{1,2})\.(?P<year_2>\d{4})(?:T| +))?"
    r"(?P<hour>[01]?\d|2[0-3]):(?P<minute>[0-5]\d):(?P<second>[0-5]\d)"
    r"(?:[%s](?P<fraction>\d{1,9}))?(?P<zone>Z|[+-]\d{2}:?\d{2})?(?![\w:]|\.\d)"
)
_BY_POINT, _BY_COMMA = re.compile(_CLOCK % "."), re.compile(_CLOCK % ".,")
#: The texts must be in this number of lines at least; one alone is the time of the recording.
_LEAST_LINES = 8


class ClockTexts:
    """Lines of a table in which such texts are nanoseconds since the midnight of the first date."""

    def __init__(self, lines: Sequence[str], head_lines: int) -> None:
        self.lines: Sequence[str] = lines
        self._of_line: dict[int, list[str]] = {}
        self._first: int | None = None
        self._dated = self._undated = 0
        head = lines[:head_lines]
        if sum(_BY_POINT.search(line) is not None for line in head) < _LEAST_LINES:
            return
        self.lines = [self._replaced(number, line) for number, line in enumerate(lines)]

    def _replaced(self, number: int, line: str) -> str:
        if ":" not in line:
            return line
        made: list[str] = []

        def nanoseconds(match: re.Match[str]) -> str:
            found = self._number(match)
            if found is None:
                return match[0]
            made.append(str(found))
            return made[-1]

        # Between commas a comma is no decimal sign.
        pattern = _BY_COMMA if re.search(r"[;\t|]", line) else _BY_POINT
        line = pattern.sub(nanoseconds, line)
        if made:
            self._of_line[number] = made
        return line

    def _number(self, match: re.Match[str]) -> int | None:
        """Nanoseconds; None for a day that no calendar has."""
        year = match["year"] or match["year_2"]
        day = 0
        if year is not None:
            month, of_month = match["month"] or match["month_2"], match["day"] or match["day_2"]
            try:
                day = date(int(year), int(month), int(of_month)).toordinal()
            except ValueError:
                return None
            self._dated += 1
            self._first = day if self._first is None else self._first
            day -= self._first
        else:
            self._undated += 1
        seconds = (int(match["hour"]) * 60 + int(match["minute"])) * 60 + int(match["second"])
        zone = match["zone"]
        if zone is not None and zone != "Z":
            shift = int(zone[1:3]) * 3600 + int(zone[-2:]) * 60
            seconds -= shift if zone[0] == "+" else -shift
        fraction = (match["fraction"] or "").ljust(9, "0")
        return day * _DAY_NS + seconds * 10**9 + int(fraction)

    def columns(self, row: int, cells: Sequence[str]) -> frozenset[int]:
        """Indices of the columns with such texts, by the cells of one line."""
        made = self._of_line.get(row, [])
        return frozenset(i for i, cell in enumerate(cells) if cell in made)

    def seconds(self, values: FloatArray) -> FloatArray:
        """Seconds of a column, which goes on after midnight where it has no dates."""
        if self._undated > self._dated:
            steps = np.diff(values, prepend=values[:1])
            values = values + _DAY_NS * np.cumsum(np.nan_to_num(steps) < -_DAY_NS / 2)
        return np.asarray(values * 1e-9, dtype=np.float64)
