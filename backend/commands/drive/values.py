"""Input and output of `servodeck params`, for a drive on a bus or of a server."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import NamedTuple, Protocol, TypeVar

import typer

from backend.axes.parameters import set_file as parameter_set
from backend.commands.base.printing import note, print_text, words_of
from backend.tools.parameters import without
from drivers.errors import NotAllowed
from drivers.texts.message import language
from drivers.texts.profile_words import ProfileWords
from profiles.schema import Raw


def print_missing(data: bytes) -> None:
    """Print on standard error which settings are missing in a new set."""
    missing = without(parameter_set.parse(data).not_read)
    if missing:
        note("printed.set-is", missing=missing)


class Described(Protocol):
    """Description of a parameter, from a profile or a server."""

    @property
    def key(self) -> str:
        """Key, as 6081:00."""

    @property
    def name(self) -> str:
        """Name as text."""

    @property
    def type(self) -> str:
        """Data type."""

    @property
    def unit(self) -> str:
        """Unit of its value, or empty."""

    @property
    def enum(self) -> Mapping[int, str]:
        """Texts of its values."""

    @property
    def bits(self) -> Mapping[str, str]:
        """Texts of its bits."""


class Reported(Protocol):
    """Reading of a parameter; ``raw`` is None where ``error`` states the reason."""

    @property
    def raw(self) -> Raw | None:
        """Raw value."""

    @property
    def value(self) -> Raw | None:
        """Value in the parameter's unit."""

    @property
    def error(self) -> str:
        """Why there is no value; empty where there is one."""


class Compared(NamedTuple):
    """One row of the comparison of a set with a drive."""

    key: str
    name: str
    unit: str
    drive_raw: Raw | None
    drive_value: Raw | None
    file_raw: Raw | None
    file_value: Raw | None
    status: str
    problem: str
    selected: bool

    @property
    def differs(self) -> bool:
        """Whether the drive has another value."""
        return self.status == "differs"


D = TypeVar("D", bound=Described)

#: Mask of the widest value with bits, so that a negative one is shown as its bit pattern.
_WIDEST = 0xFFFF_FFFF
#: Message codes of the status of a row in a comparison.
_STATUS = {
    "differs": "printed.row-differs",
    "same": "printed.row-same",
    "not_in_drive": "printed.row-not-in-drive",
    "not_in_file": "printed.row-not-in-file",
    "invalid": "printed.row-invalid",
    "read_only": "printed.row-read-only",
    "energises": "printed.row-energises",
}


def finite(key: str, name: str, text: str) -> float:
    """The number that a text gives for a parameter.

    Raises:
        NotAllowed: it is not a number, or not finite.
    """
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise NotAllowed("command.not-number", parameter=key, value=text, name=name)
    return number


def assignment(find: Callable[[str], D], text: str) -> tuple[D, Raw]:
    """Parameter and value of ``KEY=VALUE`` as typed.

    Raises:
        NotAllowed: not an assignment, no such parameter, or not a number where one is needed.
    """
    key, separator, value = text.partition("=")
    if not separator:
        raise NotAllowed("command.no-assignment", text=text)
    parameter = find(key)
    if parameter.type in ("STRING", "OCTETS"):
        return parameter, value
    try:
        return parameter, int(value, 0)
    except ValueError:
        return parameter, finite(parameter.key, parameter.name, value)


def line(parameter: Described, reported: Reported, family: str) -> str:
    """A parameter of this drive family and its value as a line of text."""
    say = ProfileWords(family, language())
    name = say(parameter.name)
    if reported.raw is None:
        return f"{parameter.key}  {name}: {reported.error or words_of('printed.not-read')}"
    label = say(_label(parameter, reported))
    shown = _in_unit(reported.raw, reported.value, parameter.unit)
    if parameter.bits and isinstance(reported.raw, int):
        shown = f"{reported.raw} ({reported.raw & _WIDEST:#06x})"
    return f"{parameter.key}  {name} = {shown}" + (f" ({label})" if label else "")


def show_readings(
    read: Iterable[tuple[Described, Reported]], family: str, *, as_json: bool
) -> bool:
    """Print parameters with their values; return whether each has one."""
    rows = list(read)
    if as_json:
        print(json.dumps([_row(parameter, reported) for parameter, reported in rows], indent=1))
    else:
        for parameter, reported in rows:
            print(line(parameter, reported, family))
    return all(reported.raw is not None for _, reported in rows)


def _row(parameter: Described, reported: Reported) -> dict[str, object]:
    return {
        "key": parameter.key,
        "name": parameter.name,
        "value": reported.value,
        "unit": parameter.unit,
        "raw": reported.raw,
        "label": _label(parameter, reported),
        "error": reported.error,
    }


def _label(parameter: Described, reported: Reported) -> str:
    return parameter.enum.get(reported.raw, "") if isinstance(reported.raw, int) else ""


def _in_unit(raw: Raw | None, value: Raw | None, unit: str) -> str:
    if raw is None:
        return words_of("limit.none")
    return f"{value} {unit}".rstrip() + (f"  [raw {raw}]" if raw != value else "")


def bytes_of(file: Path) -> bytes:
    """Contents of a file given on the command line.

    Raises:
        NotAllowed: it cannot be read.
    """
    try:
        return file.read_bytes()
    except OSError as error:
        raise NotAllowed(
            "command.cannot-read-name-file", file=str(file), strerror=error.strerror
        ) from error


def other_family(file: str, theirs: str, drive: str, ours: str) -> NotAllowed:
    """The error of a set that belongs to another drive family."""
    return NotAllowed("command.drive", drive=drive, file=file, theirs=theirs, ours=ours)


def show(rows: Iterable[Compared], family: str, *, as_json: bool = False) -> None:
    """Print a comparison."""
    if as_json:
        print(json.dumps([row._asdict() for row in rows], indent=1))
        return
    say = ProfileWords(family, language())
    for row in rows:
        name = say(row.name)
        if row.differs:
            ours = _in_unit(row.drive_raw, row.drive_value, row.unit)
            theirs = _in_unit(row.file_raw, row.file_value, row.unit)
            print_text("printed.value-differs", key=row.key, name=name, drive=ours, file=theirs)
        else:
            status = words_of(_STATUS[row.status])
            print(f"{row.key}  {name}: {status}" + (f" {row.problem}" if row.problem else ""))


def chosen(rows: Iterable[Compared], family: str, *, yes: bool) -> list[str]:
    """Show the differences, ask for confirmation and return the keys to write; may be empty.

    Raises:
        NotAllowed: the person declined.
    """
    rows = list(rows)
    show(rows, family)
    keys = [row.key for row in rows if row.selected]
    if not keys:
        print_text("printed.nothing-to-write")
    elif not yes and not typer.confirm(words_of("printed.write-these", count=len(keys))):
        raise NotAllowed("command.nothing-written")
    return keys


def loaded(result: Mapping[str, object]) -> bool:
    """Print the result of a load; return whether the drive kept every value."""
    print_text("printed.set-loaded", written=str(result["written"]), failed=str(result["failed"]))
    print_text("printed.values-before", file=str(result["backup"]))
    return result["failed"] == 0
