"""Modbus registers of a family whose manual prints a register for its parameters."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from drivers.virtual.device import ABORT_NO_OBJECT, ABORT_WRITE_ONLY, SdoAbort
from drivers.virtual.firmware.dictionary import Entry, ObjectDictionary
from profiles.schema import Profile


class RegisterTable:
    """Registers to entries. Values longer than 16 bits take several registers."""

    def __init__(self, profile: Profile, od: ObjectDictionary) -> None:
        modbus = next((link for link in profile.links if link.kind == "modbus"), None)
        self._high_first = modbus is None or modbus.word_order != "low_first"
        self._entries: dict[int, Entry] = {
            entry.parameter.modbus_register: entry
            for entry in od
            if entry.parameter.modbus_register is not None
        }

    def _words(self, entry: Entry) -> int:
        return max(1, (entry.size + 1) // 2)

    def _find(self, register: int) -> Entry:
        entry = self._entries.get(register)
        if entry is None:
            raise SdoAbort(ABORT_NO_OBJECT)
        return entry

    def read(self, register: int, count: int) -> list[int]:
        """Values of ``count`` registers; every value must lie inside the block as a whole."""
        words: list[int] = []
        while len(words) < count:
            entry = self._find(register + len(words))
            if entry.parameter.access == "wo":
                raise SdoAbort(ABORT_WRITE_ONLY)
            value = entry.current()
            if isinstance(value, str):
                raise SdoAbort(ABORT_NO_OBJECT)
            # Short values are sign-extended to the register, as their type says.
            size = self._words(entry)
            unsigned = int(value) & ((1 << 16 * size) - 1)
            parts = [unsigned >> 16 * i & 0xFFFF for i in range(size)]
            words += parts[::-1] if self._high_first else parts
        if len(words) != count:
            raise SdoAbort(ABORT_NO_OBJECT)
        return words

    def write(
        self, register: int, values: Sequence[int], write_entry: Callable[[Entry, bytes], None]
    ) -> None:
        """Write whole values. A refusal in the middle leaves those before it written."""
        done = 0
        plan: list[tuple[Entry, bytes]] = []
        while done < len(values):
            entry = self._find(register + done)
            size = self._words(entry)
            parts = list(values[done : done + size])
            if len(parts) != size:
                raise SdoAbort(ABORT_NO_OBJECT)
            ordered = parts[::-1] if self._high_first else parts
            data = b"".join(part.to_bytes(2, "little") for part in ordered)
            plan.append((entry, data[: entry.size]))
            done += size
        for entry, data in plan:
            write_entry(entry, data)
