"""The library in the database: named entries with versions that are never changed.

All functions block and must run on a thread (`Store.call`). Contents up to `INLINE` bytes are in
the database, so that they are stored together with their row; larger ones are blobs.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from datetime import UTC, datetime, timedelta

from sqlalchemy import Select, func, select
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session, selectinload

from backend.foundation.store.blobs import BlobFailed, Blobs
from backend.foundation.store.database import DatabaseFailed, Store
from backend.foundation.store.library_tables import Content, Item, Tag
from backend.foundation.store.library_tables import Version as VersionRow
from backend.records.audit.facts import Action, Value
from backend.records.audit.facts import Fact as AuditFact
from backend.records.library import rows
from backend.records.library.entries import (
    MAX_NOTES,
    MAX_TAG,
    MAX_TAGS,
    Addition,
    Entry,
    Kind,
    Query,
    Remarks,
    Version,
    require_unchanged,
)
from drivers.errors import NotAllowed
from drivers.texts import limits
from drivers.texts.message import text

INLINE = 1_000_000
#: Age of unused blobs before they are deleted: longer than storing an entry takes.
_BLOB_AGE = timedelta(days=1)
#: PostgreSQL lock held while contents are stored, so that unused ones are not deleted meanwhile.
_CONTENTS_LOCK = 0x5E2D0DED


class NotInLibrary(NotAllowed):
    """There is no such entry or version."""

    kind = "not-found"


class Library:
    """The library of a store. ``record`` is called with every change (see `audit`)."""

    def __init__(
        self,
        store: Store,
        blobs: Blobs,
        record: Callable[[AuditFact], None] = lambda _fact: None,
    ) -> None:
        self.store = store
        self.blobs = blobs
        self._record = record

    # --- finding ----------------------------------------------------------------------

    def search(self, query: Query) -> tuple[list[Entry], int]:
        """A page of entries, newest first, and their total number.

        Raises:
            DatabaseFailed: an error of the database.
        """
        wanted = rows.matching(query)
        with self.store.reading(snapshot=True) as session:
            total = session.scalar(select(func.count()).select_from(wanted.subquery())) or 0
            page = wanted.order_by(Item.changed.desc(), Item.id.desc())
            found = self._entries(session, page.limit(query.limit).offset(query.offset))
        return found, total

    def entry(self, entry_id: int) -> Entry:
        """One entry, also a deleted one.

        Raises:
            NotInLibrary: there is none.
        """
        with self.store.reading() as session:
            return _loaded(self._item(session, entry_id))

    def named(self, kind: Kind, name: str, station: str = "") -> Entry | None:
        """The entry of this name that is not deleted, or None."""
        with self.store.reading() as session:
            item = _by_name(session, kind, name, station)
            return _loaded(item) if item is not None and item.deleted is None else None

    def all_of(self, kind: Kind) -> list[Entry]:
        """All entries of a kind that are not deleted, newest first."""
        query = rows.matching(Query(kinds=(kind,))).order_by(Item.changed.desc(), Item.id.desc())
        with self.store.reading() as session:
            return self._entries(session, query)

    def versions(self, entry_id: int) -> list[Version]:
        """All versions, newest first.

        Raises:
            NotInLibrary: there is no such entry.
        """
        with self.store.reading() as session:
            return [rows.version(row) for row in reversed(self._item(session, entry_id).versions)]

    def tags(self) -> dict[str, int]:
        """Tags in use, each with its number of entries."""
        count = select(Tag.tag, func.count()).join(Item).where(Item.deleted.is_(None))
        with self.store.reading() as session:
            found = session.execute(count.group_by(Tag.tag).order_by(Tag.tag))
            return {row[0]: row[1] for row in found}

    def content(self, entry_id: int, number: int | None = None) -> bytes:
        """Contents of a version, the latest by default, compared with their SHA-256.

        Raises:
            NotInLibrary: no such entry or version, or its file is on another station.
            BlobFailed: missing or damaged.
        """
        with self.store.reading() as session:
            item = self._item(session, entry_id)
            row = _version(item, number)
            place, name = row.place, row.sha256
            inline = session.get(Content, name) if place == "database" else None
            data = inline.data if inline else None
            label = f"{item.name} version {row.number}"
        if place == "file":
            raise NotInLibrary(
                "library.lies-folder-station", value=item.name, label=label, station=item.station
            )
        if place == "blob":
            return self.blobs.get(name)
        if data is None or hashlib.sha256(data).hexdigest() != name:
            raise BlobFailed("library.contents-missing-damaged", value=name, label=label)
        return data

    # --- changing ---------------------------------------------------------------------

    def add(self, kind: Kind, name: str, data: bytes, addition: Addition) -> Entry:
        """Store a new version of the entry of this name, or a new entry.

        Contents that equal the latest version make no new one. A deleted entry of this name is
        restored.


        Raises:
            StorageFailed: nothing was stored.
        """
        if len(data) > INLINE:
            self.blobs.put(data)
        try:
            entry, fresh = self._add(kind, name, data, addition)
        except DatabaseFailed as error:
            if not isinstance(error.__cause__, IntegrityError):
                raise
            # Another station used the same name, or stored the same contents, at the same time.
            entry, fresh = self._add(kind, name, data, addition)
        if fresh:
            self._record_action("saved", entry, bytes=len(data))
        return entry

    def _add(self, kind: Kind, name: str, data: bytes, addition: Addition) -> tuple[Entry, bool]:
        digest = hashlib.sha256(data).hexdigest()
        place = "database" if len(data) <= INLINE else "blob"
        now = datetime.now(UTC)
        with self.store.writing() as session:
            _guard_contents(session, exclusive=False)
            item = _by_name(session, kind, name, lock=True)
            if item is None:
                item = Item(kind=kind, name=name, station="", changed=now, notes="", words="")
                session.add(item)
            item.deleted = None
            latest = item.versions[-1] if item.versions else None
            known = {tag.tag for tag in item.tags}
            item.tags += [Tag(tag=tag) for tag in addition.tags if tag not in known]
            fresh = latest is None or latest.sha256 != digest
            if fresh:
                if place == "database" and session.get(Content, digest) is None:
                    session.add(Content(sha256=digest, data=data))
                number = latest.number + 1 if latest else 1
                item.versions.append(
                    rows.new_version(number, place, digest, len(data), addition, now)
                )
                item.changed = now
            item.words = rows.words(item)
            session.flush()
            return _loaded(item), fresh

    def annotate(
        self,
        entry_id: int,
        *,
        notes: str | None = None,
        tags: tuple[str, ...] | None = None,
        base: Remarks | None = None,
    ) -> Entry:
        """Change notes or tags; None leaves them unchanged.

        ``base``: what they were when the person began to change them.

        Raises:
            NotInLibrary: no such entry. NotAllowed: too long or too many. ChangedMeanwhile: another
                person changed them.
        """
        if notes is not None and len(notes) > MAX_NOTES:
            raise NotAllowed("library.notes-too-long", limit=limits.signs(MAX_NOTES))
        if tags is not None:
            tags = _clean(tags)
        with self.store.writing() as session:
            item = self._item(session, entry_id)
            if base is not None:
                now = Remarks(item.notes, tuple(tag.tag for tag in item.tags))
                require_unchanged(now, base, Remarks(notes, tags))
            if notes is not None:
                item.notes = notes
            if tags is not None:
                have = {tag.tag: tag for tag in item.tags}
                item.tags = [have.get(tag) or Tag(tag=tag) for tag in tags]
            item.words = rows.words(item)
            session.flush()
            entry = _loaded(item)
        self._record_action("annotated", entry, tags=", ".join(entry.tags))
        return entry

    def delete(self, entry_id: int) -> Entry:
        """Archive an entry; its versions stay until `purge`.

        Raises:
            NotInLibrary: no such entry.
        """
        with self.store.writing() as session:
            item = self._item(session, entry_id)
            item.deleted = item.deleted or datetime.now(UTC)
            session.flush()
            entry = _loaded(item)
        self._record_action("deleted", entry)
        return entry

    def undelete(self, entry_id: int) -> Entry:
        """Restore an entry that was archived.

        Raises:
            NotInLibrary: no such entry.
        """
        with self.store.writing() as session:
            item = self._item(session, entry_id)
            item.deleted = None
            session.flush()
            entry = _loaded(item)
        self._record_action("taken back", entry)
        return entry

    def reported_deleted(self, entry: Entry) -> None:
        """Record in the audit that a file of this station was deleted permanently."""
        self._record_action("deleted", entry)

    def purge(self, before: datetime) -> list[Entry]:
        """Delete entries archived before this time permanently, with contents no other entry uses.

        Raises:
            DatabaseFailed, BlobFailed: some may remain; another call continues.
        """
        with self.store.writing() as session:
            _guard_contents(session, exclusive=True)
            wanted = select(Item).where(Item.deleted < before)
            gone = [_loaded(item) for item in session.scalars(wanted)]
            for item in session.scalars(wanted):
                session.delete(item)
            session.flush()
            used = select(VersionRow.sha256)
            for content in session.scalars(select(Content).where(Content.sha256.not_in(used))):
                session.delete(content)
        for entry in gone:
            self._record_action("purged", entry)
        self.sweep_blobs(datetime.now(UTC) - _BLOB_AGE)
        return gone

    def sweep_blobs(self, before: datetime) -> int:
        """Delete blobs stored before this time that no version refers to; return their number.

        Such blobs remain after a crash or a purge. A younger blob may belong to an entry that is
        just being stored, as its row is written after it.
        """
        with self.store.reading() as session:
            used = set(session.scalars(select(VersionRow.sha256).where(VersionRow.place == "blob")))
        unused = [
            name
            for name in self.blobs.names()
            if name not in used and self.blobs.modified(name) < before
        ]
        for name in unused:
            self.blobs.delete(name)
        return len(unused)

    # --- within a transaction -----------------------------------------------------------

    def _entries(self, session: Session, query: Select[Item]) -> list[Entry]:
        with_all = query.options(selectinload(Item.versions), selectinload(Item.tags))
        return [_loaded(item) for item in session.scalars(with_all)]

    def _item(self, session: Session, entry_id: int) -> Item:
        item = session.get(Item, entry_id)
        if item is None:
            raise NotInLibrary("library.no-entry-library", value=entry_id)
        return item

    def _record_action(self, action: Action, entry: Entry, **detail: Value) -> None:
        facts: dict[str, Value] = {
            "kind": entry.kind,
            "version": entry.latest.number,
            "sha256": entry.latest.sha256,
        }
        self._record(
            AuditFact(
                "file",
                action,
                axis=entry.latest.axis.name,
                target=entry.name,
                detail=facts | detail,
            )
        )


def _guard_contents(session: Session, *, exclusive: bool) -> None:
    """Lock against deleting stored contents while a new version refers to them.

    SQLite has only one writer at a time anyway.
    """
    if session.get_bind().dialect.name == "postgresql":
        lock = func.pg_advisory_xact_lock if exclusive else func.pg_advisory_xact_lock_shared
        session.execute(select(lock(_CONTENTS_LOCK)))


def _by_name(
    session: Session, kind: Kind, name: str, station: str = "", *, lock: bool = False
) -> Item | None:
    query = select(Item).where(Item.kind == kind, Item.name == name, Item.station == station)
    return session.scalar(query.with_for_update() if lock else query)


def _version(item: Item, number: int | None) -> VersionRow:
    row = next((v for v in reversed(item.versions) if number in (None, v.number)), None)
    if row is None:
        raise NotInLibrary(
            "library.no-version",
            value=number,
            limit=limits.between(1, len(item.versions)),
            item=item.name,
        )
    return row


def _loaded(item: Item) -> Entry:
    return rows.entry(item)


def _clean(tags: tuple[str, ...]) -> tuple[str, ...]:
    """Tags without surrounding spaces and without duplicates.

    Raises:
        NotAllowed: too many or too long.
    """
    found = dict.fromkeys(" ".join(tag.split()) for tag in tags)
    found.pop("", None)
    if len(found) > MAX_TAGS or any(len(tag) > MAX_TAG for tag in found):
        raise NotAllowed(
            "library.too-many-tags-too", limit=text("limit.tags", tags=MAX_TAGS, count=MAX_TAG)
        )
    return tuple(found)
