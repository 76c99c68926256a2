"""Recording of HTTP changes in the audit: complete, and stored before the change is confirmed.

Changes of drive parameters, control, people and the library are recorded where they happen, with
values. Every other change is recorded here, so that no new route can omit it: the requested values,
and the earlier ones where the route provides them (`backend.records.audit.asked.note_before`).
"""

from __future__ import annotations

from collections.abc import Callable
from urllib.parse import parse_qsl

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from backend.api.security.rights import API, Matched, Policy
from backend.foundation.people.rights import Right
from backend.records.audit import AuditLog, Fact
from backend.records.audit.asked import MOST_BYTES, Asked, asked, fields_of
from backend.records.audit.facts import Action, Kind
from backend.tools.registry import TOOLS

#: Longest time [s] that an answer waits for the audit. The change itself never waits.
WAIT_S = 1.0
_ACTIONS: dict[str, Action] = {
    "POST": "made",
    "PUT": "changed",
    "PATCH": "changed",
    "DELETE": "deleted",
}
_DRIVE = "/drives/{drive_id}"
#: Routes whose changes are recorded where they happen: as single values, as jobs, or as actions of
#: people. `tests/security/test_every_change_is_reported.py` checks each of them.
REPORTED_THERE = frozenset(
    f"{method} {API}{path}"
    for method, paths in {
        "POST": (
            "/stop", "/session", "/setup", "/guests", "/tokens", "/accounts", "/invitations",
            "/drives", f"{_DRIVE}/ports",
            "/scan", "/search-line", "/descriptions/from-drive", "/sets/list",
            f"{_DRIVE}/sets", f"{_DRIVE}/transition", f"{_DRIVE}/fault-reset",
            f"{_DRIVE}/procedures/{{name}}", f"{_DRIVE}/jobs/load_set", f"{_DRIVE}/jobs/move",
            f"{_DRIVE}/jobs/sequence", f"{_DRIVE}/jobs/generate", f"{_DRIVE}/jobs/home",
            f"{_DRIVE}/jobs/identify", f"{_DRIVE}/jobs/firmware",
            f"{_DRIVE}/jobs/put-back",
            f"{_DRIVE}/io/forcing/{{name}}", f"{_DRIVE}/tune/undo",
            *(f"{_DRIVE}/jobs/{tool.kind}" for tool in TOOLS),
        ),
        "PUT": (
            "/session/password", "/invitations/{invitation_id}/grant", "/sets/{file}",
            f"{_DRIVE}/parameters", f"{_DRIVE}/parameters/{{key}}",
            f"{_DRIVE}/motion-settings/{{key}}",
            f"{_DRIVE}/io/forcing/{{name}}", f"{_DRIVE}/io/probes/{{number}}",
            f"{_DRIVE}/notches", f"{_DRIVE}/gains",
        ),
        "PATCH": ("/accounts/{account_id}", "/library/{entry_id}"),
        "DELETE": (
            _DRIVE,
            "/session", "/sessions/{session_id}", "/tokens/{token_id}", "/accounts/{account_id}",
            "/invitations/{invitation_id}", "/invitations/{invitation_id}/grant",
            "/sets/{file}", "/library/{entry_id}",
        ),
    }.items()
    for path in paths
)  # fmt: skip
#: Routes that compute or read, and change nothing permanently. (Some fault records are read through
#: a selector, which is written and restored; each such write is recorded as a write.)
CHANGES_NOTHING = frozenset(
    f"POST {API}{path}"
    for path in (
        "/calculate/braking", f"{_DRIVE}/gear/plan", f"{_DRIVE}/notches/preview",
        f"{_DRIVE}/tune/candidates", f"{_DRIVE}/tune/predict", f"{_DRIVE}/tune/excitation",
        "/ethercat/eeprom/compare", "/ethercat/eeprom/plan",
        "/measurements/import/preview", f"{_DRIVE}/jobs/read_all", f"{_DRIVE}/fault-history/read",
    )
)  # fmt: skip
_READING = frozenset({"GET", "HEAD", "OPTIONS"})


class AuditedAnswers:
    """Middleware that records changes. The answer to STOP waits for nothing.

    ``name_of`` returns the name of an axis for its id.
    """

    def __init__(
        self, app: ASGIApp, audit: AuditLog, name_of: Callable[[str], str], stop_path: str
    ) -> None:
        self._app = app
        self._audit = audit
        self._name_of = name_of
        self._stop_path = stop_path
        self._policy = Policy()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        changes = scope["type"] == "http" and scope["method"] not in _READING
        if not changes or scope["path"] == self._stop_path:
            await self._app(scope, receive, send)
            return
        matched = next(iter(self._policy.needs(scope["method"], scope["path"])), None)
        # Looked up now: the name is gone after the request if it removes the
        # drive from the axis list.
        axis = self._name_of(matched.drive) if matched and matched.drive else ""
        body = _Body(receive)
        query = dict(parse_qsl(scope["query_string"].decode("latin-1")))
        said = Asked(lambda: query | dict(fields_of(body.start)))

        async def when_safe(message: Message) -> None:
            if message["type"] == "http.response.start":
                if matched is not None and message["status"] < 400:
                    self._notify(matched, scope, axis, said)
                # While the audit has a problem, every page shows it; waiting would not help.
                if not self._audit.problem:
                    await self._audit.settled(WAIT_S)
            await send(message)

        token = asked.set(said)
        try:
            await self._app(scope, body.receive, when_safe)
        finally:
            asked.reset(token)

    def _notify(self, matched: Matched, scope: Scope, axis: str, said: Asked) -> None:
        """Record a change that is recorded nowhere else."""
        if matched.route in REPORTED_THERE or matched.route in CHANGES_NOTHING:
            return
        path: str = scope["path"]
        kind: Kind = "file" if matched.need.right is Right.FILES else "station"
        if path.startswith(f"{API}/jobs/"):
            kind = "job"
        self._audit.add(
            Fact(
                kind,
                _ACTIONS[scope["method"]],
                axis=axis,
                target=path.removeprefix(API),
                old=said.old,
                new=said.new,
            )
        )


class _Body:
    """Receiving side of a request; keeps the start of the body, which may be small JSON."""

    def __init__(self, receive: Receive) -> None:
        self._receive = receive
        self.start = b""

    async def receive(self) -> Message:
        """Return the next message for the application."""
        message = await self._receive()
        if message["type"] == "http.request" and len(self.start) <= MOST_BYTES:
            self.start += message.get("body", b"")[: MOST_BYTES + 1]
        return message
