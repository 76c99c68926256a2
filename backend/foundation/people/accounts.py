"""Accounts, log-in sessions and tokens.

Everything that a request needs is kept in memory (`Directory`), because STOP must not wait
for a disk; changes go to the database first. `tend` reads what another process (the command
line) has changed there.
"""

from __future__ import annotations

import asyncio
import functools
from collections.abc import Callable, Iterable
from dataclasses import replace
from datetime import UTC, datetime, timedelta

from backend.foundation.people import changes
from backend.foundation.people.directory import Directory
from backend.foundation.people.errors import Forbidden, NotLoggedIn
from backend.foundation.people.login.budgets import LoginBudgets, address_group
from backend.foundation.people.login.credentials import (
    checked_person,
    digest,
    new_secret,
    same_code,
    spoken_code,
)
from backend.foundation.people.login.devices import KnownDevices
from backend.foundation.people.login.passwords import Passwords, require_good
from backend.foundation.people.login.turns import HashTurns
from backend.foundation.people.records import Account, LoginSession, Token, read
from backend.foundation.people.rights import ACCOUNT_ROLES, RIGHTS, Right, Role, rights_text
from backend.foundation.store.database import Store
from drivers.errors import NotAllowed
from drivers.texts.message import text

LONGEST_TOKEN = timedelta(days=366)
#: Key that counts wrong set-up codes. It cannot be an account's name, as it contains a line break.
_SET_UP = "set-up\ncode"
TOKEN_PREFIX = "sdk_"  # noqa: S105 - prefix of every token


def utc_now() -> datetime:
    """Current time in UTC."""
    return datetime.now(UTC)


