"""The server side of SDO transfers: expedited, segmented and block, without I/O.

Source: CiA 301 v4.2.0 clause 7.2.4.3.
"""

from __future__ import annotations

import struct
from binascii import crc_hqx
from collections.abc import Callable
from dataclasses import dataclass, field

from drivers.virtual.device import (
    ABORT_COMMAND,
    ABORT_LENGTH,
    ABORT_TOGGLE,
    SdoAbort,
)

_ABORT_BLOCK_SIZE = 0x05040002
_ABORT_SEQUENCE = 0x05040003
_ABORT_CRC = 0x05040004
_BLOCK = 64
_LONGEST = 1 << 20


@dataclass(slots=True)
class _Transfer:
    """Transfer in progress: ``kind`` is one of the states named in `SdoServer`."""

    kind: str
    mux: bytes
    data: bytearray = field(default_factory=bytearray)
    position: int = 0
    toggle: int = 0
    size: int | None = None
    block: int = _BLOCK
    with_crc: bool = False
    expected: int = 1
    last_seen: bool = False


class SdoServer:
    """Answers request frames. ``read`` and ``write`` take (index, subindex[, data]).

    ``size`` returns an object's bytes if its type has a fixed length: a write may then omit it.
    """

    def __init__(
        self,
        read: Callable[[int, int], bytes],
        write: Callable[[int, int, bytes], None],
        *,
        offers_block: bool = True,
        size: Callable[[int, int], int | None] | None = None,
    ) -> None:
        self._read = read
        self._write = write
        self._size = size
        self._offers_block = offers_block
        self._transfer: _Transfer | None = None

    def reset(self) -> None:
        """Reset communication: discard a transfer in progress."""
        self._transfer = None

    def request(self, frame: bytes) -> list[bytes]:
        """Return all frames that answer ``frame``: usually one, up to 127 in a block, or none."""
        if len(frame) != 8:
            return []
        if frame[0] == 0x80:
            self._transfer = None
            return []
        try:
            return self._dispatch(frame)
        except SdoAbort as refusal:
            transfer, self._transfer = self._transfer, None
            mux = frame[1:4] if transfer is None or _opens(frame[0], transfer) else transfer.mux
            return [b"\x80" + mux + struct.pack("<I", refusal.code)]

    def _dispatch(self, frame: bytes) -> list[bytes]:
        transfer = self._transfer
        if transfer is not None and transfer.kind == "block_download":
            return self._block_segment(transfer, frame)
        command = frame[0] >> 5
        if command == 2:
            return self._start_upload(frame)
        if command == 1:
            return self._start_download(frame)
        if command == 3 and transfer is not None and transfer.kind == "upload":
            return self._upload_segment(transfer, frame)
        if command == 0 and transfer is not None and transfer.kind == "download":
            return self._download_segment(transfer, frame)
        if command == 5 and self._offers_block:
            return self._block_upload(transfer, frame)
        if command == 6 and self._offers_block:
            return self._block_download(transfer, frame)
        raise SdoAbort(ABORT_COMMAND)

    def _start_upload(self, frame: bytes) -> list[bytes]:
        mux = frame[1:4]
        self._transfer = None
        data = self._read(*_object(mux))
        if 1 <= len(data) <= 4:
            return [bytes([0x43 | (4 - len(data)) << 2]) + mux + data.ljust(4, b"\0")]
        self._transfer = _Transfer("upload", mux, bytearray(data))
        return [b"\x41" + mux + struct.pack("<I", len(data))]

    def _upload_segment(self, transfer: _Transfer, frame: bytes) -> list[bytes]:
        if frame[0] & 0x10 != transfer.toggle:
            raise SdoAbort(ABORT_TOGGLE)
        part = bytes(transfer.data[transfer.position : transfer.position + 7])
        transfer.position += len(part)
        last = transfer.position >= len(transfer.data)
        answer = bytes([transfer.toggle | (7 - len(part)) << 1 | last]) + part.ljust(7, b"\0")
        transfer.toggle ^= 0x10
        if last:
            self._transfer = None
        return [answer]

    def _start_download(self, frame: bytes) -> list[bytes]:
        mux = frame[1:4]
        self._transfer = None
        if frame[0] & 0x02:
            size = 4 - (frame[0] >> 2 & 3) if frame[0] & 0x01 else self._open_size(mux)
            self._write(*_object(mux), frame[4 : 4 + size])
        else:
            size_given = struct.unpack("<I", frame[4:8])[0] if frame[0] & 0x01 else None
            self._transfer = _Transfer("download", mux, size=size_given)
        return [b"\x60" + mux + bytes(4)]

    def _open_size(self, mux: bytes) -> int:
        """Return the length of an expedited write without one: the object's length."""
        known = self._size(*_object(mux)) if self._size is not None else None
        return 4 if known is None else min(known, 4)

    def _download_segment(self, transfer: _Transfer, frame: bytes) -> list[bytes]:
        if frame[0] & 0x10 != transfer.toggle:
            raise SdoAbort(ABORT_TOGGLE)
        transfer.data += frame[1 : 8 - (frame[0] >> 1 & 7)]
        if len(transfer.data) > _LONGEST:
            raise SdoAbort(ABORT_LENGTH)
        if frame[0] & 0x01:
            self._finish(transfer)
        answer = bytes([0x20 | transfer.toggle]) + bytes(7)
        transfer.toggle ^= 0x10
        return [answer]

    def _finish(self, transfer: _Transfer) -> None:
        self._transfer = None
        if transfer.size is not None and transfer.size != len(transfer.data):
            raise SdoAbort(ABORT_LENGTH)
        self._write(*_object(transfer.mux), bytes(transfer.data))

    def _block_upload(self, transfer: _Transfer | None, frame: bytes) -> list[bytes]:
        step = frame[0] & 0x03
        if step == 0:
            mux = frame[1:4]
            if not 1 <= frame[4] <= 127:
                raise SdoAbort(_ABORT_BLOCK_SIZE)
            data = self._read(*_object(mux))
            self._transfer = _Transfer(
                "block_upload", mux, bytearray(data), block=frame[4], with_crc=bool(frame[0] & 4)
            )
            return [b"\xc6" + mux + struct.pack("<I", len(data))]
        if transfer is None or transfer.kind != "block_upload":
            raise SdoAbort(ABORT_COMMAND)
        if step == 1:
            self._transfer = None
            return []
        if step == 2:
            left = -(-len(transfer.data[transfer.position :]) // 7) or 1
            if frame[1] > min(transfer.block, left):
                raise SdoAbort(_ABORT_SEQUENCE)
            transfer.position += 7 * frame[1]
            if not 1 <= frame[2] <= 127:
                raise SdoAbort(_ABORT_BLOCK_SIZE)
            transfer.block = frame[2]
            if transfer.position >= max(len(transfer.data), 1):
                empty = (7 - len(transfer.data) % 7) % 7 if transfer.data else 7
                crc = crc_hqx(bytes(transfer.data), 0) if transfer.with_crc else 0
                return [bytes([0xC1 | empty << 2]) + crc.to_bytes(2, "little") + bytes(5)]
        return self._block_segments(transfer)

    def _block_segments(self, transfer: _Transfer) -> list[bytes]:
        frames = []
        for number in range(1, transfer.block + 1):
            start = transfer.position + 7 * (number - 1)
            last = start + 7 >= len(transfer.data)
            part = bytes(transfer.data[start : start + 7])
            frames.append(bytes([number | last << 7]) + part.ljust(7, b"\0"))
            if last:
                break
        return frames

    def _block_download(self, transfer: _Transfer | None, frame: bytes) -> list[bytes]:
        if frame[0] & 0x01:
            if transfer is None or transfer.kind != "block_download_end":
                raise SdoAbort(ABORT_COMMAND)
            empty = frame[0] >> 2 & 7
            del transfer.data[len(transfer.data) - empty :]
            crc = int.from_bytes(frame[1:3], "little")
            if transfer.with_crc and crc_hqx(bytes(transfer.data), 0) != crc:
                raise SdoAbort(_ABORT_CRC)
            self._finish(transfer)
            return [b"\xa1" + bytes(7)]
        mux = frame[1:4]
        size = struct.unpack("<I", frame[4:8])[0] if frame[0] & 0x02 else None
        self._transfer = _Transfer("block_download", mux, size=size, with_crc=bool(frame[0] & 0x04))
        return [b"\xa4" + mux + bytes([_BLOCK, 0, 0, 0])]

    def _block_segment(self, transfer: _Transfer, frame: bytes) -> list[bytes]:
        number, last = frame[0] & 0x7F, bool(frame[0] & 0x80)
        if number == transfer.expected:
            transfer.data += frame[1:8]
            transfer.expected += 1
            transfer.last_seen = last
        if len(transfer.data) > _LONGEST:
            raise SdoAbort(ABORT_LENGTH)
        if number < _BLOCK and not last:
            return []
        good = transfer.expected - 1
        transfer.expected = 1
        if transfer.last_seen:
            transfer.kind = "block_download_end"
        return [bytes([0xA2, good, _BLOCK]) + bytes(5)]


def _opens(command: int, under_way: _Transfer) -> bool:
    """Whether a request names an object, so that an abort refers to that object."""
    if under_way.kind == "block_download":
        # A segment of the block: its first byte is a number.
        return False
    specifier = command >> 5
    return (
        specifier in (1, 2)
        or (specifier == 5 and command & 0x03 == 0)
        or (specifier == 6 and not command & 0x01)
    )


def _object(mux: bytes) -> tuple[int, int]:
    return mux[0] | mux[1] << 8, mux[2]
