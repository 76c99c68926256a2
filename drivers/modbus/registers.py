"""Position of objects among 16-bit registers, and which registers to read together. Pure.

Each register is sent high byte first (MODBUS Application Protocol V1.1b3, clause 4.2); which of the
two registers of a 32-bit value comes first differs between manufacturers and is part of a `Place`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from drivers.errors import NotAllowed, ProtocolError
from drivers.objects.codec import size_of
from profiles.schema import DataType

WordOrder = Literal["low_first", "high_first"]


@dataclass(frozen=True, slots=True)
class Place:
    """Registers of one value.

    Values are read together only if they have the same ``group``; None is never merged.
    """

    start: int
    count: int
    type: DataType
    word_order: WordOrder
    group: int | None = 0

    @property
    def end(self) -> int:
        """First register after the value."""
        return self.start + self.count


@dataclass(frozen=True, slots=True)
class Block:
    """Registers that one request reads, and the positions of the requested values in it."""

    start: int
    count: int
    items: tuple[int, ...]


def words_of(data_type: DataType) -> int:
    """Return the number of registers of a type.

    Raises:
        NotAllowed: the type has no fixed length (text, octets).
    """
    size = size_of(data_type)
    if size is None:
        raise NotAllowed("modbus.values-type-cannot-carried", data_type=data_type)
    return max(1, size // 2)


def to_bytes(place: Place, registers: bytes) -> bytes:
    """Convert registers as received to the value's little-endian bytes.

    Raises:
        ProtocolError: an 8-bit value has a high byte that does not belong to it.
    """
    if place.count == 1:
        if size_of(place.type) != 1:
            return registers[::-1]
        high, low = registers
        sign_extended = high == 0xFF and low >= 0x80 and place.type == "INT8"
        if high and not sign_extended:
            raise ProtocolError(
                "modbus.register-holds-no",
                start=place.start,
                registers=registers.hex(),
                type=place.type,
            )
        return registers[1:]
    if place.word_order == "high_first":
        return registers[::-1]
    swapped = bytearray(len(registers))
    swapped[0::2] = registers[1::2]
    swapped[1::2] = registers[0::2]
    return bytes(swapped)


def to_words(place: Place, data: bytes) -> tuple[int, ...]:
    """Convert a value's little-endian bytes to registers, in the order of their addresses.

    Raises:
        ProtocolError: the length does not fit the type.
    """
    if len(data) != size_of(place.type):
        raise ProtocolError("modbus.bytes-given", bytes=len(data), type=place.type)
    if len(data) == 1:
        negative = place.type == "INT8" and data[0] >= 0x80
        return (data[0] | (0xFF00 if negative else 0),)
    words = [data[i] | data[i + 1] << 8 for i in range(0, len(data), 2)]
    return tuple(words if place.word_order == "low_first" else reversed(words))


def plan_blocks(places: Sequence[Place], max_registers: int, max_gap: int) -> tuple[Block, ...]:
    """Group values into as few requests as the limits allow.

    A block never exceeds ``max_registers``, never splits a value, bridges at most ``max_gap``
    unused registers between two values, and never joins values that overlap without being equal.
    """
    order = sorted(range(len(places)), key=lambda i: (places[i].start, places[i].count))
    blocks: list[Block] = []
    members: list[int] = []
    start = end = 0
    gap = False

    def close() -> None:
        if members:
            blocks.append(Block(start, end - start, tuple(members)))

    for item in order:
        place = places[item]
        last = places[members[-1]] if members else None
        same = last is not None and (place.start, place.count) == (last.start, last.count)
        joins = (
            last is not None
            and place.group is not None
            and place.group == last.group
            and end <= place.start <= end + max_gap
            and place.end - start <= max_registers
        )
        if joins:
            gap = gap or place.start > end
        elif not same:
            close()
            members, start, gap = [], place.start, False
        members.append(item)
        end = place.end
    close()
    return tuple(blocks)
