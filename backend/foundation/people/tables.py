"""Tables of accounts, sessions and tokens. Passwords and tokens are stored only as hashes.

They are in the station's own file even where library and audit are shared on a server: write access
to that server then gives no control of axes here, and log-in works while it is down.
"""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import ForeignKey, Integer, String
from sqlalchemy.orm import Mapped, mapped_column

from backend.foundation.store.base import Base, UtcDateTime


class AccountRow(Base):
    """An account. ``name_key`` is the normalized name, for comparison (`credentials.name_key`)."""

    __tablename__ = "people_account"

    id: Mapped[int] = mapped_column(Integer, primary_key=True)
    name: Mapped[str] = mapped_column(String(60))
    name_key: Mapped[str] = mapped_column(String(120), unique=True)
    role: Mapped[str] = mapped_column(String(20))
    password: Mapped[str] = mapped_column(String(200))
    created: Mapped[datetime] = mapped_column(UtcDateTime)


class SessionRow(Base):
    """A log-in. ``id`` is the SHA-256 of the cookie, which only the browser has."""

    __tablename__ = "people_session"

    id: Mapped[str] = mapped_column(String(64), primary_key=True)
    account_id: Mapped[int] = mapped_column(
        ForeignKey("people_account.id", ondelete="CASCADE"), index=True
    )
    created: Mapped[datetime] = mapped_column(UtcDateTime)
    used: Mapped[datetime] = mapped_column(UtcDateTime)
    client: Mapped[str] = mapped_column(String(200))


class TokenRow(Base):
    """A token for scripts. ``id`` is the SHA-256 of the token, which is shown once."""

    __tablename__ = "people_token"

    id: Mapped[str] = mapped_column(String(64), primary_key=True)
    account_id: Mapped[int] = mapped_column(
        ForeignKey("people_account.id", ondelete="CASCADE"), index=True
    )
    name: Mapped[str] = mapped_column(String(60))
    scopes: Mapped[str] = mapped_column(String(200))
    created: Mapped[datetime] = mapped_column(UtcDateTime)
    expires: Mapped[datetime] = mapped_column(UtcDateTime)
