"""The slave information interface (EEPROM): access, identity words, checksum.

Transactions of steps; no I/O. While the master reads, it takes the EEPROM from the slave's own
processor, and always returns it: some drives refuse states without it (AL status 0050h). Every lost
frame is sent again: after a lost command the data register would still hold another word.

Source: ETG.1000.4 clause 6.4 (registers 0500h to 0508h), ETG.1000.6 clause 5.4 and ETG.2010.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass

from drivers.errors import DriveError, LinkLost, LinkTimeout, ProtocolError
from drivers.ethercat.wire.registers import GONE_S, TRIES, read_again
from drivers.ethercat.wire.steps import Pause, Steps, Write
from drivers.objects.codec import serial_or_none

ALIAS_WORD, CHECKSUM_WORD, SERIAL_WORD, BOOT_WORD = 0x0004, 0x0007, 0x000E, 0x0014
MAILBOX_WORD = 0x0018
"""Offset and size of the mailbox out, of the mailbox in, and the protocols (ETG.1000.6 5.4)."""
CONFIG_WORDS = 7
_CATEGORIES_WORD, _SYNC_MANAGERS, _LAST = 0x0040, 41, 0xFFFF
"""Every category starts with type and length in 16-bit words (ETG.1000.6 table 19 and 5.4)."""
_MOST_CATEGORIES = 64
_SOEM_BYTES = 4096
"""SOEM treats everything beyond this as the end of the EEPROM (its EC_MAXEEPBUF)."""

_OWNER, _CONTROL, _DATA = 0x500, 0x502, 0x508
_READ, _WRITE, _ENABLE_WRITE = 0x0100, 0x0200, 0x0001
_BUSY, _FAILED, _WRITE_LOCKED, _EMULATED = 0x8000, 0x6000, 0x4000, 0x0020
_TAKE, _MASTER, _SLAVE = b"\x02", b"\x00", b"\x01"
_TIMEOUT_S, _POLL_S = 0.5, 0.0005
_AGAIN_S = 0.005
_LEAST_MAILBOX, _RAM = 16, 0x1000


@dataclass(frozen=True, slots=True)
class BootMailbox:
    """Position of the mailboxes in BOOT, seen from the slave: ``out`` is what it receives."""

    out_address: int
    out_size: int
    in_address: int
    in_size: int


def checksum(words: bytes) -> int:
    """Return the CRC-8 of the first seven words: x⁸+x²+x+1, start value 0xFF (ETG.1000.6 5.4).

    A slave that finds it wrong ignores its EEPROM at the next start.
    """
    crc = 0xFF
    for byte in words[: 2 * CONFIG_WORDS]:
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1 ^ 0x07) & 0xFF if crc & 0x80 else crc << 1
    return crc


def identity(clock: Callable[[], float]) -> Steps[tuple[int | None, bool]]:
    """Read the serial number (None if there is none), and whether the checksum is right.

    Errors as `read`.
    """
    words = yield from read(0, CONFIG_WORDS + 1, clock)
    serial = yield from read(SERIAL_WORD, 2, clock)
    right = words[2 * CHECKSUM_WORD] == checksum(words)
    return serial_or_none(int.from_bytes(serial, "little")), right


def read(word: int, count: int, clock: Callable[[], float]) -> Steps[bytes]:
    """Read ``count`` words from ``word``; two at a time, which every controller supports.

    Raises:
        LinkTimeout: the EEPROM stays busy.
        LinkLost: the station does not answer.
        ProtocolError: the controller reports an error.
    """
    data = bytearray()
    yield from _take(clock)
    try:
        for place in range(word, word + count, 2):
            yield from _command(_READ, place, clock)
            data += yield from _register(_DATA, 4, clock)
    except DriveError:
        yield from _give_back()
        raise
    yield from _give_back()
    return bytes(data[: 2 * count])


def write(word: int, value: int, clock: Callable[[], float]) -> Steps[None]:
    """Write one word; errors as `read`."""
    yield from _take(clock)
    try:
        yield from _ready(clock)
        yield from _put(_DATA, struct.pack("<H", value), clock)
        yield from _command(_WRITE | _ENABLE_WRITE, word, clock)
    except DriveError:
        yield from _give_back()
        raise
    yield from _give_back()


def write_alias(alias: int, clock: Callable[[], float]) -> Steps[int]:
    """Write the alias and the matching checksum; return the alias that reads back."""
    words = bytearray((yield from read(0, CONFIG_WORDS, clock)))
    struct.pack_into("<H", words, 2 * ALIAS_WORD, alias)
    yield from write(ALIAS_WORD, alias, clock)
    yield from write(CHECKSUM_WORD, checksum(bytes(words)), clock)
    return int.from_bytes((yield from read(ALIAS_WORD, 1, clock)), "little")


def boot_mailbox(clock: Callable[[], float]) -> Steps[BootMailbox | None]:
    """Read the mailboxes for BOOT; None if the slave states none."""
    reported = BootMailbox(*struct.unpack("<HHHH", (yield from read(BOOT_WORD, 4, clock))))
    sane = (
        min(reported.out_size, reported.in_size) >= _LEAST_MAILBOX and reported.out_address >= _RAM
    )
    return reported if sane and 0xFFFF not in (reported.out_size, reported.in_size) else None


def has_mailbox(clock: Callable[[], float]) -> Steps[bool]:
    """Return whether the EEPROM states mailboxes and a protocol; False if it cannot be read."""
    try:
        words = struct.unpack("<HHHHH", (yield from read(MAILBOX_WORD, 5, clock)))
    except DriveError:
        return False
    _, out_size, _, in_size, protocols = words
    blank = 0xFFFF in (out_size, in_size, protocols)
    return not blank and min(out_size, in_size) >= _LEAST_MAILBOX and protocols != 0


def process_data_places(clock: Callable[[], float]) -> Steps[tuple[int, bool]]:
    """Return how many sync managers beyond the mailboxes the EEPROM puts into process memory.

    0 without such a category. The second value states whether the category is within SOEM's reach.
    Errors as `read`.
    """
    word = _CATEGORIES_WORD
    for _ in range(_MOST_CATEGORIES):
        kind, words = struct.unpack("<HH", (yield from read(word, 2, clock)))
        if kind == _LAST:
            break
        if kind == _SYNC_MANAGERS:
            managers = yield from read(word + 2, words, clock)
            # Each has eight bytes; the first two are its start address.
            starts = [start for start, _ in struct.iter_unpack("<H6s", managers[: words // 4 * 8])]
            return sum(start >= _RAM for start in starts[2:]), 2 * (word + 2 + words) <= _SOEM_BYTES
        word += 2 + words
    return 0, True


def _take(clock: Callable[[], float]) -> Steps[None]:
    """Take the EEPROM from the slave's processor by force: one switched off holds it forever."""
    yield from _put(_OWNER, _TAKE, clock)
    yield from _put(_OWNER, _MASTER, clock)


