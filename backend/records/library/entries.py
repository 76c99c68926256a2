"""Records of the library: entries, versions and searches."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Literal

from drivers.errors import NotAllowed

Kind = Literal["set", "recording", "measurement", "report"]
KINDS: tuple[Kind, ...] = ("set", "recording", "measurement", "report")

#: JSON values of facts that a list shows.
Fact = int | float | str | bool | None
MAX_TAGS = 20
MAX_TAG = 60
MAX_NOTES = 4000


class ChangedMeanwhile(NotAllowed):
    """Another person changed the notes or tags meanwhile; ``value`` is what they are now."""

    kind = "changed-meanwhile"


@dataclass(frozen=True, slots=True)
class Remarks:
    """Notes and tags, each None where it is not concerned."""

    notes: str | None = None
    tags: tuple[str, ...] | None = None


def require_unchanged(now: Remarks, base: Remarks, wanted: Remarks) -> None:
    """Check that nobody changed notes or tags since a person read them as ``base``.

    A change to the same contents does no harm. A field without a base is not checked.

    Raises:
        ChangedMeanwhile: they are different now.
    """
    if None not in (base.notes, wanted.notes) and now.notes not in (base.notes, wanted.notes):
        raise ChangedMeanwhile("library.notes-changed", parameter="notes", value=now.notes)
    if base.tags is None or wanted.tags is None or now.tags is None:
        return
    if set(now.tags) not in (set(base.tags), set(wanted.tags)):
        tags = ", ".join(now.tags)
        raise ChangedMeanwhile("library.tags-changed", parameter="tags", value=tags)


@dataclass(frozen=True, slots=True)
class AxisIdentity:
    """The drive that an entry was made with. ``name``: the axis' name at that time."""

    profile: str = ""
    name: str = ""
    vendor_id: int | None = None
    product_code: int | None = None
    revision: int | None = None
    serial: int | None = None
    firmware: str = ""


@dataclass(frozen=True, slots=True)
class Version:
    """One state of an entry; never changed. ``number`` counts from 1."""

    number: int
    saved: datetime
    author: str
    notes: str
    bytes: int
    sha256: str
    axis: AxisIdentity
    facts: Mapping[str, object]
    place: str


@dataclass(frozen=True, slots=True)
class Entry:
    """A named entry. ``station`` is empty for an entry shared by all stations of the database."""

    id: int
    kind: Kind
    station: str
    name: str
    notes: str
    tags: tuple[str, ...]
    changed: datetime
    deleted: datetime | None
    latest: Version
    versions: int


@dataclass(frozen=True, slots=True)
class Addition:
    """Data of a new version to be stored: axis, author, and facts that a list shows."""

    axis: AxisIdentity = AxisIdentity()
    author: str = ""
    notes: str = ""
    saved: datetime | None = None
    facts: Mapping[str, object] = field(default_factory=dict)
    tags: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Query:
    """A search; empty fields do not restrict it. All ``words`` must occur, in any case."""

    words: str = ""
    kinds: tuple[Kind, ...] = ()
    tag: str = ""
    without: str = ""
    """A tag that entries must not have."""
    axis: str = ""
    serial: int | None = None
    profile: str = ""
    since: datetime | None = None
    until: datetime | None = None
    deleted: bool = False
    limit: int = 200
    offset: int = 0
