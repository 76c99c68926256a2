"""Both ends of the message channel between server and host process.

On Linux a pair of sockets that the child inherits. Elsewhere its standard input and output, which
every system can pass to a child; there, only a thread can wait for them.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import select
import socket
import threading
from collections import deque
from typing import Protocol

_PIECE = 1 << 18
_LAST_S = 2.0
"""Time for sending what is still queued at the end [s]."""


class HostEnd(Protocol):
    """The host's end: none of its methods waits, except `wait`."""

    def wait(self, timeout_s: float) -> None:
        """Return when data have arrived, or after this time."""

    def receive(self) -> bytes | None:
        """Return the data received; None without data, ``b""`` once the server's end is closed."""

    def send(self, data: bytearray) -> int | None:
        """Return the number of bytes accepted; None once the server's end is closed."""

    def close(self) -> None:
        """Send what was accepted, and end."""


class SocketHostEnd:
    """A socket that the child inherited."""

    def __init__(self, control: socket.socket) -> None:
        control.setblocking(False)
        self._control = control

    def wait(self, timeout_s: float) -> None:
        """See `HostEnd`."""
        select.select((self._control,), (), (), timeout_s)

    def receive(self) -> bytes | None:
        """See `HostEnd`."""
        try:
            return self._control.recv(1 << 16)
        except BlockingIOError:
            return None
        except ConnectionError:
            return b""

    def send(self, data: bytearray) -> int | None:
        """See `HostEnd`."""
        try:
            return self._control.send(data)
        except BlockingIOError:
            return 0
        except ConnectionError:
            return None

    def close(self) -> None:
        """See `HostEnd`."""
        self._control.close()


class PipeHostEnd:
    """Two pipes, each with a thread that waits for it."""

    def __init__(self, source: int, sink: int) -> None:
        self._source, self._sink = source, sink
        self._came: deque[bytes] = deque()
        self._signal = threading.Event()
        self._going: deque[bytes] = deque()
        self._wake = threading.Condition()
        self._broken = self._ended = self._ending = False
        threading.Thread(target=self._read, name="control-in", daemon=True).start()
        self._writer = threading.Thread(target=self._write, name="control-out", daemon=True)
        self._writer.start()

    @classmethod
    def of_this_process(cls) -> PipeHostEnd:
        """Use standard input and output; later printed output goes to standard error."""
        sink = os.dup(1)
        os.dup2(2, 1)
        return cls(0, sink)

    def wait(self, timeout_s: float) -> None:
        """See `HostEnd`."""
        self._signal.wait(timeout_s)

    def receive(self) -> bytes | None:
        """See `HostEnd`."""
        # Cleared before the check: data arriving in between are seen now or signalled again.
        self._signal.clear()
        if not self._came:
            return b"" if self._ended else None
        pieces = [self._came.popleft() for _ in range(len(self._came))]
        return b"".join(pieces)

    def send(self, data: bytearray) -> int | None:
        """See `HostEnd`."""
        if self._broken:
            return None
        with self._wake:
            self._going.append(bytes(data))
            self._wake.notify()
        return len(data)

    def close(self) -> None:
        """See `HostEnd`."""
        with self._wake:
            self._ending = True
            self._wake.notify()
        self._writer.join(_LAST_S)

    def _read(self) -> None:
        with contextlib.suppress(OSError):
            while piece := os.read(self._source, _PIECE):
                self._came.append(piece)
                self._signal.set()
        self._ended = True
        self._signal.set()

    def _write(self) -> None:
        while True:
            with self._wake:
                while not self._going:
                    if self._ending:
                        return
                    self._wake.wait()
                piece = self._going.popleft()
            try:
                while piece:
                    piece = piece[os.write(self._sink, piece) :]
            except OSError:
                self._broken = True
                return


class ServerEnd(Protocol):
    """The server's end, on its event loop."""

    async def receive(self) -> bytes:
        """Return the data received; ``b""`` once the child's end is closed."""

    async def send(self, data: bytes) -> None:
        """Send all of it.

        Raises:
            OSError: the child's end is closed.
        """

    def close(self) -> None:
        """Close it, which makes the child end. Further calls have no effect."""


class SocketServerEnd:
    """A socket whose other end the child inherited."""

    def __init__(self, ours: socket.socket) -> None:
        ours.setblocking(False)
        self._ours = ours

    async def receive(self) -> bytes:
        """See `ServerEnd`."""
        try:
            return await asyncio.get_running_loop().sock_recv(self._ours, _PIECE)
        except OSError:
            return b""

    async def send(self, data: bytes) -> None:
        """See `ServerEnd`."""
        await asyncio.get_running_loop().sock_sendall(self._ours, data)

    def close(self) -> None:
        """See `ServerEnd`."""
        with contextlib.suppress(OSError):
            self._ours.shutdown(socket.SHUT_RDWR)
        self._ours.close()


class PipeServerEnd:
    """The child's standard input and output."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader, self._writer = reader, writer

    async def receive(self) -> bytes:
        """See `ServerEnd`."""
        return await self._reader.read(_PIECE)

    async def send(self, data: bytes) -> None:
        """See `ServerEnd`."""
        if self._writer.is_closing():
            raise BrokenPipeError
        self._writer.write(data)
        await self._writer.drain()

    def close(self) -> None:
        """See `ServerEnd`."""
        self._writer.close()
