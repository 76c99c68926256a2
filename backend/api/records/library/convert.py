"""Conversion of library values to messages."""

from __future__ import annotations

from collections.abc import Mapping

from backend.api.messages.errors import message_of, message_or_none, words_of
from backend.api.records.library.models import (
    AxisInfo,
    LibraryEntry,
    StoredSet,
    ThreeWayRow,
    VersionInfo,
)
from backend.records.library.entries import AxisIdentity, Entry, Version
from backend.records.library.three_way import Triple
from drivers.texts.answers import message_in
from drivers.texts.message import Text
from profiles.schema import Parameter, Raw

#: Facts used for searching and the index only, not shown to people.
_INNER = frozenset({"words", "stamp"})


def axis(known: AxisIdentity) -> AxisInfo:
    """Identity of an axis."""
    return AxisInfo(
        profile=known.profile,
        name=known.name,
        vendor_id=known.vendor_id,
        product_code=known.product_code,
        revision=known.revision,
        serial=known.serial,
        firmware=known.firmware,
    )


def _facts(known: Mapping[str, object]) -> dict[str, int | float | str | bool | None]:
    return {
        name: value
        for name, value in known.items()
        if name not in _INNER and (value is None or isinstance(value, (int, float, str, bool)))
    }


def version(known: Version) -> VersionInfo:
    """One version."""
    problem = message_in(known.facts, "problem")
    facts = _facts(known.facts)
    if problem is not None:
        facts["problem"] = words_of(problem)
    return VersionInfo(
        number=known.number,
        saved=known.saved,
        author=known.author,
        notes=known.notes,
        bytes=known.bytes,
        sha256=known.sha256,
        axis=axis(known.axis),
        facts=facts,
        problem_message=message_or_none(problem),
    )


def entry(known: Entry, station: str) -> LibraryEntry:
    """An entry as seen from this station."""
    return LibraryEntry(
        id=known.id,
        kind=known.kind,
        station=known.station,
        here=known.station in ("", station),
        name=known.name,
        notes=known.notes,
        tags=list(known.tags),
        changed=known.changed,
        deleted=known.deleted,
        versions=known.versions,
        latest=version(known.latest),
    )


def stored_set(known: Entry) -> StoredSet:
    """A stored parameter set."""
    latest = known.latest
    count = latest.facts.get("parameters")
    return StoredSet(
        file=known.name,
        profile=latest.axis.profile,
        drive_name=latest.axis.name,
        serial=latest.axis.serial,
        firmware=latest.axis.firmware,
        author=latest.author,
        saved=latest.saved,
        notes=latest.notes,
        count=count if isinstance(count, int) else 0,
        entry=known.id,
        version=latest.number,
        tags=list(known.tags),
    )


def unusable_set(file: str, problem: Text) -> StoredSet:
    """A file in the folder that is not a parameter set."""
    return StoredSet(
        file=file, profile="", drive_name="", serial=None, firmware="", author="", saved=None,
        notes="", count=0, problem=words_of(problem), problem_message=message_of(problem),
    )  # fmt: skip


def triple(row: Triple) -> ThreeWayRow:
    """One row of a three-way comparison."""
    known = row.parameter
    return ThreeWayRow(
        key=row.key,
        name=known.name if known else "",
        group=known.group if known else "",
        unit=known.unit if known else "",
        base_raw=row.base,
        base_value=_value(known, row.base),
        theirs_raw=row.theirs,
        theirs_value=_value(known, row.theirs),
        drive_raw=row.ours,
        drive_value=_value(known, row.ours),
        status=row.status,
        problem=words_of(row.problem),
        problem_message=message_or_none(row.problem),
        motor_individual=bool(known and known.motor_individual),
        selected=row.selected,
    )


def _value(parameter: Parameter | None, raw: Raw | None) -> Raw | None:
    if raw is None or parameter is None or isinstance(raw, str):
        return raw
    return parameter.to_value(raw)
