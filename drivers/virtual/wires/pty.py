"""A pseudo-terminal at a path of our choice: the cable of virtual serial drives.

A client opens the path like a serial port. The bytes are real; bit times, parity and modem lines
do not exist on a pty, so wire time is emulated on request: a frame counts as arrived only when
its last bit would have been.
"""

from __future__ import annotations

import os
import select
import threading
import time
from dataclasses import dataclass
from pathlib import Path

from drivers.computer.sockets import set_blocking
from drivers.computer.terminals import (
    open_pair,
    output_speed,
    require_pseudo_terminals,
    terminal_name,
)
from drivers.errors import LinkLost
from drivers.modbus.timing import sleep_precisely


@dataclass(frozen=True, slots=True)
class WireTime:
    """Speed of an emulated wire. ``turnaround_s`` is what the drive takes before it answers."""

    baudrate: int
    bits_per_char: int = 10
    turnaround_s: float = 0.0

    @property
    def char_s(self) -> float:
        """Time of one character."""
        return self.bits_per_char / self.baudrate


def open_pty(path: Path) -> tuple[int, int]:
    """A raw pty whose slave end appears at ``path``: its master, which never blocks, and slave.

    The slave end is to stay open: without any, reading the master fails while no client is there.

    Raises:
        LinkLost: something that is not a wire of ours is already at the path.
        NotAllowed: the system has no pseudo-terminals (Windows).
    """
    require_pseudo_terminals()
    ours = path.is_symlink() and str(path.readlink()).startswith("/dev/pts/")
    if (path.exists() or path.is_symlink()) and not ours:
        raise LinkLost("virtual.exists-no-virtual-wire", path=str(path))
    master, slave = open_pair()
    set_blocking(master, False)
    path.parent.mkdir(parents=True, exist_ok=True)
    fresh = path.with_name(f".{path.name}.{os.getpid()}")
    fresh.unlink(missing_ok=True)
    fresh.symlink_to(terminal_name(slave))
    fresh.replace(path)  # at once: a client never sees half a wire
    return master, slave


def close_pty(path: Path, master: int, slave: int) -> None:
    """Close both ends of `open_pty` and take the link away.

    A wire that was made later at the same path is not ours to remove.
    """
    if path.is_symlink() and str(path.readlink()) == terminal_name(slave):
        path.unlink()
    os.close(slave)
    os.close(master)


class PtyWire:
    """A pty whose slave end appears at ``path``.

    One thread reads and writes; `pull` and `heal` may come from any other. While the wire
    keeps the slave end open itself, clients may come and go.
    """

    def __init__(self, path: str | Path, wire_time: WireTime | None = None) -> None:
        self.path = Path(path)
        self.wire_time = wire_time
        self._master = -1
        self._slave = -1
        self._lock = threading.Lock()
        self._closing = False
        self._busy_until_s = 0.0

    def open(self) -> None:
        """Create the pty and the link to it.

        Raises:
            LinkLost: something that is not a wire of ours is already at the path.
        """
        with self._lock:
            if self._master >= 0:
                return
            self._master, self._slave = open_pty(self.path)

    def close(self) -> None:
        """Remove the wire. Clients that have it open see an adapter that is gone."""
        self._closing = True  # the reading thread lets go of the lock
        with self._lock:
            self._closing = False
            if self._master < 0:
                return
            close_pty(self.path, self._master, self._slave)
            self._master = self._slave = -1

    def pull(self) -> None:
        """Pull the cable: the same as closing, until `heal`."""
        self.close()

    def heal(self) -> None:
        """Put the cable back."""
        self.open()

    @property
    def is_open(self) -> bool:
        """False while pulled."""
        return self._master >= 0

    def client_baudrate(self) -> int | None:
        """Baud rate that the client has set, or None if this system has no name for it."""
        return output_speed(self._master)

    def read(self, timeout_s: float) -> bytes:
        """Bytes from the client, at once; empty after ``timeout_s`` without any.

        With wire time the bytes are still on the wire when they are returned: `arrival_s`
        says until when.
        """
        if self._closing or self._master < 0:
            time.sleep(min(timeout_s, 0.002))
            return b""
        # The lock keeps the descriptor ours: a closed number may be somebody else's socket next.
        with self._lock:
            if self._master < 0 or not select.select([self._master], [], [], timeout_s)[0]:
                return b""
            try:
                data = os.read(self._master, 4096)
            except OSError:
                return b""
        if self.wire_time is not None:
            start = max(time.monotonic(), self._busy_until_s)
            self._busy_until_s = start + len(data) * self.wire_time.char_s
        return data

    @property
    def arrival_s(self) -> float:
        """Monotonic time at which the last byte read has (or will have) crossed the wire."""
        return max(self._busy_until_s, time.monotonic()) if self.wire_time else time.monotonic()

    def write(self, data: bytes) -> None:
        """Send to the client; with wire time, when the last bit has arrived there."""
        if self.wire_time is not None:
            start = max(time.monotonic(), self._busy_until_s + self.wire_time.turnaround_s)
            self._busy_until_s = start + len(data) * self.wire_time.char_s
            sleep_precisely(self._busy_until_s - time.monotonic())
        with self._lock:
            try:
                while data and self._master >= 0:
                    data = data[os.write(self._master, data) :]
            except BlockingIOError:
                return  # nobody reads: the bytes are lost, as on a real wire
