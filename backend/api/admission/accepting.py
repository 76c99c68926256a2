"""Limit on accepted connections that have sent nothing yet: the oldest are closed first.

Until a TLS handshake is complete the server's protocol has no data of a connection, yet each one
occupies a file descriptor; without free descriptors no connection is accepted any more, not even
for STOP. The listening socket itself therefore counts them.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections import OrderedDict

#: Connections without a completed handshake at a time. A handshake takes some milliseconds.
MOST_SILENT = 128
#: Connections accepted in one turn of the event loop, which carries out all that is
#: ready before it polls again.
PER_TURN = 64


class AcceptingSocket(socket.socket):
    """Listening socket that closes the oldest silent connection to make room for a new one."""

    def __init__(self, family: int, kind: int, protocol: int) -> None:
        super().__init__(family, kind, protocol)
        self._silent: OrderedDict[int, socket.socket] = OrderedDict()
        self._left = PER_TURN

    def accept(self) -> tuple[socket.socket, object]:
        """Accept as usual; the connection counts as silent until `begun`.

        Raises:
            BlockingIOError: no connection is waiting, or enough were accepted
            in this turn of the loop.
        """
        if self._left <= 0:
            raise BlockingIOError
        if self._left == PER_TURN:
            asyncio.get_running_loop().call_soon(self._turn)
        self._left -= 1
        line, address = super().accept()
        self._silent.pop(line.fileno(), None)
        self._silent[line.fileno()] = line
        while len(self._silent) > MOST_SILENT:
            _, oldest = self._silent.popitem(last=False)
            # Its transport sees the end and closes it; a socket that is closed
            # already has no descriptor.
            if oldest.fileno() >= 0:
                with contextlib.suppress(OSError):
                    oldest.shutdown(socket.SHUT_RDWR)
        return line, address

    def _turn(self) -> None:
        self._left = PER_TURN

    def begun(self, descriptor: int) -> None:
        """Record that the protocol has taken over the connection with this descriptor."""
        self._silent.pop(descriptor, None)
