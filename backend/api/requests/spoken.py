"""Language of each request, from its ``Accept-Language`` header, which the page sets."""

from __future__ import annotations

from starlette.types import ASGIApp, Receive, Scope, Send

from drivers.texts.message import language_of, speaking


class Spoken:
    """Middleware that sets the language of answers; English if none of ours is requested."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request (ASGI)."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        tags = (value for name, value in scope["headers"] if name == b"accept-language")
        with speaking(language_of(next(tags, b"").decode("latin-1"))):
            await self._app(scope, receive, send)
