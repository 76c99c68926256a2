"""Values that a controller's list would overwrite, and defects of the list itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Literal, Protocol

from backend.axes.motion.classes import motion_of
from backend.records.handover.listed import ControllerList, Listed
from backend.records.handover.model import (
    Consequence,
    StartupWrite,
    Transition,
    consequence,
    locks,
    rank,
    write_of,
)
from drivers.errors import DriveError
from drivers.objects.codec import decode, encode, size_of
from drivers.texts.message import Param, Text, text
from profiles.schema import Parameter, Profile, Raw

Defect = Literal[
    "unknown", "read_only", "size", "range", "twice", "order", "state", "energises", "locks"
]
_DEFECTS: dict[Defect, str] = {
    "unknown": "handover.defect-unknown",
    "read_only": "handover.defect-read-only",
    "size": "handover.defect-size",
    "range": "handover.defect-range",
    "twice": "handover.defect-twice",
    "order": "handover.defect-order",
    "state": "handover.defect-state",
    "energises": "handover.defect-energises",
    "locks": "handover.defect-locks",
}
_OVERWRITES: dict[Consequence, str] = {
    "gain": "handover.overwrites-gain",
    "limit": "handover.overwrites-limit",
    "unit": "handover.overwrites-unit",
    "motion": "handover.overwrites-motion",
    "other": "handover.overwrites-other",
}
#: Upward transitions in which the mailbox works (ETG.1000.6); empty where a format states none.
_STATES = ("IP", "PS", "SO", "")
#: Objects that configure the process data, which every list writes (ETG.1000.6 clause 5.6.7).
_PDO_OBJECTS = (range(0x1600, 0x1800), range(0x1A00, 0x1C00), range(0x1C12, 0x1C14))


@dataclass(frozen=True, slots=True)
class Conflict:
    """A value that the controller writes and that differs from ours.

    Raw values: ``ours`` of the set, ``drive`` of the drive now; None where they are not known.
    Where the set has no such value, that of the drive counts.
    """

    key: str
    name: str
    controller: Raw
    ours: Raw | None
    drive: Raw | None
    consequence: Consequence
    sentence: Text


@dataclass(frozen=True, slots=True)
class Finding:
    """A defect of the list, which would cause an error of the machine at start-up or later."""

    kind: Defect
    key: str
    place: Text
    text: Text


@dataclass(frozen=True, slots=True)
class Verdict:
    """Result of a comparison: conflicts in the order of the list, and defects."""

    conflicts: tuple[Conflict, ...]
    findings: tuple[Finding, ...]
    not_written: tuple[str, ...]
    """Keys of our set that the controller does not write; they keep their values in the drive."""
    restored: tuple[str, ...]
    """Keys whose value in the drive has changed and to which the controller writes our value."""
    unknown_here: tuple[str, ...]
    """Keys that the controller writes and for which neither set nor drive has a value."""
    not_read: tuple[str, ...]
    """Keys that the controller writes and that could not be read from the drive, so that it is not
    known whether the controller changes them."""
    same: int


def value_of(profile: Profile, write: Listed) -> Raw | None:
    """The raw value of a write; None where the object is unknown or has another size."""
    parameter = profile.by_key.get(write.key)
    if parameter is None or size_of(parameter.type) not in (None, len(write.data)):
        return None
    return decode(parameter.type, write.data)


def resolved(profile: Profile, listed: ControllerList) -> tuple[StartupWrite, ...]:
    """The list as start-up writes, which can be exported again; without unknown objects."""
    found = []
    for write in listed.writes:
        raw = value_of(profile, write)
        if raw is not None:
            transition: Transition = "SO" if write.transition == "SO" else "PS"
            found.append(write_of(profile.by_key[write.key], raw, transition))
    return tuple(found)


def compare(
    profile: Profile,
    listed: ControllerList,
    ours: Mapping[str, Raw] | None,
    drive: Mapping[str, Raw | None] | None,
) -> Verdict:
    """Compare the controller's list with the set and with the drive, each where it is given.

    The last write of an object counts, as it does in the drive.
    """
    conflicts: list[Conflict] = []
    restored: list[str] = []
    alone: list[str] = []
    same = 0
    last = {write.key: write for write in listed.writes}
    for key, write in last.items():
        raw = value_of(profile, write)
        if raw is None:
            continue
        parameter = profile.by_key[key]
        set_raw = ours.get(key) if ours else None
        drive_raw = drive.get(key) if drive else None
        before = set_raw if set_raw is not None else drive_raw
        if before is None:
            alone.append(key)
        elif not _equal(parameter, raw, before):
            conflicts.append(_conflict(profile, parameter, raw, set_raw, drive_raw))
        elif drive_raw is not None and not _equal(parameter, raw, drive_raw):
            restored.append(key)
        else:
            same += 1
    missing = tuple(key for key in ours or () if key not in last)
    unread = tuple(
        key
        for key in last
        if drive is not None
        and drive.get(key) is None
        and key in profile.by_key
        and profile.by_key[key].access != "wo"
    )
    return Verdict(
        tuple(conflicts),
        diagnose(profile, listed),
        missing,
        tuple(restored),
        tuple(alone),
        unread,
        same,
    )


def changed_since(
    profile: Profile, ours: Mapping[str, Raw], drive: Mapping[str, Raw | None]
) -> tuple[Conflict, ...]:
    """Values of a set that have changed in the drive; values that were not read are left out."""
    found = []
    for key, raw in ours.items():
        parameter, now = profile.by_key.get(key), drive.get(key)
        if parameter is None or now is None or _equal(parameter, raw, now):
            continue
        name = " ".join(parameter.name.split())
        before, after = shown(parameter, raw), shown(parameter, now)
        sentence = text("handover.changed-since", name=name, key=key, before=before, after=after)
        kind = consequence(profile, parameter)
        found.append(Conflict(key, name, now, raw, now, kind, sentence))
    return tuple(found)


def _equal(parameter: Parameter, one: Raw, other: Raw) -> bool:
    """Whether both values have the same bytes; a typed REAL32 has more digits than its type."""
    try:
        return encode(parameter.type, one) == encode(parameter.type, other)
    except DriveError:
        return one == other


def shown(parameter: Parameter, raw: Raw) -> str:
    """A raw value in the parameter's unit, with the raw value where it differs."""
    value = parameter.to_value(raw)
    unit = f" {parameter.unit}" if parameter.unit else ""
    return f"{value}{unit}" + (f" (raw {raw})" if value != raw else "")


