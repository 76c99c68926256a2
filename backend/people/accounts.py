"""Accounts, log-in sessions and tokens.

Everything that a request needs is kept in memory, since STOP must not wait for a disk; changes go
to the database first. `tend` brings in what another process (the command line) changed.
"""

from __future__ import annotations

import asyncio
import ipaddress
from collections.abc import Callable, Iterable
from dataclasses import replace
from datetime import UTC, datetime, timedelta

from sqlalchemy import delete, update

from backend.people.credentials import (
    checked_person,
    digest,
    name_key,
    new_secret,
    same_code,
    spoken_code,
)
from backend.people.errors import Forbidden, NoSuchPerson, NotLoggedIn, TooOften
from backend.people.identity import Identity
from backend.people.passwords import Passwords, require_good
from backend.people.records import REMEMBERED, Account, LoginSession, Token, read
from backend.people.rights import ACCOUNT_ROLES, RIGHTS, Right, Role
from backend.people.tables import AccountRow, SessionRow, TokenRow
from backend.people.throttle import Throttle
from backend.store import Store
from drivers.errors import NotAllowed

LONGEST_TOKEN = timedelta(days=366)
TOKEN_PREFIX = "sdk_"  # noqa: S105 - what every token begins with
#: Wrong tries before waits begin: for a name from one address, for a name, for an address.
_PAIR, _NAME, _ADDRESS = 5, 20, 20
_WRITE_USE = timedelta(minutes=1)


def utc_now() -> datetime:
    """The present moment."""
    return datetime.now(UTC)


