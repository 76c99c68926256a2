"""Communication objects (1005h … 1A03h) and PDOs of a virtual CANopen node.

Source: CiA 301 v4.2.0 clause 7.5.2.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Literal

from drivers.canopen.frames import RPDO, TPDO
from drivers.virtual.device import (
    ABORT_DEVICE_STATE,
    ABORT_LENGTH,
    ABORT_NO_SUBINDEX,
    ABORT_PDO_LENGTH,
    ABORT_READ_ONLY,
    ABORT_VALUE_RANGE,
    Device,
    ProcessImage,
    SdoAbort,
)

INVALID = 0x80000000
_IDENTIFIER = 0x7FF
_NO_REMOTE = 0x40000000
_GENERATES_SYNC = 0x40000000
_EXTENDED = 0x20000000
#: COB-IDs reserved for other services (CiA 301 table 40).
_RESTRICTED = (
    range(0x001), range(0x001, 0x080), range(0x101, 0x181), range(0x581, 0x600),
    range(0x601, 0x680), range(0x6E0, 0x700), range(0x701, 0x780), range(0x780, 0x800),
)  # fmt: skip
_ENTRIES = 8


@dataclass(slots=True)
class Pdo:
    """One PDO as its communication and mapping objects describe it."""

    direction: Literal["rx", "tx"]
    number: int
    cob_id: int
    kind: int
    entries: list[int]
    count: int
    inhibit_100us: int = 0
    event_ms: int = 0
    image: ProcessImage | None = None
    contents_fixed: bool = False
    identifier_fixed: bool = False

    @property
    def valid(self) -> bool:
        """Whether the PDO is exchanged (valid bit of the COB-ID)."""
        return not self.cob_id & INVALID

    @property
    def answers_remote(self) -> bool:
        """Whether a remote frame with its COB-ID is answered (bit 30 of the COB-ID is 0)."""
        return not self.cob_id & _NO_REMOTE

    @property
    def identifier(self) -> int:
        """The CAN identifier."""
        return self.cob_id & _IDENTIFIER


class CommunicationObjects:
    """Read and write access to the communication objects, which the drive does not have."""

    def __init__(self, device: Device, node_id: int) -> None:
        self._device = device
        self._node_id = node_id
        link = device.profile.link("canopen")
        self.offers_consumer = link is None or link.watchdog.present
        """Families whose manual describes no watchdog have no heartbeat consumer either (DS_C)."""
        self.heartbeat_ms = 0
        self._heartbeat_changed = False
        self.consumer = 0
        self.sync_cob = 0x80
        self.pdos: list[Pdo] = []
        self.reset()

    def reset(self) -> None:
        """Set the power-on values."""
        self.heartbeat_ms = 0
        self.consumer = 0
        self.sync_cob = 0x80
        self.pdos = [self._default("rx", n) for n in range(4)]
        self.pdos += [self._default("tx", n) for n in range(4)]

    def _default(self, direction: Literal["rx", "tx"], number: int) -> Pdo:
        base = (RPDO if direction == "rx" else TPDO)[number] + self._node_id
        index = (0x1600 if direction == "rx" else 0x1A00) + number
        spec = self._device.profile.pdo
        sets = [s for s in (spec.sets if spec else ()) if s.index == index]
        entries = [
            part.bits if part.key is None else self._entry(part.key)
            for each in sets
            for part in each.layout
        ] or [self._entry(key) for each in sets for key in each.entries]
        identifier = sets[0].identifier if sets else None
        if identifier is not None:
            base = identifier.at(self._node_id)
        cob_id = base if entries else base | INVALID
        padded = (entries + [0] * _ENTRIES)[:_ENTRIES]
        pdo = Pdo(direction, number, cob_id, 255, padded, len(entries))
        pdo.contents_fixed = bool(sets) and sets[0].fixed
        pdo.identifier_fixed = identifier is not None and identifier.fixed
        return pdo

    def _entry(self, key: str) -> int:
        index, subindex = int(key[:4], 16), int(key[5:], 16)
        bits = self._device.entry(index, subindex).bit_length
        return index << 16 | subindex << 8 | bits

    def owns(self, index: int) -> bool:
        """Whether ``index`` is served here and not by the drive."""
        if index == 0x1016:
            return self.offers_consumer
        return index in (0x1005, 0x1014, 0x1017, 0x1200) or (
            index & 0xFFFC in (0x1400, 0x1600, 0x1800, 0x1A00)
        )

    def read(self, index: int, subindex: int) -> bytes:
        """Return the value of an object. Raises SdoAbort."""
        plain = {
            (0x1005, 0): struct.pack("<I", self.sync_cob),
            (0x1014, 0): struct.pack("<I", 0x80 + self._node_id),
            (0x1016, 0): b"\x01",
            (0x1016, 1): struct.pack("<I", self.consumer),
            (0x1017, 0): struct.pack("<H", self.heartbeat_ms),
            (0x1200, 0): b"\x02",
            (0x1200, 1): struct.pack("<I", 0x600 + self._node_id),
            (0x1200, 2): struct.pack("<I", 0x580 + self._node_id),
        }
        if (index, subindex) in plain:
            return plain[index, subindex]
        if index < 0x1400:
            raise SdoAbort(ABORT_NO_SUBINDEX)
        pdo = self._pdo(index)
        return self._read_mapping(pdo, subindex) if index & 0x200 else _read_pdo(pdo, subindex)

    def take_heartbeat_change(self) -> bool:
        """Return whether 1017h was written since the last call."""
        changed, self._heartbeat_changed = self._heartbeat_changed, False
        return changed

    def _read_mapping(self, pdo: Pdo, subindex: int) -> bytes:
        if subindex == 0:
            return bytes([pdo.count])
        if subindex > _ENTRIES:
            raise SdoAbort(ABORT_NO_SUBINDEX)
        return struct.pack("<I", pdo.entries[subindex - 1])

    def write(self, index: int, subindex: int, data: bytes) -> None:
        """Write an object. Raises SdoAbort; nothing is changed then."""
        if (index, subindex) == (0x1017, 0):
            self.heartbeat_ms = _number(data, 2)
            self._heartbeat_changed = True
        elif (index, subindex) == (0x1016, 1):
            self.consumer = _number(data, 4)
        elif (index, subindex) == (0x1005, 0):
            self.sync_cob = _sync_identifier(_number(data, 4))
        elif index < 0x1400:
            self.read(index, subindex)
            raise SdoAbort(ABORT_READ_ONLY)
        elif index & 0x200:
            self._write_mapping(self._pdo(index), subindex, data)
        else:
            self._write_pdo(self._pdo(index), subindex, data)

    def _pdo(self, index: int) -> Pdo:
        return self.pdos[(index & 3) + (4 if index & 0x0800 else 0)]

    def _write_pdo(self, pdo: Pdo, subindex: int, data: bytes) -> None:
        if subindex == 1:
            if pdo.identifier_fixed:
                raise SdoAbort(ABORT_READ_ONLY)
            cob_id = _number(data, 4)
            if pdo.valid and not cob_id & INVALID and cob_id & _IDENTIFIER != pdo.identifier:
                raise SdoAbort(ABORT_VALUE_RANGE)
            if not cob_id & INVALID:
                _check_identifier(cob_id)
            pdo.cob_id = cob_id
        elif subindex == 2:
            kind = _number(data, 1)
            if 241 <= kind <= 251 or (pdo.direction == "rx" and kind in (252, 253)):
                raise SdoAbort(ABORT_VALUE_RANGE)
            pdo.kind = kind
        elif subindex == 3 and pdo.direction == "tx":
            inhibit_100us = _number(data, 2)
            if pdo.valid:
                # CiA 301 clause 7.5.2.37: cannot be changed while the PDO is valid.
                raise SdoAbort(ABORT_DEVICE_STATE)
            pdo.inhibit_100us = inhibit_100us
        elif subindex == 5:
            pdo.event_ms = _number(data, 2)
        else:
            _read_pdo(pdo, subindex)
            raise SdoAbort(ABORT_READ_ONLY)

    def _write_mapping(self, pdo: Pdo, subindex: int, data: bytes) -> None:
        if subindex > _ENTRIES:
            raise SdoAbort(ABORT_NO_SUBINDEX)
        if pdo.contents_fixed:
            raise SdoAbort(ABORT_READ_ONLY)
        if pdo.valid:
            raise SdoAbort(ABORT_DEVICE_STATE)
        if subindex == 0:
            count = _number(data, 1)
            if count > _ENTRIES:
                raise SdoAbort(ABORT_PDO_LENGTH)
            entries = pdo.entries[:count]
            image = self._device.map_process_data(entries, pdo.direction) if count else None
            if image is not None and image.size > 8:
                raise SdoAbort(ABORT_PDO_LENGTH)
            pdo.count, pdo.image = count, image
            return
        if pdo.count:
            raise SdoAbort(ABORT_DEVICE_STATE)
        entry = _number(data, 4)
        if entry:
            self._device.map_process_data([entry], pdo.direction)
        pdo.entries[subindex - 1] = entry

    def bind(self) -> None:
        """Bind every valid PDO to the drive's values (on entering Operational)."""
        for pdo in self.pdos:
            if pdo.count and pdo.image is None:
                pdo.image = self._device.map_process_data(pdo.entries[: pdo.count], pdo.direction)


def _read_pdo(pdo: Pdo, subindex: int) -> bytes:
    values = {
        0: b"\x05",
        1: struct.pack("<I", pdo.cob_id),
        2: bytes([pdo.kind]),
        3: struct.pack("<H", pdo.inhibit_100us),
        5: struct.pack("<H", pdo.event_ms),
    }
    if subindex not in values:
        raise SdoAbort(ABORT_NO_SUBINDEX)
    return values[subindex]


def _check_identifier(cob_id: int) -> None:
    """Refuse COB-IDs of other services and 29-bit identifiers, which are not supported."""
    if cob_id & _EXTENDED or any(cob_id & _IDENTIFIER in taken for taken in _RESTRICTED):
        raise SdoAbort(ABORT_VALUE_RANGE)


def _sync_identifier(cob_id: int) -> int:
    """Check 1005h: this node consumes SYNC and cannot produce it (CiA 301 clause 7.5.2.5)."""
    if cob_id & _GENERATES_SYNC:
        raise SdoAbort(ABORT_VALUE_RANGE)
    _check_identifier(cob_id)
    return cob_id


def _number(data: bytes, size: int) -> int:
    if len(data) != size:
        raise SdoAbort(ABORT_LENGTH)
    return int.from_bytes(data, "little")