def _conflict(
    profile: Profile, parameter: Parameter, raw: Raw, ours: Raw | None, drive: Raw | None
) -> Conflict:
    kind = consequence(profile, parameter)
    before = ours if ours is not None else drive
    assert before is not None
    name = " ".join(parameter.name.split())
    sentence = text(
        _OVERWRITES[kind],
        name=name,
        key=parameter.key,
        before=shown(parameter, before),
        after=shown(parameter, raw),
    )
    return Conflict(parameter.key, name, raw, ours, drive, kind, sentence)


def diagnose(profile: Profile, listed: ControllerList) -> tuple[Finding, ...]:
    """Defects of a list according to the family's profile."""
    found: list[Finding] = []
    seen: dict[str, Text] = {}
    highest, before = -2, ""
    for write in listed.writes:
        parameter = profile.by_key.get(write.key)

        note = partial(_noted, found, write)
        # A PDO assignment or mapping is cleared, filled and then given its length, so several
        # writes of one object are normal.
        fills_pdo = any(write.index in each for each in _PDO_OBJECTS)
        if write.key in seen and not fills_pdo:
            note("twice", before=seen[write.key])
        seen.setdefault(write.key, write.place)
        if write.transition not in _STATES:
            note("state", transition=write.transition[:10])
        if parameter is None:
            if not fills_pdo:
                note("unknown", title=profile.title)
            continue
        _check(profile, parameter, write, note)
        place = rank(profile, parameter)
        if listed.ordered and place <= 0 < highest:
            note("order", before=before)
        if place > highest:
            highest, before = place, write.key
    return tuple(found)


def _noted(found: list[Finding], at: Listed, kind: Defect, /, **facts: Param) -> None:
    words = text(_DEFECTS[kind], place=at.place, key=at.key, **facts)
    found.append(Finding(kind, at.key, at.place, words))


class _Note(Protocol):
    """Function that records a finding."""

    def __call__(self, kind: Defect, /, **facts: Param) -> None: ...


def _check(profile: Profile, parameter: Parameter, write: Listed, note: _Note) -> None:
    if parameter.access == "ro":
        note("read_only")
        return
    if motion_of(parameter) == "energises":
        note("energises")
    size = size_of(parameter.type)
    if size is None:
        return
    if size != len(write.data):
        note("size", length_bytes=len(write.data), type=parameter.type, size_bytes=size)
        return
    raw = decode(parameter.type, write.data)
    if locks(profile, parameter, raw):
        note("locks")
    low, high = parameter.raw_limits
    if not isinstance(raw, str) and (
        (low is not None and raw < low) or (high is not None and raw > high)
    ):
        note("range", raw=raw, low=low, high=high)
