"""Modbus registers of a family whose manual prints a register for its parameters."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from drivers.virtual.device import (
    ABORT_NO_OBJECT,
    ABORT_TOO_HIGH,
    ABORT_WRITE_ONLY,
    SdoAbort,
)
from drivers.virtual.firmware.objects.dictionary import Entry, ObjectDictionary
from profiles.schema import Profile


class RegisterTable:
    """Maps registers to entries. Values longer than 16 bits occupy several registers.

    Each register is separate, as the manual prints them (003:633-673 and 003:905-990 give H and L a
    line each): a master may read one half, and write one half with function 06.
    """

    def __init__(self, profile: Profile, od: ObjectDictionary) -> None:
        modbus = next((link for link in profile.links if link.kind == "modbus"), None)
        high_first = modbus is None or modbus.word_order != "low_first"
        self._places: dict[int, tuple[Entry, int]] = {}
        """For each register its entry and by how many bits its word is shifted in the value."""
        for entry in od:
            start = entry.parameter.modbus_register
            if start is None:
                continue
            count = max(1, (entry.size + 1) // 2)
            for word in range(count):
                shift = 16 * (count - 1 - word if high_first else word)
                self._places[start + word] = entry, shift

    def _find(self, register: int) -> tuple[Entry, int]:
        place = self._places.get(register)
        if place is None:
            raise SdoAbort(ABORT_NO_OBJECT)
        return place

    def read(self, register: int, count: int) -> list[int]:
        """Return the values of ``count`` registers. The words of one value are consistent."""
        words: list[int] = []
        held: dict[str, int] = {}
        for at in range(register, register + count):
            entry, shift = self._find(at)
            if entry.parameter.access == "wo":
                raise SdoAbort(ABORT_WRITE_ONLY)
            if entry.key not in held:
                value = entry.current()
                if isinstance(value, str):
                    raise SdoAbort(ABORT_NO_OBJECT)
                held[entry.key] = int(value)
            # Short values are sign-extended to the register, according to their type.
            words.append(held[entry.key] >> shift & 0xFFFF)
        return words

    def write(
        self, register: int, values: Sequence[int], write_entry: Callable[[Entry, bytes], None]
    ) -> None:
        """Write registers; all words of one value at once, a half leaves the other unchanged.

        After a refusal in the middle, the values before it remain written.
        """
        plan: dict[str, tuple[Entry, int]] = {}
        for at, word in enumerate(values, register):
            entry, shift = self._find(at)
            value = plan[entry.key][1] if entry.key in plan else _raw(entry)
            plan[entry.key] = entry, value & ~(0xFFFF << shift) | word << shift
        for entry, value in plan.values():
            write_entry(entry, _stored(entry, value))


def _raw(entry: Entry) -> int:
    """Return the bits of an entry's value, unsigned."""
    value = entry.current()
    if isinstance(value, str):
        raise SdoAbort(ABORT_NO_OBJECT)
    return int(value) & ((1 << 16 * max(1, (entry.size + 1) // 2)) - 1)


def _stored(entry: Entry, value: int) -> bytes:
    """Convert a register's bits to the entry's bytes; an 8-bit overflow is out of range."""
    if entry.size == 1:
        fits = range(0xFF80, 0x10000) if entry.parameter.type == "INT8" else range(0x80, 0x100)
        if value >= 0x80 and value not in fits:
            raise SdoAbort(ABORT_TOO_HIGH)
        value &= 0xFF
    return value.to_bytes(entry.size, "little")
