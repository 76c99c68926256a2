"""Connections that were accepted and have said nothing yet: bounded, the oldest go first.

Until a TLS handshake is done the server's protocol knows nothing of a connection, and each takes a
file descriptor; with none left nobody is accepted any more, STOP included. So the listening
socket itself counts them.
"""

from __future__ import annotations

import contextlib
import socket
from collections import OrderedDict

#: Without a handshake at a time. One takes some milliseconds.
MOST_SILENT = 128


class AcceptingSocket(socket.socket):
    """A listening socket that lets go of the oldest silent connection for a new one."""

    def __init__(self, family: int, kind: int, protocol: int) -> None:
        super().__init__(family, kind, protocol)
        self._silent: OrderedDict[int, socket.socket] = OrderedDict()

    def accept(self) -> tuple[socket.socket, object]:
        """As usual; a connection is silent until `begun`."""
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

    def begun(self, descriptor: int) -> None:
        """The protocol has the connection of this descriptor now."""
        self._silent.pop(descriptor, None)
