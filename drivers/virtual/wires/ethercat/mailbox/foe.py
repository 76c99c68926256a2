"""File access over EtherCAT, server side (ETG.1000.6 clause 5.8): firmware upload and download.

In BOOT the drive's program is erased when a download starts: after an interrupted download the
drive accepts only INIT and BOOT. In Pre-Op the file is held separately until it is complete.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

_READ, _WRITE, _DATA, _ACK, _ERROR, _BUSY = 1, 2, 3, 4, 5, 6
NOT_FOUND, ILLEGAL, PACKET_NUMBER, BOOTSTRAP_ONLY = 0x8001, 0x8004, 0x8005, 0x8008
_HEADER = 6


@dataclass(slots=True)
class FileTrouble:
    """Faults to inject into the file service; none by default."""

    refuse: int = 0
    """Error code for every write request."""
    fail_at: int | None = None
    """Byte at which writing to memory fails…"""
    code: int = 0x8011
    """…with this error code."""
    text: str = ""
    busy: int = 0
    """Number of "busy" answers before each packet is accepted."""
    boot_only: bool = False
    """Accept files in BOOT only."""


class FirmwareStore:
    """Stores downloaded files."""

    def __init__(self) -> None:
        self.files: dict[str, bytes] = {}
        self.intact = True
        """The drive has a complete program."""
        self.trouble = FileTrouble()
        self._boot = False
        self._room = 0
        self._name: str | None = None
        self._writing = False
        self._data = bytearray()
        self._packet = 0
        self._busy_left = 0

    def enter(self, capacity: int, *, boot: bool) -> None:
        """Open a mailbox with ``capacity`` bytes of payload, in BOOT or above."""
        self._room = capacity - _HEADER
        self._boot = boot
        self._name, self._writing = None, False

    def handle(self, payload: bytes) -> list[bytes]:
        """Return the answers to one FoE message."""
        code = payload[0] if payload else 0
        number = struct.unpack_from("<I", payload.ljust(_HEADER, b"\0"), 2)[0]
        rest = payload[_HEADER:]
        if code == _WRITE:
            return self._begin(_text(rest))
        if code == _DATA and self._writing:
            return self._store(number, rest)
        if code == _READ:
            self._name, self._packet, self._writing = _text(rest), 1, False
            if self._name not in self.files:
                return [_message(_ERROR, NOT_FOUND)]
            return [self._packet_out()]
        if code == _ACK and not self._writing and self._name in self.files:
            if number != self._packet:
                return [_message(_ERROR, PACKET_NUMBER)]
            if self._packet * self._room > len(self.files[self._name]):
                self._name = None
                return []
            self._packet += 1
            return [self._packet_out()]
        return [_message(_ERROR, ILLEGAL)]

    def _begin(self, name: str) -> list[bytes]:
        refused = self.trouble.refuse
        if not refused and self.trouble.boot_only and not self._boot:
            refused = BOOTSTRAP_ONLY
        if refused:
            return [_message(_ERROR, refused) + self.trouble.text.encode()]
        self._name, self._data, self._packet = name, bytearray(), 0
        self._writing = True
        self._busy_left = self.trouble.busy
        self.intact = self.intact and not self._boot
        return [_message(_ACK, 0)]

    def _store(self, number: int, data: bytes) -> list[bytes]:
        if number != self._packet + 1 or self._name is None:
            self._writing = False
            return [_message(_ERROR, PACKET_NUMBER)]
        if self._busy_left:
            self._busy_left -= 1
            return [struct.pack("<BBHH", _BUSY, 0, 1, 2)]
        limit = self.trouble.fail_at
        if limit is not None and len(self._data) + len(data) > limit:
            self._writing = False
            return [_message(_ERROR, self.trouble.code) + self.trouble.text.encode()]
        self._packet = number
        self._busy_left = self.trouble.busy
        self._data += data
        if len(data) < self._room:
            self.files[self._name] = bytes(self._data)
            self._writing = False
            self.intact = True
        return [_message(_ACK, number)]

    def _packet_out(self) -> bytes:
        data = self.files[self._name or ""]
        start = (self._packet - 1) * self._room
        return _message(_DATA, self._packet) + data[start : start + self._room]


def _message(code: int, number: int) -> bytes:
    return struct.pack("<BBI", code, 0, number)


def _text(raw: bytes) -> str:
    return raw.split(b"\0", 1)[0].decode("ascii", "replace")
