"""Reading and writing a whole EEPROM, word by word, as steps without I/O.

A change begins by making the checksum wrong and ends by making it right. A power failure in between
leaves contents that the ESC ignores, that any check detects, and that the saved file repairs.
"""

from __future__ import annotations

import struct
from collections.abc import Callable

from drivers.errors import NotAllowed, ProtocolError
from drivers.ethercat.eeprom.image import HEADER_BYTES, MOST_BYTES, Image
from drivers.ethercat.wire import sii
from drivers.ethercat.wire.sii import CHECKSUM_WORD
from drivers.ethercat.wire.steps import Steps
from drivers.texts.message import Text, text

Report = Callable[[float, Text], None]
_PART_WORDS = 64


def read_image(clock: Callable[[], float], report: Report, size: int | None = None) -> Steps[bytes]:
    """Read everything; ``size`` [bytes] where the contents cannot be trusted to state it.

    Raises:
        ProtocolError: the stated size is impossible, and ``size`` is not given.
        LinkTimeout, LinkLost: see `sii.read`.
    """
    if size is None:
        size = Image((yield from sii.read(0, HEADER_BYTES // 2, clock))).stated_bytes
        if size > MOST_BYTES:
            raise ProtocolError("ethercat.eeprom-size-unknown", stated=size)
    data = bytearray()
    while len(data) < size:
        report(len(data) / size, text("ethercat.eeprom-read", bytes=len(data), size=size))
        count = min(_PART_WORDS, (size - len(data)) // 2)
        data += yield from sii.read(len(data) // 2, count, clock)
    return bytes(data)


def write_image(
    present: bytes, target: bytes, clock: Callable[[], float], report: Report
) -> Steps[None]:
    """Write the words in which ``target`` differs from ``present``, and read everything back.

    Raises:
        NotAllowed: the drive's processor emulates the EEPROM: a broken-off write could not be
            repaired.
        ProtocolError: the contents read back differ; the checksum is then left wrong.
        LinkTimeout, LinkLost: the writing broke off; the checksum is wrong.
    """
    if (yield from sii.emulated(clock)):
        raise NotAllowed("ethercat.eeprom-emulated")
    places = [
        at // 2
        for at in range(0, len(target), 2)
        if present[at : at + 2] != target[at : at + 2] and at // 2 != CHECKSUM_WORD
    ]
    right = _word(target, CHECKSUM_WORD)
    if not places and _word(present, CHECKSUM_WORD) == right:
        return
    yield from sii.write(CHECKSUM_WORD, right ^ 0xFF, clock)
    for done, word in enumerate(places):
        report(
            0.7 * done / len(places),
            text("ethercat.eeprom-written", words=done, count=len(places)),
        )
        yield from sii.write(word, _word(target, word), clock)
    held = yield from read_image(
        clock, lambda share, step: report(0.7 + 0.3 * share, step), len(target)
    )
    for word in range(len(target) // 2):
        if word != CHECKSUM_WORD and _word(held, word) != _word(target, word):
            raise _differs(word, _word(held, word), _word(target, word))
    yield from sii.write(CHECKSUM_WORD, right, clock)
    last = int.from_bytes((yield from sii.read(CHECKSUM_WORD, 1, clock)), "little")
    if last != right:
        raise _differs(CHECKSUM_WORD, last, right)


def _word(data: bytes, word: int) -> int:
    return int(struct.unpack_from("<H", data, 2 * word)[0])


def _differs(word: int, held: int, wanted: int) -> ProtocolError:
    return ProtocolError("ethercat.eeprom-reads-back", word=word, held=held, wanted=wanted)
