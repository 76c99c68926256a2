"""Websockets that end with the session they were opened by, at once."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager

from starlette.types import Message, Receive, Send

from backend.people.errors import TooOften
from backend.people.throttle import Bucket

#: Close codes of ours: the session is over; the page sends more than a person can cause.
OVER, FLOODED = 4401, 4429
#: Messages at once and a second. A held button sends 25, pointer and cursor 20 each.
_FLOOD = (600.0, 200.0)
#: Websockets of one log-in: ten pages with plots, recordings and the axis in 3D.
MOST_PER_SESSION = 40
#: Of all log-ins together.
MOST_SOCKETS = 300


class GuardedSocket:
    """One websocket, seen by the application through `receive` and `send`."""

    def __init__(self, receive: Receive, send: Send, session: str) -> None:
        self.session = session
        #: The name of the live connection, once it has one.
        self.connection: str | None = None
        self._receive, self._send = receive, send
        self._over = asyncio.Event()
        self._code = OVER
        self._closed = False
        self._bucket = Bucket(*_FLOOD)

    def end(self, code: int = OVER) -> None:
        """From now on nothing goes in or out."""
        self._code = code
        self._over.set()

    async def receive(self) -> Message:
        """The next message, or word that the session is over."""
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
        """Send, unless the session is over.

        Raises:
            OSError: it is; Starlette makes a WebSocketDisconnect of it.
        """
        if self._over.is_set():
            raise OSError("the session is over")
        if message["type"] == "websocket.close":
            self._closed = True
        await self._send(message)

    async def finish(self) -> None:
        """Close what the application has left open."""
        if not self._closed and self._over.is_set():
            self._closed = True
            await self._send({"type": "websocket.close", "code": self._code, "reason": "over"})


class OpenSockets:
    """All open websockets."""

    def __init__(self) -> None:
        self._open: set[GuardedSocket] = set()
        self._owners: dict[str, str] = {}

    def require_room(self, session: str) -> None:
        """One session does not take the places of all others, and all together not those of STOP.

        Raises:
            TooOften: it has as many as it may.
        """
        if session and sum(each.session == session for each in self._open) >= MOST_PER_SESSION:
            raise TooOften(
                "api-security.connections-log-open", 1.0, most_per_session=MOST_PER_SESSION
            )
        if len(self._open) >= MOST_SOCKETS:
            raise TooOften("api-security.pages-open", 1.0, most_sockets=MOST_SOCKETS)

    @contextmanager
    def open(self, socket: GuardedSocket) -> Iterator[None]:
        """Hold a websocket while it is open."""
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
        """Note whose a live connection is."""
        self._owners[connection] = session

    def disown(self, connection: str) -> None:
        """A live connection is gone."""
        self._owners.pop(connection, None)

    def owner(self, connection: str) -> str | None:
        """Session of a live connection, None where there is no such connection."""
        return self._owners.get(connection)
