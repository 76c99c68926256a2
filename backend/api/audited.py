"""Changes through the interface and the audit: none is forgotten, none is told before it is safe.

What changes a drive, control, people or the library is told where it happens, with values. Every
other change of files or of the station is told here, by what the request's route needs (see
backend.api.rights), so that a new route cannot forget it.
"""

from __future__ import annotations

from collections.abc import Callable

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from backend.api.rights import API, Policy
from backend.audit import AuditLog, Fact
from backend.people.rights import Right

#: Longest that an answer waits. The change itself never does.
WAIT_S = 1.0
_ACTIONS = {"POST": "made", "PUT": "changed", "PATCH": "changed", "DELETE": "deleted"}
_READING = frozenset({"GET", "HEAD", "OPTIONS"})
#: Below these paths every change is told where it happens: with versions, or as a job.
_TOLD = (f"{API}/sets", f"{API}/library", f"{API}/scan", f"{API}/jobs")
_TOLD_OF_DRIVE = ("sets", "jobs", "parameters", "procedures")


class AuditedAnswers:
    """Wraps the application. STOP's answer waits for nothing.

    ``name_of`` gives an axis's name for its id.
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
        """One request."""
        changes = scope["type"] == "http" and scope["method"] not in _READING
        if not changes or scope["path"] == self._stop_path:
            await self._app(scope, receive, send)
            return
        # The name may be gone when the answer comes: a drive that was taken off the bench.
        fact = self._fact(scope["method"], scope["path"])

        async def when_safe(message: Message) -> None:
            if message["type"] == "http.response.start":
                if fact is not None and message["status"] < 400:
                    self._audit.add(fact)
                # While the audit has a problem everybody is told of it; waiting would not help.
                if not self._audit.problem:
                    await self._audit.settled(WAIT_S)
            await send(message)

        await self._app(scope, receive, when_safe)

    def _fact(self, method: str, path: str) -> Fact | None:
        """What to record of a change that nobody else tells; None for the others."""
        if path.startswith(_TOLD):
            return None
        for matched in self._policy.needs(method, path) if method in _ACTIONS else []:
            if matched.need.right not in (Right.FILES, Right.STATION):
                continue
            drive = matched.drive
            inner = path.removeprefix(f"{API}/drives/{drive}/").split("/")[0]
            if drive is not None and inner in _TOLD_OF_DRIVE:
                return None
            return Fact(
                "file" if matched.need.right is Right.FILES else "station",
                _ACTIONS[method],
                axis=self._name_of(drive) if drive is not None else "",
                target=path.removeprefix(API),
            )
        return None
