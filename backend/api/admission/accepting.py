"""Connections that were accepted and have said nothing yet: bounded, the oldest go first.

Until a TLS handshake is done the server's protocol has no data of a connection, and each takes a
file descriptor; with none left nobody is accepted any more, STOP included. So the listening
socket itself counts them.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections import OrderedDict

#: Without a handshake at a time. One takes some milliseconds.
MOST_SILENT = 128
#: Accepted in one turn of the event loop, which does all that is ready before it looks again.
PER_TURN = 64


class AcceptingSocket(socket.socket):
    """A listening socket that lets go of the oldest silent connection for a new one."""

    def __init__(self, family: int, kind: int, protocol: int) -> None:
        super().__init__(family, kind, protocol)
        self._silent: OrderedDict[int, socket.socket] = OrderedDict()
        self._left = PER_TURN

    def accept(self) -> tuple[socket.socket, object]:
        """As usual; a connection is silent until `begun`.

        Raises:
            BlockingIOError: nobody is there, or enough came in this turn of the loop.
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
            # Its transport sees the end and closes it; one that is closed already has no number.
            if oldest.fileno() >= 0:
                with contextlib.suppress(OSError):
                    oldest.shutdown(socket.SHUT_RDWR)
        return line, address

    def _turn(self) -> None:
        self._left = PER_TURN

    def begun(self, descriptor: int) -> None:
        """The protocol has the connection of this descriptor now."""
        self._silent.pop(descriptor, None)
