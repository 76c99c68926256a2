"""The gate: checks every request and websocket before any code of a route runs.

The order of the checks: address (Host, Origin), identity (cookie or token), declared route
(`backend.api.security.rights`), right, control of the axis, CSRF token of a change, size of
the body. An admitted request runs with `acting` set, so that everything it starts is
attributed to its person.
"""

from __future__ import annotations

import logging
import time
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from backend.api.admission.requests import Admission
from backend.api.messages.errors import (
    TITLES,
    NotFound,
    WrongMethod,
    answer,
    answer_error,
    message_or_none,
    problem_of,
    words_of,
)
from backend.api.messages.models import Problem
from backend.api.security.body import BodyRefused, MeasuredBody, framing, is_json
from backend.api.security.origin import Addresses, header
from backend.api.security.rights import Matched, Policy
from backend.api.security.socket import GuardedSocket, OpenSockets
from backend.foundation.people.errors import Forbidden, NotLoggedIn, TooOften
from backend.foundation.people.identity import Actor, Identity, acting, arrived_s
from backend.foundation.people.lease import Leases
from backend.foundation.people.login.credentials import csrf_of, same_text
from backend.foundation.people.rights import Right
from backend.foundation.people.station import People
from drivers.errors import DriveError, NotAllowed
from drivers.texts.message import text

log = logging.getLogger(__name__)

COOKIE, SECURE_COOKIE = "servodeck", "__Host-servodeck"
#: Cookie of a browser that has logged in before; see `backend.foundation.people.login.devices`.
DEVICE_COOKIE, SECURE_DEVICE_COOKIE = "servodeck-device", "__Host-servodeck-device"
CSRF_HEADER = "x-servodeck-csrf"
CONNECTION_HEADER = "x-servodeck-connection"
_SAFE = ("GET", "HEAD", "OPTIONS")
_REFUSED = {
    400: text("api-security.body-no-length"),
    408: text("api-security.body-too-slow"),
    413: text("api-security.body-too-large"),
    422: text("api-security.body-half-character"),
}

