"""The EEPROM of a slave as bytes: its fields, its consistency, and differences of two images.

Pure. Source: ETG.1000.6 clause 5.4 and ETG.2010 (words, categories, checksum).
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

from drivers.ethercat.wire.sii import ALIAS_WORD, CHECKSUM_WORD, CONFIG_WORDS, checksum
from drivers.texts.message import Text, text

HEADER_BYTES, UNIT_BYTES = 0x80, 0x80
"""Length of the header before the categories, and the unit in which the size is stated."""
MOST_BYTES = 1 << 20
VENDOR_WORD, SERIAL_WORD, SIZE_WORD = 0x08, 0x0E, 0x3E
_END = 0xFFFF
_BLANK = 0xFFFFFFFF

#: Fields of the header: name, first word, words.
FIELDS: tuple[tuple[str, int, int], ...] = (
    ("pdi_control", 0, 1), ("pdi_configuration", 1, 1), ("sync_impulse", 2, 1),
    ("pdi_configuration_2", 3, 1), ("alias", ALIAS_WORD, 1), ("reserved", 5, 2),
    ("checksum", CHECKSUM_WORD, 1), ("vendor_id", VENDOR_WORD, 2), ("product_code", 0x0A, 2),
    ("revision", 0x0C, 2), ("serial", SERIAL_WORD, 2), ("hardware_delays", 0x10, 4),
    ("boot_mailbox", 0x14, 4), ("mailbox", 0x18, 4), ("protocols", 0x1C, 1),
    ("reserved", 0x1D, 0x21), ("size", SIZE_WORD, 1), ("version", 0x3F, 1),
)  # fmt: skip
#: Categories (ETG.2010 table 4).
CATEGORIES = {
    10: "strings", 20: "data_types", 30: "general", 40: "fmmus", 41: "sync_managers",
    43: "fmmus_extended", 44: "sync_units", 50: "transmit_pdos", 51: "receive_pdos",
    60: "distributed_clocks",
}  # fmt: skip


class SlaveIdentity(NamedTuple):
    """Identity of a drive: 1018h:01 to 1018h:03."""

    vendor_id: int
    product_code: int
    revision: int


class Category(NamedTuple):
    """One category: its first word (of the head) and its contents."""

    kind: int
    word: int
    data: bytes


@dataclass(frozen=True, slots=True)
class Difference:
    """A field in which two images differ; a value is None where that image lacks the field.

    ``field`` is a name of `FIELDS` or `CATEGORIES`, or "category N".
    """

    field: str
    word: int
    first: str | None
    second: str | None


@dataclass(frozen=True, slots=True)
class Image:
    """The contents of an EEPROM, from word 0."""

    data: bytes

    def part(self, word: int, count: int) -> bytes:
        """Return the bytes of ``count`` words."""
        return self.data[2 * word : 2 * (word + count)]

    @property
    def checksum_right(self) -> bool:
        """Whether word 7 matches the words before it; otherwise the ESC ignores the contents."""
        head = self.part(0, CONFIG_WORDS + 1)
        return len(head) == 16 and head[14] == checksum(head)

    @property
    def identity(self) -> SlaveIdentity:
        """Vendor, product and revision."""
        return SlaveIdentity(*struct.unpack("<III", self.part(VENDOR_WORD, 6)))

    @property
    def has_identity(self) -> bool:
        """Whether vendor and product were ever written."""
        return _BLANK not in self.identity[:2]

    @property
    def serial(self) -> int | None:
        """The serial number; None if there is none."""
        (serial,) = struct.unpack("<I", self.part(SERIAL_WORD, 2))
        return None if serial in (0, _BLANK) else int(serial)

    @property
    def alias(self) -> int:
        """The station alias."""
        return int.from_bytes(self.part(ALIAS_WORD, 1), "little")

    @property
    def stated_bytes(self) -> int:
        """Size in bytes that the EEPROM states."""
        return UNIT_BYTES * (int.from_bytes(self.part(SIZE_WORD, 1), "little") + 1)

    @property
    def trusted(self) -> bool:
        """Whether the identity of the drive in it can be trusted."""
        return self.checksum_right and self.has_identity

    def categories(self) -> Iterator[Category]:
        """Iterate over the categories up to the end mark.

        Raises:
            ValueError: a category exceeds the contents, or there is no end mark.
        """
        word = HEADER_BYTES // 2
        while True:
            head = self.part(word, 2)
            if head[:2] == _END.to_bytes(2, "little"):
                return
            if len(head) < 4:
                raise ValueError("no end mark")
            kind, count = struct.unpack("<HH", head)
            data = self.part(word + 2, count)
            if len(data) < 2 * count:
                raise ValueError("beyond the end")
            yield Category(kind, word, data)
            word += 2 + count

    def problem(self) -> Text | None:
        """Return why this cannot be the complete contents of a slave's EEPROM; None if it can."""
        size = len(self.data)
        if size < HEADER_BYTES or size % UNIT_BYTES or size > MOST_BYTES:
            return text("ethercat.eeprom-no-image", bytes=size)
        if not self.checksum_right:
            return text("ethercat.eeprom-checksum-wrong")
        if not self.has_identity:
            return text("ethercat.eeprom-no-identity")
        if self.stated_bytes != size:
            return text("ethercat.eeprom-size-differs", stated=self.stated_bytes, bytes=size)
        try:
            list(self.categories())
        except ValueError:
            return text("ethercat.eeprom-no-end")
        return None

    def with_words(self, word: int, data: bytes) -> Image:
        """Return an image with other bytes from a word on, and a matching checksum."""
        changed = bytearray(self.data)
        changed[2 * word : 2 * word + len(data)] = data
        changed[2 * CHECKSUM_WORD] = checksum(bytes(changed))
        return Image(bytes(changed))


def differences(first: Image, second: Image) -> tuple[Difference, ...]:
    """Return the fields and categories in which two images differ, in the order of their words."""
    found = [
        Difference(name, word, before.hex(), after.hex())
        for name, word, count in FIELDS
        if (before := first.part(word, count)) != (after := second.part(word, count))
    ]
    return tuple(found) + _of_categories(first, second)


def _of_categories(first: Image, second: Image) -> tuple[Difference, ...]:
    try:
        before, after = list(first.categories()), list(second.categories())
    except ValueError:
        return _of_the_rest(first, second)
    found = []
    for place in range(max(len(before), len(after))):
        one = before[place] if place < len(before) else None
        other = after[place] if place < len(after) else None
        if one is not None and other is not None and one[0::2] == other[0::2]:
            continue
        known = other or one
        assert known is not None
        name = CATEGORIES.get(known.kind, f"category {known.kind}")
        found.append(
            Difference(
                name,
                known.word,
                None if one is None else one.data.hex(),
                None if other is None else other.data.hex(),
            )
        )
    return tuple(found) or _of_the_rest(first, second)


def _of_the_rest(first: Image, second: Image) -> tuple[Difference, ...]:
    """Compare everything behind the header as one field, including data after the end mark."""
    before, after = first.data[HEADER_BYTES:], second.data[HEADER_BYTES:]
    if before == after:
        return ()
    return (Difference("contents", HEADER_BYTES // 2, before.hex(), after.hex()),)
