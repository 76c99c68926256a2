"""The station's database: accounts, library and audit, on SQLite or PostgreSQL."""

from backend.store.base import Base, UtcDateTime
from backend.store.database import DatabaseFailed, Store

__all__ = ["Base", "DatabaseFailed", "Store", "UtcDateTime"]
