"""The session of a request: its message to the page, its cookies, its account."""

from __future__ import annotations

from fastapi import Request, Response

from backend.api.people.models import Session
from backend.api.security.gate import (
    COOKIE,
    DEVICE_COOKIE,
    SECURE_COOKIE,
    SECURE_DEVICE_COOKIE,
    credentials,
)
from backend.foundation.people.accounts import Accounts
from backend.foundation.people.errors import Forbidden
from backend.foundation.people.identity import Identity
from backend.foundation.people.login.credentials import csrf_of
from backend.foundation.people.login.devices import LIFETIME_S
from backend.foundation.people.records import Account
from backend.foundation.people.rights import Right
from backend.foundation.people.station import People


def session_of(people: People, identity: Identity | None, cookie: str | None) -> Session:
    """The session as shown to the page; ``identity`` is None if nobody is logged in."""
    by_cookie = identity is not None and identity.kind in ("session", "guest") and cookie
    return Session(
        person=None if identity is None else identity.person,
        role=None if identity is None else identity.role,
        rights=[] if identity is None else sorted(identity.rights),
        login_required=people.accounts_needed,
        setup_required=people.setup_needed,
        guest=identity is not None and identity.is_guest,
        csrf=csrf_of(cookie) if by_cookie and cookie else None,
        expires=None if identity is None else people.expires(identity),
    )


def with_cookie(request: Request, response: Response, people: People, secret: str) -> Session:
    """Set the cookie of a new session; it is limited to HTTPS if the page was loaded by HTTPS."""
    secure = _is_secure(request)
    response.set_cookie(
        SECURE_COOKIE if secure else COOKIE,
        secret,
        httponly=True,
        secure=secure,
        samesite="strict",
        path="/",
    )
    return session_of(people, people.identify(secret, None), secret)


def remember_device(request: Request, response: Response, people: People, account: int) -> None:
    """Set the device cookie, so that tries of strangers do not use up this browser's budget."""
    devices = people.accounts.devices
    known = devices.known(device_of(request))
    if known is not None and known.account == account:
        return
    secure = _is_secure(request)
    response.set_cookie(
        SECURE_DEVICE_COOKIE if secure else DEVICE_COOKIE,
        devices.issue(account),
        max_age=LIFETIME_S,
        httponly=True,
        secure=secure,
        samesite="strict",
        path="/",
    )


def device_of(request: Request) -> str | None:
    """The device cookie of a browser, independent of the session."""
    return credentials(request.scope).device


def _is_secure(request: Request) -> bool:
    return request.url.scheme == "https" or request.headers.get("origin", "").startswith("https:")


def address_of(request: Request) -> str:
    """The client address of a request; empty if unknown."""
    return request.client.host if request.client else ""


def client_of(request: Request) -> str:
    """The browser or program of a request, as in its User-Agent header."""
    return request.headers.get("user-agent", "")


def own_account(accounts: Accounts, me: Identity) -> Account:
    """The account of a session; tokens and guests have no account that they may change.

    Raises:
        Forbidden: there is none.
    """
    if me.kind != "session":
        raise Forbidden("api-security.needs-log-password")
    return accounts.directory.owner(me.session)


def whose_sessions(accounts: Accounts, me: Identity) -> int | None:
    """Account whose sessions and tokens may be listed; None for all, as for administrators.

    Raises:
        Forbidden: a guest, a token, or the single user of a station without accounts.
    """
    if Right.ADMINISTER in me.rights:
        return None
    return own_account(accounts, me).id
