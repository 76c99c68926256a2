"""File access over EtherCAT, server side (ETG.1000.6 clause 5.8): firmware files in and out."""

from __future__ import annotations

import struct

_READ, _WRITE, _DATA, _ACK, _ERROR = 1, 2, 3, 4, 5
NOT_FOUND, ILLEGAL, PACKET_NUMBER = 0x8001, 0x8004, 0x8005
_HEADER = 6


class FirmwareStore:
    """Keeps what was downloaded; ``capacity`` is the payload of one mailbox in bytes."""

    def __init__(self, capacity: int) -> None:
        self.files: dict[str, bytes] = {}
        self._room = capacity - _HEADER
        self._name: str | None = None
        self._writing = False
        self._data = bytearray()
        self._packet = 0

    def handle(self, payload: bytes) -> list[bytes]:
        """Answers to one FoE message."""
        code = payload[0] if payload else 0
        number = struct.unpack_from("<I", payload.ljust(_HEADER, b"\0"), 2)[0]
        rest = payload[_HEADER:]
        if code == _WRITE:
            self._name, self._data, self._packet = _text(rest), bytearray(), 0
            self._writing = True
            return [_message(_ACK, 0)]
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

    def _store(self, number: int, data: bytes) -> list[bytes]:
        if number != self._packet + 1 or self._name is None:
            self._writing = False
            return [_message(_ERROR, PACKET_NUMBER)]
        self._packet = number
        self._data += data
        if len(data) < self._room:
            self.files[self._name] = bytes(self._data)
            self._writing = False
        return [_message(_ACK, number)]

    def _packet_out(self) -> bytes:
        data = self.files[self._name or ""]
        start = (self._packet - 1) * self._room
        return _message(_DATA, self._packet) + data[start : start + self._room]


def _message(code: int, number: int) -> bytes:
    return struct.pack("<BBI", code, 0, number)


def _text(raw: bytes) -> str:
    return raw.split(b"\0", 1)[0].decode("ascii", "replace")
