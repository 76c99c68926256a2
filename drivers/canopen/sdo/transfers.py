"""Client side of SDO transfers as generators without any I/O.

A transfer yields `Exchange`s (what to send, which answer to wait for) and receives the answers; its
return value is the result. The caller handles time-outs. All frames are 8 bytes. Source: CiA 301
v4.2.0 clause 7.2.4.3.
"""

from __future__ import annotations

import struct
from binascii import crc_hqx
from collections.abc import Generator
from typing import NamedTuple, TypeVar

from drivers.errors import ProtocolError, Rejected
from drivers.objects.sdo_abort import rejected
from drivers.texts.message import Text, text

T = TypeVar("T")

ABORT = 0x80
ABORT_TIMED_OUT = 0x05040000
ABORT_TOGGLE = 0x05030000
ABORT_COMMAND = 0x05040001
ABORT_SEQUENCE = 0x05040003
ABORT_CRC = 0x05040004
ABORT_MEMORY = 0x05040005
ABORT_LENGTH = 0x06070010
ABORT_GENERAL = 0x08000000
BLOCK_REQUESTS = (0xA4, 0xC6)
"""First bytes of the requests that open a block transfer."""

_MAX_BYTES = 16 * 1024 * 1024
_BLOCK = 127


class Exchange(NamedTuple):
    """One request and its answer.

    ``mux`` is what a first answer must contain in bytes 1 to 3 (index, subindex); segments contain
    none. ``answered`` is False for frames without an answer, such as an abort.
    """

    send: tuple[bytes, ...]
    mux: bytes | None
    answered: bool = True


Transfer = Generator[Exchange, bytes, T]


def multiplexer(index: int, subindex: int) -> bytes:
    """Return index and subindex as in SDO frames."""
    return struct.pack("<HB", index, subindex)


def abort_frame(mux: bytes, code: int) -> bytes:
    """Return a frame that aborts the transfer of ``mux``."""
    return bytes([ABORT]) + mux + struct.pack("<I", code)


def upload(index: int, subindex: int, block_above: int | None = None) -> Transfer[bytes]:
    """Read an object, expedited or in segments as the server decides.

    An object announced with more than ``block_above`` bytes is read by block transfer instead, if
    the server supports it.

    Raises:
        Rejected: the server aborted.
        ProtocolError: an answer that CiA 301 does not allow; the server was sent an abort.
    """
    mux = multiplexer(index, subindex)
    answer = yield Exchange((bytes([0x40]) + mux + bytes(4),), mux)
    _raise_abort(answer, mux, writing=False)
    command = answer[0]
    if command & 0xE0 != 0x40:
        yield from _give_up(mux, ABORT_COMMAND, _unexpected(command))
    if command & 0x02:
        size = 4 - (command >> 2 & 3) if command & 0x01 else 4
        return answer[4 : 4 + size]
    announced: int | None = struct.unpack("<I", answer[4:8])[0] if command & 0x01 else None
    if announced is not None and announced > _MAX_BYTES:
        yield from _give_up(mux, ABORT_MEMORY, text("sdo.announced-too-much", announced=announced))
    if block_above is None or announced is None or announced <= block_above:
        return (yield from _upload_segments(mux, announced))
    yield Exchange((abort_frame(mux, ABORT_GENERAL),), mux, answered=False)
    try:
        return (yield from block_upload(index, subindex))
    except Rejected as refusal:
        if refusal.abort_code != ABORT_COMMAND:
            raise
    return (yield from upload(index, subindex))


def _upload_segments(mux: bytes, announced: int | None) -> Transfer[bytes]:
    data = bytearray()
    toggle = 0
    empty = 0
    while True:
        answer = yield Exchange((bytes([0x60 | toggle]) + bytes(7),), None)
        _raise_abort(answer, mux, writing=False)
        command = answer[0]
        if command & 0xE0:
            yield from _give_up(mux, ABORT_COMMAND, _unexpected(command))
        if command & 0x10 != toggle:
            yield from _give_up(mux, ABORT_TOGGLE, text("sdo.segment-twice-or-lost"))
        data += answer[1 : 8 - (command >> 1 & 7)]
        if len(data) > (_MAX_BYTES if announced is None else announced):
            too_much = (
                text("sdo.more-than-accepted", most=_MAX_BYTES)
                if announced is None
                else text("sdo.more-than-announced", announced=announced)
            )
            yield from _give_up(mux, ABORT_LENGTH, too_much)
        if command & 0x01:
            break
        empty = 0 if command >> 1 & 7 < 7 else empty + 1
        if empty > _BLOCK:
            yield from _give_up(mux, ABORT_SEQUENCE, text("sdo.same-segments"))
        toggle ^= 0x10
    if announced is not None and len(data) != announced:
        raise ProtocolError(
            "canopen.drive-announced-bytes-sent", announced_bytes=announced, count=len(data)
        )
    return bytes(data)


