"""CoE server: SDO transfers, complete access, SDO information, emergencies (ETG.1000.6 5.6).

Without I/O: takes a request's bytes (after the mailbox header) and returns the answers. It stores
the state of one segmented transfer; a channel has only one.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from drivers.virtual.device import (
    ABORT_COMMAND,
    ABORT_LENGTH,
    ABORT_READ_ONLY,
    ABORT_TOGGLE,
    ABORT_UNSUPPORTED,
    SdoAbort,
)
from drivers.virtual.wires.ethercat.mailbox import sdoinfo
from drivers.virtual.wires.ethercat.mailbox.dictionary import CoeDictionary

_EMERGENCY, _SDO_REQUEST, _SDO_RESPONSE, _SDO_INFORMATION = 1, 2, 3, 8
_ABORT_COMMAND = 0x80
_TOGGLE = 0x10
_COMPLETE = 0x10
_EXPEDITED, _SIZE_GIVEN = 0x02, 0x01

MAILBOX_SYNTAX = 0x01
MAILBOX_SERVICE = 0x04
MAILBOX_SHORT = 0x06


class MailboxError(Exception):
    """Answered by a mailbox error service with ``detail`` (ETG.1000.4 table 31)."""

    def __init__(self, detail: int) -> None:
        super().__init__(f"mailbox error {detail:#06x}")
        self.detail = detail


@dataclass(slots=True)
class Oddities:
    """Deviations of real slaves from the standard; all off by default."""

    unpadded_count: bool = False
    """Complete access without the pad byte after subindex 0."""
    abort_command: int = _ABORT_COMMAND
    """Command byte of an abort; some slaves set more than the three relevant bits."""
    endless_segments: bool = False
    """Segmented uploads continue beyond the announced size and mark no segment as last."""


@dataclass(slots=True)
class _Transfer:
    """A segmented transfer in progress."""

    index: int
    subindex: int
    complete: bool
    upload: bool
    data: bytearray
    size: int
    toggle: int = 0
    sent: int = 0


class CoeServer:
    """CoE server of one slave; ``capacity`` is the payload of one mailbox in bytes."""

    def __init__(self, dictionary: CoeDictionary, complete_access: bool, capacity: int) -> None:
        self._dictionary = dictionary
        self._complete_access = complete_access
        self._capacity = capacity
        self._transfer: _Transfer | None = None
        self.oddities = Oddities()
        self.segments_answered = 0
        """Segments of the present or last segmented transfer, for injected faults."""

    def reset(self) -> None:
        """Discard a transfer in progress."""
        self._transfer = None

    def handle(self, payload: bytes) -> list[bytes]:
        """Return the answers to one request, in order; none for an abort from the master.

        Raises:
            MailboxError: not a CoE service of this slave.
        """
        if len(payload) < 3:
            raise MailboxError(MAILBOX_SHORT)
        service = payload[1] >> 4
        body = payload[2:]
        if service == _SDO_REQUEST:
            return self._sdo(body.ljust(8, b"\0"))
        if service == _SDO_INFORMATION:
            answers = sdoinfo.answer(self._dictionary, body, self._capacity - 2)
            return [_header(_SDO_INFORMATION) + part for part in answers]
        raise MailboxError(MAILBOX_SERVICE)

    @staticmethod
    def emergency(code: int, register: int, data: bytes) -> bytes:
        """Return an emergency message (ETG.1000.6 clause 5.6.4)."""
        return _header(_EMERGENCY) + struct.pack("<HB", code, register) + data[:5].ljust(5, b"\0")

    def _sdo(self, body: bytes) -> list[bytes]:
        command, index, subindex = struct.unpack_from("<BHB", body)
        kind = command >> 5
        if kind == 4:
            self._transfer = None
            return []
        transfer = self._transfer
        if kind in (0, 3) and transfer is not None:
            index, subindex = transfer.index, transfer.subindex
        try:
            answer = self._execute(kind, command, index, subindex, body)
        except SdoAbort as abort:
            self._transfer = None
            # An abort is an SDO *request* with command exactly 80h (ETG.1000.6 table 39).
            return [
                _header(_SDO_REQUEST)
                + struct.pack("<BHBI", self.oddities.abort_command, index, subindex, abort.code)
            ]
        return [_header(_SDO_RESPONSE) + answer]

    def _execute(self, kind: int, command: int, index: int, subindex: int, body: bytes) -> bytes:
        if kind == 1:
            return self._download(command, index, subindex, body[4:])
        if kind == 2:
            return self._upload(command, index, subindex)
        if kind == 3:
            return self._upload_segment(command)
        if kind == 0:
            return self._download_segment(command, body[1:])
        raise SdoAbort(ABORT_COMMAND)

    # -- upload ---------------------------------------------------------------------------------

    def _upload(self, command: int, index: int, subindex: int) -> bytes:
        self._transfer = None
        complete = bool(command & _COMPLETE)
        data = self._read_all(index, subindex) if complete else self._read(index, subindex)
        echo = _COMPLETE if complete else 0
        if 0 < len(data) <= 4 and not complete:
            reply = 0x40 | (4 - len(data)) << 2 | _EXPEDITED | _SIZE_GIVEN
            return struct.pack("<BHB", reply, index, subindex) + data.ljust(4, b"\0")
        first = self._capacity - 2 - 8
        if len(data) > first:
            self._transfer = _Transfer(
                index, subindex, complete, True, bytearray(data), len(data), sent=first
            )
            self.segments_answered = 0
        head = struct.pack("<BHBI", 0x40 | echo | _SIZE_GIVEN, index, subindex, len(data))
        return head + data[:first]

    def _upload_segment(self, command: int) -> bytes:
        transfer = self._transfer
        if transfer is None or not transfer.upload:
            raise SdoAbort(ABORT_COMMAND)
        if command & _TOGGLE != transfer.toggle:
            raise SdoAbort(ABORT_TOGGLE)
        room = self._capacity - 2 - 1
        part = bytes(transfer.data[transfer.sent : transfer.sent + room])
        transfer.sent += len(part)
        last = transfer.sent >= transfer.size and not self.oddities.endless_segments
        part = part or bytes(room)
        unused = max(0, 7 - len(part))
        reply = transfer.toggle | unused << 1 | int(last)
        transfer.toggle ^= _TOGGLE
        self.segments_answered += 1
        if last:
            self._transfer = None
        return bytes([reply]) + part.ljust(7, b"\0")

    # -- download -------------------------------------------------------------------------------

    def _download(self, command: int, index: int, subindex: int, rest: bytes) -> bytes:
        self._transfer = None
        complete = bool(command & _COMPLETE)
        if command & _EXPEDITED:
            size = 4 - (command >> 2 & 0x03) if command & _SIZE_GIVEN else 4
            data = rest[:size]
        else:
            size = struct.unpack_from("<I", rest)[0]
            data = rest[4:]
            if size > len(data):
                self._transfer = _Transfer(index, subindex, complete, False, bytearray(data), size)
                self.segments_answered = 0
                return self._downloaded(complete, index, subindex)
            data = data[:size]
        self._store(index, subindex, complete, data)
        return self._downloaded(complete, index, subindex)

    @staticmethod
    def _downloaded(complete: bool, index: int, subindex: int) -> bytes:
        reply = 0x60 | (_COMPLETE if complete else 0)
        return struct.pack("<BHBI", reply, index, subindex, 0)

    def _download_segment(self, command: int, rest: bytes) -> bytes:
        transfer = self._transfer
        if transfer is None or transfer.upload:
            raise SdoAbort(ABORT_COMMAND)
        if command & _TOGGLE != transfer.toggle:
            raise SdoAbort(ABORT_TOGGLE)
        unused = command >> 1 & 0x07
        transfer.data += rest[: len(rest) - unused] if len(rest) <= 7 else rest
        reply = 0x20 | transfer.toggle
        transfer.toggle ^= _TOGGLE
        self.segments_answered += 1
        if len(transfer.data) > transfer.size:
            raise SdoAbort(ABORT_LENGTH)
        if command & 0x01:
            if len(transfer.data) != transfer.size:
                raise SdoAbort(ABORT_LENGTH)
            self._transfer = None
            self._store(transfer.index, transfer.subindex, transfer.complete, bytes(transfer.data))
        return bytes([reply]) + bytes(7)

    # -- values ---------------------------------------------------------------------------------

    def _read(self, index: int, subindex: int) -> bytes:
        return self._dictionary.read(index, subindex)

    def _store(self, index: int, subindex: int, complete: bool, data: bytes) -> None:
        if complete:
            self._write_all(index, subindex, data)
        else:
            self._dictionary.write(index, subindex, data)

    def _entries(self, index: int, subindex: int) -> list[int]:
        if not self._complete_access or subindex > 1:
            raise SdoAbort(ABORT_UNSUPPORTED)
        return [s for s in self._dictionary.subindices(index) if s >= subindex]

    def _read_all(self, index: int, first: int) -> bytes:
        """Complete access: subindex 0 padded to 16 bits, the rest packed as in a PDO."""
        entries = self._entries(index, first)
        if self._dictionary.is_list(index):
            count = int.from_bytes(self._dictionary.read(index, 0), "little")
            entries = [s for s in entries if s <= count]
        packed = _BitWriter()
        for subindex in entries:
            info = self._dictionary.entry(index, subindex)
            value = (
                self._dictionary.read(index, subindex)
                if info.readable
                else bytes((info.bit_length + 7) // 8)
            )
            bits = info.bit_length or len(value) * 8
            if subindex == 0 and not self.oddities.unpadded_count:
                bits = 16
            packed.append(value, bits)
        return packed.data()

    def _write_all(self, index: int, first: int, data: bytes) -> None:
        """Complete access download. A list is cleared, then written, its count last."""
        entries = self._entries(index, first)
        source = _BitReader(data)
        count: bytes | None = None
        if self._dictionary.is_list(index):
            self._dictionary.write(index, 0, b"\0")
        for subindex in entries:
            info = self._dictionary.entry(index, subindex)
            value = source.take(16 if subindex == 0 else info.bit_length)
            if value is None:
                break
            if subindex == 0 and self._dictionary.is_list(index):
                count = value[:1]
            elif info.writable:
                self._dictionary.write(index, subindex, value[: (info.bit_length + 7) // 8])
            elif info.readable and _differs(value, self._dictionary.read(index, subindex)):
                raise SdoAbort(ABORT_READ_ONLY)
        if source.left >= 8:
            raise SdoAbort(ABORT_LENGTH)
        if count is not None:
            self._dictionary.write(index, 0, count)


def _header(service: int) -> bytes:
    return struct.pack("<H", service << 12)


def _differs(left: bytes, right: bytes) -> bool:
    return int.from_bytes(left, "little") != int.from_bytes(right, "little")


class _BitWriter:
    """Packs values bit by bit; values of a byte or more start at a byte boundary."""

    def __init__(self) -> None:
        self._value = 0
        self._bits = 0

    def append(self, data: bytes, bits: int) -> None:
        if bits >= 8:
            self._bits = -(-self._bits // 8) * 8
        value = int.from_bytes(data, "little") & ((1 << bits) - 1)
        self._value |= value << self._bits
        self._bits += bits

    def data(self) -> bytes:
        return self._value.to_bytes(-(-self._bits // 8), "little")


class _BitReader:
    """Reverse of `_BitWriter`."""

    def __init__(self, data: bytes) -> None:
        self._value = int.from_bytes(data, "little")
        self._length = len(data) * 8
        self._at = 0

    @property
    def left(self) -> int:
        return self._length - self._at

    def take(self, bits: int) -> bytes | None:
        at = -(-self._at // 8) * 8 if bits >= 8 else self._at
        if at + bits > self._length:
            return None
        self._at = at + bits
        return (self._value >> at & ((1 << bits) - 1)).to_bytes(-(-bits // 8), "little")
