"""Reading start-up lists as text or bytes: CODESYS, CSV, shell scripts, ROS 2, concise DCF."""

from __future__ import annotations

import csv
import io
import re
import shlex
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import yaml

from backend.records.handover.listed import (
    BadRow,
    Listed,
    chosen,
    line_of,
    listed,
    number,
    row_of_bytes,
    sized,
)
from drivers.texts.message import Text, joined, prose, text
from profiles.schema import Profile

_INTEGERS = {"int8": 1, "uint8": 1, "int16": 2, "uint16": 2, "int32": 4, "uint32": 4, "int64": 8,
             "uint64": 8}  # fmt: skip
#: Types of integers that `ethercat download` accepts; it lists sm8 to sm64 as well but refuses
#: them.
_SIZE = _INTEGERS | {"bool": 1}
_REAL = {"float": struct.Struct("<f"), "double": struct.Struct("<d")}
#: The command of the IgH master: its name, a path, or a variable that contains it.
_COMMAND = re.compile(r"(?:\S*/)?ethercat|\$\{?\w+\}?", re.I)
#: Words before a command that do not affect what it writes.
_BEFORE = re.compile(r"do|then|else|if|while|until|!|\{|time|exec|sudo|nice|-\w+|\w+=\S*")
_SHOWS = ("echo", "printf", "logger")
_REDIRECTED = re.compile(r"\d?[<>]{1,2}\s*(?:&\d|[^\s;&|]+)")
#: Options of `ethercat` that have an argument, by their short and long names.
_WITH_WORD = {"t": "type", "p": "position", "a": "alias", "m": "master", "d": "domain"}
_HEADINGS = {"codesys": "line", "csv": "key"}
_ENTRY = struct.Struct("<HBI")
_MOST_YAML_LEVELS = 20
#: The command-line tool of the IgH master.
_PROGRAM = "ethercat"
#: Largest number of YAML nodes: a slave file with 20 000 writes, each a map of four fields.
_MOST_YAML_NODES = 200_000
#: Longest line that is read; the time of `shlex` grows with the square of a word's length.
_LONGEST_LINE = 2_000
#: Largest number of lines to analyse: twice the permitted writes, as not every one is a write.
_MOST_CANDIDATES = 40_000


def is_script(content: str) -> bool:
    """Whether a text is a script with at least one ``ethercat download``."""
    if _PROGRAM not in content:
        return False
    try:
        return any(_commands(line, place) for place, line in _candidates(content))
    except BadRow:
        return True  # it writes in an unsupported form, which is refused later with its place


def table_of(content: str) -> tuple[str, str] | None:
    """Format and separator of a table, from its first line; spreadsheets change the separator."""
    first = content.partition("\n")[0].strip()
    for separator in ";,\t":
        words = [word.strip().strip('"').lower() for word in first.split(separator)]
        for form, heading in _HEADINGS.items():
            if len(words) > 2 and words[0] == heading:
                return form, separator
    return None


