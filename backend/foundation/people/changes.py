"""Changes to the stored accounts, sessions and tokens, one transaction each. All of them block.

Each raises `DatabaseFailed` when the database cannot be written.
"""

from __future__ import annotations

from collections.abc import Iterable
from datetime import datetime

from sqlalchemy import delete, update

from backend.foundation.people.login.credentials import name_key
from backend.foundation.people.records import Account, LoginSession, Token
from backend.foundation.people.rights import Role
from backend.foundation.people.tables import AccountRow, SessionRow, TokenRow
from backend.foundation.store.database import Store


def add_account(store: Store, name: str, role: Role, password: str, created: datetime) -> Account:
    """Add an account and return it with the id from the database; ``password`` is the hash."""
    with store.writing() as database:
        row = AccountRow(
            name=name,
            name_key=name_key(name),
            role=role.value,
            password=password,
            created=created,
        )
        database.add(row)
        database.flush()
        return Account(row.id, name, role, password, created)


def change_account(
    store: Store, account_id: int, *, role: Role | None = None, password: str | None = None
) -> None:
    """Change role or password hash of an account; None leaves the value unchanged."""
    values = {"role": None if role is None else role.value, "password": password}
    given = {name: value for name, value in values.items() if value is not None}
    with store.writing() as database:
        database.execute(update(AccountRow).where(AccountRow.id == account_id).values(**given))


def delete_account(store: Store, account_id: int) -> None:
    """Delete an account with its sessions and tokens."""
    with store.writing() as database:
        database.execute(delete(AccountRow).where(AccountRow.id == account_id))


def add_session(store: Store, session: LoginSession) -> None:
    """Add a log-in session."""
    with store.writing() as database:
        database.add(
            SessionRow(
                id=session.id,
                account_id=session.account,
                created=session.created,
                used=session.used,
                client=session.client,
            )
        )


def delete_sessions(store: Store, ids: Iterable[str]) -> None:
    """Delete sessions that have ended."""
    with store.writing() as database:
        database.execute(delete(SessionRow).where(SessionRow.id.in_(list(ids))))


def add_token(store: Store, token: Token) -> None:
    """Add a token for scripts."""
    with store.writing() as database:
        database.add(
            TokenRow(
                id=token.id,
                account_id=token.account,
                name=token.name,
                scopes=" ".join(sorted(token.scopes)),
                created=token.created,
                expires=token.expires,
            )
        )


def delete_token(store: Store, token_id: str) -> None:
    """Delete a token that was revoked."""
    with store.writing() as database:
        database.execute(delete(TokenRow).where(TokenRow.id == token_id))


def tend(store: Store, used: Iterable[LoginSession], over: Iterable[str]) -> None:
    """Store when sessions were last used, and delete the sessions and tokens that have ended."""
    gone = list(over)
    with store.writing() as database:
        for session in used:
            database.execute(
                update(SessionRow).where(SessionRow.id == session.id).values(used=session.used)
            )
        database.execute(delete(SessionRow).where(SessionRow.id.in_(gone)))
        database.execute(delete(TokenRow).where(TokenRow.id.in_(gone)))
