"""A drive that is only a dictionary: enough to be a CANopen node, no motion."""

from __future__ import annotations

import struct
from collections.abc import Sequence

from drivers.objects.codec import decode, encode, size_of
from drivers.virtual.device import (
    ABORT_LENGTH,
    ABORT_NO_OBJECT,
    ABORT_NO_SUBINDEX,
    ABORT_NOT_MAPPABLE,
    ABORT_READ_ONLY,
    ABORT_VALUE_RANGE,
    EntryInfo,
    SdoAbort,
)
from profiles.schema import (
    DataType,
    Identity,
    LinkSpec,
    Parameter,
    PdoSet,
    PdoSpec,
    Profile,
    UnitSpec,
    Watchdog,
)

_ROWS: list[tuple[str, str, DataType, str, str, int | str]] = [
    ("1008:00", "Device name", "STRING", "ro", "none", "Small drive of many letters"),
    ("2000:00", "Small number", "UINT8", "rw", "none", 7),
    ("2001:00", "Limited number", "INT16", "rw", "none", 0),
    ("6040:00", "Control word", "UINT16", "rw", "rx", 0),
    ("6041:00", "Status word", "UINT16", "ro", "tx", 0x0250),
    ("6060:00", "Mode", "INT8", "rw", "rx", 0),
    ("6061:00", "Mode display", "INT8", "ro", "tx", 0),
    ("6064:00", "Position", "INT32", "ro", "tx", 0),
    ("606C:00", "Speed", "INT32", "ro", "tx", 0),
    ("6071:00", "Target torque", "INT16", "rw", "rx", 0),
    ("607A:00", "Target position", "INT32", "rw", "rx", 0),
    ("60FF:00", "Target speed", "INT32", "rw", "rx", 0),
]


def small_profile() -> Profile:
    """Its profile."""
    return Profile(
        drive="small",
        title="Small drive",
        manual="000",
        identity=Identity(
            maker="Test", model="Small", vendor_id=0x1234, product_code=0x56, revision=3
        ),
        links=(LinkSpec(kind="canopen", watchdog=Watchdog(present=True), source="000:1"),),
        units=UnitSpec(),
        supported_modes=(1, 3),
        parameters=tuple(
            Parameter.model_validate(
                {
                    "key": key, "name": name, "group": "g", "type": kind, "access": access,
                    "pdo": pdo, "default_raw": default, "source": "000:1",
                    **({"min_raw": -100, "max_raw": 100} if key == "2001:00" else {}),
                }
            )
            for key, name, kind, access, pdo, default in _ROWS
        ),
        pdo=PdoSpec(
            sets=(
                PdoSet(index=0x1600, direction="rx", entries=("6040:00",), source="000:1"),
                PdoSet(index=0x1A00, direction="tx", entries=("6041:00",), source="000:1"),
            ),
            default_rx=0x1600,
            default_tx=0x1A00,
            max_entries=8,
            source="000:1",
        ),
    )  # fmt: skip


