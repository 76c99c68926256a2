"""Accounts and guests of one station together: identifies the person behind a request."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from backend.foundation.people.accounts import Accounts
from backend.foundation.people.elapsed import moment_of
from backend.foundation.people.errors import NotLoggedIn
from backend.foundation.people.identity import LOCAL, Identity
from backend.foundation.people.login.devices import KnownDevices
from backend.foundation.people.login.marker import AccountsMarker
from backend.foundation.people.login.passwords import Passwords
from backend.foundation.people.records import Account, LoginSession
from backend.foundation.people.rights import RIGHTS
from backend.foundation.people.support import Support
from backend.foundation.store.database import Store
from backend.foundation.store.files import StorageFailed
from drivers.errors import NotAllowed

log = logging.getLogger(__name__)


class People:
    """Accounts and guests of a station.

    Without ``accounts_needed`` everybody who reaches the server is the same user. That is
    permissible only on the machine's own loopback interface, which
    `backend.commands.server.serve` ensures.
    """

    def __init__(
        self,
        folder: Path,
        *,
        accounts_needed: bool = False,
        passwords: Passwords | None = None,
    ) -> None:
        self.accounts_needed = accounts_needed
        self._store = Store(folder)
        #: Called with the id of a session, token or guest that has ended.
        self.on_ended: list[Callable[[str], None]] = []
        #: Called with the id of a session or token whose account has lost a right to move axes.
        self.on_lowered: list[Callable[[str], None]] = []
        self.accounts = Accounts(
            self._store, passwords or Passwords(), ended=self._ended, lowered=self._lowered
        )
        self._marker = AccountsMarker(folder)
        self.accounts.on_set_up = self._set_up
        self.support = Support()
        self.support.on_ended.append(self._ended)

    async def open(self, *, recovering: bool = False) -> None:
        """Read the accounts, where the station uses them.

        ``recovering`` skips the check that they still exist; only the
        machine's terminal may use it.

        Raises:
            AccountsMissing: the station has had accounts, and has no administrator now.
            DatabaseFailed: they cannot be read.
        """
        if self.accounts_needed:
            await self.accounts.open()
            file = self._store.sqlite_file
            if file is not None:
                # Only its user may read password hashes; SQLite gives its side files the same mode.
                file.chmod(0o600)
            set_up = self.accounts.directory.is_set_up
            if not recovering:
                await asyncio.to_thread(self._marker.require_accounts, file, set_up=set_up)
            await self.mark()

    async def mark(self) -> None:
        """Write the marker outside the database, if there are accounts."""
        if self.accounts_needed and self.accounts.directory.is_set_up:
            await asyncio.to_thread(self._set_up)

    def _set_up(self) -> None:
        try:
            self.accounts.devices = KnownDevices(self._marker.write().key)
        except StorageFailed as error:
            # Log-in still works; only the second record of the accounts' existence is missing.
            log.error("the note that accounts exist is missing next to the database: %s", error)  # noqa: TRY400

    def close(self) -> None:
        """Close the database."""
        self._store.close()

    @property
    def setup_needed(self) -> bool:
        """Whether the first administrator does not exist yet."""
        return self.accounts_needed and not self.accounts.directory.is_set_up

    def identify(self, cookie: str | None, bearer: str | None) -> Identity | None:
        """Identity of a cookie or token, with its current rights; None if it is not valid."""
        if not self.accounts_needed:
            return LOCAL
        if bearer is not None:
            known = self.accounts.directory.token(bearer)
            if known is None:
                return None
            owner, token = known
            rights = token.scopes & RIGHTS[owner.role]
            return Identity(f"{owner.name} ({token.name})", owner.role, "token", token.id, rights)
        if cookie is None:
            return None
        found = self.accounts.directory.session(cookie)
        if found is not None:
            account, session, alive = found
            if not alive:
                return None
            self.accounts.directory.touch(session.id)
            return _of_session(account, session)
        return self.support.guest(cookie)

    def renewed(self, identity: Identity) -> Identity | None:
        """The same person with their current rights; None if their session has ended."""
        match identity.kind:
            case "local":
                return identity
            case "guest":
                found = self.support.of_session(identity.session)
                return None if found is None else self.support.identity(found)
            case "session" | "token":
                return self.accounts.directory.renewed(identity)

    def expires(self, identity: Identity) -> datetime | None:
        """Time at which this person's session ends; None if it does not."""
        if identity.is_guest:
            found = self.support.of_session(identity.session)
            return None if found is None else datetime.fromtimestamp(moment_of(found.expires), UTC)
        return self.accounts.directory.expires(identity.session)

    def admit(self, identity: Identity, message: str) -> Identity:
        """Current identity of the person behind a live connection, when a message arrives.

        Raises:
            NotLoggedIn: their session has ended and the message is not STOP.
        """
        now = self.renewed(identity)
        if now is None:
            if message != "stop":
                raise NotLoggedIn("people.session-over")
            return replace(identity, rights=frozenset())
        if message != "ping":
            self.accounts.directory.touch(identity.session)
        return now

    def may_stop(self, cookie: str | None) -> Identity | None:
        """Identity, without rights, of a session that ended recently.

        Its page still shows STOP, which must work.
        """
        found = None if cookie is None else self.accounts.directory.session(cookie)
        if found is None:
            return None
        account, session, _ = found
        if not self.accounts.directory.is_remembered(session):
            return None
        return Identity(account.name, account.role, "session", session.id, frozenset())

    def is_known(self, device: str | None) -> bool:
        """Whether this cookie is of a browser that has logged in here before."""
        return self.accounts.devices.known(device) is not None

    def require_accounts(self) -> None:
        """Check that the station has accounts, which remote access requires.

        Raises:
            NotAllowed: this station has no accounts.
        """
        if not self.accounts_needed:
            raise NotAllowed("people.station-runs-without-accounts")

    def _ended(self, session: str) -> None:
        for listener in self.on_ended:
            listener(session)

    def _lowered(self, session: str) -> None:
        for listener in self.on_lowered:
            listener(session)


def _of_session(account: Account, session: LoginSession) -> Identity:
    return Identity(account.name, account.role, "session", session.id, RIGHTS[account.role])