class Accounts:
    """The people of a station. ``ended`` is called with the id of every session that ends."""

    def __init__(
        self,
        store: Store,
        passwords: Passwords,
        now: Callable[[], datetime] = utc_now,
        ended: Callable[[str], None] = lambda _session: None,
    ) -> None:
        self._store, self._passwords, self._now, self._ended = store, passwords, now, ended
        self._accounts: dict[int, Account] = {}
        self._sessions: dict[str, LoginSession] = {}
        self._written: dict[str, datetime] = {}
        self._tokens: dict[str, Token] = {}
        #: Ended here; a read that began before must not bring them back.
        self._dead: set[str] = set()
        self._changing = asyncio.Lock()
        #: One hash at a time: many at once would keep the cores from what moves.
        self._hashing = asyncio.Semaphore(1)
        self._throttles = (Throttle(_PAIR), Throttle(_NAME), Throttle(_ADDRESS))
        self.setup_code = spoken_code(3)

    # --- what the gate asks -----------------------------------------------------------

    @property
    def is_set_up(self) -> bool:
        """Whether there is an administrator."""
        return any(a.role is Role.ADMINISTRATOR for a in self._accounts.values())

    def session(self, secret: str) -> tuple[Account, LoginSession, bool] | None:
        """The session of a cookie, and whether it is still alive; None where there is none."""
        session = self._sessions.get(digest(secret))
        account = None if session is None else self._accounts.get(session.account)
        if session is None or account is None:
            return None
        return account, session, self._now() < session.expires

    def owner(self, session_id: str) -> Account:
        """The account of a session.

        Raises:
            NoSuchPerson: there is no such session.
        """
        session = self._sessions.get(session_id)
        if session is None:
            raise NoSuchPerson("there is no such session", value=session_id)
        return self.account(session.account)

    def expires(self, session_id: str) -> datetime | None:
        """When a session or token ends; None where there is none."""
        known = self._sessions.get(session_id) or self._tokens.get(session_id)
        return None if known is None else known.expires

    def is_remembered(self, session: LoginSession) -> bool:
        """Whether it is alive, or ended so lately that its page may not know."""
        return self._now() < session.expires + REMEMBERED

    def touch(self, session_id: str) -> None:
        """A person did something with this session."""
        if (session := self._sessions.get(session_id)) is not None:
            self._sessions[session_id] = replace(session, used=self._now())

    def renewed(self, identity: Identity) -> Identity | None:
        """The same person with the role of this moment, or None when the session is over."""
        now = self._now()
        session, token = self._sessions.get(identity.session), self._tokens.get(identity.session)
        known = session or token
        account = None if known is None else self._accounts.get(known.account)
        if known is None or account is None or now >= known.expires:
            return None
        rights = RIGHTS[account.role] if token is None else RIGHTS[account.role] & token.scopes
        return replace(identity, role=account.role, rights=rights)

    def token(self, secret: str) -> tuple[Account, Token] | None:
        """The owner and the token, or None where it is unknown or has expired."""
        token = self._tokens.get(digest(secret))
        account = None if token is None else self._accounts.get(token.account)
        if token is None or account is None or self._now() >= token.expires:
            return None
        return account, token

    # --- log-in -----------------------------------------------------------------------

    async def set_up(
        self, code: str, name: str, password: str, address: str, client: str
    ) -> tuple[str, LoginSession]:
        """The first administrator; the code stands in the terminal of the machine.

        Raises:
            Forbidden: there is one already, or the code is wrong. TooOften: too many tries.
        """
        self._require_patience("setup", address)
        async with self._changing:
            if self.is_set_up:
                raise Forbidden("this station has an administrator", remedy="log in")
            if not same_code(code, self.setup_code):
                self._count("setup", address)
                raise Forbidden("the code is wrong", remedy="read it in the terminal again")
            account = await self._add(name, password, Role.ADMINISTRATOR)
        return await self._begin(account, client)

    async def log_in(
        self, name: str, password: str, address: str, client: str
    ) -> tuple[str, LoginSession]:
        """A session for the right name and password. Returns the cookie and the session.

        Raises:
            NotLoggedIn: one of them is wrong; it is not said which. TooOften: too many tries.
        """
        self._require_patience(name, address)
        async with self._changing:
            await self._load()
        account = self._find(name)
        kept = self._passwords.decoy if account is None else account.password
        # Counted before the hash, so that tries at the same time count one another.
        self._count(name, address)
        async with self._hashing:
            good = await asyncio.to_thread(self._passwords.verify, kept, password)
        if account is None or not good:
            raise NotLoggedIn("name or password is wrong", remedy="try again")
        for throttle, keys in zip(self._throttles, self._keys(name, address), strict=True):
            throttle.succeeded(keys)
        return await self._begin(account, client)

    async def log_out(self, session: str) -> None:
        """End a session at once; it cannot even press STOP any more."""
        await self._end([session])

    def _keys(self, name: str, address: str) -> tuple[str, str, str]:
        key = name_key(name)[:120]
        return f"{key} {address}", key, address

    def _require_patience(self, name: str, address: str) -> None:
        wait = max(
            throttle.wait_s(key)
            for throttle, key in zip(self._throttles, self._keys(name, address), strict=True)
        )
        if wait > 0:
            raise TooOften("too many wrong tries", wait)

    def _count(self, name: str, address: str) -> None:
        for throttle, key in zip(self._throttles, self._keys(name, address), strict=True):
            # Behind a proxy everybody comes from this machine: one must not lock out all.
            if key != address or not _is_loopback(address):
                throttle.failed(key)

    async def _begin(self, account: Account, client: str) -> tuple[str, LoginSession]:
        secret, now = new_secret(), self._now()
        session = LoginSession(digest(secret), account.id, now, now, client[:200])

        def write() -> None:
            with self._store.writing() as database:
                database.add(
                    SessionRow(
                        id=session.id,
                        account_id=account.id,
                        created=now,
                        used=now,
                        client=session.client,
                    )
                )

        async with self._changing:
            await self._store.call(write)
            self._sessions[session.id] = session
            self._written[session.id] = now
        return secret, session

    # --- accounts ---------------------------------------------------------------------

    def all(self) -> list[Account]:
        """Accounts by name."""
        return sorted(self._accounts.values(), key=lambda a: name_key(a.name))

    def account(self, account_id: int) -> Account:
        """The account of this number.

        Raises:
            NoSuchPerson: there is none.
        """
        account = self._accounts.get(account_id)
        if account is None:
            raise NoSuchPerson("there is no such account", value=account_id)
        return account

    async def add(self, name: str, password: str, role: Role) -> Account:
        """A new account.

        Raises:
            NotAllowed: the name is taken, or name or password is none.
        """
        async with self._changing:
            return await self._add(name, password, role)

    async def _add(self, name: str, password: str, role: Role) -> Account:
        name = checked_person(name)
        if role not in ACCOUNT_ROLES:
            raise NotAllowed(f"{role} is not a role of an account", value=role)
        require_good(password, name)
        await self._load()
        if self._find(name) is not None:
            raise NotAllowed(
                f"there is an account {name} already",
                value=name,
                remedy="choose another name, or change that account",
            )
        kept = await self._hash(password)
        now = self._now()

        def write() -> int:
            with self._store.writing() as database:
                row = AccountRow(
                    name=name,
                    name_key=name_key(name),
                    role=role.value,
                    password=kept,
                    created=now,
                )
                database.add(row)
                database.flush()
                return row.id

        number = await self._store.call(write)
        account = Account(number, name, role, kept, now)
        self._accounts[number] = account
        return account

    async def set_role(self, account_id: int, role: Role) -> Account:
        """Another role; it holds from the next request on.

        Raises:
            NotAllowed: nobody would be left who administers.
        """
        async with self._changing:
            account = self.account(account_id)
            if role not in ACCOUNT_ROLES:
                raise NotAllowed(f"{role} is not a role of an account", value=role)
            if role is not Role.ADMINISTRATOR:
                self._require_another_administrator(account)
            await self._change(account_id, role=role.value)
            self._accounts[account_id] = replace(account, role=role)
            return self._accounts[account_id]

    async def set_password(self, account_id: int, password: str, keep: str = "") -> None:
        """A new password; ends every session of the account but ``keep``."""
        account = self.account(account_id)
        require_good(password, account.name)
        kept = await self._hash(password)
        async with self._changing:
            account = self.account(account_id)
            await self._change(account_id, password=kept)
            self._accounts[account_id] = replace(account, password=kept)
        await self._end(s.id for s in self.sessions(account_id) if s.id != keep)

    async def require_password(self, account_id: int, password: str, address: str) -> None:
        """The present password, before something that a borrowed screen must not do.

        Raises:
            Forbidden: it is wrong. TooOften: too many tries.
        """
        account = self.account(account_id)
        self._require_patience(account.name, address)
        self._count(account.name, address)
        async with self._hashing:
            good = await asyncio.to_thread(self._passwords.verify, account.password, password)
        if not good:
            raise Forbidden("the present password is wrong", remedy="try again")
        for throttle, key in zip(self._throttles, self._keys(account.name, address), strict=True):
            throttle.succeeded(key)

    async def remove(self, account_id: int) -> None:
        """Delete an account with its sessions and tokens.

        Raises:
            NotAllowed: nobody would be left who administers.
        """
        async with self._changing:
            account = self.account(account_id)
            self._require_another_administrator(account)

            def write() -> None:
                with self._store.writing() as database:
                    database.execute(delete(AccountRow).where(AccountRow.id == account_id))

            await self._store.call(write)
            self._drop_account(account_id)

    def _require_another_administrator(self, account: Account) -> None:
        others = [
            a
            for a in self._accounts.values()
            if a.role is Role.ADMINISTRATOR and a.id != account.id
        ]
        if account.role is Role.ADMINISTRATOR and not others:
            raise NotAllowed(
                f"{account.name} is the only administrator",
                value=account.name,
                remedy="make another account administrator first",
            )

    def _find(self, name: str) -> Account | None:
        key = name_key(name.strip())
        return next((a for a in self._accounts.values() if name_key(a.name) == key), None)

    async def _hash(self, password: str) -> str:
        async with self._hashing:
            return await asyncio.to_thread(self._passwords.hash, password)

    async def _change(self, account_id: int, **values: str) -> None:
        def write() -> None:
            with self._store.writing() as database:
                database.execute(
                    update(AccountRow).where(AccountRow.id == account_id).values(**values)
                )

        await self._store.call(write)

    def _drop_account(self, account_id: int) -> None:
        self._accounts.pop(account_id, None)
        gone = [s.id for s in self._sessions.values() if s.account == account_id]
        gone += [t.id for t in self._tokens.values() if t.account == account_id]
        for each in gone:
            self._forget(each)

    # --- sessions ---------------------------------------------------------------------

    def sessions(self, account_id: int | None = None) -> list[LoginSession]:
        """Living sessions, newest first; of one account where given."""
        now = self._now()
        found = [
            s
            for s in self._sessions.values()
            if account_id in (None, s.account) and now < s.expires
        ]
        return sorted(found, key=lambda s: s.created, reverse=True)

    async def _end(self, sessions: Iterable[str]) -> None:
        gone = list(sessions)

        def write() -> None:
            with self._store.writing() as database:
                database.execute(delete(SessionRow).where(SessionRow.id.in_(gone)))

        # Whoever is to be out is out even when the disk is full; the row then goes later.
        for session in gone:
            self._forget(session)
        if gone:
            await self._store.call(write)

    def _forget(self, session: str) -> None:
        known = self._sessions.pop(session, None) or self._tokens.pop(session, None)
        self._written.pop(session, None)
        self._dead.add(session)
        if known is not None:
            self._ended(session)

    # --- tokens -----------------------------------------------------------------------

    def tokens(self, account_id: int | None = None) -> list[Token]:
        """Tokens, newest first; of one account where given."""
        found = [t for t in self._tokens.values() if account_id in (None, t.account)]
        return sorted(found, key=lambda t: t.created, reverse=True)

    async def make_token(
        self, account_id: int, name: str, scopes: frozenset[Right], lifetime: timedelta
    ) -> tuple[str, Token]:
        """A token for a script. Returns the secret, which is not kept, and the token.

        Raises:
            NotAllowed: a scope that the owner does not have, or too long a life.
        """
        account = self.account(account_id)
        name = checked_person(name)
        beyond = scopes - RIGHTS[account.role]
        if beyond or not scopes:
            raise NotAllowed(
                f"{account.name} cannot give a token {', '.join(sorted(beyond)) or 'no scope'}",
                limit=", ".join(sorted(RIGHTS[account.role])),
                remedy="choose among these",
            )
        if not timedelta(0) < lifetime <= LONGEST_TOKEN:
            raise NotAllowed(
                "a token lives at least a minute and at most a year",
                limit=f"{LONGEST_TOKEN.days} days",
                remedy="choose a time within the limit",
            )
        secret, now = new_secret(TOKEN_PREFIX), self._now()
        token = Token(digest(secret), account_id, name, scopes, now, now + lifetime)

        def write() -> None:
            with self._store.writing() as database:
                database.add(
                    TokenRow(
                        id=token.id,
                        account_id=account_id,
                        name=name,
                        scopes=" ".join(sorted(scopes)),
                        created=now,
                        expires=token.expires,
                    )
                )

        async with self._changing:
            await self._store.call(write)
            self._tokens[token.id] = token
        return secret, token

    async def revoke_token(self, token: Token) -> None:
        """End a token at once."""

        def write() -> None:
            with self._store.writing() as database:
                database.execute(delete(TokenRow).where(TokenRow.id == token.id))

        self._forget(token.id)
        await self._store.call(write)

    # --- the database -----------------------------------------------------------------

    async def open(self) -> None:
        """Read what is kept.

        Raises:
            DatabaseFailed: it cannot be.
        """
        async with self._changing:
            await self._load()

    async def tend(self) -> None:
        """Now and then: write down uses, forget what has ended, take in changes from outside."""
        now = self._now()
        used = [
            s
            for s in self._sessions.values()
            if s.used - self._written.get(s.id, s.created) >= _WRITE_USE
        ]
        over = [s.id for s in self._sessions.values() if now >= s.expires + REMEMBERED]
        over += [t.id for t in self._tokens.values() if now >= t.expires]

        def write() -> None:
            with self._store.writing() as database:
                for session in used:
                    database.execute(
                        update(SessionRow)
                        .where(SessionRow.id == session.id)
                        .values(used=session.used)
                    )
                database.execute(delete(SessionRow).where(SessionRow.id.in_(over)))
                database.execute(delete(TokenRow).where(TokenRow.id.in_(over)))

        async with self._changing:
            if used or over:
                await self._store.call(write)
                self._written |= {s.id: s.used for s in used}
            await self._load()

    async def _load(self) -> None:
        """Take in what the database holds; only under the lock, so that nothing is overtaken."""
        kept = await self._store.call(read, self._store)
        for account in self._accounts.keys() - kept.accounts.keys():
            self._drop_account(account)
        gone = (self._sessions.keys() - kept.sessions.keys()) | (
            self._tokens.keys() - kept.tokens.keys()
        )
        for each in gone:
            self._forget(each)
        self._dead &= kept.sessions.keys() | kept.tokens.keys()
        self._accounts = kept.accounts
        self._tokens = {k: t for k, t in kept.tokens.items() if k not in self._dead}
        for key, session in kept.sessions.items():
            known = self._sessions.get(key)
            if key not in self._dead and (known is None or known.used < session.used):
                self._sessions[key] = session
                self._written[key] = session.used


def _is_loopback(address: str) -> bool:
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return False
