"""Tables of axis condition: results of health checks, and signed baselines.

``axis_key`` identifies an axis by vendor, product and serial number where the drive reports them,
so that it is the same axis on another station; otherwise by station and place on the bench.
"""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import JSON, BigInteger, Index, Integer, String, Text
from sqlalchemy.orm import Mapped, mapped_column

from backend.foundation.store.base import Base, UtcDateTime


class HealthRun(Base):
    """One round of a health check. A row never changes."""

    __tablename__ = "health_run"
    __table_args__ = (Index("ix_health_run_axis_key_taken", "axis_key", "taken"),)

    id: Mapped[int] = mapped_column(Integer, primary_key=True)
    station: Mapped[str] = mapped_column(String(100))
    axis_key: Mapped[str] = mapped_column(String(200))
    axis: Mapped[str] = mapped_column(String(200))
    profile: Mapped[str] = mapped_column(String(100))
    vendor_id: Mapped[int | None] = mapped_column(BigInteger)
    product_code: Mapped[int | None] = mapped_column(BigInteger)
    revision: Mapped[int | None] = mapped_column(BigInteger)
    serial: Mapped[int | None] = mapped_column(BigInteger)
    firmware: Mapped[str] = mapped_column(String(100), default="")
    taken: Mapped[datetime] = mapped_column(UtcDateTime)
    person: Mapped[str] = mapped_column(String(200), default="")
    settings: Mapped[dict[str, object]] = mapped_column(JSON)
    settings_sha256: Mapped[str] = mapped_column(String(64))
    """Hash of the settings that affect values: only runs with the same hash are compared."""
    measurements: Mapped[dict[str, str]] = mapped_column(JSON)
    """Names of the stored raw data, with their SHA-256."""
    round: Mapped[str] = mapped_column(Text)
    """`backend.tools.watching.health.result.HealthRound` as JSON. Stored as text: thousands are
    read for one page, and the model's own parser takes a tenth of the time.
    """


class HealthBaseline(Base):
    """A signed baseline: a copy of its runs, with a checksum over the whole copy."""

    __tablename__ = "health_baseline"

    id: Mapped[int] = mapped_column(Integer, primary_key=True)
    axis_key: Mapped[str] = mapped_column(String(200), index=True)
    signed: Mapped[datetime] = mapped_column(UtcDateTime)
    person: Mapped[str] = mapped_column(String(200))
    notes: Mapped[str] = mapped_column(Text, default="")
    content: Mapped[dict[str, object]] = mapped_column(JSON)
    sha256: Mapped[str] = mapped_column(String(64))