def expedited(index: int, subindex: int, data: bytes) -> bytes:
    """Return the request that writes 1 to 4 bytes at once (CiA 301 clause 7.2.4.3.3)."""
    return (
        bytes([0x23 | (4 - len(data)) << 2]) + multiplexer(index, subindex) + data.ljust(4, b"\0")
    )


def download(index: int, subindex: int, data: bytes) -> Transfer[None]:
    """Write an object: expedited up to 4 bytes, otherwise in segments.

    Raises:
        Rejected: the server aborted.
        ProtocolError: an answer that CiA 301 does not allow; the server was sent an abort.
    """
    mux = multiplexer(index, subindex)
    if 1 <= len(data) <= 4:
        first = expedited(index, subindex, data)
    else:
        first = b"\x21" + mux + struct.pack("<I", len(data))
    answer = yield Exchange((first,), mux)
    _raise_abort(answer, mux, writing=True)
    if answer[0] & 0xE0 != 0x60:
        yield from _give_up(mux, ABORT_COMMAND, _unexpected(answer[0]))
    if 1 <= len(data) <= 4:
        return
    toggle = 0
    for start in range(0, max(len(data), 1), 7):
        part = data[start : start + 7]
        last = start + 7 >= len(data)
        command = toggle | (7 - len(part)) << 1 | last
        answer = yield Exchange((bytes([command]) + part.ljust(7, b"\0"),), None)
        _raise_abort(answer, mux, writing=True)
        if answer[0] & 0xE0 != 0x20:
            yield from _give_up(mux, ABORT_COMMAND, _unexpected(answer[0]))
        if answer[0] & 0x10 != toggle:
            yield from _give_up(mux, ABORT_TOGGLE, text("sdo.segment-out-of-turn"))
        toggle ^= 0x10


