"""An answer that reports a change leaves when the audit has it safe, or after a bounded time."""

from __future__ import annotations

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from backend.audit import AuditLog

#: Longest that an answer waits. The change itself never does.
WAIT_S = 1.0
_READING = frozenset({"GET", "HEAD", "OPTIONS"})


class AuditedAnswers:
    """Wraps the application. STOP's answer waits for nothing."""

    def __init__(self, app: ASGIApp, audit: AuditLog, stop_path: str) -> None:
        self._app = app
        self._audit = audit
        self._stop_path = stop_path

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One request."""
        changes = scope["type"] == "http" and scope["method"] not in _READING
        if not changes or scope["path"] == self._stop_path:
            await self._app(scope, receive, send)
            return

        async def when_safe(message: Message) -> None:
            # While the audit has a problem everybody is told of it; waiting would not help.
            if message["type"] == "http.response.start" and not self._audit.problem:
                await self._audit.settled(WAIT_S)
            await send(message)

        await self._app(scope, receive, when_safe)
