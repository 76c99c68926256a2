"""Reading a file's table: named columns of numbers. The contents are not trusted.

Text: columns separated by comma, semicolon, tab, bar or blanks; decimal point or comma; any lines
before the table (makers' scopes write several); UTF-8, UTF-16 or Latin-1; also compressed by gzip.
Times may be numbers or clock texts. JSON: arrays, rows or signals. MATLAB: up to v7. A file that is
too large is refused before it is unpacked in memory.
"""

from __future__ import annotations

import csv
import gzip
import io
import re
import zlib
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from backend.analysis.signals.arrays import FloatArray
from backend.records.response_import.clock_texts import ClockTexts
from backend.records.response_import.errors import BadRecording
from backend.records.response_import.json_tables import is_json, read_json
from backend.records.response_import.matlab import read_matlab
from drivers.texts import limits
from drivers.texts.message import text as message

#: Limits: bytes of the file, bytes unpacked, rows and columns of a table.
MAX_FILE_BYTES = 64 << 20
MAX_UNPACKED_BYTES = 256 << 20
MAX_ROWS, MAX_COLUMNS = 4_000_000, 256
#: The table must begin within this number of lines.
_HEAD_LINES = 400
_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eEdD][+-]?\d+)?$")
#: First line of a trace of CODESYS, without blanks; its values of a switch.
_CODESYS = "[key];[value]"
_SWITCH = {"true": "1", "false": "0"}
_WORD = re.compile(r"[^\W\d][^\W\d ]*$")
_MISSING = {"", "nan", "-nan", "inf", "-inf", "+inf", "null", "n/a", "#n/a", "none", "-", "1.#qnan"}


@dataclass(frozen=True)
class Table:
    """The table of a file.

    ``columns``: in the order of the file, with ``names``; NaN in empty cells. ``first_line``: line
    of the file with the first row, 0 for files without lines. ``facts``: pairs of name and value
    from the lines before the table, such as a sample time. ``clocks``: for each column the index
    of its own time column, where the file has one for each channel.
    """

    names: tuple[str, ...]
    columns: tuple[FloatArray, ...]
    first_line: int
    form: str
    facts: tuple[tuple[str, str], ...] = ()
    clocks: tuple[int, ...] = ()
    clock_texts: frozenset[int] = frozenset()
    """Columns that were times of day or dates; they are in seconds."""

    @property
    def rows(self) -> int:
        """Length of the longest column."""
        return max((c.size for c in self.columns), default=0)


def read_table(data: bytes, name: str) -> Table:
    """Read the table of a file.

    Raises:
        BadRecording: no table in it, too large, or a format that is not supported.
    """
    if len(data) > MAX_FILE_BYTES:
        raise BadRecording(
            "import.bytes", value=len(data), limit=limits.size(MAX_FILE_BYTES), name=name
        )
    if not data:
        raise BadRecording("import.empty", value=0, name=name)
    data = _unpacked(data, name)
    if (found := read_matlab(data, name)) is not None:
        names, columns = found
        return Table(names, columns, 0, "MAT")
    _refuse_known(data, name)
    text = _decoded(data, name)
    return _from_json(text, name) if is_json(text) else _from_text(text, name)


def _from_json(text: str, name: str) -> Table:
    found = read_json(text, name)
    if len(found.columns) > MAX_COLUMNS:
        raise BadRecording(
            "import.columns", value=len(found.columns), limit=str(MAX_COLUMNS), name=name
        )
    return Table(
        tuple(found.names),
        tuple(found.columns),
        0,
        "JSON",
        (),
        tuple(found.clocks) if found.own_times else (),
        frozenset(found.clock_texts),
    )


