"""Tables of the audit: the hash chain of entries, and its head."""

from __future__ import annotations

from sqlalchemy import BigInteger, Integer, String, Text
from sqlalchemy.orm import Mapped, mapped_column

from backend.foundation.store.base import Base

#: SQLite accepts only INTEGER as a row number.
_NUMBER = BigInteger().with_variant(Integer, "sqlite")


class AuditEntry(Base):
    """One entry. ``body`` is the hashed content; other columns repeat parts of it for search.

    ``hash`` is the SHA-256 of ``previous`` (64 hexadecimal digits) followed by ``body`` in UTF-8.
    The database refuses to change or delete a row.
    """

    __tablename__ = "audit_entry"

    number: Mapped[int] = mapped_column(_NUMBER, primary_key=True, autoincrement=False)
    time: Mapped[str] = mapped_column(String(32), index=True)
    """ISO 8601 in UTC with microseconds; stored as text, so that it is
    identical to the hashed text.
    """
    station: Mapped[str] = mapped_column(String(100))
    person: Mapped[str] = mapped_column(String(200), index=True)
    kind: Mapped[str] = mapped_column(String(30), index=True)
    axis: Mapped[str] = mapped_column(String(200), index=True)
    target: Mapped[str] = mapped_column(String(300))
    body: Mapped[str] = mapped_column(Text)
    previous: Mapped[str] = mapped_column(String(64))
    hash: Mapped[str] = mapped_column(String(64))


class AuditHead(Base):
    """The single row with the last entry of the chain; locked while entries are added."""

    __tablename__ = "audit_head"

    id: Mapped[int] = mapped_column(Integer, primary_key=True, autoincrement=False)
    number: Mapped[int] = mapped_column(BigInteger)
    hash: Mapped[str] = mapped_column(String(64))
