"""Accounts, sessions and tokens in memory, for the checks of every request.

STOP must not wait for a disk, so nothing here reads or writes one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from datetime import datetime, timedelta

from backend.foundation.people.errors import NoSuchPerson
from backend.foundation.people.identity import Identity
from backend.foundation.people.login.credentials import digest, name_key
from backend.foundation.people.records import REMEMBERED, Account, LoginSession, Records, Token
from backend.foundation.people.rights import MOVING, RIGHTS, Role
from drivers.errors import NotAllowed

_WRITE_USE = timedelta(minutes=1)


class Directory:
    """Accounts, sessions and tokens of one station.

    ``ended`` is called with the id of every session and token that ends, ``lowered`` with the id of
    each whose account has lost a right to move axes.
    """

    def __init__(
        self,
        now: Callable[[], datetime],
        ended: Callable[[str], None],
        lowered: Callable[[str], None] = lambda _session: None,
    ) -> None:
        self._now, self._ended, self._lowered = now, ended, lowered
        self._accounts: dict[int, Account] = {}
        self._sessions: dict[str, LoginSession] = {}
        self._written: dict[str, datetime] = {}
        self._tokens: dict[str, Token] = {}
        #: Ids that ended here; a database read that began earlier must not restore them.
        self._dead: set[str] = set()

    # --- what the gate asks -----------------------------------------------------------

    @property
    def is_set_up(self) -> bool:
        """Whether there is an administrator account."""
        return any(a.role is Role.ADMINISTRATOR for a in self._accounts.values())

    def session(self, secret: str) -> tuple[Account, LoginSession, bool] | None:
        """Account and session of a cookie, and whether the session is valid; None if unknown."""
        session = self._sessions.get(digest(secret))
        account = None if session is None else self._accounts.get(session.account)
        if session is None or account is None:
            return None
        return account, session, self._now() < session.expires

    def owner(self, session_id: str) -> Account:
        """The account of a session.

        Raises:
            NoSuchPerson: there is no session of this id.
        """
        session = self._sessions.get(session_id)
        if session is None:
            raise NoSuchPerson("people.no-session", value=session_id)
        return self.account(session.account)

    def account_of(self, session_id: str) -> Account | None:
        """Account of a session or token; None if the id is unknown."""
        known = self._sessions.get(session_id) or self._tokens.get(session_id)
        return None if known is None else self._accounts.get(known.account)

    def expires(self, session_id: str) -> datetime | None:
        """Time at which a session or token ends; None if the id is unknown."""
        known = self._sessions.get(session_id) or self._tokens.get(session_id)
        return None if known is None else known.expires

    def is_remembered(self, session: LoginSession) -> bool:
        """Whether the session is valid, or ended so recently that its page may not know it yet."""
        return self._now() < session.expires + REMEMBERED

    def touch(self, session_id: str) -> None:
        """Record that a person has just used this session."""
        if (session := self._sessions.get(session_id)) is not None:
            self._sessions[session_id] = replace(session, used=self._now())

    def renewed(self, identity: Identity) -> Identity | None:
        """The same identity with its current role and rights; None if its session has ended."""
        now = self._now()
        session, token = self._sessions.get(identity.session), self._tokens.get(identity.session)
        known = session or token
        account = None if known is None else self._accounts.get(known.account)
        if known is None or account is None or now >= known.expires:
            return None
        rights = RIGHTS[account.role] if token is None else RIGHTS[account.role] & token.scopes
        return replace(identity, role=account.role, rights=rights)

    def token(self, secret: str) -> tuple[Account, Token] | None:
        """Owner and token of a secret; None if it is unknown or has expired."""
        token = self._tokens.get(digest(secret))
        account = None if token is None else self._accounts.get(token.account)
        if token is None or account is None or self._now() >= token.expires:
            return None
        return account, token

    # --- who and what there is --------------------------------------------------------

    def all(self) -> list[Account]:
        """All accounts, sorted by name."""
        return sorted(self._accounts.values(), key=lambda a: name_key(a.name))

    def account(self, account_id: int) -> Account:
        """The account of this number.

        Raises:
            NoSuchPerson: there is none.
        """
        account = self._accounts.get(account_id)
        if account is None:
            raise NoSuchPerson("people.no-account", value=account_id)
        return account

    def find(self, name: str) -> Account | None:
        """Account of this name, compared by `name_key`; None if there is none."""
        key = name_key(name)
        return next((a for a in self._accounts.values() if name_key(a.name) == key), None)

    def require_another_administrator(self, account: Account) -> None:
        """Check that an administrator other than this account exists.

        Raises:
            NotAllowed: the account is the only administrator.
        """
        others = [
            a
            for a in self._accounts.values()
            if a.role is Role.ADMINISTRATOR and a.id != account.id
        ]
        if account.role is Role.ADMINISTRATOR and not others:
            raise NotAllowed("people.administrator", value=account.name)

    def sessions(self, account_id: int | None = None) -> list[LoginSession]:
        """Valid sessions, newest first; of one account if given."""
        now = self._now()
        found = [
            s
            for s in self._sessions.values()
            if account_id in (None, s.account) and now < s.expires
        ]
        return sorted(found, key=lambda s: s.created, reverse=True)

    def tokens(self, account_id: int | None = None) -> list[Token]:
        """Tokens, newest first; of one account if given."""
        found = [t for t in self._tokens.values() if account_id in (None, t.account)]
        return sorted(found, key=lambda t: t.created, reverse=True)

    # --- what has changed -------------------------------------------------------------

    def put(self, account: Account) -> None:
        """Add or replace an account; `lowered` is called if its role loses a right to move axes."""
        before = self._accounts.get(account.id)
        self._accounts[account.id] = account
        lost = frozenset() if before is None else RIGHTS[before.role] - RIGHTS[account.role]
        if lost & MOVING:
            known = [session.id for session in self.sessions(account.id)]
            for each in (*known, *(token.id for token in self.tokens(account.id))):
                self._lowered(each)

    def begin(self, session: LoginSession) -> None:
        """Add a session that is stored in the database already."""
        self._sessions[session.id] = session
        self._written[session.id] = session.used

    def put_token(self, token: Token) -> None:
        """Add a token."""
        self._tokens[token.id] = token

    def forget(self, session: str) -> None:
        """End a session or token."""
        known = self._sessions.pop(session, None) or self._tokens.pop(session, None)
        self._written.pop(session, None)
        self._dead.add(session)
        if known is not None:
            self._ended(session)

    def drop_account(self, account_id: int) -> None:
        """Remove an account and end its sessions and tokens."""
        self._accounts.pop(account_id, None)
        gone = [s.id for s in self._sessions.values() if s.account == account_id]
        gone += [t.id for t in self._tokens.values() if t.account == account_id]
        for each in gone:
            self.forget(each)

    # --- the database -----------------------------------------------------------------

    def unwritten(self) -> list[LoginSession]:
        """Sessions whose last use is a minute or more later than the use that is stored."""
        return [
            s
            for s in self._sessions.values()
            if s.used - self._written.get(s.id, s.created) >= _WRITE_USE
        ]

    def over(self) -> list[str]:
        """Ids of the sessions and tokens that can be deleted from the database."""
        now = self._now()
        sessions = [s.id for s in self._sessions.values() if now >= s.expires + REMEMBERED]
        return sessions + [t.id for t in self._tokens.values() if now >= t.expires]

    def written(self, used: Iterable[LoginSession]) -> None:
        """Record that the last uses of these sessions are stored."""
        self._written |= {s.id: s.used for s in used}

    def take(self, kept: Records) -> None:
        """Take over the records of the database, except those that ended here in the meantime."""
        for account in self._accounts.keys() - kept.accounts.keys():
            self.drop_account(account)
        gone = (self._sessions.keys() - kept.sessions.keys()) | (
            self._tokens.keys() - kept.tokens.keys()
        )
        for each in gone:
            self.forget(each)
        self._dead &= kept.sessions.keys() | kept.tokens.keys()
        for changed in kept.accounts.values():
            self.put(changed)
        self._tokens = {k: t for k, t in kept.tokens.items() if k not in self._dead}
        for key, session in kept.sessions.items():
            known = self._sessions.get(key)
            if key not in self._dead and (known is None or known.used < session.used):
                self._sessions[key] = session
                self._written[key] = session.used