def _unpacked(data: bytes, name: str) -> bytes:
    """The data without gzip compression; unpacking stops at the size limit."""
    if data[:2] != b"\x1f\x8b":
        return data
    try:
        with gzip.GzipFile(fileobj=io.BytesIO(data)) as packed:
            plain = packed.read(MAX_UNPACKED_BYTES + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise BadRecording("import.damaged-gzip-file", value=name, cause=str(error)) from error
    if len(plain) > MAX_UNPACKED_BYTES:
        raise BadRecording(
            "import.unpacks-more-bytes",
            value=name,
            limit=limits.size(MAX_UNPACKED_BYTES),
            max_unpacked_bytes=MAX_UNPACKED_BYTES,
        )
    return plain


_KNOWN = (
    (b"PK\x03\x04", "import.is-zip", "import.unpack-or-csv"),
    (b"\xd0\xcf\x11\xe0", "import.is-excel-old", "import.save-csv"),
    (b"%PDF", "import.is-pdf", "import.export-csv"),
    (b"TDSm", "import.is-tdms", "import.export-csv-mat"),
    (b"\x89PNG", "import.is-picture", "import.export-csv-numbers"),
    (b"<?xml", "import.is-xml", "import.export-csv-twincat"),
)


def _refuse_known(data: bytes, name: str) -> None:
    for begin, what, remedy in _KNOWN:
        if data.lstrip(b"\xef\xbb\xbf").startswith(begin):
            raise BadRecording(
                "import.not-table-numbers", value=name, remedy=remedy, what=message(what)
            )


def _decoded(data: bytes, name: str) -> str:
    for mark, encoding in (
        (b"\xef\xbb\xbf", "utf-8"),
        (b"\xff\xfe", "utf-16"),
        (b"\xfe\xff", "utf-16"),
    ):
        if data.startswith(mark):
            return _as(data, encoding, name).lstrip("\ufeff")
    sample = data[:4096]
    half = max(len(sample) // 2, 1)
    if sample[1::2].count(0) > 0.4 * half:
        return _as(data, "utf-16-le", name)
    if sample[0::2].count(0) > 0.4 * half:
        return _as(data, "utf-16-be", name)
    if b"\0" in data[: 1 << 20]:
        raise BadRecording("import.holds-binary-data-zero", value=name, index=data.index(0))
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        # Latin-1 decodes every byte, also the degree and micro signs of older programs.
        return data.decode("latin-1")


def _as(data: bytes, encoding: str, name: str) -> str:
    try:
        return data.decode(encoding)
    except UnicodeDecodeError as error:
        raise BadRecording(
            "import.damaged-begins-text-none", value=name, encoding=encoding, start=error.start
        ) from error


def _split(line: str, separator: str | None) -> list[str]:
    cells = line.split(separator)
    if separator is not None and '"' in line:
        # A separator between quotes is part of the number: "0,25","1,5".
        with suppress(csv.Error):
            cells = next(csv.reader([line], delimiter=separator), [])
    return [cell.strip().strip('"').strip() for cell in cells]


def _is_number(cell: str, comma: bool) -> bool:
    if comma and "." in cell:
        return False
    return bool(_NUMBER.match(cell)) and (comma or "," not in cell)


@dataclass(frozen=True)
class _Layout:
    separator: str | None
    comma: bool
    first: int
    width: int


def _layout(lines: list[str], name: str) -> _Layout:
    """Separator and decimal sign with which the most consecutive lines are rows of numbers.

    Of equal candidates the one with the most columns is taken.
    """
    best: tuple[int, int, _Layout] | None = None
    for separator, comma in (
        ("\t", False), ("\t", True), (";", False), (";", True), (",", False), (None, False),
        (None, True), ("|", False), (",", True),
    ):  # fmt: skip
        run = _longest_run(lines, separator, comma)
        if run is None:
            continue
        count, layout = run
        score = (count, layout.width)
        if layout.width >= 2 and (best is None or score > best[:2]):
            best = (*score, layout)
    if best is None:
        first = next((line for line in lines if line.strip()), "")[:60]
        raise BadRecording(
            "import.holds-no-table-numbers", value=name, head_lines=_HEAD_LINES, first=first
        )
    return best[2]


def _longest_run(
    lines: list[str], separator: str | None, comma: bool
) -> tuple[int, _Layout] | None:
    """The longest run of rows of numbers of similar width, each at least half filled."""
    best: tuple[int, _Layout] | None = None
    start, width, count = 0, 0, 0
    for i, line in enumerate(lines):
        cells = _split(line, separator)
        while len(cells) > 1 and cells[-1] == "":
            cells.pop()
        numbers = sum(_is_number(c, comma) for c in cells)
        missing = sum(c.lower() in _MISSING for c in cells)
        row = bool(cells) and numbers >= 1 and numbers + missing == len(cells)
        row = row and 2 * numbers >= len(cells)
        # Rows may end with empty cells, where one of several channels has ended.
        if row and (count == 0 or abs(len(cells) - width) <= width // 2):
            if count == 0:
                start, width = i, len(cells)
            width, count = max(width, len(cells)), count + 1
            if best is None or count > best[0]:
                best = (count, _Layout(separator, comma, start, width))
        else:
            count = 0
            if row:
                start, width, count = i, len(cells), 1
    return best


def _from_text(text: str, name: str) -> Table:
    # Split at line ends only: other characters at which `splitlines` splits occur in units.
    lines = re.split(r"\r\n|\n|\r", text)
    if lines[0].replace(" ", "").lower() == _CODESYS:
        return codesys_trace(lines, name)
    if len(lines) > MAX_ROWS + _HEAD_LINES:
        raise BadRecording(
            "import.lines",
            value=len(lines),
            limit=message("limit.lines", count=MAX_ROWS),
            name=name,
        )
    clock = ClockTexts(lines, _HEAD_LINES)
    layout = _layout(list(clock.lines[:_HEAD_LINES]), name)
    if layout.width > MAX_COLUMNS:
        raise BadRecording("import.columns", value=layout.width, limit=str(MAX_COLUMNS), name=name)
    rows = list(clock.lines[layout.first :])
    while rows and _no_row(rows[-1], layout):
        rows.pop()
    columns = _numbers(rows, layout, name)
    by_clock = clock.columns(layout.first, _split(rows[0] if rows else "", layout.separator))
    columns = tuple(clock.seconds(c) if i in by_clock else c for i, c in enumerate(columns))
    head = lines[: layout.first]
    names, clocks = _scope_names(head, layout) or (_names(head, layout), ())
    return Table(names, columns, layout.first + 1, _form(layout), _facts(head), clocks, by_clock)


def _no_row(line: str, layout: _Layout) -> bool:
    """Whether a line at the end is none of the table: empty, or one word such as EOF."""
    cells = [cell for cell in _split(line, layout.separator) if cell]
    return not cells or (len(cells) == 1 and _WORD.match(cells[0]) is not None)


def _scope_names(
    head: list[str], layout: _Layout
) -> tuple[tuple[str, ...], tuple[int, ...]] | None:
    """Column names and clocks of an export of TwinCAT Scope; None where it is none.

    Each line of its head repeats its key in the time columns (InfoSys TE13xx, "Export to CSV"):
    channels with the same times follow one time column. Times are in milliseconds.
    """
    found: dict[str, list[str]] = {}
    keys = set()
    for line in head:
        cells = _split(line, layout.separator)
        keys.update(cells[:1])
        # Between blanks, a name with a blank in it moves the names after it.
        if cells and (layout.separator is not None or len(cells) == layout.width):
            found[cells[0]] = [*cells, *("",) * layout.width][: layout.width]
    named = found.get("Name") or found.get("SymbolName")
    if named is None or "SampleTime[ms]" not in keys:
        return None
    units = found.get("Unit", [""] * layout.width)
    names: list[str] = []
    clocks: list[int] = []
    clock = 0
    for i, (cell, unit) in enumerate(zip(named, units, strict=True)):
        clock = i if cell == named[0] else clock
        shown = "" if unit in {"", "(None)"} else f" [{unit.split(' (')[0]}]"
        names.append("Time [ms]" if i == clock else (cell or f"column {i + 1}") + shown)
        clocks.append(clock)
    return tuple(names), tuple(clocks)


def codesys_trace(lines: list[str], name: str) -> Table:
    """Table of a trace of CODESYS, which has its channels one below the other.

    Each has lines ``N.Variable; name`` and ``N.Data;``, then its samples ``; time; value``. The
    file does not state the unit of the times.

    Raises:
        BadRecording: no channel, or a sample that is no pair of numbers.
    """
    names: list[str] = []
    times: list[list[float]] = []
    values: list[list[float]] = []
    for at, line in enumerate(lines[1:], start=2):
        cells = [cell.strip() for cell in line.split(";")]
        if cells[0].endswith(".Variable") and len(cells) > 1:
            names.append(cells[1])
            times.append([])
            values.append([])
        if cells[0] or len(cells) < 2 or not names:
            continue
        for j, into in ((1, times[-1]), (2, values[-1])):
            cell = _SWITCH.get(cells[j].lower(), cells[j]) if j < len(cells) else ""
            if not _is_number(cell, False):
                raise BadRecording(
                    "import.line-column-no-number", value=cell[:40], name=name, first=at, j=j + 1
                )
            into.append(float(re.sub("[dD]", "e", cell)))
    if not names or not max(map(len, times)):
        raise BadRecording(
            "import.holds-no-table-numbers", value=name, head_lines=_HEAD_LINES, first=lines[0]
        )
    if 2 * len(names) > MAX_COLUMNS:
        raise BadRecording(
            "import.columns", value=2 * len(names), limit=str(MAX_COLUMNS), name=name
        )
    filled = [np.array(row) for pair in zip(times, values, strict=True) for row in pair]
    shown = [each for own in names for each in ("Time", own)]
    clocks = [2 * (i // 2) for i in range(len(shown))]
    # One clock of all channels is one column.
    if all(row == times[0] for row in times):
        filled, shown = [filled[0], *filled[1::2]], ["Time", *names]
        clocks = [0] * len(shown)
    return Table(tuple(shown), tuple(filled), 0, "CODESYS trace", (), tuple(clocks))


def _form(layout: _Layout) -> str:
    signs = {"\t": "tab", ";": "semicolon", ",": "comma", None: "blanks", "|": "bar"}
    return f"text, {signs[layout.separator]}" + (", decimal comma" if layout.comma else "")


def _numbers(rows: list[str], layout: _Layout, name: str) -> tuple[FloatArray, ...]:
    fast = _fast(rows, layout)
    if fast is not None:
        return tuple(np.ascontiguousarray(c) for c in fast.T)
    out = np.full((len(rows), layout.width), np.nan)
    for i, line in enumerate(rows):
        cells = _split(line, layout.separator)
        while len(cells) > layout.width and cells[-1] == "":
            cells.pop()
        if len(cells) > layout.width:
            raise BadRecording(
                "import.line-columns-table",
                value=line[:80],
                limit=message("limit.columns", count=layout.width),
                name=name,
                first=layout.first + 1 + i,
                cells=len(cells),
                width=layout.width,
            )
        for j, cell in enumerate(cells):
            if cell.lower() in _MISSING:
                continue
            if not _is_number(cell, layout.comma):
                raise BadRecording(
                    "import.line-column-no-number",
                    value=cell[:40],
                    name=name,
                    first=layout.first + 1 + i,
                    j=j + 1,
                )
            out[i, j] = float(re.sub("[dD]", "e", cell.replace(",", ".")))
    return tuple(np.ascontiguousarray(c) for c in out.T)


def _fast(rows: list[str], layout: _Layout) -> FloatArray | None:
    """Parse a whole regular table at once; None where a row is irregular."""
    text = "\n".join(rows)
    if layout.comma:
        text = text.replace(",", ".")
    if '"' in text or "#" in text:
        return None
    try:
        found = np.loadtxt(io.StringIO(text), delimiter=layout.separator, comments=None, ndmin=2)
    except ValueError:
        return None
    return found if found.shape == (len(rows), layout.width) else None


def _names(head: list[str], layout: _Layout) -> tuple[str, ...]:
    """Column names from the last lines before the table, with units from a line below them."""
    rows = []
    for line in head:
        cells = _split(
            line.lstrip("#%").strip() if layout.separator is None else line.lstrip("#%"),
            layout.separator,
        )
        while len(cells) > layout.width and cells[-1] == "":
            cells.pop()
        rows.append(cells)
    fitting = [
        cells
        for cells in rows[-12:]
        if len(cells) == layout.width and sum(bool(c) for c in cells) * 2 >= layout.width
    ]
    if not fitting:
        return tuple(f"column {i + 1}" for i in range(layout.width))
    named = next((cells for cells in fitting if _has_names(cells)), fitting[-1])
    units = fitting[-1] if fitting[-1] is not named else None
    names = []
    for i, cell in enumerate(named):
        unit = units[i] if units else ""
        short = unit and len(unit) <= 12 and not _is_number(unit, layout.comma)
        names.append((cell or f"column {i + 1}") + (f" [{unit.strip('[]()')}]" if short else ""))
    return tuple(names)


def _has_names(cells: list[str]) -> bool:
    """Whether a line contains names: mostly words, and not all the same."""
    words = [c for c in cells if re.search(r"[^\W\d]", c)]
    return 2 * len(words) >= len(cells) and len(set(words)) > 1


def _facts(head: list[str]) -> tuple[tuple[str, str], ...]:
    found = []
    for line in head:
        cells = [c.strip().strip('"') for c in re.split(r"[\t;:=]|,(?=\s)", line, maxsplit=1)]
        if len(cells) == 2 and all(cells):
            found.append((cells[0].lstrip("#% ")[:80], cells[1][:200]))
    return tuple(found[:60])
