"""The object dictionary as CoE shows it: the drive's own objects under those of the network.

The wire owns what only the network state knows (ETG.1000.6 clause 5.6.7, ETG.1020): sync manager
types 1C00h, PDO assignment 1C12h/1C13h, PDO mapping 16xxh/1Axxh (writable in Pre-Op only,
004:1131-1145) and synchronisation 1C32h/1C33h. Everything else is the drive's.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from drivers.virtual.device import (
    ABORT_DEVICE_STATE,
    ABORT_NO_SUBINDEX,
    ABORT_NOT_MAPPABLE,
    ABORT_PDO_LENGTH,
    ABORT_READ_ONLY,
    ABORT_TOO_LONG,
    ABORT_TOO_SHORT,
    ABORT_VALUE_RANGE,
    Device,
    EntryInfo,
    SdoAbort,
)
from drivers.virtual.wires.ethercat.registers import AlState
from profiles.schema import DataType, Parameter, PdoSet

ABORT_COUNT_NOT_ZERO = 0x06010003
"""Subindex cannot be written, subindex 0 must be 0 for it (ETG.1000.6 table 40)."""

_BITS: dict[DataType, int] = {"UINT8": 8, "UINT16": 16, "UINT32": 32}


@dataclass(slots=True)
class SyncReport:
    """What 1C32h/1C33h tell of the synchronisation; the process data keep it up to date."""

    mode: int = 0
    """0 free run, 1 with the sync manager event, 2 with SYNC0 (ETG.1020 table 59)."""
    cycle_ns: int = 0
    missed: int = 0
    too_short: int = 0


class NetworkObject:
    """One list object: subindex 0 counts, the others hold unsigned numbers of one type."""

    def __init__(
        self, name: str, kind: DataType, values: Sequence[int], count: int, count_type: DataType
    ) -> None:
        self.name = name
        self.kind: DataType = kind
        self.values = list(values)
        self.count = count
        self.count_type: DataType = count_type

    def active(self) -> tuple[int, ...]:
        """Values within the count."""
        return tuple(self.values[: self.count])


class CoeDictionary:
    """Reads, writes and descriptions; every refusal is an `SdoAbort`."""

    def __init__(
        self, device: Device, state: Callable[[], AlState], report: SyncReport, has_dc: bool
    ) -> None:
        self._device = device
        self._state = state
        self._report = report
        self._has_dc = has_dc
        self._objects: dict[int, NetworkObject] = {}
        self.reset()

    def reset(self) -> None:
        """Power-on contents: the profile's default mapping and assignment."""
        pdo = self._device.profile.pdo
        sets = pdo.sets if pdo else ()
        self._fixed = {s.index for s in sets if s.fixed or not (pdo and pdo.remappable)}
        self._max_bytes = pdo.max_bytes if pdo else None
        objects = {0x1C00: NetworkObject("Sync manager type", "UINT8", (1, 2, 3, 4), 4, "UINT8")}
        for pdo_set in sets:
            slots = max(pdo.max_entries if pdo else 0, len(pdo_set.entries))
            words = [self.mapping_word(key) for key in pdo_set.entries]
            name = ("RxPDO" if pdo_set.direction == "rx" else "TxPDO") + " mapping"
            objects[pdo_set.index] = NetworkObject(
                name, "UINT32", words + [0] * (slots - len(words)), len(words), "UINT8"
            )
        if pdo:
            self._add_assignment(objects, 0x1C12, "rx", pdo.default_rx, sets)
            self._add_assignment(objects, 0x1C13, "tx", pdo.default_tx, sets)
        self._objects = objects

    def _add_assignment(
        self,
        objects: dict[int, NetworkObject],
        index: int,
        direction: str,
        default: int,
        sets: Sequence[PdoSet],
    ) -> None:
        count_parameter = self._device.profile.by_key.get(f"{index:04X}:00")
        count_type: DataType = "UINT16" if _is_16_bit(count_parameter) else "UINT8"
        printed = [p for p in self._device.profile.parameters if p.index == index and p.subindex]
        slots = len(printed) or sum(1 for s in sets if s.direction == direction)
        name = (
            "Sync manager 2 PDO assignment"
            if direction == "rx"
            else ("Sync manager 3 PDO assignment")
        )
        values = [default] + [0] * (slots - 1)
        objects[index] = NetworkObject(name, "UINT16", values, 1, count_type)

    def mapping_word(self, key: str) -> int:
        """Profile key to the 32-bit mapping entry."""
        index, subindex = int(key[:4], 16), int(key[5:], 16)
        return index << 16 | subindex << 8 | self._device.entry(index, subindex).bit_length

    @property
    def pdo_indices(self) -> tuple[int, ...]:
        """Indices of all mapping objects."""
        return tuple(i for i in self._objects if 0x1600 <= i < 0x1C00)

    def mapping(self, pdo_index: int) -> tuple[int, ...]:
        """Active entries of one mapping object."""
        found = self._objects.get(pdo_index)
        return found.active() if found else ()

    def assigned(self, direction: str) -> tuple[int, ...]:
        """All mapping entries of the PDOs that are assigned in one direction."""
        found = self._objects.get(0x1C12 if direction == "rx" else 0x1C13)
        pdos = found.active() if found else ()
        return tuple(entry for pdo in pdos for entry in self.mapping(pdo))

    def assigned_pdos(self, direction: str) -> tuple[int, ...]:
        """Indices of the PDOs that are assigned in one direction."""
        found = self._objects.get(0x1C12 if direction == "rx" else 0x1C13)
        return found.active() if found else ()

    # -- what the CoE server asks ---------------------------------------------------------------

    def indices(self) -> list[int]:
        """All objects, ascending."""
        own = set(self._objects) | (set() if not self._has_sync() else {0x1C32, 0x1C33})
        return sorted(own | set(self._device.indices()))

    def subindices(self, index: int) -> list[int]:
        """All subindices of one object, ascending."""
        if (found := self._objects.get(index)) is not None:
            return list(range(len(found.values) + 1))
        if index in (0x1C32, 0x1C33) and self._has_sync():
            return [0, *_SYNC_ENTRIES]
        return sorted(self._device.subindices(index))

    def is_list(self, index: int) -> bool:
        """Objects whose length follows their own subindex 0 in complete access."""
        return index in self._objects

    def object_name(self, index: int) -> str:
        """Name of the whole object: that of its first entry, which stands for it."""
        if (found := self._objects.get(index)) is not None:
            return found.name
        return self.entry(index, self.subindices(index)[0]).name

    def parameter(self, index: int, subindex: int) -> Parameter | None:
        """What the profile prints of an entry of the drive; None for the network's own."""
        if index in self._objects:
            return None
        return self._device.profile.by_key.get(f"{index:04X}:{subindex:02X}")

    def entry(self, index: int, subindex: int) -> EntryInfo:
        """Description of one entry."""
        if (found := self._objects.get(index)) is not None:
            if subindex > len(found.values):
                raise SdoAbort(ABORT_NO_SUBINDEX)
            kind = found.kind if subindex else found.count_type
            writable = index != 0x1C00 and index not in self._fixed
            name = found.name if not subindex else f"Entry {subindex}"
            return EntryInfo(name, kind, _BITS[kind], True, writable, False, False)
        if index in (0x1C32, 0x1C33) and self._has_sync():
            if subindex == 0:
                return EntryInfo("Synchronisation", "UINT8", 8, True, False, False, False)
            if subindex not in _SYNC_ENTRIES:
                raise SdoAbort(ABORT_NO_SUBINDEX)
            name, kind = _SYNC_ENTRIES[subindex]
            return EntryInfo(name, kind, _BITS[kind], True, False, False, False)
        return self._device.entry(index, subindex)

    def read(self, index: int, subindex: int) -> bytes:
        """Value of one entry."""
        if (found := self._objects.get(index)) is not None:
            if subindex > len(found.values):
                raise SdoAbort(ABORT_NO_SUBINDEX)
            kind = found.kind if subindex else found.count_type
            value = found.values[subindex - 1] if subindex else found.count
            return value.to_bytes(_BITS[kind] // 8, "little")
        if index in (0x1C32, 0x1C33) and self._has_sync():
            info = self.entry(index, subindex)
            return self._sync_value(index, subindex).to_bytes(info.bit_length // 8, "little")
        return self._device.read(index, subindex)

    def write(self, index: int, subindex: int, data: bytes) -> None:
        """Write one entry."""
        if index in self._objects:
            self._write_list(index, subindex, data)
        elif index in (0x1C32, 0x1C33) and self._has_sync():
            self.entry(index, subindex)
            raise SdoAbort(ABORT_READ_ONLY)
        else:
            self._device.write(index, subindex, data)

    # -- the network's own objects --------------------------------------------------------------

    def _has_sync(self) -> bool:
        pdo = self._device.profile.pdo
        return bool(pdo and pdo.sync_modes)

    def _sync_value(self, index: int, subindex: int) -> int:
        pdo = self._device.profile.pdo
        minimum_ns = (pdo.cycle_min_us or 0) * 1000 if pdo else 0
        mode = self._report.mode
        values = {
            0: 0x20,
            # 1C33h: 22h is "with the event of sync manager 2" (ETG.1020 table 60).
            1: 0x22 if index == 0x1C33 and mode == 1 else mode,
            2: self._report.cycle_ns,
            4: 0x0002 | (0x0004 if self._has_dc else 0),
            5: minimum_ns,
            0x0B: self._report.missed & 0xFFFF,
            0x0C: self._report.too_short & 0xFFFF,
        }
        return values.get(subindex, 0)

    def _write_list(self, index: int, subindex: int, data: bytes) -> None:
        found = self._objects[index]
        if index == 0x1C00 or index in self._fixed:
            raise SdoAbort(ABORT_READ_ONLY)
        if subindex > len(found.values):
            raise SdoAbort(ABORT_NO_SUBINDEX)
        if self._state() != AlState.PREOP:
            raise SdoAbort(ABORT_DEVICE_STATE)
        size = _BITS[found.kind if subindex else found.count_type] // 8
        if len(data) > size:
            raise SdoAbort(ABORT_TOO_LONG)
        if len(data) < size and subindex:
            raise SdoAbort(ABORT_TOO_SHORT)
        value = int.from_bytes(data, "little")
        if not subindex:
            self._write_count(index, found, value)
        elif found.count:
            raise SdoAbort(ABORT_COUNT_NOT_ZERO)
        else:
            if value:
                self._check_entry(index, value)
            found.values[subindex - 1] = value

    def _check_entry(self, index: int, value: int) -> None:
        if index in (0x1C12, 0x1C13):
            low = 0x1600 if index == 0x1C12 else 0x1A00
            if value not in self._objects or not low <= value < low + 0x200:
                raise SdoAbort(ABORT_VALUE_RANGE)
            return
        self._device.map_process_data([value], "rx" if index < 0x1800 else "tx")

    def _write_count(self, index: int, found: NetworkObject, count: int) -> None:
        if count > len(found.values):
            raise SdoAbort(ABORT_PDO_LENGTH)
        if not all(found.values[:count]):
            raise SdoAbort(ABORT_NOT_MAPPABLE)
        before, found.count = found.count, count
        direction = "rx" if index == 0x1C12 or 0x1600 <= index < 0x1800 else "tx"
        bits = sum(entry & 0xFF for entry in self.assigned(direction))
        if self._max_bytes is not None and bits > self._max_bytes * 8:
            found.count = before
            raise SdoAbort(ABORT_PDO_LENGTH)


def _is_16_bit(parameter: Parameter | None) -> bool:
    return parameter is not None and parameter.type == "UINT16"


_SYNC_ENTRIES: dict[int, tuple[str, DataType]] = {
    1: ("Synchronisation type", "UINT16"),
    2: ("Cycle time", "UINT32"),
    4: ("Synchronisation types supported", "UINT16"),
    5: ("Minimum cycle time", "UINT32"),
    0x0B: ("SM event missed counter", "UINT16"),
    0x0C: ("Cycle exceeded counter", "UINT16"),
}
