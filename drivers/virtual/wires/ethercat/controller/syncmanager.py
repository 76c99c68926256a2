"""Sync managers and FMMUs: access rules of the process memory.

ETG.1000.4 clauses 6.6 and 6.7. In mailbox mode a buffer is written once and read once, and its
state changes on the last byte; in buffered mode the newest complete data are valid.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

MAILBOX_FULL = 0x08
_MODE_MAILBOX = 0x02
_DIRECTION_WRITE = 0x04
_WATCHDOG_TRIGGER = 0x40
_ENABLE = 0x01
_REPEAT = 0x02
_MEMORY_BITS = 0x10000 * 8


def _ignore() -> None:
    """Default of the callbacks below."""


@dataclass(slots=True)
class SyncManager:
    """One channel. ``locked`` is set by the slave application (PDI control bit 0)."""

    number: int
    start: int = 0
    length: int = 0
    control: int = 0
    activate: int = 0
    locked: bool = True
    full: bool = False
    repeat_ack: bool = False
    data: bytearray = field(default_factory=bytearray)
    on_written: Callable[[], None] = _ignore
    on_read: Callable[[], None] = _ignore
    end: int = field(default=0, init=False)
    """First address after the buffer."""
    enabled: bool = field(default=False, init=False)
    """Enabled by the master."""
    mailbox: bool = field(default=False, init=False)
    """Mailbox mode instead of buffered mode."""
    writable: bool = field(default=False, init=False)
    """The master writes, the slave reads."""
    watches: bool = field(default=False, init=False)
    """Writing triggers the process-data watchdog."""
    _opened: bool = False

    @property
    def repeat_request(self) -> bool:
        """The master's repeat toggle."""
        return bool(self.activate & _REPEAT)

    def configure(self, raw: bytes) -> None:
        """Apply 8 register bytes, except status (+5) and PDI control (+7), which are read-only."""
        before = (self.start, self.length, self.control, self.activate & _ENABLE)
        self.start, self.length, self.control = struct.unpack_from("<HHB", raw)
        self.activate = raw[6]
        self.end = self.start + self.length
        self.enabled = bool(self.activate & _ENABLE) and self.length > 0
        self.mailbox = self.control & 0x03 == _MODE_MAILBOX
        self.writable = self.control & 0x0C == _DIRECTION_WRITE
        self.watches = bool(self.control & _WATCHDOG_TRIGGER)
        if before != (self.start, self.length, self.control, self.activate & _ENABLE):
            self.reset()

    def reset(self) -> None:
        """Clear the buffer, as after power-on or reconfiguration."""
        self.data = bytearray(self.length)
        self.full = False
        self._opened = False

    def registers(self) -> bytes:
        """Return the 8 register bytes as the master reads them."""
        status = MAILBOX_FULL if self.full and self.mailbox else 0
        pdi = (_ENABLE if self.locked else 0) | (_REPEAT if self.repeat_ack else 0)
        return struct.pack(
            "<HHBBBB", self.start, self.length, self.control, status, self.activate, pdi
        )

    def read(self, address: int, length: int) -> bytes | None:
        """Read by the master; None if the channel does not allow it (no working counter)."""
        if self.locked or self.writable:
            return None
        offset = address - self.start
        if not self.mailbox:
            if offset < 0:
                return None
            return bytes(self.data[offset : offset + length]).ljust(length, b"\0")
        if not self.full or offset < 0 or (offset and not self._opened):
            return None
        self._opened = True
        taken = bytes(self.data[offset : offset + length]).ljust(length, b"\0")
        if offset + length >= self.length:
            self._opened = False
            self.full = False
            self.on_read()
        return taken

    def write(self, address: int, data: bytes) -> bool:
        """Write by the master; False if the channel does not allow it."""
        if self.locked or not self.writable:
            return False
        offset = address - self.start
        if offset < 0 or offset + len(data) > self.length:
            return False
        if self.mailbox and (self.full or (offset and not self._opened)):
            return False
        self._opened = True
        self.data[offset : offset + len(data)] = data
        if offset + len(data) == self.length:
            self._opened = False
            self.full = self.mailbox
            self.on_written()
        return True

    def put(self, message: bytes) -> None:
        """Write a message to the mailbox that the master reads."""
        self.data = bytearray(message.ljust(self.length, b"\0")[: self.length])
        self._opened = False
        self.full = True

    def take(self) -> bytes:
        """Take the message that the master has written to the mailbox."""
        self.full = False
        return bytes(self.data)


@dataclass(frozen=True, slots=True)
class Fmmu:
    """One logical-to-physical mapping (ETG.1000.4 table 56)."""

    start: int
    length: int
    end: int
    """First logical byte address after it."""
    start_bit: int
    stop_bit: int
    physical: int
    physical_bit: int
    reads: bool
    writes: bool

    @property
    def bytewise(self) -> bool:
        """Whether it maps whole bytes only, the usual case."""
        return self.start_bit == 0 and self.stop_bit == 7 and self.physical_bit == 0

    def bits(self, address: int, length: int) -> Iterator[tuple[int, int]]:
        """Yield pairs of bits within a datagram: position in its data, and in physical memory."""
        begin = self.start * 8 + self.start_bit
        end = (self.end - 1) * 8 + self.stop_bit + 1
        origin = self.physical * 8 + self.physical_bit - begin
        for bit in range(max(begin, address * 8), min(end, (address + length) * 8)):
            if origin + bit < _MEMORY_BITS:
                yield bit - address * 8, origin + bit


def parse_fmmu(raw: bytes) -> Fmmu | None:
    """Return the mapping of 16 register bytes; None while it is not activated."""
    start, length, start_bit, stop_bit, physical, physical_bit, kind, active = struct.unpack_from(
        "<IHBBHBBB", raw
    )
    if not active & 1 or not length:
        return None
    return Fmmu(
        start, length, start + length, start_bit & 7, stop_bit & 7, physical, physical_bit & 7,
        bool(kind & 1), bool(kind & 2),
    )  # fmt: skip
