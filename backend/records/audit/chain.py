"""The hash chain: each entry's hash covers its text and the hash of the entry before it.

Changing, removing, inserting or reordering entries breaks the chain at the first entry concerned.
Whoever can rewrite the whole database can compute a new chain. An anchor protects against that: a
number and hash recorded elsewhere (a printed report, an e-mail).
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from sqlalchemy import insert, select
from sqlalchemy.orm import Session

from backend.foundation.store.audit_tables import AuditEntry, AuditHead
from drivers.texts.message import Text, text

#: Value used as the hash before the first entry.
ZERO = "0" * 64
#: Parts of the body that are columns as well, with the column's length.
COLUMNS = {"time": 32, "station": 100, "person": 200, "kind": 30, "axis": 200, "target": 300}


@dataclass(frozen=True, slots=True)
class Anchor:
    """An entry's number and hash."""

    number: int
    hash: str

    def __str__(self) -> str:
        return f"{self.number}:{self.hash}"


@dataclass(frozen=True, slots=True)
class Verdict:
    """Outcome of a check. ``broken``: number of the first wrong entry; None without any."""

    entries: int
    head: Anchor
    broken: int | None = None
    why: Text | None = None

    @property
    def ok(self) -> bool:
        """Whether the chain is intact."""
        return self.broken is None


def link(previous: str, body: str) -> str:
    """Hash of an entry: SHA-256 of the preceding hash (as text) and its body, in UTF-8."""
    return hashlib.sha256(previous.encode("ascii") + body.encode()).hexdigest()


def append(session: Session, bodies: Sequence[str]) -> Anchor:
    """Add entries; the head is locked until the transaction ends, which serialises writers."""
    head = session.execute(
        select(AuditHead).where(AuditHead.id == 1).with_for_update()
    ).scalar_one()
    number, previous = head.number, head.hash
    rows = []
    for body in bodies:
        number += 1
        digest = link(previous, body)
        rows.append(
            {"number": number, "body": body, "previous": previous, "hash": digest, **columns(body)}
        )
        previous = digest
    if rows:
        session.execute(insert(AuditEntry), rows)
        head.number, head.hash = number, previous
    return Anchor(number, previous)


def columns(body: str) -> dict[str, str]:
    """The searchable parts of a body."""
    content = json.loads(body)
    return {name: str(content[name])[:length] for name, length in COLUMNS.items()}


def verify(
    entries: Iterable[AuditEntry], head: Anchor | None, anchor: Anchor | None = None
) -> Verdict:
    """Check entries in the order of their numbers against each other, the head and an anchor."""
    number, previous = 0, ZERO
    for entry in entries:
        why = _wrong(entry, number + 1, previous)
        if why is None and anchor and entry.number == anchor.number and entry.hash != anchor.hash:
            why = text("audit.hash-not-of-anchor", anchor=anchor.hash)
        if why is not None:
            return Verdict(number, Anchor(number, previous), min(entry.number, number + 1), why)
        number, previous = entry.number, entry.hash
    end = Anchor(number, previous)
    if head is None:
        return Verdict(number, end, number + 1, text("audit.head-gone"))
    if head != end:
        why = text("audit.end-missing", ended=head.number, last=number)
        return Verdict(number, end, number + 1, why)
    if anchor is not None and anchor.number > number:
        why = text("audit.anchor-beyond-end", anchor=anchor.number, last=number)
        return Verdict(number, end, number + 1, why)
    return Verdict(number, end)


def _wrong(entry: AuditEntry, number: int, previous: str) -> Text | None:
    if entry.number != number:
        return text("audit.entry-missing", number=number)
    if entry.previous != previous:
        return text("audit.entry-does-not-follow")
    if link(previous, entry.body) != entry.hash:
        return text("audit.contents-altered")
    try:
        parts = columns(entry.body)
    except (ValueError, KeyError, TypeError):
        return text("audit.contents-unreadable")
    for name, value in parts.items():
        if getattr(entry, name) != value:
            return text("audit.column-altered", column=name)
    return None