def codesys(content: str, separator: str) -> Iterator[Listed]:
    """Writes from a CODESYS table (columns of the page "Startup parameters")."""
    for line, row in enumerate(csv.DictReader(io.StringIO(content), delimiter=separator), 2):
        place = line_of(line)
        index, _, subindex = (row.get("Index:Subindex") or "").partition(":")
        bits = number(row.get("Bit length"), place)
        if bits % 8 or not 8 <= bits <= 64:
            raise BadRow(text("handover.row-bit-length", place=place, bits=str(bits)[:40]))
        value = sized(number(row.get("Value"), place), bits // 8, place)
        yield listed(number(index, place), number(subindex, place), value, "PS", place)


def csv_table(content: str, separator: str) -> Iterator[Listed]:
    """Writes from a CSV table as exported by servodeck."""
    for line, row in enumerate(csv.DictReader(io.StringIO(content), delimiter=separator), 2):
        place = line_of(line)
        yield listed(
            number(row.get("index"), place),
            number(row.get("subindex"), place),
            row_of_bytes(row.get("data"), place),
            row.get("transition") or "",
            place,
        )


@dataclass(frozen=True, slots=True)
class Download:
    """One download of a script; ``slave``: master, alias and position as written there."""

    slave: tuple[str, str, str]
    write: Listed


def igh(script: str, profile: Profile) -> Iterator[Download]:
    """Every ``ethercat download`` of a script, in its order.

    Without a type option the command reads the type from the slave; here it comes from the profile.
    """
    for place, line in _candidates(script):
        for words in _commands(line, place):
            options, plain = _options(words)
            if len(plain) != 3:
                raise BadRow(text("handover.row-download-form", place=place))
            index, subindex = (_as_in_c(word, place) for word in plain[:2])
            kind = options.get("type") or _own_type(profile, index, subindex, place)
            if kind in _REAL:
                data = _real(plain[2], kind, place)
            elif kind in _SIZE:
                data = sized(_as_in_c(plain[2], place), _SIZE[kind], place)
            else:
                raise BadRow(text("handover.row-download-form", place=place))
            slave = [options.get(name, "") for name in ("master", "alias", "position")]
            write = listed(index, subindex, data, "PS", place)
            yield Download((slave[0], slave[1], slave[2]), write)


def _own_type(profile: Profile, index: int, subindex: int, place: Text) -> str:
    parameter = profile.by_key.get(f"{index:04X}:{subindex:02X}")
    if parameter is None:
        raise BadRow(
            text("handover.row-no-type", place=place, key=f"{index:04X}:{subindex:02X}"[:40])
        )
    return {"REAL32": "float"}.get(parameter.type, parameter.type.lower())


def _real(word: str, kind: str, place: Text) -> bytes:
    # Like a C++ stream, which does not accept inf and nan.
    written = re.fullmatch(r"[+-]?(\d{1,40}\.?\d{0,40}|\.\d{1,40})(e[+-]?\d{1,3})?", word, re.I)
    try:
        if written is not None:
            return _REAL[kind].pack(float(word))
    except OverflowError:
        pass
    raise BadRow(text("handover.row-no-number", place=place, word=word[:40]))


def _as_in_c(word: str, place: Text) -> int:
    """A number as `ethercat` reads it: with a leading 0 it is octal."""
    octal = re.fullmatch(r"[+-]?0[0-7]+", word.strip())
    return int(word, 8) if octal else number(word, place)


def _lines(content: str) -> list[str]:
    """Lines of a shell script; a line that ends with a backslash continues in the next."""
    lines: list[str] = []
    parts: list[str] = []
    for line in content.splitlines():
        if line.endswith("\\"):
            parts.append(line[:-1])
            lines.append("")  # keeps the numbers of the following lines
        else:
            lines.append("".join([*parts, line]))
            parts = []
    if parts:
        lines[-1] = "".join(parts)
    return lines


def _candidates(script: str) -> Iterator[tuple[Text, str]]:
    """Lines of a shell script that may contain a download, with their places.

    Raises:
        BadRow: a line is too long, or there are too many lines.
    """
    found = 0
    for at, line in enumerate(_lines(script), 1):
        before = line[: max(line.rfind("download"), 0)]
        if not ("$" in before or _PROGRAM in before.lower()) or _in_remark(before):
            continue
        found += 1
        if len(line) > _LONGEST_LINE or found > _MOST_CANDIDATES:
            raise BadRow(text("handover.row-download-form", place=line_of(at)))
        yield line_of(at), line


def _in_remark(before: str) -> bool:
    """Whether the text before contains a # that begins a comment, outside of quotes."""
    return any(
        not (before.count('"', 0, at) % 2 or before.count("'", 0, at) % 2)
        for at in (m.end() for m in re.finditer(r"(?:^|\s)(?=#)", before[:_LONGEST_LINE]))
    )


def _commands(line: str, place: Text) -> list[list[str]]:
    """Words after ``ethercat`` of each download in a line.

    Raises:
        BadRow: the line writes, but what it writes is not certain.
    """
    plain = _REDIRECTED.sub(" ", line.replace("`", " ; "))
    words = shlex.shlex(plain, posix=True, punctuation_chars=";&|()")
    words.whitespace_split = True
    found = []
    command: list[str] = []
    try:
        for word in [*words, ";"]:
            if word.strip(";&|()"):
                command.append(word)
                continue
            found.append(_download(command, place))
            command = []
    except ValueError as error:
        why = text("handover.row-refused", place=place, cause=prose(str(error)))
        raise BadRow(why) from error
    return [each for each in found if each]


def _download(command: list[str], place: Text) -> list[str]:
    """Words after ``ethercat`` where the command is a download; otherwise an empty list."""
    if command and command[0] in _SHOWS:
        return []
    for at, word in enumerate(command):
        if "$(" in word and _PROGRAM in word and "download" in word:
            raise BadRow(text("handover.row-download-form", place=place))
        if _COMMAND.fullmatch(word) and "download" in command[at + 1 :]:
            if not all(_BEFORE.fullmatch(before) for before in command[:at]):
                raise BadRow(text("handover.row-download-form", place=place))
            behind = command[at + 1 :]
            behind.remove("download")
            return behind
    return []


def _options(words: Sequence[str]) -> tuple[dict[str, str], list[str]]:
    """Options by their long names, and the positional words."""
    given = iter(words)
    options: dict[str, str] = {}
    plain: list[str] = []
    for word in given:
        if word == "--":
            plain += given
        elif word.startswith("--"):
            name, equals, value = word[2:].partition("=")
            if equals or name in _WITH_WORD.values():
                options[name] = value if equals else next(given, "")
        elif re.match(r"-[a-z]", word):
            if long := _WITH_WORD.get(word[1]):
                options[long] = word[2:] or next(given, "")
        else:
            plain.append(word)
    return options, plain


def ros2(written: str, profile: Profile, slave: int | None) -> Iterator[Listed]:
    """Writes from a slave file of ethercat_driver_ros2, or from a bus.yml of ros2_canopen."""
    # Aliases can expand a small file to an enormous one, and deep nesting takes a parser minutes.
    # No slave file has either.
    depth = count = 0
    for event in yaml.parse(written, yaml.CSafeLoader):
        if isinstance(event, yaml.AliasEvent):
            raise BadRow(text("handover.yaml-aliases"))
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if depth > _MOST_YAML_LEVELS:
            raise BadRow(text("handover.yaml-levels", levels=_MOST_YAML_LEVELS))
        count += isinstance(event, yaml.NodeEvent)
        if count > _MOST_YAML_NODES:
            raise BadRow(text("handover.yaml-nodes", nodes=_MOST_YAML_NODES))
    content = yaml.load(written, yaml.CSafeLoader)
    rows = content.get("sdo") if isinstance(content, dict) else None
    if rows is None and isinstance(content, dict):
        nodes = _bus_nodes(content)
        rows = chosen(nodes, slave) if nodes else None
    for place_number, row in enumerate(rows if isinstance(rows, list) else [], 1):
        place = prose(f"sdo {place_number}")
        if not isinstance(row, dict):
            raise BadRow(text("handover.row-sdo-form", place=place))
        index, subindex, value = (_whole(row, f, place) for f in ("index", "sub_index", "value"))
        kind = str(row.get("type") or _profile_type(profile, index, subindex))
        if kind not in _SIZE or (row.get("type") and kind not in _INTEGERS):
            # For types other than integers, ethercat_driver_ros2 writes uninitialised memory.
            raise BadRow(text("handover.row-unknown-type", place=place, type=kind[:40]))
        data = sized(value, _SIZE[kind], place)
        yield listed(index, subindex, data, "PS", place)


def _bus_nodes(content: dict[Any, Any]) -> list[Any]:
    """SDO rows of each node of a bus.yml: under `nodes` with `defaults`, or at the top level."""
    named = content.get("nodes")
    if isinstance(named, list):
        named = {
            key: each for part in named if isinstance(part, dict) for key, each in part.items()
        }
    if isinstance(named, dict):
        defaults = content.get("defaults")
        shared = defaults.get("sdo") if isinstance(defaults, dict) else None
        found = [each.get("sdo", shared) for each in named.values() if isinstance(each, dict)]
        return [rows for rows in found if rows is not None]
    return [each["sdo"] for each in content.values() if isinstance(each, dict) and "sdo" in each]


def _profile_type(profile: Profile, index: int, subindex: int) -> str:
    """Type of an object from the profile, as bus.yml states none."""
    parameter = profile.by_key.get(f"{index:04X}:{subindex:02X}")
    if parameter is None:
        return "int32"
    return {"REAL32": "uint32"}.get(parameter.type, parameter.type.lower())


def _whole(row: dict[Any, Any], field: str, place: Text) -> int:
    """An integer; in bus.yml files it may also be a quoted string."""
    value = row.get(field)
    of_field = joined((place, field), ": ")
    if isinstance(value, str):
        return number(value, of_field)
    if isinstance(value, bool) or not isinstance(value, int):
        raise BadRow(text("handover.row-no-whole-number", place=of_field, word=str(value)[:40]))
    return value


def concise_dcf(data: bytes, most: int) -> tuple[Listed, ...] | None:
    """The first ``most`` writes of a concise DCF (1F22h, CiA 302-3).

    It has a count, then index, subindex, size and data of each write. None where the bytes are not
    a concise DCF, which must end with its last entry.
    """
    if len(data) < 4:
        return None
    count = int.from_bytes(data[:4], "little")
    at = 4
    found: list[tuple[int, int, bytes]] = []
    if count > len(data) // (_ENTRY.size + 1):
        return None
    for _ in range(count):
        if at + _ENTRY.size > len(data):
            return None
        index, subindex, size = _ENTRY.unpack_from(data, at)
        at += _ENTRY.size
        value = data[at : at + size]
        at += size
        if len(value) != size or not size or index < 0x1000:
            return None
        if len(found) < most:
            found.append((index, subindex, value))
    if at != len(data) or not found:
        return None
    return tuple(
        Listed(index, subindex, value, "", text("handover.place-entry", entry=entry))
        for entry, (index, subindex, value) in enumerate(found, 1)
    )
