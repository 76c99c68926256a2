"""The language of each request, by its ``Accept-Language``: the page sends that of the page."""

from __future__ import annotations

from starlette.types import ASGIApp, Receive, Scope, Send

from drivers.texts.message import language_of, speaking


class Spoken:
    """Answers in the language that a request asks for; English where it asks for none of ours."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """See ASGI."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        tags = (value for name, value in scope["headers"] if name == b"accept-language")
        with speaking(language_of(next(tags, b"").decode("latin-1"))):
            await self._app(scope, receive, send)
