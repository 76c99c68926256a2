"""A virtual slcan adapter on a pty, for python-can's slcan client and others.

Source: Lawicel CAN232 manual V3 (commands S, O, C, L, t, r, F, V, N; CR for OK, BEL for error).
"""

from __future__ import annotations

import contextlib
import os
import select
from collections import deque
from collections.abc import Callable
from pathlib import Path
from queue import SimpleQueue

from drivers.canopen.frames import Frame
from drivers.virtual.wires.pty import close_pty, open_pty

_BUS_ERROR_FLAGS = b"FA4\r"
_PASSIVE_FLAGS = b"F21\r"
_NO_FLAGS = b"F00\r"
_BEL = b"\a"


class SlcanSide:
    """The adapter. ``path`` becomes a symbolic link to the pty.

    Raises:
        LinkLost: the path exists and is not a link.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.refused = 0
        self._opened = False
        self._bus_off = False
        self._passive = False
        self._buffer = bytearray()
        self._frames: deque[Frame] = deque()
        self._master = self._slave = -1
        # Descriptors are opened and closed only between two reads of the wire's thread.
        self._wanted: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._plug()

    def plug(self) -> None:
        """Connect the adapter again, at the same path."""
        self._wanted.put(self._plug)

    def unplug(self) -> None:
        """Disconnect the adapter: the client's descriptor becomes invalid."""
        self._wanted.put(self._unplug)

    def _plug(self) -> None:
        if self._master >= 0:
            return
        self._master, self._slave = open_pty(self.path)

    def _unplug(self) -> None:
        self._opened = False
        self._frames.clear()
        self._buffer.clear()
        master, slave = self._master, self._slave
        self._master = self._slave = -1
        if master >= 0:
            close_pty(self.path, master, slave)

    def bus_off(self) -> None:
        """Refuse frames with BEL until the channel is closed and opened again."""
        self._bus_off = True

    def error(self, kind: int) -> None:
        """Become error passive with a full buffer; this adapter does not report ``kind``."""
        del kind
        self._passive = True

    def close(self) -> None:
        """Remove the pty and its link."""
        self._unplug()

    def recv(self, timeout_s: float) -> Frame | None:
        """Return the client's next frame, or None after ``timeout_s``."""
        while not self._wanted.empty():
            self._wanted.get()()
        if self._frames:
            return self._frames.popleft()
        master = self._master
        if master < 0:
            select.select([], [], [], timeout_s)
            return None
        ready, _, _ = select.select([master], [], [], timeout_s)
        if ready:
            self._buffer += os.read(master, 4096)
        while (end := self._buffer.find(b"\r")) >= 0:
            command = bytes(self._buffer[:end])
            del self._buffer[: end + 1]
            self._obey(command)
        return self._frames.popleft() if self._frames else None

    def send(self, frame: Frame) -> None:
        """Send a frame to the client; lost if the channel is closed or the client is slow."""
        if not self._opened or self._bus_off:
            return
        letter = "r" if frame.remote else "t"
        data = "" if frame.remote else frame.data.hex().upper()
        self._reply(f"{letter}{frame.cob_id:03X}{len(frame.data)}{data}\r".encode())

    def _obey(self, command: bytes) -> None:
        letter = command[:1]
        if letter in (b"t", b"r"):
            self._transmit(command)
        elif letter in (b"O", b"L"):
            self._opened = True
            self._reply(b"\r")
        elif letter == b"C":
            self._opened = False
            self._bus_off = self._passive = False
            self._reply(b"\r")
        elif letter == b"F":
            passive = _PASSIVE_FLAGS if self._passive else _NO_FLAGS
            self._reply(_BUS_ERROR_FLAGS if self._bus_off else passive)
        elif letter == b"V":
            self._reply(b"V1013\r")
        elif letter == b"N":
            self._reply(b"NSD01\r")
        elif letter in (b"S", b"s", b"X", b"Z", b""):
            self._reply(b"\r")
        else:
            self._reply(_BEL)

    def _transmit(self, command: bytes) -> None:
        frame = _parse(command)
        if frame is None or not self._opened or self._bus_off or self._passive:
            self.refused += 1
            self._reply(_BEL)
            return
        self._frames.append(frame)
        self._reply(b"z\r")

    def _reply(self, data: bytes) -> None:
        with contextlib.suppress(BlockingIOError):
            os.write(self._master, data)


def _parse(command: bytes) -> Frame | None:
    try:
        cob_id, length = int(command[1:4], 16), int(command[4:5])
        data = bytes.fromhex(command[5:].decode("ascii"))
    except ValueError:
        return None
    remote = command[:1] == b"r"
    if length > 8 or (not remote and len(data) != length):
        return None
    return Frame(cob_id, data, remote)
