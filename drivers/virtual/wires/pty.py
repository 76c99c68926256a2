"""A pseudo-terminal at a given path: the cable of virtual serial drives.

A client opens the path like a serial port. The bytes are real; a pty has no bit times, parity or
modem lines, so wire time is emulated on request: a frame counts as received only at the time of its
last bit.
"""

from __future__ import annotations

import os
import select
import threading
import time
from dataclasses import dataclass
from pathlib import Path

from drivers.computer.network.sockets import set_blocking
from drivers.computer.serial_ports.terminals import (
    open_pair,
    output_speed,
    require_pseudo_terminals,
    terminal_name,
)
from drivers.errors import LinkLost
from drivers.modbus.timing import sleep_precisely


@dataclass(frozen=True, slots=True)
class WireTime:
    """Speed of an emulated wire. ``turnaround_s`` is the drive's time before it answers."""

    baudrate: int
    bits_per_char: int = 10
    turnaround_s: float = 0.0

    @property
    def char_s(self) -> float:
        """Duration of one character."""
        return self.bits_per_char / self.baudrate


def open_pty(path: Path) -> tuple[int, int]:
    """Create a raw pty whose slave end appears at ``path``; return master (non-blocking) and slave.

    The slave end must stay open: otherwise reading the master fails while there is no client.

    Raises:
        LinkLost: the path exists and is not a virtual wire.
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
    fresh.replace(path)  # atomic: a client never sees an incomplete link
    return master, slave


def close_pty(path: Path, master: int, slave: int) -> None:
    """Close both ends of `open_pty` and remove the link.

    A newer wire at the same path is not removed.
    """
    if path.is_symlink() and str(path.readlink()) == terminal_name(slave):
        path.unlink()
    os.close(slave)
    os.close(master)


class PtyWire:
    """A pty whose slave end appears at ``path``.

    One thread reads and writes; `pull` and `heal` may be called from any other. The wire itself
    keeps the slave end open, so clients may connect and disconnect.
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
            LinkLost: the path exists and is not a virtual wire.
        """
        with self._lock:
            if self._master >= 0:
                return
            self._master, self._slave = open_pty(self.path)

    def close(self) -> None:
        """Remove the wire. Clients that have it open see a missing adapter."""
        self._closing = True  # the reading thread releases the lock
        with self._lock:
            self._closing = False
            if self._master < 0:
                return
            close_pty(self.path, self._master, self._slave)
            self._master = self._slave = -1

    def pull(self) -> None:
        """Disconnect the cable: the same as closing, until `heal`."""
        self.close()

    def heal(self) -> None:
        """Connect the cable again."""
        self.open()

    @property
    def is_open(self) -> bool:
        """False while disconnected."""
        return self._master >= 0

    def client_baudrate(self) -> int | None:
        """Return the client's baud rate, or None if this system has no name for it."""
        return output_speed(self._master)

    def read(self, timeout_s: float) -> bytes:
        """Return bytes from the client at once; empty after ``timeout_s`` without any.

        With wire time the returned bytes are still on the wire until `arrival_s`.
        """
        if self._closing or self._master < 0:
            time.sleep(min(timeout_s, 0.002))
            return b""
        # The lock protects the descriptor: after closing, its number may belong to another socket.
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
        """Monotonic time at which the last byte read has crossed (or will cross) the wire."""
        return max(self._busy_until_s, time.monotonic()) if self.wire_time else time.monotonic()

    def write(self, data: bytes) -> None:
        """Send to the client; with wire time, return when the last bit has arrived."""
        if self.wire_time is not None:
            start = max(time.monotonic(), self._busy_until_s + self.wire_time.turnaround_s)
            self._busy_until_s = start + len(data) * self.wire_time.char_s
            sleep_precisely(self._busy_until_s - time.monotonic())
        with self._lock:
            try:
                while data and self._master >= 0:
                    data = data[os.write(self._master, data) :]
            except BlockingIOError:
                return  # no reader: the bytes are lost, as on a real wire
