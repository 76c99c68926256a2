"""A drive that is only a dictionary, and a first-order velocity that follows its target.

It obeys the Device protocol and nothing else: the wire must work with any such drive.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from drivers.virtual.device import (
    ABORT_NO_OBJECT,
    ABORT_NO_SUBINDEX,
    ABORT_NOT_MAPPABLE,
    ABORT_READ_ONLY,
    ABORT_TOO_LONG,
    ABORT_TOO_SHORT,
    ABORT_WRITE_ONLY,
    EntryInfo,
    SdoAbort,
)
from drivers.virtual.mechanics.spec import MechanicsSpec
from profiles.schema import (
    DataType,
    Identity,
    LinkSpec,
    Parameter,
    PdoMapping,
    PdoSet,
    PdoSpec,
    Profile,
    UnitSpec,
    Watchdog,
)

_BITS: dict[DataType, int] = {
    "BOOL": 8, "INT8": 8, "UINT8": 8, "INT16": 16, "UINT16": 16, "INT32": 32, "UINT32": 32,
    "STRING": 160, "OCTETS": 8 * 1500,
}  # fmt: skip


def _parameter(
    key: str, kind: DataType, access: str = "rw", pdo: PdoMapping = "none", default: int | str = 0
) -> Parameter:
    return Parameter.model_validate(
        {
            "key": key, "name": f"Object {key}", "group": "test", "type": kind, "access": access,
            "pdo": pdo, "default_raw": default, "source": "test",
        }
    )  # fmt: skip


def make_profile(
    *,
    dc: bool = True,
    complete_access: bool = True,
    foe: bool = False,
    remappable: bool = True,
    cycle_min_us: int | None = None,
    interpolates: bool = False,
) -> Profile:
    """A small drive with the process data of MMS7's default set (004:1085, 004:1116-1119)."""
    pdo = PdoSpec(
        sets=(
            PdoSet(index=0x1600, direction="rx", entries=("6040:00", "6060:00", "607A:00"),
                   source="test"),
            PdoSet(index=0x1603, direction="rx", entries=("6040:00", "607A:00"), source="test"),
            PdoSet(index=0x1A00, direction="tx", entries=("603F:00", "6041:00", "6061:00",
                   "6064:00"), source="test"),
            PdoSet(index=0x1A03, direction="tx", entries=("603F:00", "6041:00", "6064:00"),
                   source="test"),
        ),
        default_rx=0x1603, default_tx=0x1A03, max_entries=12, max_bytes=32,
        remappable=remappable, cycle_min_us=cycle_min_us,
        sync_modes=("SM", "DC") if dc else ("SM",), source="test",
    )  # fmt: skip
    return Profile(
        drive="test_drive",
        title="Dictionary drive",
        manual="000",
        identity=Identity(
            maker="Testers", model="DICT-1", vendor_id=0x0000ABCD, product_code=0x1234,
            revision=0x00010002,
        ),
        links=(
            LinkSpec(
                kind="ethercat", watchdog=Watchdog(present=True),
                complete_access=complete_access, foe=foe, source="test",
            ),
        ),
        units=UnitSpec(),
        supported_modes=(8,),
        parameters=(
            _parameter("1000:00", "UINT32", "ro", default=0x00020192),
            _parameter("1008:00", "STRING", "ro", default="DICT-1 drive"),
            _parameter("1018:00", "UINT8", "ro", default=4),
            _parameter("1018:01", "UINT32", "ro", default=0x0000ABCD),
            _parameter("1018:02", "UINT32", "ro", default=0x1234),
            _parameter("1018:03", "UINT32", "ro", default=0x00010002),
            _parameter("1018:04", "UINT32", "ro", default=77),
            _parameter("2001:00", "UINT8", "ro", default=3),
            _parameter("2001:01", "UINT16", default=0x1122),
            _parameter("2001:02", "UINT8", default=0x33),
            _parameter("2001:03", "UINT32", default=0x44556677),
            _parameter("2002:00", "OCTETS"),
            _parameter("2003:00", "UINT16", "wo"),
            _parameter("603F:00", "UINT16", "ro", "tx"),
            _parameter("6040:00", "UINT16", "rw", "rx"),
            _parameter("6041:00", "UINT16", "ro", "tx", default=0x0250),
            _parameter("6060:00", "INT8", "rw", "rx"),
            _parameter("6061:00", "INT8", "ro", "tx"),
            _parameter("6064:00", "INT32", "ro", "tx"),
            _parameter("607A:00", "INT32", "rw", "rx"),
            *((_parameter("60C2:01", "UINT8"), _parameter("60C2:02", "INT8"))
              if interpolates else ()),
        ),
        pdo=pdo,
    )  # fmt: skip


