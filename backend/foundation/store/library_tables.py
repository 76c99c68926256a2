"""Tables of the library: named items, their versions, tags and contents."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import (
    JSON,
    BigInteger,
    ForeignKey,
    Integer,
    LargeBinary,
    String,
    Text,
    UniqueConstraint,
)
from sqlalchemy.orm import Mapped, mapped_column, relationship

from backend.foundation.store.base import Base, UtcDateTime


class Item(Base):
    """A parameter set, recording, measurement or report.

    ``station`` is empty where the contents are in the store and so available to every station;
    otherwise it is the station whose state folder contains the file.
    """

    __tablename__ = "library_item"
    __table_args__ = (UniqueConstraint("kind", "station", "name", name="uq_library_item_name"),)

    id: Mapped[int] = mapped_column(Integer, primary_key=True)
    kind: Mapped[str] = mapped_column(String(20))
    station: Mapped[str] = mapped_column(String(100), default="")
    name: Mapped[str] = mapped_column(String(200))
    notes: Mapped[str] = mapped_column(Text, default="")
    words: Mapped[str] = mapped_column(Text, default="")
    """All searchable text, in lower case."""
    changed: Mapped[datetime] = mapped_column(UtcDateTime, index=True)
    deleted: Mapped[datetime | None] = mapped_column(UtcDateTime)
    versions: Mapped[list[Version]] = relationship(
        back_populates="item", order_by="Version.number", cascade="all, delete-orphan"
    )
    tags: Mapped[list[Tag]] = relationship(
        back_populates="item", order_by="Tag.tag", cascade="all, delete-orphan"
    )


class Version(Base):
    """One version of an item: its contents and the axis that they belong to. A row never changes.

    ``sha256`` is of the contents. They are stored inline in `Content`, as a blob, or (``place``
    "file") in the state folder of the item's station.
    """

    __tablename__ = "library_version"
    __table_args__ = (UniqueConstraint("item_id", "number", name="uq_library_version_number"),)

    id: Mapped[int] = mapped_column(Integer, primary_key=True)
    item_id: Mapped[int] = mapped_column(ForeignKey("library_item.id", ondelete="CASCADE"))
    number: Mapped[int] = mapped_column(Integer)
    saved: Mapped[datetime] = mapped_column(UtcDateTime, index=True)
    author: Mapped[str] = mapped_column(String(200), default="")
    notes: Mapped[str] = mapped_column(Text, default="")
    place: Mapped[str] = mapped_column(String(10))
    sha256: Mapped[str] = mapped_column(String(64), default="", index=True)
    bytes: Mapped[int] = mapped_column(BigInteger)
    profile: Mapped[str] = mapped_column(String(100), default="", index=True)
    axis: Mapped[str] = mapped_column(String(200), default="")
    vendor_id: Mapped[int | None] = mapped_column(BigInteger)
    product_code: Mapped[int | None] = mapped_column(BigInteger)
    revision: Mapped[int | None] = mapped_column(BigInteger)
    serial: Mapped[int | None] = mapped_column(BigInteger, index=True)
    firmware: Mapped[str] = mapped_column(String(100), default="")
    facts: Mapped[dict[str, object]] = mapped_column(JSON, default=dict)
    """Values that lists show for this kind: rows of a set, channels of a recording …"""
    item: Mapped[Item] = relationship(back_populates="versions")


class Tag(Base):
    """A tag that people have given an item."""

    __tablename__ = "library_tag"

    item_id: Mapped[int] = mapped_column(
        ForeignKey("library_item.id", ondelete="CASCADE"), primary_key=True
    )
    tag: Mapped[str] = mapped_column(String(60), primary_key=True, index=True)
    item: Mapped[Item] = relationship(back_populates="tags")


class Content(Base):
    """Contents that are small enough for the database, by their SHA-256."""

    __tablename__ = "library_content"

    sha256: Mapped[str] = mapped_column(String(64), primary_key=True)
    data: Mapped[bytes] = mapped_column(LargeBinary)
