"""Modbus RTU frames: pure functions that encode and decode them.

Sources: "MODBUS Application Protocol Specification V1.1b3" (function codes 03, 06 and 16, clauses
6.3, 6.6, 6.12 and 7) and "MODBUS over Serial Line V1.02" (clause 2.5.1, frame and CRC). The frames
printed in manual 003:1040-1170 are the test vectors. The CRC is sent low byte first; manual 003
calls that byte CRC_H.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from drivers.errors import OutOfRange
from drivers.texts.message import Text, text

READ = 0x03
READ_INPUT = 0x04
WRITE_ONE = 0x06
WRITE_MANY = 0x10
EXCEPTION_BIT = 0x80

#: Longest block of one request, limited by the 8-bit byte count (V1.1b3, clauses 6.3 and 6.12).
MAX_READ_REGISTERS = 125
MAX_WRITE_REGISTERS = 123
MAX_FRAME_BYTES = 256

#: Meaning of exception codes. 1 to 11: V1.1b3 clause 7; 2 to 4 also in manual 003:1160-1162.
EXCEPTION_TEXTS: dict[int, Text] = {
    1: text("modbus.exception-1"),
    2: text("modbus.exception-2"),
    3: text("modbus.exception-3"),
    4: text("modbus.exception-4"),
    5: text("modbus.exception-5"),
    6: text("modbus.exception-6"),
    8: text("modbus.exception-8"),
    10: text("modbus.exception-10"),
    11: text("modbus.exception-11"),
}
UNKNOWN_EXCEPTION = text("modbus.exception-unknown")

#: The drive was busy and did nothing: repeat the request later (V1.1b3 clause 7).
BUSY = 6
#: A gateway reports that the drive behind it was not reached (V1.1b3 clause 7).
NOT_REACHED = (10, 11)


def _crc_table() -> tuple[int, ...]:
    table = []
    for value in range(256):
        for _ in range(8):
            value = (value >> 1) ^ 0xA001 if value & 1 else value >> 1  # noqa: PLW2901
        table.append(value)
    return tuple(table)


_CRC_TABLE = _crc_table()


def crc16(data: bytes | bytearray | memoryview) -> int:
    """Return the CRC of Modbus RTU (reflected polynomial A001h, start FFFFh)."""
    crc = 0xFFFF
    table = _CRC_TABLE
    for byte in data:
        crc = (crc >> 8) ^ table[(crc ^ byte) & 0xFF]
    return crc


def seal(body: bytes) -> bytes:
    """Return ``body`` with its CRC appended, low byte first."""
    return body + crc16(body).to_bytes(2, "little")


def is_sealed(frame: bytes) -> bool:
    """Return whether the last two bytes are the CRC of the others."""
    return len(frame) >= 4 and crc16(frame[:-2]) == frame[-2] | frame[-1] << 8


@dataclass(frozen=True, slots=True)
class Request:
    """One request of the master. ``values`` are empty for a read."""

    station: int
    function: int
    start: int
    count: int
    values: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Query:
    """The bytes of a request together with the form of its answer.

    A good answer starts with ``head`` and is ``length`` bytes long; a refusal starts with
    ``refusal`` and is 5 bytes long. Function codes 06 and 16 echo address and value or count in
    ``head``, so that only the answer to this request matches.
    """

    frame: bytes
    head: bytes
    length: int
    refusal: bytes

    @property
    def station(self) -> int:
        """Address of the drive."""
        return self.frame[0]


def _check(station: int, start: int, count: int, longest: int) -> None:
    if not 1 <= station <= 247:
        raise OutOfRange("modbus.station-outside-addresses-247", value=station, limit="1…247")
    if not 1 <= count <= longest or start < 0 or start + count > 0x10000:
        raise OutOfRange(
            "modbus.registers-not-fit-request",
            value=count,
            limit=f"1…{longest}",
            start=start,
            longest=longest,
        )


@lru_cache(maxsize=4096)
def read_query(station: int, start: int, count: int, function: int = READ) -> Query:
    """Read ``count`` holding registers (03), or input registers (04).

    Raises:
        OutOfRange: station, register or count do not exist in Modbus.
    """
    _check(station, start, count, MAX_READ_REGISTERS)
    frame = seal(struct.pack(">BBHH", station, function, start, count))
    head = bytes((station, function, 2 * count))
    return Query(frame, head, 5 + 2 * count, bytes((station, function | EXCEPTION_BIT)))


def write_one_query(station: int, register: int, value: int) -> Query:
    """Write one register (06); the answer repeats the request.

    Raises:
        OutOfRange: station, register or value do not exist in Modbus.
    """
    _check(station, register, 1, 1)
    _check_words((value,))
    frame = seal(struct.pack(">BBHH", station, WRITE_ONE, register, value))
    return Query(frame, frame[:6], 8, bytes((station, WRITE_ONE | EXCEPTION_BIT)))


def write_many_query(station: int, start: int, values: Sequence[int]) -> Query:
    """Write several registers at once (16).

    Raises:
        OutOfRange: station, registers or values do not exist in Modbus.
    """
    count = len(values)
    _check(station, start, count, MAX_WRITE_REGISTERS)
    _check_words(values)
    head = struct.pack(">BBHH", station, WRITE_MANY, start, count)
    frame = seal(head + struct.pack(f">B{count}H", 2 * count, *values))
    return Query(frame, head, 8, bytes((station, WRITE_MANY | EXCEPTION_BIT)))


def _check_words(values: Sequence[int]) -> None:
    for value in values:
        if not 0 <= value <= 0xFFFF:
            raise OutOfRange("modbus.not-fit-16-bit", value=value, limit="0…65535")


@dataclass(frozen=True, slots=True)
class Answer:
    """Result of searching received bytes for an answer.

    ``frame`` is the whole answer or None; ``start`` and ``end`` are its position in the buffer.
    ``crc_errors`` counts positions with the form of the answer, all its bytes, and a wrong CRC.
    """

    frame: bytes | None
    start: int = 0
    end: int = 0
    crc_errors: int = 0

    @property
    def exception(self) -> int | None:
        """Exception code of a refusal, else None."""
        if self.frame is None or not self.frame[1] & EXCEPTION_BIT:
            return None
        return self.frame[2]


def find_answer(buffer: bytes | bytearray, query: Query) -> Answer:
    """Search for the answer to ``query`` anywhere in ``buffer``.

    Anything before it (noise, the tail of a late answer, another station's frame) is skipped; a
    candidate with a wrong CRC is counted and skipped by one byte, so that the true answer is found
    even inside what looked like a longer one.
    """
    crc_errors = 0
    size = len(buffer)
    for start in range(size - 4):
        if buffer.startswith(query.head, start):
            length = query.length
        elif buffer.startswith(query.refusal, start):
            length = 5
        else:
            continue
        if start + length > size:
            continue
        frame = bytes(buffer[start : start + length])
        if is_sealed(frame):
            return Answer(frame, start, start + length, crc_errors)
        crc_errors += 1
    return Answer(None, 0, 0, crc_errors)


class RequestParser:
    """Splits a byte stream into requests, on the slave's side.

    A request is recognised by its function code, its length and its CRC. Bytes that cannot be the
    start of one are skipped and counted, so that the parser resynchronises after noise.
    """

    def __init__(self) -> None:
        self._buffer = bytearray()
        self.skipped_bytes = 0

    def feed(self, data: bytes) -> list[Request]:
        """Add bytes and return the requests that are now complete."""
        self._buffer += data
        return self._cut(silent=False)

    def end_of_frame(self) -> list[Request]:
        """Return the remaining requests at the end of a frame, which RTU marks by silence.

        Bytes that only looked like the start of a longer request are searched once more. A whole
        frame with an unknown function code is returned with ``count`` 0.
        """
        rest = bytes(self._buffer)
        if rest and self._request_length(0) is None and is_sealed(rest):
            self._buffer.clear()
            return [Request(rest[0], rest[1], 0, 0)]
        found = self._cut(silent=True)
        self.skipped_bytes += len(self._buffer)
        self._buffer.clear()
        return found

    def _cut(self, *, silent: bool) -> list[Request]:
        found: list[Request] = []
        start = done = 0
        while len(self._buffer) - start >= 8:
            length = self._request_length(start) or 0
            if start + length > len(self._buffer) and not silent:
                break
            frame = bytes(self._buffer[start : start + length])
            if length and len(frame) == length and is_sealed(frame):
                found.append(_parse_request(frame))
                self.skipped_bytes += start - done
                start = done = start + length
            else:
                start += 1
        # Bytes before anything known are kept until silence: they may belong to an unknown
        # function.
        keep = max(done, len(self._buffer) - MAX_FRAME_BYTES)
        self.skipped_bytes += keep - done
        del self._buffer[:keep]
        return found

    def _request_length(self, start: int) -> int | None:
        """Return the length of the request that would start here; None if none can."""
        if len(self._buffer) - start < 8 or self._buffer[start] > 247:
            return None
        function = self._buffer[start + 1]
        if function in (READ, WRITE_ONE):
            return 8
        if function != WRITE_MANY:
            return None
        count = self._buffer[start + 4] << 8 | self._buffer[start + 5]
        if not 1 <= count <= MAX_WRITE_REGISTERS or self._buffer[start + 6] != 2 * count:
            return None
        return 9 + 2 * count


def _parse_request(frame: bytes) -> Request:
    station, function, start, second = struct.unpack_from(">BBHH", frame)
    if function == READ:
        return Request(station, READ, start, second)
    if function == WRITE_ONE:
        return Request(station, WRITE_ONE, start, 1, (second,))
    return Request(station, WRITE_MANY, start, second, struct.unpack_from(f">{second}H", frame, 7))


def read_response(station: int, words: Sequence[int]) -> bytes:
    """Return an answer to 03 with the values of the registers."""
    return seal(struct.pack(f">BBB{len(words)}H", station, READ, 2 * len(words), *words))


def write_response(request: Request) -> bytes:
    """Return an answer to 06 or 16: address and value, or address and count."""
    second = request.values[0] if request.function == WRITE_ONE else request.count
    return seal(struct.pack(">BBHH", request.station, request.function, request.start, second))


def exception_response(station: int, function: int, code: int) -> bytes:
    """Return the refusal of a request with ``function``; ``code`` as in EXCEPTION_TEXTS."""
    return seal(bytes((station, (function | EXCEPTION_BIT) & 0xFF, code)))