def _give_back() -> Steps[None]:
    for _ in range(TRIES):
        if (yield Write(_OWNER, _SLAVE)) is not None:
            return


def emulated(clock: Callable[[], float]) -> Steps[bool]:
    """Return whether the drive's processor emulates the EEPROM (0502h bit 5); errors as `read`."""
    return bool((yield from _ready(clock)) & _EMULATED)


def _command(command: int, word: int, clock: Callable[[], float]) -> Steps[None]:
    """Send a command, repeated while a chip that still stores the last word sets bit 13.

    Raises:
        ProtocolError: the EEPROM refuses the command.
    """
    deadline = clock() + _TIMEOUT_S
    while True:
        yield from _send(command, word, clock)
        status = yield from _ready(clock)
        if not status & _FAILED:
            return
        if status & _WRITE_LOCKED or clock() > deadline:
            raise ProtocolError("ethercat.drive-eeprom-refuses-word", word=word, status=status)
        yield Pause(_AGAIN_S)


def _send(command: int, word: int, clock: Callable[[], float]) -> Steps[None]:
    deadline = clock() + GONE_S
    while True:
        # A command may be executed although its frame is lost: never send it to a busy EEPROM.
        yield from _ready(clock)
        if (yield Write(_CONTROL, struct.pack("<HI", command, word))) is not None:
            return
        if clock() > deadline:
            raise _gone()


def _ready(clock: Callable[[], float]) -> Steps[int]:
    deadline = clock() + _TIMEOUT_S
    while True:
        asked = clock()
        status = int.from_bytes((yield from _register(_CONTROL, 2, clock)), "little")
        if not status & _BUSY:
            return status
        if asked > deadline:  # not a status read before this computer was stalled
            raise LinkTimeout("ethercat.drive-eeprom-stays-busy", timeout_s=_TIMEOUT_S)
        yield Pause(_POLL_S)


def _put(register: int, data: bytes, clock: Callable[[], float]) -> Steps[None]:
    """Write a register; writing it twice has no effect here."""
    deadline = clock() + GONE_S
    while (yield Write(register, data)) is None:
        if clock() > deadline:
            raise _gone()
        yield Pause(_AGAIN_S)


def _register(register: int, size: int, clock: Callable[[], float]) -> Steps[bytes]:
    data = yield from read_again(register, size, clock)
    if data is None:
        raise _gone()
    return data


def _gone() -> LinkLost:
    return LinkLost("ethercat.station-not-answer-check-supply")
