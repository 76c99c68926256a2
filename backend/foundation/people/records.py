"""Records of accounts, sessions and tokens, and reading them from the database."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta

from sqlalchemy import select

from backend.foundation.people.rights import Right, Role
from backend.foundation.people.tables import AccountRow, SessionRow, TokenRow
from backend.foundation.store.database import Store

#: A session ends this long after its last use, at the latest this long after the log-in.
IDLE = timedelta(hours=2)
LONGEST = timedelta(hours=12)
#: A session that has ended can still press STOP for this long (its page may not know yet).
REMEMBERED = timedelta(hours=24)


@dataclass(frozen=True, slots=True)
class Account:
    """An account; ``password`` is the argon2id hash."""

    id: int
    name: str
    role: Role
    password: str
    created: datetime


@dataclass(frozen=True, slots=True)
class LoginSession:
    """A log-in session; ``id`` is the hash of the cookie."""

    id: str
    account: int
    created: datetime
    used: datetime
    client: str

    @property
    def expires(self) -> datetime:
        """Time at which the session ends if it is not used any more."""
        return min(self.used + IDLE, self.created + LONGEST)


@dataclass(frozen=True, slots=True)
class Token:
    """A token for scripts; ``id`` is the hash of the token."""

    id: str
    account: int
    name: str
    scopes: frozenset[Right]
    created: datetime
    expires: datetime


@dataclass(frozen=True, slots=True)
class Records:
    """All stored accounts, sessions and tokens, by id."""

    accounts: dict[int, Account]
    sessions: dict[str, LoginSession]
    tokens: dict[str, Token]


def read(store: Store) -> Records:
    """Read all records. Blocks.

    Raises:
        DatabaseFailed: the database cannot be read.
    """
    with store.reading() as database:
        accounts = {
            row.id: Account(row.id, row.name, Role(row.role), row.password, row.created)
            for row in database.scalars(select(AccountRow))
        }
        sessions = {
            row.id: LoginSession(row.id, row.account_id, row.created, row.used, row.client)
            for row in database.scalars(select(SessionRow))
        }
        tokens = {
            row.id: Token(
                row.id,
                row.account_id,
                row.name,
                frozenset(Right(scope) for scope in row.scopes.split()),
                row.created,
                row.expires,
            )
            for row in database.scalars(select(TokenRow))
        }
    return Records(accounts, sessions, tokens)