class Accounts:
    """Accounts, sessions and tokens of a station.

    ``ended`` is called with the id of every session and token that ends, ``lowered`` with the id of
    each whose account has lost a right to move axes.
    """

    def __init__(
        self,
        store: Store,
        passwords: Passwords,
        now: Callable[[], datetime] = utc_now,
        ended: Callable[[str], None] = lambda _session: None,
        lowered: Callable[[str], None] = lambda _session: None,
    ) -> None:
        self._store, self._passwords, self._now = store, passwords, now
        self.directory = Directory(now, ended, lowered)
        self._changing = asyncio.Lock()
        self._turns = HashTurns()
        self._budgets = LoginBudgets()
        self.devices = KnownDevices()
        #: Called on a worker thread after an account was given the role of administrator.
        self.on_set_up: Callable[[], None] = lambda: None
        self.setup_code = spoken_code(3)

    # --- log-in -----------------------------------------------------------------------

    async def set_up(
        self, code: str, name: str, password: str, address: str, client: str
    ) -> tuple[str, LoginSession]:
        """Make the first administrator; ``code`` is shown in the terminal of the machine.

        Raises:
            Forbidden: there is an administrator already, or the code is wrong.
            TooOften: too many tries.
        """
        self._budgets.require(_SET_UP, address)
        async with self._changing:
            if self.directory.is_set_up:
                raise Forbidden("people.station-administrator")
            if not same_code(code, self.setup_code):
                self._budgets.tried(_SET_UP, address)
                raise Forbidden("people.code-wrong")
            account = await self._add(name, password, Role.ADMINISTRATOR)
        return await self._begin(account, client)

    async def log_in(
        self, name: str, password: str, address: str, client: str, device: str | None = None
    ) -> tuple[str, LoginSession]:
        """Begin a session for the right name and password. Returns the cookie and the session.

        ``device`` is the cookie by which the browser may be known (`KnownDevices`).

        Raises:
            NotLoggedIn: name or password is wrong; the error does not state which.
            TooOften: too many tries.
        """
        known = self._known(name, device)
        self._budgets.require(name, address, known)
        place, wrong = known or address_group(address), self._budgets.wrong_tries_of(address)
        async with self._turns.turn(place, known=bool(known), wrong=wrong):
            async with self._changing:
                await self._load()
            known = self._known(name, device)
            # Tries that were ahead in the queue may have used up the budget in the meantime.
            self._budgets.require(name, address, known)
            self._budgets.tried(name, address, known)
            account = self.directory.find(name)
            kept = self._passwords.decoy if account is None else account.password
            good = await asyncio.to_thread(self._passwords.verify, kept, password)
        if account is None or not good:
            raise NotLoggedIn("people.name-password-wrong")
        self._budgets.succeeded(name, address, known)
        return await self._begin(account, client)

    def _known(self, name: str, device: str | None) -> str:
        """Id of the browser if it has logged in to this account before, otherwise empty."""
        found, account = self.devices.known(device), self.directory.find(name)
        return found.id if found and account and found.account == account.id else ""

    async def log_out(self, session: str) -> None:
        """End a session at once; after that its cookie is not accepted for STOP either."""
        await self._end([session])

    async def _begin(self, account: Account, client: str) -> tuple[str, LoginSession]:
        """Begin a session.

        Raises:
            NotLoggedIn: the account was removed, or has another password, since it was checked.
        """
        secret, now = new_secret(), self._now()
        session = LoginSession(digest(secret), account.id, now, now, client[:200])
        async with self._changing:
            known = self.directory.find(account.name)
            if known is None or (known.id, known.password) != (account.id, account.password):
                raise NotLoggedIn("people.name-password-wrong")
            await self._store.call(changes.add_session, self._store, session)
            self.directory.begin(session)
        return secret, session

    # --- accounts ---------------------------------------------------------------------

    async def add(self, name: str, password: str, role: Role) -> Account:
        """Add an account.

        Raises:
            NotAllowed: the name is in use, or the name, the password or the role is not acceptable.
        """
        async with self._changing:
            return await self._add(name, password, role)

    async def _add(self, name: str, password: str, role: Role) -> Account:
        name = checked_person(name)
        if role not in ACCOUNT_ROLES:
            raise NotAllowed("people.not-role-account", value=role)
        require_good(password, name)
        await self._load()
        if self.directory.find(name) is not None:
            raise NotAllowed("people.account-already", value=name)
        kept = await self._hash(password)
        account = await self._store.call(
            changes.add_account, self._store, name, role, kept, self._now()
        )
        self.directory.put(account)
        if role is Role.ADMINISTRATOR:
            await asyncio.to_thread(self.on_set_up)
        return account

    async def set_role(self, account_id: int, role: Role) -> Account:
        """Change the role of an account; effective from the next request on.

        Raises:
            NotAllowed: the role is not one for accounts, or no administrator would be left.
        """
        async with self._changing:
            account = self.directory.account(account_id)
            if role not in ACCOUNT_ROLES:
                raise NotAllowed("people.not-role-account", value=role)
            if role is not Role.ADMINISTRATOR:
                self.directory.require_another_administrator(account)
            await self._store.call(
                functools.partial(changes.change_account, self._store, account_id, role=role)
            )
            account = replace(account, role=role)
            self.directory.put(account)
            if role is Role.ADMINISTRATOR:
                await asyncio.to_thread(self.on_set_up)
            return account

    async def set_password(self, account_id: int, password: str, keep: str = "") -> None:
        """Set a new password; ends every session of the account except ``keep``."""
        account = self.directory.account(account_id)
        require_good(password, account.name)
        kept = await self._hash(password)
        async with self._changing:
            account = self.directory.account(account_id)
            await self._store.call(
                functools.partial(changes.change_account, self._store, account_id, password=kept)
            )
            self.directory.put(replace(account, password=kept))
        await self._end(s.id for s in self.directory.sessions(account_id) if s.id != keep)

    async def require_password(self, account_id: int, password: str, address: str) -> None:
        """Check the current password before a change that only its owner may make.

        Raises:
            Forbidden: the password is wrong.
            TooOften: too many tries.
        """
        account = self.directory.account(account_id)
        # The caller has a session of the account, so these tries have a
        # budget apart from strangers'.
        own = f"account {account_id}"
        self._budgets.require(account.name, address, own)
        self._budgets.tried(account.name, address, own)
        async with self._turns.turn(own, known=True):
            good = await asyncio.to_thread(self._passwords.verify, account.password, password)
        if not good:
            raise Forbidden("people.present-password-wrong")
        self._budgets.succeeded(account.name, address, own)

    async def remove(self, account_id: int) -> None:
        """Delete an account with its sessions and tokens.

        Raises:
            NotAllowed: no administrator would be left.
        """
        async with self._changing:
            account = self.directory.account(account_id)
            self.directory.require_another_administrator(account)
            await self._store.call(changes.delete_account, self._store, account_id)
            self.directory.drop_account(account_id)

    async def _hash(self, password: str) -> str:
        async with self._turns.turn("hash", known=True):
            return await asyncio.to_thread(self._passwords.hash, password)

    # --- sessions ---------------------------------------------------------------------

    async def _end(self, sessions: Iterable[str]) -> None:
        gone = list(sessions)
        # Sessions end in memory first, so that they end even when the disk is full; the
        # rows are then deleted later.
        for session in gone:
            self.directory.forget(session)
        if gone:
            await self._store.call(changes.delete_sessions, self._store, gone)

    # --- tokens -----------------------------------------------------------------------

    async def make_token(
        self, account_id: int, name: str, scopes: frozenset[Right], lifetime: timedelta
    ) -> tuple[str, Token]:
        """Make a token for a script. Returns the secret, which is not stored, and the token.

        Raises:
            NotAllowed: a scope that the owner does not have, no scope, or a
            lifetime that is too long.
        """
        account = self.directory.account(account_id)
        name = checked_person(name)
        beyond = scopes - RIGHTS[account.role]
        if beyond or not scopes:
            raise NotAllowed(
                "people.cannot-give-token",
                limit=rights_text(RIGHTS[account.role]),
                account=account.name,
                beyond=rights_text(beyond) if beyond else text("people.no-scope"),
            )
        if not timedelta(0) < lifetime <= LONGEST_TOKEN:
            raise NotAllowed(
                "people.token-lives-least-minute",
                limit=text("limit.days", count=LONGEST_TOKEN.days),
            )
        secret, now = new_secret(TOKEN_PREFIX), self._now()
        token = Token(digest(secret), account_id, name, scopes, now, now + lifetime)
        async with self._changing:
            await self._store.call(changes.add_token, self._store, token)
            self.directory.put_token(token)
        return secret, token

    async def revoke_token(self, token: Token) -> None:
        """End a token at once."""
        self.directory.forget(token.id)
        await self._store.call(changes.delete_token, self._store, token.id)

    # --- the database -----------------------------------------------------------------

    async def open(self) -> None:
        """Read accounts, sessions and tokens from the database.

        Raises:
            DatabaseFailed: the database cannot be read.
        """
        async with self._changing:
            await self._load()

    async def tend(self) -> None:
        """Periodic upkeep: store last uses, delete what has ended, read others' changes."""
        used, over = self.directory.unwritten(), self.directory.over()
        async with self._changing:
            if used or over:
                await self._store.call(changes.tend, self._store, used, over)
                self.directory.written(used)
            await self._load()

    async def _load(self) -> None:
        """Read the database into memory; only under the lock, so that no newer change is lost."""
        self.directory.take(await self._store.call(read, self._store))
