"""A small device for wire tests: a dictionary of objects, one of registers, no physics."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import cast

from drivers.objects.codec import size_of
from drivers.virtual.device import (
    ABORT_LENGTH,
    ABORT_NO_OBJECT,
    ABORT_NO_SUBINDEX,
    ABORT_READ_ONLY,
    ABORT_TOO_HIGH,
    Device,
    EntryInfo,
    SdoAbort,
)
from drivers.virtual.wires.modbus import ModbusSlave, ObjectRegisters, Registers, TableRegisters
from drivers.virtual.wires.pty import PtyWire, WireTime
from profiles.schema import (
    DataType,
    Identity,
    LinkSpec,
    Parameter,
    Profile,
    UnitSpec,
    Watchdog,
)

#: Types of the few objects used here; sizes as in manual 004.
TYPES: dict[tuple[int, int], DataType] = {
    (0x1018, 0): "UINT8",
    (0x1018, 1): "UINT32",
    (0x1018, 2): "UINT32",
    (0x1018, 3): "UINT32",
    (0x1018, 4): "UINT32",
    (0x2070, 1): "UINT16",
    (0x2070, 2): "UINT16",
    (0x2070, 3): "UINT16",
    (0x2105, 0): "UINT8",
    (0x6040, 0): "UINT16",
    (0x6041, 0): "UINT16",
    (0x6060, 0): "INT8",
    (0x6061, 0): "INT8",
    (0x6064, 0): "INT32",
    (0x607A, 0): "INT32",
    (0x6098, 0): "INT8",
    (0x6099, 0): "UINT8",
    (0x6099, 1): "UINT32",
    (0x6099, 2): "UINT32",
}
READ_ONLY = {(0x6041, 0), (0x6061, 0), (0x6064, 0)}


class ShelfDevice:
    """Objects and registers on a shelf. ``hook`` runs before every access."""

    def __init__(self) -> None:
        self.powered = True
        self.objects = {key: bytes(size_of(t) or 0) for key, t in TYPES.items()}
        self.registers: dict[int, int] = {}
        self.read_only_registers: set[int] = set()
        self.writes: list[tuple[int, int, bytes]] = []
        self.advanced_ns: list[int] = []
        self.hook: Callable[[], None] = lambda: None

    def advance(self, t_ns: int) -> None:
        self.advanced_ns.append(t_ns)

    def read(self, index: int, subindex: int) -> bytes:
        self.hook()
        if index not in {i for i, _ in self.objects}:
            raise SdoAbort(ABORT_NO_OBJECT)
        if (index, subindex) not in self.objects:
            raise SdoAbort(ABORT_NO_SUBINDEX)
        return self.objects[index, subindex]

    def write(self, index: int, subindex: int, data: bytes) -> None:
        old = self.read(index, subindex)
        if (index, subindex) in READ_ONLY:
            raise SdoAbort(ABORT_READ_ONLY)
        if len(old) != len(data):
            raise SdoAbort(ABORT_LENGTH)
        if (index, subindex) == (0x2105, 0) and data[0] > 247:
            raise SdoAbort(ABORT_TOO_HIGH)
        self.writes.append((index, subindex, data))
        self.objects[index, subindex] = data

    def read_register(self, register: int, count: int) -> list[int]:
        self.hook()
        if any(r not in self.registers for r in range(register, register + count)):
            raise SdoAbort(ABORT_NO_OBJECT)
        return [self.registers[r] for r in range(register, register + count)]

    def write_registers(self, register: int, values: Sequence[int]) -> None:
        self.read_register(register, len(values))
        if any(r in self.read_only_registers for r in range(register, register + len(values))):
            raise SdoAbort(ABORT_READ_ONLY)
        self.registers.update(enumerate(values, register))

    def indices(self) -> Sequence[int]:
        return sorted({i for i, _ in self.objects})

    def subindices(self, index: int) -> Sequence[int]:
        return sorted(s for i, s in self.objects if i == index)

    def entry(self, index: int, subindex: int) -> EntryInfo:
        kind = TYPES[index, subindex]
        writable = (index, subindex) not in READ_ONLY
        return EntryInfo("", kind, 8 * (size_of(kind) or 0), True, writable, False, False)


@contextmanager
def serving(
    path: Path,
    devices: dict[int, ShelfDevice],
    *,
    by_table: bool = False,
    wire_time: WireTime | None = None,
    client_baudrate: int | None = None,
) -> Iterator[ModbusSlave]:
    """A slave thread for these devices at ``path``; ended even when the test fails."""
    stations: dict[int, tuple[Device, Registers]] = {}
    for station, shelf in devices.items():
        device = cast("Device", shelf)
        stations[station] = (device, (TableRegisters if by_table else ObjectRegisters)(device))
    slave = ModbusSlave(
        PtyWire(path, wire_time), stations, lock=threading.RLock(), client_baudrate=client_baudrate
    )
    slave.start()
    try:
        yield slave
    finally:
        slave.stop()


def small_profile(
    *parameters: tuple[str, DataType], kind: str = "mlink", **spec: object
) -> Profile:
    link = LinkSpec.model_validate(
        {"kind": kind, "watchdog": Watchdog(present=False), "source": "test", **spec}
    )
    return Profile(
        drive="small",
        title="small",
        manual="000",
        identity=Identity(maker="m", model="m"),
        links=(link,),
        units=UnitSpec(),
        supported_modes=(1,),
        parameters=tuple(
            Parameter(key=key, name=key, group="g", type=kind_, source="000:1")
            for key, kind_ in parameters
        ),
    )
