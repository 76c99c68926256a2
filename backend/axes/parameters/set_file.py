"""Parameter sets as files: an open, readable, versioned text format (TOML).

The format is described in docs/parameter-sets.md. A file ends with an ``[end]`` table, so that a
truncated file is detected even when the cut is between two rows. A bad row does not affect the
others; a file that is damaged as a whole is refused.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Literal

from backend.axes.drive.drive import Drive
from backend.axes.drive.readings import Reading
from backend.axes.motion.alternatives import refused
from backend.axes.motion.classes import motion_of
from backend.axes.parameters.toml_keys import deepest_key
from drivers.errors import DriveError, NotAllowed, with_remedy
from drivers.texts.message import Text, text
from profiles.schema import Parameter, Profile, Raw

FORMAT = "servodeck parameter set"
VERSION = 1
SUFFIX = ".sdset"
MAX_BYTES = 4_000_000
#: The format has no dotted keys; this leaves room for tables of later versions.
_DEEPEST_KEY = 8

Status = Literal[
    "differs", "same", "not_in_drive", "not_in_file", "invalid", "read_only", "energises"
]


class BadSet(NotAllowed):
    """A file cannot be used as a parameter set; the message states why."""

    kind = "bad-parameter-set"


@dataclass(frozen=True, slots=True)
class Row:
    """One parameter of a file. ``raw`` is None where the row is bad, with ``problem`` set."""

    key: str
    raw: Raw | None
    name: str = ""
    unit: str = ""
    problem: Text | None = None


@dataclass(frozen=True, slots=True)
class ParameterSet:
    """Contents of a file."""

    profile: str
    drive_name: str
    serial: int | None
    firmware: str
    author: str
    saved: datetime | None
    notes: str
    rows: tuple[Row, ...]
    vendor_id: int | None = None
    product_code: int | None = None
    revision: int | None = None
    not_read: tuple[str, ...] = ()
    """Keys of settings that could not be read when the file was made."""


@dataclass(frozen=True, slots=True)
class Difference:
    """One row of a comparison; raw values, None where absent."""

    parameter: Parameter | None
    key: str
    theirs: Raw | None
    ours: Raw | None
    status: Status
    problem: Text | None = None
    selected: bool = False


def storable(profile: Profile, *, motor_individual: bool) -> list[Parameter]:
    """Parameters that belong in a set: readable and writable settings.

    Left out: commands and setpoints, the communication area 1000h–1FFFh (its mapping objects depend
    on the master), and parameters of the individual motor unless ``motor_individual``.
    """
    commands = {
        step.key for proc in profile.procedures for step in proc.steps if step.do == "write"
    }
    roles = {
        "control_word", "mode", "position_target", "position_offset", "velocity_target",
        "velocity_offset", "torque_target", "torque_offset",
    }  # fmt: skip
    commands |= {signal.key for signal in profile.signals if signal.role in roles}
    return [
        p
        for p in profile.parameters
        if p.access == "rw"
        and p.key not in commands
        and not (p.index is not None and p.index < 0x2000)
        and (motor_individual or not p.motor_individual)
    ]


def dump(
    drive: Drive, readings: Iterable[Reading], *, author: str, notes: str, saved: datetime
) -> bytes:
    """The file of these readings; those without a value are left out and named at its end."""
    profile, found = drive.profile, drive.found
    lines = [
        f"# {FORMAT}; see docs/parameter-sets.md. Values are written from `raw`;",
        "# `value`, `unit` and `name` are for people.",
        f"format = {_text(FORMAT)}",
        f"version = {VERSION}",
        "",
        "[identity]",
        f"profile = {_text(profile.drive)}",
        f"title = {_text(profile.title)}",
        f"drive = {_text(drive.name)}",
        f"firmware = {_text(found.firmware if found else '')}",
    ]
    if found is not None:
        for field in ("vendor_id", "product_code", "revision", "serial"):
            value = getattr(found, field)
            if value is not None:
                lines.append(f"{field} = {value}")
    lines += [
        "",
        "[about]",
        f"saved = {saved.astimezone(UTC).isoformat(timespec='seconds').replace('+00:00', 'Z')}",
        f"author = {_text(author)}",
        f"notes = {_text(notes)}",
    ]
    count = 0
    group = None
    not_read = []
    for reading in readings:
        parameter = drive.parameter(reading.key)
        if reading.raw is None:
            lines.append(f"# {reading.key} {parameter.name}: not read: {_comment(reading.error)}")
            if not reading.unused:
                not_read.append(reading.key)
            continue
        if parameter.group != group:
            group = parameter.group
            lines += ["", f"# --- {_comment(group)}"]
        lines += ["[[parameter]]", f"key = {_text(parameter.key)}", f"raw = {_raw(reading.raw)}"]
        if parameter.unit:
            lines += [f"value = {_raw(reading.value)}", f"unit = {_text(parameter.unit)}"]
        lines.append(f"name = {_text(parameter.name)}")
        count += 1
    lines += ["", "[end]", f"parameters = {count}"]
    if not_read:
        lines.append(f"not_read = [{', '.join(map(_text, not_read))}]")
    return "\n".join([*lines, ""]).encode()


def parse(data: bytes, name: str = "the file") -> ParameterSet:
    """Read a file.

    Raises:
        BadSet: not a parameter set, of another version, damaged or truncated.
    """
    if len(data) > MAX_BYTES:
        raise BadSet("sets.larger-bytes", name=name, max_bytes=MAX_BYTES)
    try:
        written = data.decode("utf-8")
        if deepest_key(written) > _DEEPEST_KEY:
            raise BadSet("sets.no-parameter-set-servodeck", name=name)
        content = tomllib.loads(written)
    except (ValueError, RecursionError) as error:  # also of dates and of numbers without end
        raise BadSet("sets.damaged-no-parameter-set", name=name, cause=str(error)) from error
    if content.get("format") != FORMAT:
        raise BadSet("sets.no-parameter-set-servodeck", name=name)
    version = content.get("version")
    if version != VERSION:
        raise BadSet(
            "sets.format-version-program-reads",
            name=name,
            version=version if isinstance(version, (int, str)) else repr(version),
            other_version=VERSION,
        )
    if "end" not in content:
        raise BadSet("sets.truncated-end-missing", name=name)
    identity, about = _table(content, "identity", name), _table(content, "about", name)
    rows = content.get("parameter", [])
    if not isinstance(rows, list):
        raise BadSet("sets.parameter-rows-missing", name=name)
    saved = about.get("saved")
    if not isinstance(saved, datetime) or not 1 < saved.year < 9999:
        saved = None  # at the ends of the calendar, some time zone cannot express it
    return ParameterSet(
        profile=str(identity.get("profile", "")),
        drive_name=str(identity.get("drive", "")),
        serial=_number(identity, "serial"),
        firmware=str(identity.get("firmware", "")),
        author=str(about.get("author", "")),
        saved=saved,
        notes=str(about.get("notes", "")),
        rows=tuple(_row(row, number) for number, row in enumerate(rows, 1)),
        vendor_id=_number(identity, "vendor_id"),
        product_code=_number(identity, "product_code"),
        revision=_number(identity, "revision"),
        not_read=_keys(content["end"], "not_read"),
    )


def _keys(table: object, field: str) -> tuple[str, ...]:
    value = table.get(field) if isinstance(table, dict) else None
    return tuple(map(str, value)) if isinstance(value, list) else ()


def _number(table: dict[str, Any], field: str) -> int | None:
    value = table.get(field)
    # The database holds signed 64 bits; identity objects have 32 (CiA 301 clause 7.5.2.21).
    known = isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 1 << 63
    return value if known else None


def _table(content: dict[str, Any], field: str, name: str) -> dict[str, Any]:
    table = content.get(field)
    if not isinstance(table, dict):
        raise BadSet("sets.missing", name=name, field=field)
    return table


def _row(row: object, number: int) -> Row:
    if not isinstance(row, dict) or not isinstance(row.get("key"), str):
        return Row(f"#{number}", None, problem=text("sets.row-no-key", row=number))
    raw = row.get("raw")
    name, unit = str(row.get("name", "")), str(row.get("unit", ""))
    if isinstance(raw, bool) or not isinstance(raw, (int, float, str)):
        why = text("sets.row-no-value", row=number, raw=repr(raw))
        return Row(row["key"], None, name, unit, why)
    return Row(row["key"], raw, name, unit)


def compare(drive: Drive, rows: Iterable[Row], ours: dict[str, Reading]) -> list[Difference]:
    """Compare rows of a file (or of another drive, or defaults) with readings of this drive."""
    result: list[Difference] = []
    seen: set[str] = set()
    for row in rows:
        parameter = drive.profile.by_key.get(row.key)
        if row.key in seen:
            twice = text("sets.row-twice")
            result.append(Difference(parameter, row.key, row.raw, None, "invalid", twice))
            continue
        seen.add(row.key)
        result.append(_difference(drive, parameter, row, ours.get(row.key)))
    for key, reading in ours.items():
        if key not in seen and reading.raw is not None:
            parameter = drive.profile.by_key[key]
            result.append(Difference(parameter, key, None, reading.raw, "not_in_file"))
    return result


def _difference(
    drive: Drive, parameter: Parameter | None, row: Row, ours: Reading | None
) -> Difference:
    now = ours.raw if ours else None
    if parameter is None:
        lacks = text("sets.row-no-parameter", profile_title=drive.profile.title, key=row.key)
        return Difference(None, row.key, row.raw, None, "not_in_drive", row.problem or lacks)
    if row.raw is None:
        return Difference(parameter, row.key, None, now, "invalid", row.problem)
    problem = drive.unreachable_why(parameter) or (None if ours is None else ours.problem)
    if problem is not None:
        return Difference(parameter, row.key, row.raw, None, "not_in_drive", problem)
    if parameter.access == "ro":
        return Difference(parameter, row.key, row.raw, now, "read_only")
    try:
        drive.check(parameter, row.raw)
    except DriveError as error:
        return Difference(parameter, row.key, row.raw, now, "invalid", error.text)
    if row.raw == now:
        return Difference(parameter, row.key, row.raw, now, "same")
    if motion_of(parameter) == "energises":
        no = refused(drive.name, drive.profile, parameter)
        problem = with_remedy(no)
        return Difference(parameter, row.key, row.raw, now, "energises", problem)
    return Difference(
        parameter, row.key, row.raw, now, "differs", selected=not parameter.motor_individual
    )


def _text(value: str) -> str:
    # A JSON string without surrogates is a TOML basic string; DEL is the one exception.
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")


def _comment(value: str) -> str:
    return " ".join(value.split())


def _raw(value: Raw | None) -> str:
    if isinstance(value, str):
        return _text(value)
    return repr(value) if value is not None else _text("")
