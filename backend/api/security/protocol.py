"""Limits on connections: too slow in sending or reading, or too many from one address."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import ipaddress
import itertools
import socket
from collections import Counter
from collections.abc import Sequence
from weakref import WeakKeyDictionary

import h11
import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.frames import Frame

from backend.api.admission.accepting import AcceptingSocket
from backend.api.admission.requests import Beginnings
from backend.api.security.rights import API
from backend.foundation.people.login.throttle import Bucket

#: Time limit [s] for the head of a request, from the connection or its first byte on.
HEAD_S = 10.0
#: Time limit [s] for a client to read, once an answer has filled all buffers (48 KiB).
DRAIN_S = 60.0
#: Limit of connections from one address that is not this machine. A page needs about eight.
MOST_PER_ADDRESS = 100

#: Limit of all connections: above it the longest idle one is closed for a new one.
#: Requests in progress and websockets have limits of their own, which are lower in
#: total (`backend.api.admission.requests`, `backend.api.security.socket`), so that
#: there always is an idle one.
MOST_CONNECTIONS = 800

#: Control frames of a websocket: burst, and frames per second. Our page answers a ping every 5 s.
_FRAMES = (100.0, 20.0)

_open: Counter[str] = Counter()
_numbers = itertools.count(1)
#: First bytes of a STOP request.
_STOP = f"POST {API}/stop ".encode()
_turns: WeakKeyDictionary[asyncio.AbstractEventLoop, Beginnings] = WeakKeyDictionary()


def _beginnings() -> Beginnings:
    """The queue of the running event loop."""
    loop = asyncio.get_running_loop()
    found = _turns.get(loop)
    if found is None:
        found = _turns[loop] = Beginnings()
    return found


class AcceptingConfig(uvicorn.Config):
    """Configuration with the listening sockets, which are notified when a connection begins."""

    accepting: Sequence[AcceptingSocket] = ()


class PatientSocket(WebSocketsSansIOProtocol):
    """Websocket that is closed when the client sends too many frames that no application sees.

    Messages are counted where they are decoded (`backend.api.security.socket`); pings, pongs and
    empty parts of messages do not get there.
    """

    _frames: Bucket | None = None

    def handle_ping(self) -> None:
        """Answer the ping, unless there are too many frames."""
        if self._is_bearable():
            super().handle_ping()

    def handle_pong(self, event: Frame) -> None:
        """Note the pong, unless there are too many frames."""
        if self._is_bearable():
            super().handle_pong(event)

    def handle_cont(self, event: Frame) -> None:
        """Handle a part of a message, unless there are too many frames."""
        if self._is_bearable():
            super().handle_cont(event)

    def _is_bearable(self) -> bool:
        if self._frames is None:
            self._frames = Bucket(*_FRAMES)
        if self._frames.take():
            return True
        self.transport.abort()
        return False


class PatientProtocol(H11Protocol):
    """HTTP/1.1 with a deadline for request heads and a limit on connections per address."""

    _waits = False
    _head_timer: asyncio.TimerHandle | None = None
    number = 0
    asked = False
    _drain_timer: asyncio.TimerHandle | None = None
    address: str | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Count the connection; if it is one too many, close the longest idle one.

        Clients that only hold connections then cannot shut others out: STOP may also
        come by a new connection.
        """
        super().connection_made(transport)
        _give_up_unread(transport)
        self._note_begun(transport)
        address = self.client[0] if self.client else ""
        room = len(self.connections) <= MOST_CONNECTIONS or self._close_idle(None)
        if room and not _is_loopback(address):
            room = _open[address] < MOST_PER_ADDRESS or self._close_idle(address)
            if room:
                _open[address] += 1
                self.address = address
        if not room:
            transport.close()
            return
        self.number = next(_numbers)
        self._arm()

    def _note_begun(self, transport: asyncio.Transport) -> None:
        line = transport.get_extra_info("socket")
        for server in self.config.accepting if isinstance(self.config, AcceptingConfig) else ():
            if line is not None:
                server.begun(line.fileno())

    def _close_idle(self, address: str | None) -> bool:
        """Close the longest idle connection, of this address or of any; False if there was none.

        Connections that have never sent a request are closed before those between two requests.
        """
        idle = [
            each
            for each in self.connections
            if isinstance(each, PatientProtocol)
            and each.is_idle
            and address in (None, each.address)
        ]
        if not idle:
            return False
        oldest = min(idle, key=lambda each: (each.asked, each.number))
        oldest.drop()
        return True

    def drop(self) -> None:
        """Close this connection at once, as its place is needed."""
        self._uncount()
        self._disarm()
        self.connections.discard(self)
        self.transport.abort()

    @property
    def is_idle(self) -> bool:
        """Whether no request is in progress; the head of one may be incomplete."""
        return self._head_timer is not None and not self.transport.is_closing()

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop counting the connection."""
        self._disarm()
        self.resume_writing()
        self._uncount()
        super().connection_lost(exc)

    def pause_writing(self) -> None:
        """Start the time limit for a client that does not read."""
        super().pause_writing()
        if self._drain_timer is None:
            self._drain_timer = self.loop.call_later(DRAIN_S, self.transport.abort)

    def resume_writing(self) -> None:
        """Stop the time limit, as the client reads again."""
        if self._drain_timer is not None:
            self._drain_timer.cancel()
            self._drain_timer = None
        super().resume_writing()

    def data_received(self, data: bytes) -> None:
        """Handle data; the time limit runs while the head of a request is incomplete.

        Only a limited number of new requests is parsed per turn; what may
        be STOP is parsed at once.
        """
        if self.conn.their_state is not h11.IDLE or data.startswith(_STOP):
            self._received(data)
        else:
            self._waits = True
            # No more data must be read before this has been parsed.
            self.flow.pause_reading()
            _beginnings().begin(functools.partial(self._begin, data))

    def _begin(self, data: bytes) -> None:
        self._waits = False
        if not self.transport.is_closing():
            self.flow.resume_reading()
            self._received(data)

    def _received(self, data: bytes) -> None:
        super().data_received(data)
        self.asked = self.asked or self.conn.their_state is not h11.IDLE
        if self.conn.their_state is h11.IDLE:
            self._arm()
        else:
            self._disarm()

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        """Leave the connection to the websocket, which has limits of its own."""
        self._disarm()
        # The end of a websocket is not reported here; its messages and
        # silence are limited elsewhere.
        self._uncount()
        super().handle_websocket_upgrade(event)

    def _uncount(self) -> None:
        if self.address is not None:
            _open[self.address] -= 1
            if _open[self.address] <= 0:
                del _open[self.address]
            self.address = None

    def _arm(self) -> None:
        if self._head_timer is None:
            self._head_timer = self.loop.call_later(HEAD_S, self._too_slow)

    def _disarm(self) -> None:
        if self._head_timer is not None:
            self._head_timer.cancel()
            self._head_timer = None

    def _too_slow(self) -> None:
        self._head_timer = None
        if not self.transport.is_closing():
            self.transport.close()


def _give_up_unread(transport: asyncio.Transport) -> None:
    """Let the system drop a connection whose client acknowledges nothing, where supported."""
    line = transport.get_extra_info("socket")
    if line is not None and hasattr(socket, "TCP_USER_TIMEOUT"):
        with contextlib.suppress(OSError):
            line.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, int(DRAIN_S * 1000))


def _is_loopback(address: str) -> bool:
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return False
