"""Websockets that are closed at once when their session ends."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager

from starlette.types import Message, Receive, Send

from backend.foundation.people.errors import TooOften
from backend.foundation.people.login.throttle import Bucket

#: Our close codes: the session has ended; the page sends more than a person can cause.
OVER, FLOODED = 4401, 4429
#: Limit on messages: burst, and messages per second. A held button sends 25 per second,
#: pointer and cursor 20 each.
_FLOOD = (600.0, 200.0)
#: Websockets of one session: enough for ten pages with plots, recordings and the axis in 3D.
MOST_PER_SESSION = 40
#: Websockets of all sessions together.
MOST_SOCKETS = 300


class GuardedSocket:
    """One websocket, used by the application through `receive` and `send`."""

    def __init__(self, receive: Receive, send: Send, session: str) -> None:
        self.session = session
        #: Id of the live connection, once it has one.
        self.connection: str | None = None
        self._receive, self._send = receive, send
        self._over = asyncio.Event()
        self._code = OVER
        self._closed = False
        self._bucket = Bucket(*_FLOOD)

    def end(self, code: int = OVER) -> None:
        """Stop all traffic in both directions."""
        self._code = code
        self._over.set()

    async def receive(self) -> Message:
        """Return the next message, or a disconnect if the session has ended."""
        coming = asyncio.ensure_future(self._receive())
        over = asyncio.ensure_future(self._over.wait())
        try:
            await asyncio.wait({coming, over}, return_when=asyncio.FIRST_COMPLETED)
            if self._over.is_set():
                return {"type": "websocket.disconnect", "code": self._code, "reason": "over"}
            message = coming.result()
        finally:
            over.cancel()
            coming.cancel()
        if message["type"] == "websocket.disconnect":
            self._closed = True
        elif message["type"] == "websocket.receive" and not self._bucket.take():
            self.end(FLOODED)
            return {"type": "websocket.disconnect", "code": FLOODED, "reason": "flooded"}
        return message

    async def send(self, message: Message) -> None:
        """Send a message, unless the session has ended.

        Raises:
            OSError: it has ended; Starlette converts it to a WebSocketDisconnect.
        """
        if self._over.is_set():
            raise OSError("the session is over")
        if message["type"] == "websocket.close":
            self._closed = True
        await self._send(message)

    async def finish(self) -> None:
        """Close the websocket if the application has left it open."""
        if not self._closed and self._over.is_set():
            self._closed = True
            await self._send({"type": "websocket.close", "code": self._code, "reason": "over"})


class OpenSockets:
    """All open websockets of the server."""

    def __init__(self) -> None:
        self._open: set[GuardedSocket] = set()
        self._owners: dict[str, str] = {}

    def require_room(self, session: str) -> None:
        """Check the limits of one session and of all together, which leave room for STOP.

        Raises:
            TooOften: a limit is reached.
        """
        if session and sum(each.session == session for each in self._open) >= MOST_PER_SESSION:
            raise TooOften(
                "api-security.connections-log-open", 1.0, most_per_session=MOST_PER_SESSION
            )
        if len(self._open) >= MOST_SOCKETS:
            raise TooOften("api-security.pages-open", 1.0, most_sockets=MOST_SOCKETS)

    @contextmanager
    def open(self, socket: GuardedSocket) -> Iterator[None]:
        """Register a websocket while it is open."""
        self._open.add(socket)
        try:
            yield
        finally:
            self._open.discard(socket)

    def end(self, session: str) -> None:
        """End all websockets of a session."""
        for socket in list(self._open):
            if socket.session == session:
                socket.end()

    def own(self, connection: str, session: str) -> None:
        """Record the session of a live connection."""
        self._owners[connection] = session

    def disown(self, connection: str) -> None:
        """Remove a live connection that is gone."""
        self._owners.pop(connection, None)

    def owner(self, connection: str) -> str | None:
        """Session of a live connection; None if there is no such connection."""
        return self._owners.get(connection)
