"""Process data: check of a mapping, and transfer of values to and from the dictionary."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Sequence
from typing import NamedTuple

from drivers.virtual.device import (
    ABORT_NOT_MAPPABLE,
    ABORT_PDO_LENGTH,
    SdoAbort,
)
from drivers.virtual.firmware.objects.dictionary import Entry, Number, ObjectDictionary

_FORMAT = {
    "BOOL": "B", "INT8": "b", "UINT8": "B", "INT16": "h", "UINT16": "H",
    "INT32": "i", "UINT32": "I", "INT64": "q", "UINT64": "Q", "REAL32": "f",
}  # fmt: skip


def check_mapping(
    od: ObjectDictionary, entries: Sequence[int], direction: str, max_bytes: int | None
) -> list[Entry | int]:
    """Return entries of a mapping, or the number of bytes of a gap (index 0).

    Raises SdoAbort: unknown or not mappable in this direction, wrong bit length, too long.
    """
    found: list[Entry | int] = []
    total = 0
    for item in entries:
        code, bits = item >> 8, item & 0xFF
        total += bits
        if code == 0:
            if bits == 0 or bits % 8:
                raise SdoAbort(ABORT_PDO_LENGTH)
            found.append(bits // 8)
            continue
        entry = od.entries.get(code)
        if entry is None:
            raise SdoAbort(ABORT_NOT_MAPPABLE)
        if entry.parameter.pdo not in (direction, "rxtx") or entry.storage is None:
            raise SdoAbort(ABORT_NOT_MAPPABLE)
        if entry.size * 8 != bits:
            raise SdoAbort(ABORT_PDO_LENGTH)
        found.append(entry)
    if max_bytes is not None and total > max_bytes * 8:
        raise SdoAbort(ABORT_PDO_LENGTH)
    return found


def _layout(parts: Sequence[Entry | int]) -> struct.Struct:
    fields = (f"{p}x" if isinstance(p, int) else _FORMAT[p.parameter.type] for p in parts)
    return struct.Struct("<" + "".join(fields))


class InputImage:
    """Drive to master. Built once per mapping; ``pack`` is called every cycle."""

    def __init__(self, parts: Sequence[Entry | int]) -> None:
        self._struct = _layout(parts)
        self.size = self._struct.size
        self._entries = [part for part in parts if isinstance(part, Entry)]

    def pack(self) -> bytes:
        """Return the present values."""
        # The getters are looked up on every call: a restart of the firmware replaces them.
        values = [
            entry.value if entry.getter is None else entry.getter() for entry in self._entries
        ]
        try:
            return self._struct.pack(*values)
        except struct.error:  # a value beyond its type wraps around as a counter does
            return self._struct.pack(*[entry.current() for entry in self._entries])

    def unpack(self, data: bytes) -> None:  # noqa: ARG002 - the seam's signature
        """Refuse the access: inputs cannot be written."""
        raise SdoAbort(ABORT_NOT_MAPPABLE)


class OutputImage:
    """Master to drive. Values out of range are limited, as a drive does with process data."""

    def __init__(
        self, parts: Sequence[Entry | int], od: ObjectDictionary, arrived: Callable[[], None]
    ) -> None:
        self._struct = _layout(parts)
        self.size = self._struct.size
        self._entries = [part for part in parts if isinstance(part, Entry)]
        places = [
            _Place(place, entry, *_limits(entry)) for place, entry in enumerate(self._entries)
        ]
        self._places = sorted(places, key=lambda each: _ORDER.get(each.entry.key, 0))
        self._od = od
        self._arrived = arrived
        self._last: bytes | None = None
        self._writes = -1

    def pack(self) -> bytes:
        """Return the outputs as in the dictionary."""
        return self._struct.pack(*[entry.current() for entry in self._entries])

    def unpack(self, data: bytes) -> None:
        """Apply one cycle's outputs; setpoints first, the control word last."""
        # Process data override what another access wrote in between.
        if data != self._last or self._writes != self._od.writes:
            self._last, self._writes = data, self._od.writes
            self._take(self._struct.unpack(data))
        self._arrived()

    def _take(self, values: tuple[Number, ...]) -> None:
        changed = []
        for place, entry, low, high in self._places:
            value = values[place]
            if value < low:
                value = low
            elif value > high:
                value = high
            before = entry.value
            if value != before:
                changed.append((entry, value, before))
        for entry, value, _ in changed:
            entry.value = entry.active = value
        for entry, value, before in changed:
            if entry.setter is None:
                continue
            try:
                entry.setter(value)
            except SdoAbort:
                # Nothing is reported: a refused value has no effect.
                entry.value = entry.active = before


#: The mode must act before the control word, and both after the setpoints of the same cycle.
_ORDER = {"6060:00": 1, "6040:00": 2}


class _Place(NamedTuple):
    """Where an output lies among the values of a cycle, and its limits, found once."""

    place: int
    entry: Entry
    low: Number
    high: Number


def _limits(entry: Entry) -> tuple[Number, Number]:
    low, high = entry.parameter.raw_limits
    return (-math.inf if low is None else low, math.inf if high is None else high)
