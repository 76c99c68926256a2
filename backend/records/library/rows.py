"""Conversion between the library's tables and its records: rows to records, searches to queries."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import cast

from sqlalchemy import Select, and_, exists, select

from backend.foundation.store.library_tables import Item, Tag
from backend.foundation.store.library_tables import Version as VersionRow
from backend.records.audit.trail import like
from backend.records.library.entries import Addition, AxisIdentity, Entry, Kind, Query, Version


def entry(item: Item) -> Entry:
    """An entry with its latest version."""
    return Entry(
        id=item.id,
        kind=cast("Kind", item.kind),
        station=item.station,
        name=item.name,
        notes=item.notes,
        tags=tuple(sorted(tag.tag for tag in item.tags)),
        changed=item.changed,
        deleted=item.deleted,
        latest=version(item.versions[-1]),
        versions=len(item.versions),
    )


def version(row: VersionRow) -> Version:
    """A version from its row."""
    return Version(
        number=row.number,
        saved=row.saved,
        author=row.author,
        notes=row.notes,
        bytes=row.bytes,
        sha256=row.sha256,
        axis=AxisIdentity(
            profile=row.profile,
            name=row.axis,
            vendor_id=row.vendor_id,
            product_code=row.product_code,
            revision=row.revision,
            serial=row.serial,
            firmware=row.firmware,
        ),
        facts=row.facts,
        place=row.place,
    )


def new_version(
    number: int, place: str, digest: str, size: int, addition: Addition, now: datetime
) -> VersionRow:
    """The row of a new version."""
    axis = addition.axis
    return VersionRow(
        number=number,
        saved=addition.saved or now,
        author=addition.author[:200],
        notes=addition.notes,
        place=place,
        sha256=digest,
        bytes=size,
        profile=axis.profile[:100],
        axis=axis.name[:200],
        vendor_id=axis.vendor_id,
        product_code=axis.product_code,
        revision=axis.revision,
        serial=axis.serial,
        firmware=axis.firmware[:100],
        facts=dict(addition.facts),
    )


def words(item: Item) -> str:
    """All text that a search covers, in lower case."""
    latest = item.versions[-1]
    parts = [
        item.name, item.notes, *(tag.tag for tag in item.tags), latest.notes, latest.author,
        latest.axis, latest.profile, latest.firmware, str(latest.facts.get("words", "")),
    ]  # fmt: skip
    if latest.serial is not None:
        parts.append(str(latest.serial))
    return " ".join(parts).lower()


def matching(query: Query) -> Select[Item]:
    """Query for the items of a search, without an order."""
    found = select(Item)
    found = found.where(Item.deleted.is_not(None) if query.deleted else Item.deleted.is_(None))
    for word in query.words.lower().split():
        found = found.where(Item.words.like(f"%{like(word)}%", escape="\\"))
    if query.kinds:
        found = found.where(Item.kind.in_(query.kinds))
    if query.tag:
        found = found.where(exists().where(Tag.item_id == Item.id, Tag.tag == query.tag))
    if query.without:
        found = found.where(~exists().where(Tag.item_id == Item.id, Tag.tag == query.without))
    of_version = []
    if query.axis:
        of_version.append(VersionRow.axis == query.axis)
    if query.serial is not None:
        of_version.append(VersionRow.serial == query.serial)
    if query.profile:
        of_version.append(VersionRow.profile == query.profile)
    if of_version:
        found = found.where(exists().where(and_(VersionRow.item_id == Item.id, *of_version)))
    if query.since is not None:
        found = found.where(Item.changed >= query.since.astimezone(UTC))
    if query.until is not None:
        found = found.where(Item.changed < query.until.astimezone(UTC))
    return found