class _Image:
    def __init__(self, device: DictionaryDevice, entries: Sequence[int]) -> None:
        self._device = device
        self._fields = [((e >> 16, e >> 8 & 0xFF), (e & 0xFF) // 8) for e in entries]
        self.size = sum(size for _, size in self._fields)

    def pack(self) -> bytes:
        return b"".join(self._device.values[key][:size] for key, size in self._fields)

    def unpack(self, data: bytes) -> None:
        at = 0
        self._device.unpacked.append((self._device.time_ns, bytes(data)))
        for key, size in self._fields:
            self._device.values[key] = data[at : at + size]
            at += size


class DictionaryDevice:
    """See the module docstring. 6064h copies 607Ah one advance later."""

    def __init__(self, profile: Profile | None = None) -> None:
        self.profile = profile or make_profile()
        self.powered = True
        self.time_ns = 0
        self.advances: list[int] = []
        self.unpacked: list[tuple[int, bytes]] = []
        self.lost: list[str] = []
        self.injected: list[tuple[str, float]] = []
        self.power_cycles: list[float] = []
        self.emergencies: list[tuple[int, int, bytes]] = []
        self._on_again_ns = 0
        self.values = self._defaults()

    def _defaults(self) -> dict[tuple[int, int], bytes]:
        values: dict[tuple[int, int], bytes] = {}
        for p in self.profile.parameters:
            assert p.index is not None
            assert p.subindex is not None
            raw = p.default_raw
            if isinstance(raw, str):
                value = raw.encode()
            elif p.type == "OCTETS":
                value = b""
            else:
                value = int(raw or 0).to_bytes(_BITS[p.type] // 8, "little")
            values[p.index, p.subindex] = value
        return values

    def _find(self, index: int, subindex: int) -> Parameter:
        if index not in self.indices():
            raise SdoAbort(ABORT_NO_OBJECT)
        found = self.profile.by_key.get(f"{index:04X}:{subindex:02X}")
        if found is None:
            raise SdoAbort(ABORT_NO_SUBINDEX)
        return found

    def advance(self, t_ns: int) -> None:
        if t_ns > self.time_ns:
            self.time_ns = t_ns
            if not self.powered and t_ns >= self._on_again_ns:
                self._start_up()
            self.advances.append(t_ns)
            self.values[0x6064, 0] = self.values[0x607A, 0]

    def read(self, index: int, subindex: int) -> bytes:
        if self._find(index, subindex).access == "wo":
            raise SdoAbort(ABORT_WRITE_ONLY)
        return self.values[index, subindex]

    def write(self, index: int, subindex: int, data: bytes) -> None:
        found = self._find(index, subindex)
        if found.access == "ro":
            raise SdoAbort(ABORT_READ_ONLY)
        size = _BITS[found.type] // 8
        if found.type not in ("STRING", "OCTETS"):
            if len(data) > size:
                raise SdoAbort(ABORT_TOO_LONG)
            if len(data) < size:
                raise SdoAbort(ABORT_TOO_SHORT)
        self.values[index, subindex] = bytes(data)

    def read_register(self, register: int, count: int) -> list[int]:
        raise SdoAbort(ABORT_NO_OBJECT)

    def write_registers(self, register: int, values: Sequence[int]) -> None:
        raise SdoAbort(ABORT_NO_OBJECT)

    def indices(self) -> Sequence[int]:
        return sorted({p.index for p in self.profile.parameters if p.index is not None})

    def subindices(self, index: int) -> Sequence[int]:
        found = sorted(p.subindex or 0 for p in self.profile.parameters if p.index == index)
        if not found:
            raise SdoAbort(ABORT_NO_OBJECT)
        return found

    def entry(self, index: int, subindex: int) -> EntryInfo:
        p = self._find(index, subindex)
        return EntryInfo(
            p.name,
            p.type,
            _BITS[p.type],
            p.access != "wo",
            p.access != "ro",
            "r" in p.pdo,
            p.pdo in ("tx", "rxtx"),
        )

    def map_process_data(self, entries: Sequence[int], direction: str) -> _Image:
        for word in entries:
            p = self._find(word >> 16, word >> 8 & 0xFF)
            if p.pdo not in (direction, "rxtx") or _BITS[p.type] != word & 0xFF:
                raise SdoAbort(ABORT_NOT_MAPPABLE)
        return _Image(self, entries)

    def communication_lost(self, reason: str) -> None:
        self.lost.append(reason)

    def take_emergencies(self) -> list[tuple[int, int, bytes]]:
        taken, self.emergencies = self.emergencies, []
        return taken

    def power_cycle(self, off_s: float = 0.0) -> None:
        self.power_cycles.append(off_s)
        self.powered = False
        self._on_again_ns = self.time_ns + round(off_s * 1e9)
        if off_s == 0:
            self._start_up()

    def _start_up(self) -> None:
        self.powered = True
        kept = self.values.get((0x2002, 0), b"")
        self.values = self._defaults()
        self.values[0x2002, 0] = kept

    def inject(self, what: str, value: float = 1.0) -> None:
        self.injected.append((what, value))
        if what == "emergency":
            self.emergencies.append((int(value), 0x01, b"\x01\x02\x03\x04\x05"))
        else:
            raise ValueError(f"this drive has no trouble named {what!r}")


def make_device(
    drive: str, mechanics: MechanicsSpec, nvm: Path | None = None, station: int = 1
) -> DictionaryDevice:
    """Factory for the command line; the drive "firmware" takes files."""
    return DictionaryDevice(make_profile(foe=drive == "firmware"))
