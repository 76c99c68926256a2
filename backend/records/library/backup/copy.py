"""Copying all rows of library and audit from one database to another, SQLite or PostgreSQL."""

from __future__ import annotations

from collections.abc import Iterable

from sqlalchemy import Table, func, insert, select
from sqlalchemy.orm import Session

from backend.foundation.store.audit_tables import AuditEntry, AuditHead
from backend.foundation.store.base import Base
from backend.foundation.store.database import Store
from backend.foundation.store.health_tables import HealthBaseline, HealthRun
from backend.foundation.store.library_tables import Content, Item, Tag, Version
from backend.records.audit.chain import ZERO
from drivers.errors import NotAllowed

#: Tables in the order in which they can be filled.
_TABLES: tuple[type[Base], ...] = (
    Item, Content, Version, Tag, HealthRun, HealthBaseline, AuditEntry,
)  # fmt: skip
_CHUNK = 500


def copy_rows(source: Store, target: Store) -> int:
    """Copy into a database without library and audit; return the number of rows. Blocks.

    Raises:
        NotAllowed: the target has a library or audit already; nothing was changed.
        DatabaseFailed: an error of a database; nothing was changed.
    """
    count = 0
    with source.reading(snapshot=True) as old, target.writing() as new:
        _require_empty(new, target.shown)
        for table in _tables(_TABLES):
            query = select(table).order_by(*table.primary_key.columns)
            found = old.execute(query.execution_options(yield_per=_CHUNK))
            for part in found.mappings().partitions(_CHUNK):
                new.execute(insert(table), [dict(row) for row in part])
                count += len(part)
        head = old.get_one(AuditHead, 1)
        copied = new.get_one(AuditHead, 1)
        copied.number, copied.hash = head.number, head.hash
        if new.get_bind().dialect.name == "postgresql":
            _set_sequences(new)
    return count


def _tables(models: Iterable[type[Base]]) -> list[Table]:
    return [model.__table__ for model in models if isinstance(model.__table__, Table)]


def _require_empty(session: Session, shown: str) -> None:
    items = session.scalar(select(func.count()).select_from(Item))
    head = session.get(AuditHead, 1, with_for_update=True)
    if items or head is None or head.hash != ZERO:
        raise NotAllowed("store.library-audit-already-nothing", value=shown)


def _set_sequences(session: Session) -> None:
    """Set PostgreSQL's sequences, which do not advance when ids are inserted explicitly."""
    for table in _tables((Item, Version, HealthRun, HealthBaseline)):
        highest = session.scalar(select(func.max(table.c.id))) or 1
        sequence = func.pg_get_serial_sequence(table.name, "id")
        session.execute(select(func.setval(sequence, highest)))
