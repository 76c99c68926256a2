"""Parameter lists as CSV: export of a set, and import of lists from other tools.

Accepted are lists with a heading (``key`` or ``index`` and ``subindex``, with ``raw`` or ``value``)
and lists without one (``key, raw`` or ``index, subindex, raw``), where a line with several numbers
that differ is refused. A list whose heading has several columns of values (set and actual value) is
refused: a person must decide which of them is meant. The separator is a comma, semicolon or
tabulator; lines that begin with ``#`` are comments. ``raw`` is the value as transferred; ``value``
is in the parameter's unit. A bad line does not affect the others.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from backend.axes.drive.readings import Reading
from backend.axes.parameters.set_file import MAX_BYTES, BadSet, Row
from backend.foundation.store.spreadsheet import as_text
from drivers.texts.message import Text, Unsuitable, text
from profiles.schema import Parameter, Profile, Raw

_MAX_LINES = 20_000
#: The last two are the encodings of spreadsheets on Western and Chinese systems.
_ENCODINGS = ["utf-8-sig", "cp1252", "gb18030"]
_KEY = re.compile(r"(?:0x)?([0-9a-f]{4})(?:h?[:.\s_/-]\s*|sub)(?:0x)?([0-9a-f]{1,2})h?", re.I)
_INDEX = re.compile(r"(?:0x([0-9a-f]{1,4})|([0-9a-f]{4})h?)", re.I)
#: Line with the separator that a spreadsheet writes and expects in front of a list.
_SEPARATOR_LINE = re.compile(r'"?sep=([,;\t])"?', re.I)
_REMARK = re.compile(r"[#;/]")
#: A further cell that begins with a number, whatever remark is behind it.
_NUMBER = re.compile(r"\s*[+-]?(?:0x[0-9a-f]+|\d+(?:[.,]\d+)?)\s*(?:[#;/].*)?$", re.I | re.S)
_SAME_UNIT = {"r/min": "rpm", "1/min": "rpm", "min-1": "rpm", "u/min": "rpm", "sec": "s"}
_HEADINGS = {
    "key": {"key", "address", "object", "parameter", "id", "number"},
    "index": {"index", "idx"},
    "subindex": {"subindex", "sub", "sub index", "sub-index"},
    "raw": {"raw", "raw value", "data"},
    "value": {"value", "current value", "actual value", "engineering value", "set value"},
    "unit": {"unit", "units"},
}


@dataclass(frozen=True, slots=True)
class _Columns:
    """Numbers of the columns; -1 for a missing one. Without a heading the last column is raw."""

    key: int = -1
    index: int = -1
    subindex: int = -1
    raw: int = -1
    value: int = -1
    unit: int = -1
    guessed: bool = False
    """Without a heading: a list of several axes has several numbers in a line."""


@dataclass(frozen=True, slots=True)
class ParameterList:
    """Usable rows, and a message for each line that is not usable."""

    readings: tuple[Reading, ...]
    problems: tuple[Text, ...]


@dataclass(frozen=True, slots=True)
class LeftOut:
    """A row of a set that a list in another format does not have."""

    key: str
    why: Text


def write_csv(profile: Profile, rows: Iterable[Row]) -> str:
    """A list with heading ``key,name,group,unit,value,raw`` and CRLF line ends (RFC 4180)."""
    out = io.StringIO()
    writer = csv.writer(out)
    writer.writerow(("key", "name", "group", "unit", "value", "raw"))
    for row in rows:
        if row.raw is None:
            continue
        parameter = profile.by_key.get(row.key)
        if parameter is None:
            facts: tuple[Raw, ...] = (row.name, "", row.unit, "")
        else:
            value = parameter.to_value(row.raw)
            facts = (parameter.name, parameter.group, parameter.unit, value)
        cells = (row.key, *facts, row.raw)
        writer.writerow(as_text(cell) if isinstance(cell, str) else cell for cell in cells)
    return out.getvalue()


def read_csv(data: bytes, profile: Profile, name: str = "the file") -> ParameterList:
    """Read a list for drives of ``profile``.

    Raises:
        BadSet: too large, not a text, or no line is a parameter of this family.
    """
    if len(data) > MAX_BYTES:
        raise BadSet("sets.larger-bytes", name=name, max_bytes=MAX_BYTES)
    content = _decoded(data, name)
    separator = _separator(content)
    places, lines = _lines(content)
    columns: _Columns | None = None
    readings: dict[str, Reading] = {}
    problems: list[Text] = []
    try:
        rows = csv.reader(lines[:_MAX_LINES], delimiter=separator, skipinitialspace=True)
        for cells in rows:
            number = places[rows.line_num - 1]
            if columns is None:
                columns = _headed(cells, name)
                if columns is not None:
                    continue
                columns = _bare(cells)
            try:
                reading = _reading(cells, columns, profile, separator)
            except Unsuitable as error:
                problems.append(text("sets.line", line=number, cause=error.why))
                continue
            if reading.key in readings:
                twice = text("sets.line-twice", key=reading.key)
                problems.append(text("sets.line", line=number, cause=twice))
                continue
            readings[reading.key] = reading
    except csv.Error as error:
        raise BadSet("sets.no-csv-file", name=name, cause=str(error)) from error
    if len(lines) > _MAX_LINES:
        problems.append(text("sets.lines-left", lines=_MAX_LINES))
    if not readings:
        raise BadSet("sets.no-value", name=name, profile_title=profile.title, first=first(problems))
    return ParameterList(tuple(readings.values()), tuple(problems))


def first(problems: Sequence[Text]) -> Text | str:
    """The first problem, as part of the message that nothing could be read."""
    return text("sets.first-problem", problem=problems[0]) if problems else ""


def _decoded(data: bytes, name: str) -> str:
    encodings = ["utf-16"] if data[:2] in (b"\xff\xfe", b"\xfe\xff") else _ENCODINGS
    for encoding in encodings:
        try:
            content = data.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" not in content:
            return content
    raise BadSet("sets.no-text-file", name=name)


def _lines(content: str) -> tuple[list[int], list[str]]:
    """Lines that are neither empty nor a comment, and their numbers in the file."""
    kept = [
        (number, line)
        for number, line in enumerate(content.splitlines(keepends=True), start=1)
        if line.strip() and line.lstrip()[0] != "#" and not _SEPARATOR_LINE.fullmatch(line.strip())
    ]
    return [number for number, _ in kept], [line for _, line in kept]


def _separator(content: str) -> str:
    """The separator.

    It is taken from a spreadsheet's first line. Otherwise it is the first of tabulator, semicolon
    and comma in the first line that is not a comment.
    """
    reported = _SEPARATOR_LINE.fullmatch(content.partition("\n")[0].strip(" \r"))
    if reported is not None:
        return reported[1]
    line = next(iter(_lines(content)[1]), "")
    return next((mark for mark in ("\t", ";") if mark in line), ",")


def _headed(cells: list[str], name: str) -> _Columns | None:
    """Columns by their headings; None where this line is not a heading.

    Raises:
        BadSet: several columns of values.
    """
    places: dict[str, int] = {}
    values: dict[str, list[str]] = {"raw": [], "value": []}
    for place, cell in enumerate(cells):
        title = cell.strip().lower()
        for column, names in _HEADINGS.items():
            if title in names:
                places.setdefault(column, place)
                values.get(column, []).append(cell.strip())
    if not ({"key", "index"} & places.keys() and {"raw", "value"} & places.keys()):
        return None
    for titles in values.values():
        if len(titles) > 1:
            raise BadSet("sets.several-columns", name=name, columns=", ".join(titles))
    at = {column: places.get(column, -1) for column in _HEADINGS}
    return _Columns(at["key"], at["index"], at["subindex"], at["raw"], at["value"], at["unit"])


def _bare(cells: list[str]) -> _Columns:
    """Columns of a list without heading: ``key, raw`` or ``index, subindex, raw``."""
    if cells and _KEY.fullmatch(cells[0].strip()):
        return _Columns(key=0, raw=1, guessed=True)
    if cells and len(cells) >= 3 and _INDEX.fullmatch(cells[0].strip()):
        return _Columns(index=0, subindex=1, raw=2, guessed=True)
    return _Columns(key=0, raw=1, guessed=True)


def _reading(cells: list[str], columns: _Columns, profile: Profile, separator: str) -> Reading:
    def cell(place: int) -> str:
        return cells[place].strip() if 0 <= place < len(cells) else ""

    parameter = _parameter(cell(columns.key), cell(columns.index), cell(columns.subindex), profile)
    raw = cell(columns.raw)
    if columns.guessed and raw:
        numbers = [raw, *(each for each in cells[columns.raw + 1 :] if _NUMBER.match(each))]
        if len({_REMARK.split(word)[0].strip() for word in numbers}) > 1:
            # Of another axis, a limit, or the raw value in a further column.
            words = ", ".join(word.strip()[:12] for word in numbers[:6])
            raise Unsuitable(text("sets.line-several-numbers", key=parameter.key, words=words))
    written = cell(columns.value)
    if raw:
        made = _made(parameter, _value(parameter, raw, separator))
        if _same_unit(cell(columns.unit), parameter.unit):
            _check_alike(parameter, made, written, separator)
        return made
    if not written:
        raise Unsuitable(text("sets.line-no-value", key=parameter.key))
    value = _value(parameter, written, separator)
    if isinstance(value, str):
        return _made(parameter, value)
    if not _same_unit(cell(columns.unit), parameter.unit):
        facts = {"key": parameter.key, "word": written[:40], "theirs": cell(columns.unit)[:20]}
        if not parameter.unit:
            raise Unsuitable(text("sets.line-has-unit", **facts))
        raise Unsuitable(text("sets.line-other-unit", **facts, ours=parameter.unit))
    return _made(parameter, parameter.to_raw(value))


def _check_alike(parameter: Parameter, made: Reading, written: str, separator: str) -> None:
    """Check a value in the parameter's unit against the raw one beside it, within its last digit.

    A person may have changed only one of them.

    Raises:
        Unsuitable: they differ.
    """
    if not written or isinstance(made.value, str) or made.value is None:
        return
    try:
        value = _value(parameter, written, separator)
    except Unsuitable:
        return
    if isinstance(value, str):
        return
    digits, _, power = written.lower().partition("e")
    decimals = len(re.split(r"[.,]", digits)[-1]) if re.search(r"[.,]", digits) else 0
    last = 0.0 if written[:2].lower() == "0x" else 10.0 ** (int(power or 0) - decimals)
    if abs(value - made.value) > 0.51 * last + 1e-6 * abs(made.value):
        facts = {"raw": made.raw, "value": made.value, "written": written[:40]}
        raise Unsuitable(text("sets.line-raw-and-value", key=made.key, **facts))


def _made(parameter: Parameter, raw: Raw) -> Reading:
    if parameter.is_integer and isinstance(raw, float):
        if not raw.is_integer():
            raise Unsuitable(text("sets.line-no-whole-number", key=parameter.key, word=f"{raw:g}"))
        raw = int(raw)
    return Reading(parameter.key, raw, parameter.to_value(raw), None)


def _parameter(key: str, index: str, subindex: str, profile: Profile) -> Parameter:
    shown = key or f"{index}:{subindex}"
    found = profile.parameter(key) if key else None
    if found is None and (match := _KEY.fullmatch(key)):
        found = profile.by_key.get(f"{match[1].upper()}:{int(match[2], 16):02X}")
    if found is None and (match := _INDEX.fullmatch(index)):
        sub = _whole(subindex or "0")
        number = int(match[1] or match[2], 16)
        found = profile.by_key.get(f"{number:04X}:{sub:02X}") if sub is not None else None
    if found is None:
        raise Unsuitable(text("sets.line-no-parameter", title=profile.title, word=shown[:60]))
    return found


def _same_unit(theirs: str, ours: str) -> bool:
    """Whether a list's unit is the parameter's; True where the list has none."""

    def plain(unit: str) -> str:
        bare = unit.strip(" []()").casefold().replace("\u00b5", "\u03bc").replace("^", "")
        return _SAME_UNIT.get(bare, bare)

    return not theirs or plain(theirs) == plain(ours)


def _whole(word: str) -> int | None:
    match = re.fullmatch(r"([+-]?)(?:0x([0-9a-f]{1,16})|([0-9]{1,20}))", word, re.I | re.A)
    if match is None:
        return None
    number = int(match[2], 16) if match[2] else int(match[3])
    return -number if match[1] == "-" else number


def _value(parameter: Parameter, word: str, separator: str) -> Raw:
    if parameter.type in ("STRING", "OCTETS"):
        return word.removeprefix("'") if word[:2] in ("'=", "'+", "'-", "'@") else word
    if (whole := _whole(word)) is not None:
        return whole
    if separator != "," and re.fullmatch(r"[+-]?[1-9]\d{0,2}([,.])\d{3}(\1\d{3})*", word, re.A):
        # 1,000 and 1.000 may each mean one thousand or one, depending on the country.
        raise Unsuitable(text("sets.line-two-ways", key=parameter.key, word=word))
    if separator != ",":
        word = word.replace(",", ".")
    if re.fullmatch(r"[+-]?(\d{1,20}\.?\d{0,20}|\.\d{1,20})(e[+-]?\d{1,2})?", word, re.I | re.A):
        return float(word)
    raise Unsuitable(text("sets.line-no-number", key=parameter.key, word=word[:40]))
