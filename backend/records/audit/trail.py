"""Reading the audit: search, export, check. All functions block and must run on a thread."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Literal

from sqlalchemy import Select, select
from sqlalchemy.orm import Session

from backend.foundation.store.audit_tables import AuditEntry, AuditHead
from backend.foundation.store.database import Store
from backend.foundation.store.spreadsheet import as_text
from backend.records.audit.chain import Anchor, Verdict, verify
from backend.records.audit.facts import Kind, Value, stamp
from drivers.texts.message import Language, Text, prose

Format = Literal["csv", "jsonl"]
_CHUNK = 500
_ESCAPE = "\\"


@dataclass(frozen=True, slots=True)
class Filter:
    """Conditions of a search; empty fields do not restrict it. All ``words`` must occur."""

    kinds: tuple[str, ...] = ()
    person: str = ""
    axis: str = ""
    station: str = ""
    words: str = ""
    since: datetime | None = None
    until: datetime | None = None

    def apply(self, query: Select[AuditEntry]) -> Select[AuditEntry]:
        """The query with these conditions."""
        if self.kinds:
            query = query.where(AuditEntry.kind.in_(self.kinds))
        for column, wanted in (
            (AuditEntry.person, self.person),
            (AuditEntry.axis, self.axis),
            (AuditEntry.station, self.station),
        ):
            if wanted:
                query = query.where(column == wanted)
        if self.since is not None:
            query = query.where(AuditEntry.time >= stamp(self.since))
        if self.until is not None:
            query = query.where(AuditEntry.time < stamp(self.until))
        for word in self.words.split():
            # The body is JSON: a quote or backslash is written with a backslash there.
            inner = json.dumps(word, ensure_ascii=False)[1:-1]
            query = query.where(AuditEntry.body.ilike(f"%{like(inner)}%", escape=_ESCAPE))
        return query


def like(text: str) -> str:
    """Text with the special characters of LIKE escaped."""
    for sign in (_ESCAPE, "%", "_"):
        text = text.replace(sign, _ESCAPE + sign)
    return text


@dataclass(frozen=True, slots=True)
class Event:
    """One entry as people read it."""

    number: int
    hash: str
    time: datetime
    station: str
    person: str
    kind: Kind
    action: str
    axis: str
    target: str
    old: Value
    new: Value
    outcome: Text | None
    title: Text | None
    reason: Text | None
    detail: dict[str, Value]

    def detail_in(self, language: Language) -> dict[str, Value]:
        """Its details; a job's title and the reason for a motion's end in this language."""
        messages = {"title": self.title, "reason": self.reason}
        return self.detail | {
            name: each.words(language) for name, each in messages.items() if each is not None
        }


class Trail:
    """The audit of a store, for reading."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def search(self, wanted: Filter, *, before: int | None = None, limit: int = 200) -> list[Event]:
        """Events, newest first; ``before``: number of the last one already shown.

        Raises:
            DatabaseFailed: an error of the database.
        """
        query = wanted.apply(select(AuditEntry)).order_by(AuditEntry.number.desc()).limit(limit)
        if before is not None:
            query = query.where(AuditEntry.number < before)
        with self._store.reading() as session:
            return [_event(entry) for entry in session.scalars(query)]

    def names(self) -> dict[str, list[str]]:
        """Choices for a filter: the persons, axes and stations that occur."""
        columns = {
            "person": AuditEntry.person,
            "axis": AuditEntry.axis,
            "station": AuditEntry.station,
        }
        with self._store.reading() as session:
            return {
                name: [v for v in session.scalars(select(c).distinct().order_by(c)) if v]
                for name, c in columns.items()
            }

    def export(self, wanted: Filter, form: Format, language: Language = "en") -> Iterator[str]:
        """Lines of an export, oldest first.

        JSON lines contain body, number and both hashes, so that a chain exported as a whole can be
        checked without the database. A CSV table has its texts in ``language``.

        Raises:
            DatabaseFailed: an error of the database.
        """
        if form == "csv":
            yield _csv_line(_CSV)
        last = 0
        while True:
            query = wanted.apply(select(AuditEntry)).where(AuditEntry.number > last)
            query = query.order_by(AuditEntry.number).limit(_CHUNK)
            # One transaction per chunk, as a slow reader must not hold one open.
            with self._store.reading() as session:
                entries = list(session.scalars(query))
            for entry in entries:
                yield _json_line(entry) if form == "jsonl" else _csv_line(_csv_row(entry, language))
            if not entries:
                return
            last = entries[-1].number

    def head(self) -> Anchor:
        """Number and hash of the last entry.

        Raises:
            DatabaseFailed: an error of the database.
        """
        with self._store.reading() as session:
            return _head(session) or Anchor(0, "")

    def verify(self, anchor: Anchor | None = None) -> Verdict:
        """Check the whole chain in one consistent view of the database.

        Raises:
            DatabaseFailed: an error of the database.
        """
        query = select(AuditEntry).order_by(AuditEntry.number)
        with self._store.reading(snapshot=True) as session:
            head = _head(session)
            entries = session.scalars(query.execution_options(yield_per=1000))
            return verify(entries, head, anchor)


def _head(session: Session) -> Anchor | None:
    head = session.get(AuditHead, 1)
    return Anchor(head.number, head.hash) if head else None


def _event(entry: AuditEntry) -> Event:
    content = json.loads(entry.body)
    detail = content["detail"]
    return Event(
        number=entry.number,
        hash=entry.hash,
        time=datetime.fromisoformat(content["time"]),
        station=content["station"],
        person=content["person"],
        kind=content["kind"],
        action=content["action"],
        axis=content["axis"],
        target=content["target"],
        old=content["old"],
        new=content["new"],
        outcome=_message(content, "outcome", content["outcome"]),
        title=_message(content, "title", detail.get("title", "")),
        reason=_message(content, "reason", detail.get("reason", "")),
        detail=detail,
    )


def _message(content: Mapping[str, Any], name: str, words: object) -> Text | None:
    """A message of an entry; only its text for entries from before messages had codes."""
    found = content.get("messages", {}).get(name)
    if found is not None:
        return Text.from_wire(found)
    return prose(str(words)) if words else None


def _json_line(entry: AuditEntry) -> str:
    line = {
        "number": entry.number,
        "previous": entry.previous,
        "hash": entry.hash,
        "body": entry.body,
    }
    return json.dumps(line, ensure_ascii=False) + "\n"


_CSV = [
    "number", "time", "station", "person", "kind", "action", "axis", "target", "old", "new",
    "outcome", "detail", "hash",
]  # fmt: skip


def _csv_row(entry: AuditEntry, language: Language) -> list[str]:
    content, event = json.loads(entry.body), _event(entry)
    shown = event.detail_in(language)
    row = {
        **content,
        "number": entry.number,
        "hash": entry.hash,
        "outcome": event.outcome.words(language) if event.outcome else "",
        "detail": json.dumps(shown, ensure_ascii=False) if shown else "",
    }
    return [_cell(row[name]) for name in _CSV]


def _cell(value: object) -> str:
    if value is None:
        return ""
    return as_text(value) if isinstance(value, str) else str(value)


def _csv_line(row: list[str]) -> str:
    out = io.StringIO()
    csv.writer(out).writerow(row)
    return out.getvalue()