HEADERS = {
    "Content-Security-Policy": (
        "default-src 'self'; connect-src 'self'; img-src 'self' data: blob:; "
        "style-src 'self' 'unsafe-inline'; worker-src 'self' blob:; frame-ancestors 'self'; "
        "base-uri 'none'; form-action 'self'; object-src 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "SAMEORIGIN",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), microphone=(), geolocation=(), payment=(), usb=(), serial=()",
}


@dataclass(frozen=True, slots=True)
class Credentials:
    """Cookies and token that a request was sent with."""

    cookie: str | None
    bearer: str | None
    device: str | None = None


def credentials(scope: Scope) -> Credentials:
    """Cookie and bearer token of a request.

    Raises:
        Forbidden: the Authorization header occurs twice.
    """
    headers = scope["headers"]
    bearer = header(headers, b"authorization")
    token = None
    if bearer is not None:
        scheme, _, token = bearer.partition(" ")
        token = token.strip() if scheme.lower() == "bearer" else ""
    jar = SimpleCookie()
    try:
        for key, value in headers:
            if key == b"cookie":
                jar.load(value.decode("latin-1"))
    except CookieError:
        return Credentials(None, token)

    def brought(*names: str) -> str | None:
        return next((jar[name].value for name in names if name in jar), None)

    return Credentials(
        brought(SECURE_COOKIE, COOKIE), token, brought(SECURE_DEVICE_COOKIE, DEVICE_COOKIE)
    )


@dataclass(frozen=True, slots=True)
class _Admitted:
    """An admitted request: its person, and limits on its body."""

    actor: Actor | None
    body_bytes: int
    known: bool
    stop: bool


class Gate:
    """Middleware that makes the checks."""

    def __init__(
        self,
        app: ASGIApp,
        people: People,
        leases: Leases,
        addresses: Addresses,
        sockets: OpenSockets,
        policy: Policy | None = None,
        *,
        strict_transport: bool = False,
    ) -> None:
        self._app, self._people, self._leases = app, people, leases
        self._addresses, self._sockets = addresses, sockets
        self._policy = policy or Policy()
        self._admission = Admission()
        self._headers = dict(HEADERS)
        if strict_transport:
            self._headers["Strict-Transport-Security"] = "max-age=31536000"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request, one websocket or the lifespan."""
        if scope["type"] == "http":
            await self._http(scope, receive, send)
        elif scope["type"] == "websocket":
            await self._websocket(scope, receive, send)
        else:
            await self._app(scope, receive, send)

    # --- HTTP -------------------------------------------------------------------------

    async def _http(self, scope: Scope, receive: Receive, send: Send) -> None:
        begun = False
        # Set before it waits for its turn or its body: a STOP in the meantime takes precedence.
        arrived_s.set(time.monotonic())

        async def dressed(message: Message) -> None:
            nonlocal begun
            if message["type"] == "http.response.start":
                begun = True
                self._dress(scope, message)
            await send(message)

        try:
            if not self._is_somebodys_stop(scope):
                await self._admission.beginnings.turn()
            length, chunked = framing(scope["headers"])
            admitted = self._admit(scope)
            body = MeasuredBody(
                receive,
                admitted.body_bytes,
                length,
                chunked,
                is_json=is_json(scope["headers"]),
            )
            body.require_accepted()
            with self._admission.running(_address(scope), known=admitted.known, stop=admitted.stop):
                await self._run(scope, body, dressed, admitted.actor)
        except BodyRefused as refusal:
            response = answer(_refusal(refusal.status))
            response.headers["Connection"] = "close"
            await response(scope, receive, dressed)
        except DriveError as error:
            refused = answer_error(error)
            if isinstance(error, TooOften):
                # The body is not awaited: the connection is closed to make room for others.
                refused.headers["Connection"] = "close"
            await refused(scope, receive, dressed)
        except Exception as error:
            log.exception("unhandled error at %s %s", scope["method"], scope["path"])
            if begun:
                raise
            await answer(problem_of(error))(scope, receive, dressed)

    async def _run(self, scope: Scope, body: MeasuredBody, send: Send, actor: Actor | None) -> None:
        async def unless_refused(message: Message) -> None:
            # The application may have replaced the refusal by an answer of its own.
            body.require_accepted()
            await send(message)

        token = acting.set(actor)
        try:
            await self._app(scope, body.receive, unless_refused)
        finally:
            acting.reset(token)

    def _is_somebodys_stop(self, scope: Scope) -> bool:
        """Whether this is a STOP that is permitted; it bypasses all queues."""
        if not self._policy.is_stop(scope["method"], scope["path"]):
            return False
        brought = credentials(scope)
        known = self._people.identify(brought.cookie, brought.bearer)
        return (known or self._people.may_stop(brought.cookie)) is not None

    def _admit(self, scope: Scope) -> _Admitted:
        """Check whether the request may continue.

        Raises:
            DriveError: it may not, and why.
        """
        method, path = scope["method"], scope["path"]
        self._check_place(scope, changes=method not in _SAFE)
        brought = credentials(scope)
        identity = self._people.identify(brought.cookie, brought.bearer)
        needs = self._policy.needs(method, path)
        stop = self._policy.is_stop(method, path)
        if identity is None and stop:
            identity = self._people.may_stop(brought.cookie)
        known = identity is not None or self._people.is_known(brought.device)
        if not known:
            self._admission.require_rate(_address(scope))
        if not needs:
            raise self._undeclared(method, path, identity)
        connection = self._own_connection(scope, identity)
        named = header(scope["headers"], CONNECTION_HEADER.encode())
        if connection is None:
            # Routes trust this header, so a wrong one is removed.
            scope["headers"] = [
                (key, value) for key, value in scope["headers"] if key != CONNECTION_HEADER.encode()
            ]
        for matched in needs:
            self._require(matched, identity, connection)
        if method not in _SAFE and any(m.need.lease == "drive" for m in needs):
            self._require_present(named)
        if method not in _SAFE and all(m.need.right != "stop" for m in needs):
            self._require_csrf(scope, identity, brought)
        limit = min(m.need.body_bytes for m in needs)
        actor = None if identity is None else Actor(identity, connection)
        return _Admitted(actor, limit, known=known, stop=stop)

    def _check_place(self, scope: Scope, *, changes: bool) -> None:
        server = scope.get("server")
        self._addresses.check(
            scope["headers"],
            secure=scope.get("scheme") in ("https", "wss"),
            local_address=server[0] if server else None,
            changes=changes,
        )

    def _require(self, matched: Matched, identity: Identity | None, connection: str | None) -> None:
        need = matched.need
        if need.right == "public":
            return
        if identity is None:
            setup = self._people.setup_needed
            what = "api-security.make-first-account" if setup else "api-security.log-in"
            raise NotLoggedIn("api-security.nobody-logged", remedy=what)
        if not isinstance(need.right, Right):
            return
        require_right(self._people, identity, need.right, matched.drive)
        if need.lease == "drive" and matched.drive is not None:
            self._leases.require(matched.drive, connection)

    def _undeclared(self, method: str, path: str, identity: Identity | None) -> DriveError:
        if identity is None:
            return NotLoggedIn("api-security.nobody-logged-log")
        if methods := self._policy.methods(path):
            return WrongMethod("api-security.not", methods, method=method, path=path)
        return NotFound("api-security.nothing", path=path)

    def _require_csrf(self, scope: Scope, identity: Identity | None, brought: Credentials) -> None:
        """Check the CSRF token of a change.

        Browsers send cookies by themselves, but only our own page can read and send this token.

        Raises:
            Forbidden: it is missing or of another session.
        """
        if identity is None or identity.kind not in ("session", "guest"):
            return
        given = header(scope["headers"], CSRF_HEADER.encode())
        if brought.cookie is None or not same_text(given or "", csrf_of(brought.cookie)):
            raise Forbidden(
                "api-security.request-not-come-page", limit=text("limit.header", header=CSRF_HEADER)
            )

    def _own_connection(self, scope: Scope, identity: Identity | None) -> str | None:
        """The live connection that a request names, if it belongs to the same session."""
        named = header(scope["headers"], CONNECTION_HEADER.encode())
        if named is None or identity is None:
            return None
        return named if self._sockets.owner(named) == identity.session else None

    def _require_present(self, named: str | None) -> None:
        """Refuse a change that arrives after its page has gone.

        A network that hangs may deliver a request half a minute late, when the person who pressed
        may already be at the machine. Programs name no connection.

        Raises:
            NotAllowed: the live connection that the request names has ended.
        """
        if named is not None and self._sockets.owner(named) is None:
            raise NotAllowed("api-security.connection-page-asked-ended")

    def _dress(self, scope: Scope, message: Message) -> None:
        headers = MutableHeaders(scope=message)
        for name, value in self._headers.items():
            headers.setdefault(name, value)
        if scope["path"].startswith("/api/"):
            headers.setdefault("Cache-Control", "no-store")

    # --- websockets -------------------------------------------------------------------

    async def _websocket(self, scope: Scope, receive: Receive, send: Send) -> None:
        try:
            self._check_place(scope, changes=True)
            brought = credentials(scope)
            identity = self._people.identify(brought.cookie, brought.bearer)
            if identity is None and not self._people.is_known(brought.device):
                self._admission.require_rate(_address(scope))
            needs = self._policy.needs("WS", scope["path"])
            if not needs:
                raise NotFound("api-security.nothing-2", scope=scope["path"])
            for matched in needs:
                self._require(matched, identity, None)
            self._sockets.require_room("" if identity is None else identity.session)
        except DriveError as refusal:
            # Before the websocket is accepted, this becomes an HTTP answer with status 403.
            await send({"type": "websocket.close", "code": 1008, "reason": refusal.message[:100]})
            return
        if identity is None:
            raise RuntimeError("a websocket may not be public")
        guarded = GuardedSocket(receive, send, identity.session)
        token = acting.set(Actor(identity))
        try:
            with self._sockets.open(guarded):
                await self._app(scope, guarded.receive, guarded.send)
        finally:
            acting.reset(token)
            await guarded.finish()


def require_right(people: People, identity: Identity, right: Right, drive: str | None) -> None:
    """Check that this person may do this now.

    Raises:
        Forbidden: they may not, and why.
    """
    if identity.is_guest and right is not Right.LOOK:
        people.support.require(identity, right, drive)
        return
    if right not in identity.rights:
        raise Forbidden(
            "api-security.may-not",
            value=str(identity.role),
            limit=str(right),
            person=identity.person,
        )


def _address(scope: Scope) -> str:
    client = scope.get("client")
    return str(client[0]) if client else ""


def _refusal(status: int) -> Problem:
    why = _REFUSED[status]
    remedy = why.remedy()
    return Problem(
        type="urn:servodeck:body",
        title=TITLES["body"],
        status=status,
        detail=words_of(why),
        remedy=words_of(remedy) or None,
        code=why.code,
        advice=message_or_none(remedy),
    )