def block_upload(index: int, subindex: int) -> Transfer[bytes]:
    """Read an object by block transfer with CRC.

    Raises:
        Rejected: the server aborted; code 05040001h means that it has no block transfer.
        ProtocolError: wrong CRC, length or answer; the server was sent an abort.
    """
    mux = multiplexer(index, subindex)
    answer = yield Exchange((b"\xa4" + mux + bytes([_BLOCK, 0, 0, 0]),), mux)
    _raise_abort(answer, mux, writing=False)
    if answer[0] & 0xE1 != 0xC0:
        yield from _give_up(mux, ABORT_COMMAND, _unexpected(answer[0]))
    with_crc = bool(answer[0] & 0x04)
    announced: int | None = struct.unpack("<I", answer[4:8])[0] if answer[0] & 0x02 else None
    data = bytearray()
    send: tuple[bytes, ...] = (b"\xa3" + bytes(7),)
    ended = False
    budget = 2 * ((_MAX_BYTES if announced is None else announced) // 7 + _BLOCK)
    while not ended:
        good = 0
        while True:
            segment = yield Exchange(send, None)
            send = ()
            budget -= 1
            if budget < 0:
                yield from _give_up(mux, ABORT_SEQUENCE, text("sdo.same-segments"))
            _raise_abort(segment, mux, writing=False)
            number, last = segment[0] & 0x7F, bool(segment[0] & 0x80)
            if number == good + 1:
                good = number
                data += segment[1:8]
                ended = last
            if number == _BLOCK or last:
                break
        if len(data) > _MAX_BYTES:
            yield from _give_up(mux, ABORT_MEMORY, text("sdo.block-does-not-end"))
        send = (bytes([0xA2, good, _BLOCK]) + bytes(5),)
    answer = yield Exchange(send, None)
    _raise_abort(answer, mux, writing=False)
    if answer[0] & 0xE3 != 0xC1:
        yield from _give_up(mux, ABORT_COMMAND, _unexpected(answer[0]))
    result = bytes(data[: len(data) - (answer[0] >> 2 & 7)])
    if with_crc and crc_hqx(result, 0) != int.from_bytes(answer[1:3], "little"):
        yield from _give_up(mux, ABORT_CRC, text("sdo.block-checksum"))
    if announced is not None and announced != len(result):
        yield from _give_up(
            mux, ABORT_LENGTH, text("sdo.announced-and-sent", announced=announced, sent=len(result))
        )
    yield Exchange((b"\xa1" + bytes(7),), None, answered=False)
    return result


def block_download(index: int, subindex: int, data: bytes) -> Transfer[None]:
    """Write an object by block transfer with CRC.

    Raises:
        Rejected: the server aborted; code 05040001h means that it has no block transfer.
        ProtocolError: an answer that CiA 301 does not allow; the server was sent an abort.
    """
    mux = multiplexer(index, subindex)
    answer = yield Exchange((b"\xc6" + mux + struct.pack("<I", len(data)),), mux)
    _raise_abort(answer, mux, writing=True)
    if answer[0] & 0xE3 != 0xA0:
        yield from _give_up(mux, ABORT_COMMAND, _unexpected(answer[0]))
    with_crc = bool(answer[0] & 0x04)
    block = answer[4]
    sent = 0
    refusals = 0
    while sent < max(len(data), 1):
        if not 1 <= block <= 127:
            yield from _give_up(mux, ABORT_SEQUENCE, text("sdo.block-size", block=block))
        frames = []
        for number in range(1, block + 1):
            part = data[sent + 7 * (number - 1) : sent + 7 * number]
            last = sent + 7 * number >= len(data)
            frames.append(bytes([number | last << 7]) + part.ljust(7, b"\0"))
            if last:
                break
        answer = yield Exchange(tuple(frames), None)
        _raise_abort(answer, mux, writing=True)
        if answer[0] & 0xE3 != 0xA2 or answer[1] > len(frames):
            yield from _give_up(mux, ABORT_SEQUENCE, text("sdo.block-acknowledged"))
        refusals += answer[1] == 0
        if refusals > 3:
            yield from _give_up(mux, ABORT_SEQUENCE, text("sdo.block-not-taken"))
        sent += 7 * answer[1]
        block = answer[2]
    empty = (7 - len(data) % 7) % 7 if data else 7
    crc = crc_hqx(data, 0) if with_crc else 0
    answer = yield Exchange(
        (bytes([0xC1 | empty << 2]) + crc.to_bytes(2, "little") + bytes(5),), None
    )
    _raise_abort(answer, mux, writing=True)
    if answer[0] & 0xE3 != 0xA1:
        yield from _give_up(mux, ABORT_COMMAND, _unexpected(answer[0]))


def fitted(data: bytes, size: int | None) -> bytes:
    """Cut ``data`` to ``size`` if only padding is removed.

    Some drives send four bytes for every object, filled with zeros or with the sign.
    """
    if size is None or len(data) <= size:
        return data
    rest = data[size:]
    sign = b"\xff" if data[size - 1] & 0x80 else b"\0"
    if rest.strip(b"\0") == b"" or rest.strip(sign) == b"":
        return data[:size]
    return data


def answers(frame: bytes, exchange: Exchange) -> bool:
    """Return whether ``frame`` can be the answer to ``exchange``: same object, or a segment.

    An abort may contain object 0000:00: the firmware of several manufacturers does not fill it in.
    """
    if len(frame) != 8:
        return False
    if exchange.mux is None:
        return True
    return frame[1:4] == exchange.mux or (frame[0] == ABORT and frame[1:4] == b"\0\0\0")


def _raise_abort(answer: bytes, mux: bytes, *, writing: bool) -> None:
    if answer[0] == ABORT:
        index, subindex = struct.unpack("<HB", mux)
        raise rejected(
            int.from_bytes(answer[4:8], "little"),
            parameter=f"{index:04X}:{subindex:02X}",
            writing=writing,
        )


def _unexpected(answer: int) -> Text:
    return text("sdo.unexpected-answer", answer=f"{answer:#04x}")


def _give_up(mux: bytes, code: int, why: Text) -> Generator[Exchange, bytes, None]:
    yield Exchange((abort_frame(mux, code),), mux, answered=False)
    index, subindex = struct.unpack("<HB", mux)
    raise ProtocolError("sdo.transfer-given-up", parameter=f"{index:04X}:{subindex:02X}", why=why)