class SmallImage:
    """Values of mapped entries, packed."""

    def __init__(self, device: SmallDevice, entries: Sequence[int]) -> None:
        self._device = device
        self._entries = [(e >> 16, e >> 8 & 0xFF, (e & 0xFF) // 8) for e in entries]
        self.size = sum(size for *_, size in self._entries)

    def pack(self) -> bytes:
        return b"".join(self._device.read(i, s) for i, s, _ in self._entries)

    def unpack(self, data: bytes) -> None:
        start = 0
        for index, subindex, size in self._entries:
            self._device.write(index, subindex, data[start : start + size])
            start += size


class SmallDevice:
    """Position follows its target at once; speed follows its target at once."""

    def __init__(self, serial: int = 42) -> None:
        self.profile = small_profile()
        self.powered = True
        self.lost: list[str] = []
        self.emergencies: list[tuple[int, int, bytes]] = []
        self.big = bytes(range(256)) * 8
        self.serial = serial
        self.now_ns = 0
        self.coupled = True
        self._values: dict[tuple[int, int], bytes] = {}
        self.power_cycle()

    def advance(self, t_ns: int) -> None:
        self.now_ns = max(self.now_ns, t_ns)

    def power_cycle(self, off_s: float = 0.0) -> None:
        self._values = {
            (p.index or 0, p.subindex or 0): encode(p.type, p.default_raw or 0)
            for p in self.profile.parameters
        }

    def read(self, index: int, subindex: int) -> bytes:
        if (index, subindex) == (0x1018, 4):
            return struct.pack("<I", self.serial)
        if (index, subindex) == (0x1021, 0):
            return self.big
        if (index, subindex) not in self._values:
            known = any(i == index for i, _ in self._values)
            raise SdoAbort(ABORT_NO_SUBINDEX if known else ABORT_NO_OBJECT)
        return self._values[index, subindex]

    def write(self, index: int, subindex: int, data: bytes) -> None:
        if (index, subindex) == (0x1021, 0):
            self.big = data
            return
        self.read(index, subindex)
        parameter = self.profile.by_key[f"{index:04X}:{subindex:02X}"]
        if parameter.access == "ro":
            raise SdoAbort(ABORT_READ_ONLY)
        if len(data) != size_of(parameter.type):
            raise SdoAbort(ABORT_LENGTH)
        low, high = parameter.raw_limits
        value = decode(parameter.type, data)
        if isinstance(value, int) and not (low or 0) <= value <= (high or 0):
            raise SdoAbort(ABORT_VALUE_RANGE)
        self._values[index, subindex] = data
        follower = {0x607A: 0x6064, 0x60FF: 0x606C, 0x6060: 0x6061}.get(index)
        if follower and self.coupled:
            self._values[follower, 0] = data
        if index == 0x6040:
            # CiA 402-2 clause 8.4: the states that these control words lead to.
            status = {0x06: 0x0231, 0x07: 0x0233, 0x0F: 0x0237}.get(data[0] & 0x8F, 0x0250)
            self._values[0x6041, 0] = status.to_bytes(2, "little")

    def turn_by_hand(self, position: int) -> None:
        self.coupled = False
        self._values[0x6064, 0] = position.to_bytes(4, "little", signed=True)

    def value(self, index: int, subindex: int = 0) -> int | float | str:
        parameter = self.profile.by_key[f"{index:04X}:{subindex:02X}"]
        return decode(parameter.type, self._values[index, subindex])

    def read_register(self, register: int, count: int) -> list[int]:
        raise SdoAbort(ABORT_NO_OBJECT)

    def write_registers(self, register: int, values: Sequence[int]) -> None:
        raise SdoAbort(ABORT_NO_OBJECT)

    def indices(self) -> Sequence[int]:
        return sorted({i for i, _ in self._values})

    def subindices(self, index: int) -> Sequence[int]:
        return sorted(s for i, s in self._values if i == index)

    def entry(self, index: int, subindex: int) -> EntryInfo:
        parameter = self.profile.by_key.get(f"{index:04X}:{subindex:02X}")
        if parameter is None:
            raise SdoAbort(ABORT_NO_OBJECT)
        bits = 8 * (size_of(parameter.type) or 0)
        rx, tx = parameter.pdo in ("rx", "rxtx"), parameter.pdo in ("tx", "rxtx")
        return EntryInfo(parameter.name, parameter.type, bits, True, True, rx, tx)

    def map_process_data(self, entries: Sequence[int], direction: str) -> SmallImage:
        for entry in entries:
            info = self.entry(entry >> 16, entry >> 8 & 0xFF)
            if not (info.pdo_rx if direction == "rx" else info.pdo_tx):
                raise SdoAbort(ABORT_NOT_MAPPABLE)
            if info.bit_length != entry & 0xFF:
                raise SdoAbort(ABORT_NOT_MAPPABLE)
        return SmallImage(self, entries)

    def communication_lost(self, reason: str) -> None:
        self.lost.append(reason)

    def take_emergencies(self) -> list[tuple[int, int, bytes]]:
        pending, self.emergencies = self.emergencies, []
        return pending

    def inject(self, what: str, value: float = 1.0) -> None:
        self.emergencies.append((int(what, 16), 1, bytes(5)))
