"""Rules for writing process data mappings and assignments (004:2121-2142, ETG.1000.6 5.6.7)."""

from __future__ import annotations

from collections.abc import Callable

from drivers.virtual.device import (
    ABORT_NOT_MAPPABLE,
    ABORT_UNSUPPORTED,
    ABORT_VALUE_RANGE,
    SdoAbort,
)
from drivers.virtual.firmware.objects.dictionary import Entry, ObjectDictionary
from drivers.virtual.firmware.objects.process_data import check_mapping
from profiles.schema import Profile, Raw

Check = Callable[[Raw], None]


class MappingRules:
    """Checks for writes to 1600h–17FFh, 1A00h–1BFFh, 1C12h and 1C13h.

    The wire ensures that these objects change only in Pre-Operational.
    """

    def __init__(self, od: ObjectDictionary, profile: Profile) -> None:
        self._od = od
        self._max_entries = profile.pdo.max_entries if profile.pdo else 8
        self._max_bytes = profile.pdo.max_bytes if profile.pdo else None

    def check_for(self, entry: Entry) -> Check | None:
        """Return the check of this entry, or None if it is not a mapping object."""
        index = entry.parameter.index or 0
        if index in (0x1C12, 0x1C13):
            return self._assignment(index, entry.parameter.subindex or 0)
        if 0x1600 <= index < 0x1C00:
            direction = "rx" if index < 0x1A00 else "tx"
            if entry.parameter.subindex == 0:
                return self._count(index, direction)
            return self._item(index, direction)
        return None

    def _counted(self, index: int) -> int:
        """Return the count in use, before the write that is being checked."""
        entry = self._od.entries.get(index << 8)
        return int(entry.value) if entry is not None else 0

    def _count(self, index: int, direction: str) -> Check:
        def check(count: Raw) -> None:
            number = int(count)
            found = [self._od.entries.get(index << 8 | sub) for sub in range(1, number + 1)]
            mapped = [int(entry.value) for entry in found if entry is not None]
            if number > self._max_entries or len(mapped) != number:
                raise SdoAbort(ABORT_VALUE_RANGE)
            check_mapping(self._od, mapped, direction, self._max_bytes)

        return check

    def _item(self, index: int, direction: str) -> Check:
        def check(item: Raw) -> None:
            if self._counted(index) != 0:
                raise SdoAbort(ABORT_UNSUPPORTED)
            if int(item):
                check_mapping(self._od, [int(item)], direction, None)

        return check

    def _assignment(self, index: int, subindex: int) -> Check:
        first = 0x1600 if index == 0x1C12 else 0x1A00

        def check(value: Raw) -> None:
            number = int(value)
            if subindex == 0:
                if number > max(self._od.subindices(index)):
                    raise SdoAbort(ABORT_VALUE_RANGE)
            elif self._counted(index) != 0:
                raise SdoAbort(ABORT_UNSUPPORTED)
            elif number and not (first <= number < first + 0x200 and number << 8 in self._od):
                raise SdoAbort(ABORT_NOT_MAPPABLE)

        return check
