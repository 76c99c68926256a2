"""The object dictionary for CoE: the network's objects, then the drive's own objects.

The slave holds what only the network state determines (ETG.1000.6 clause 5.6.7, ETG.1020): sync
manager types 1C00h, PDO assignment 1C12h/1C13h, PDO mapping 16xxh/1Axxh (writable in Pre-Op only,
004:1131-1145) and synchronisation 1C32h/1C33h. All other objects are the drive's.
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
from drivers.virtual.wires.ethercat.controller.registers import AlState
from profiles.schema import DataType, Parameter, PdoPart

ABORT_COUNT_NOT_ZERO = 0x06010003
"""Subindex cannot be written unless subindex 0 is 0 (ETG.1000.6 table 40)."""

_BITS: dict[DataType, int] = {"UINT8": 8, "UINT16": 16, "UINT32": 32}


@dataclass(slots=True)
class SyncReport:
    """Synchronisation values in 1C32h/1C33h; the process data update them."""

    mode: int = 0
    """0 free run, 1 sync manager event, 2 SYNC0, 3 SYNC1 (ETG.1020 table 59)."""
    cycle_ns: int = 0
    missed: int = 0
    """SYNC0 events without new outputs, since Op."""


class NetworkObject:
    """One list object: subindex 0 is the count, the others are unsigned numbers of one type.

    If the drive's own dictionary has the object, the values are stored there, so that the drive's
    save and restore include them; otherwise they are stored here.
    """

    def __init__(
        self, device: Device, index: int, name: str, kind: DataType, defaults: Sequence[int]
    ) -> None:
        self.name = name
        self.kind: DataType = kind
        self._index = index
        self._values = [sum(1 for v in defaults if v), *defaults]
        self._device = device if index in device.indices() else None
        self.count_type: DataType = "UINT8"
        self.slots = len(defaults)
        if self._device is not None:
            self.count_type = device.entry(index, 0).type
            self.slots = max(device.subindices(index))

    def type_of(self, subindex: int) -> DataType:
        """Return the type of an entry. Raises SdoAbort if it does not exist."""
        if subindex > self.slots:
            raise SdoAbort(ABORT_NO_SUBINDEX)
        return self.kind if subindex else self.count_type

    def get(self, subindex: int) -> int:
        """Return the value of an entry."""
        if self._device is not None:
            return int.from_bytes(self._device.read(self._index, subindex), "little")
        return self._values[subindex]

    def put(self, subindex: int, value: int) -> None:
        """Store a checked value; the drive may still refuse it."""
        if self._device is not None:
            size = _BITS[self.type_of(subindex)] // 8
            self._device.write(self._index, subindex, value.to_bytes(size, "little"))
        else:
            self._values[subindex] = value

    def active(self) -> tuple[int, ...]:
        """Return the values within the count."""
        return tuple(self.get(n) for n in range(1, min(self.get(0), self.slots) + 1))


class CoeDictionary:
    """Reads, writes and descriptions; every refusal is an `SdoAbort`."""

    def __init__(
        self, device: Device, state: Callable[[], AlState], report: SyncReport, has_dc: bool
    ) -> None:
        self._device = device
        self._state = state
        self._report = report
        self._has_dc = has_dc
        pdo = device.profile.pdo
        sets = pdo.sets if pdo else ()
        self._fixed = {s.index for s in sets if s.fixed or not (pdo and pdo.remappable)}
        self._max_bytes = pdo.max_bytes if pdo else None
        self._objects: dict[int, NetworkObject] = {}
        self.reset()

    def reset(self) -> None:
        """Set values that the drive does not store to the profile's defaults."""
        device = self._device
        pdo = device.profile.pdo
        objects = {0x1C00: NetworkObject(device, 0x1C00, _SM_TYPES, "UINT8", (1, 2, 3, 4))}
        for pdo_set in pdo.sets if pdo else ():
            words = [self._part_word(part) for part in pdo_set.layout] or [
                self.mapping_word(key) for key in pdo_set.entries
            ]
            words += [0] * ((pdo.max_entries if pdo else 0) - len(words))
            name = ("RxPDO" if pdo_set.direction == "rx" else "TxPDO") + " mapping"
            objects[pdo_set.index] = NetworkObject(device, pdo_set.index, name, "UINT32", words)
        for index, direction in (0x1C12, "rx"), (0x1C13, "tx"):
            if pdo is not None:
                default = pdo.default_rx if direction == "rx" else pdo.default_tx
                others = sum(1 for s in pdo.sets if s.direction == direction) - 1
                name = f"PDO assignment of sync manager {index & 0xF}"
                values = [default] + [0] * others
                objects[index] = NetworkObject(device, index, name, "UINT16", values)
        self._objects = objects

    def mapping_word(self, key: str) -> int:
        """Return the 32-bit mapping entry of a profile key."""
        index, subindex = int(key[:4], 16), int(key[5:], 16)
        return index << 16 | subindex << 8 | self._device.entry(index, subindex).bit_length

    def _part_word(self, part: PdoPart) -> int:
        """Return the mapping entry of a part; padding has index 0 (ETG.2000 clause 6.10)."""
        return part.bits if part.key is None else self.mapping_word(part.key) & ~0xFF | part.bits

    def mapping(self, pdo_index: int) -> tuple[int, ...]:
        """Return the active entries of one mapping object."""
        found = self._objects.get(pdo_index)
        return found.active() if found else ()

    def assigned(self, direction: str) -> tuple[int, ...]:
        """Return all mapping entries of the PDOs assigned in one direction."""
        found = self._objects.get(0x1C12 if direction == "rx" else 0x1C13)
        pdos = found.active() if found else ()
        return tuple(entry for pdo in pdos for entry in self.mapping(pdo))

    def assigned_pdos(self, direction: str) -> tuple[int, ...]:
        """Return the indices of the PDOs assigned in one direction."""
        found = self._objects.get(0x1C12 if direction == "rx" else 0x1C13)
        return found.active() if found else ()

    # -- access by the CoE server ----------------------------------------------------------------

    def indices(self) -> list[int]:
        """Return the indices of all objects, ascending."""
        own = set(self._objects) | (set() if not self._has_sync() else {0x1C32, 0x1C33})
        return sorted(own | set(self._device.indices()))

    def subindices(self, index: int) -> list[int]:
        """Return all subindices of one object, ascending."""
        if (found := self._objects.get(index)) is not None:
            return list(range(found.slots + 1))
        if index in (0x1C32, 0x1C33) and self._has_sync():
            return [0, *_SYNC_ENTRIES]
        return sorted(self._device.subindices(index))

    def is_list(self, index: int) -> bool:
        """Whether complete access uses the object's own subindex 0 as its length."""
        return index in self._objects

    def object_name(self, index: int) -> str:
        """Return the name of the object: that of its first entry."""
        if (found := self._objects.get(index)) is not None:
            return found.name
        return self.entry(index, self.subindices(index)[0]).name

    def parameter(self, index: int, subindex: int) -> Parameter | None:
        """Return the profile's data of a drive entry; None for network objects."""
        if index in self._objects:
            return None
        return self._device.profile.by_key.get(f"{index:04X}:{subindex:02X}")

    def entry(self, index: int, subindex: int) -> EntryInfo:
        """Return the description of one entry."""
        if (found := self._objects.get(index)) is not None:
            kind = found.type_of(subindex)
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
        """Return the value of one entry."""
        if (found := self._objects.get(index)) is not None:
            size = _BITS[found.type_of(subindex)] // 8
            return found.get(subindex).to_bytes(size, "little")
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
        }
        return values.get(subindex, 0)

    def _write_list(self, index: int, subindex: int, data: bytes) -> None:
        found = self._objects[index]
        if index == 0x1C00 or index in self._fixed:
            raise SdoAbort(ABORT_READ_ONLY)
        size = _BITS[found.type_of(subindex)] // 8
        if self._state() != AlState.PREOP:
            raise SdoAbort(ABORT_DEVICE_STATE)
        if len(data) > size:
            raise SdoAbort(ABORT_TOO_LONG)
        # A count listed as UINT16 (004:1437) is also accepted in the standard's 8 bits.
        if len(data) < size and subindex:
            raise SdoAbort(ABORT_TOO_SHORT)
        value = int.from_bytes(data, "little")
        if not subindex:
            self._write_count(index, found, value)
            return
        if found.get(0):
            raise SdoAbort(ABORT_COUNT_NOT_ZERO)
        if value:
            self._check_entry(index, value)
        found.put(subindex, value)

    def _check_entry(self, index: int, value: int) -> None:
        if index in (0x1C12, 0x1C13):
            low = 0x1600 if index == 0x1C12 else 0x1A00
            if value not in self._objects or not low <= value < low + 0x200:
                raise SdoAbort(ABORT_VALUE_RANGE)
            return
        self._device.map_process_data([value], "rx" if index < 0x1800 else "tx")

    def _write_count(self, index: int, found: NetworkObject, count: int) -> None:
        if count > found.slots:
            raise SdoAbort(ABORT_PDO_LENGTH)
        if not all(found.get(n) for n in range(1, count + 1)):
            raise SdoAbort(ABORT_NOT_MAPPABLE)
        before = found.get(0)
        found.put(0, count)
        direction = "rx" if index == 0x1C12 or 0x1600 <= index < 0x1800 else "tx"
        bits = sum(entry & 0xFF for entry in self.assigned(direction))
        if self._max_bytes is not None and bits > self._max_bytes * 8:
            found.put(0, before)
            raise SdoAbort(ABORT_PDO_LENGTH)


_SM_TYPES = "Sync manager communication types"

_SYNC_ENTRIES: dict[int, tuple[str, DataType]] = {
    1: ("Synchronisation type", "UINT16"),
    2: ("Cycle time", "UINT32"),
    4: ("Synchronisation types supported", "UINT16"),
    5: ("Minimum cycle time", "UINT32"),
    0x0B: ("SM event missed counter", "UINT16"),
}
