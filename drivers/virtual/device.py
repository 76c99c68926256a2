"""The interface between a virtual drive's firmware and its wire."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from profiles.schema import DataType, Profile


class SdoAbort(Exception):
    """The firmware refuses an access; ``code`` is the CiA 301 abort code (table 22)."""

    def __init__(self, code: int) -> None:
        super().__init__(f"SDO abort {code:#010x}")
        self.code = code


ABORT_TOGGLE = 0x05030000
ABORT_COMMAND = 0x05040001
ABORT_UNSUPPORTED = 0x06010000
ABORT_WRITE_ONLY = 0x06010001
ABORT_READ_ONLY = 0x06010002
ABORT_NO_OBJECT = 0x06020000
ABORT_NOT_MAPPABLE = 0x06040041
ABORT_PDO_LENGTH = 0x06040042
ABORT_LENGTH = 0x06070010
ABORT_TOO_LONG = 0x06070012
ABORT_TOO_SHORT = 0x06070013
ABORT_NO_SUBINDEX = 0x06090011
ABORT_VALUE_RANGE = 0x06090030
ABORT_TOO_HIGH = 0x06090031
ABORT_TOO_LOW = 0x06090032
ABORT_GENERAL = 0x08000000
ABORT_STORE = 0x08000020
ABORT_LOCAL_CONTROL = 0x08000021
ABORT_DEVICE_STATE = 0x08000022
ABORT_NO_DATA = 0x08000024


@dataclass(frozen=True, slots=True)
class EntryInfo:
    """Description of an entry in the SDO information service (ETG.1000.6 clause 5.6.3)."""

    name: str
    type: DataType
    bit_length: int
    readable: bool
    writable: bool
    pdo_rx: bool
    pdo_tx: bool


class ProcessImage(Protocol):
    """Process data of one direction, bound to a mapping."""

    size: int
    """Size in bytes."""

    def pack(self) -> bytes:
        """Return the values of the mapped objects (inputs, drive to master)."""

    def unpack(self, data: bytes) -> None:
        """Apply the outputs of the master; values out of range are limited as in a drive."""


class Device(Protocol):
    """A virtual drive as its wire accesses it. Not thread-safe: one wire thread calls it.

    Times are nanoseconds on the wire's clock, which may be real or simulated. ``advance`` is called
    before every access; physics and firmware are computed lazily up to that time.
    """

    profile: Profile
    powered: bool

    def advance(self, t_ns: int) -> None:
        """Advance physics and firmware to ``t_ns``; earlier times have no effect."""

    def read(self, index: int, subindex: int) -> bytes:
        """Return the value of an object, little endian. Raises SdoAbort."""

    def write(self, index: int, subindex: int, data: bytes) -> None:
        """Write an object. Raises SdoAbort with nothing changed."""

    def read_register(self, register: int, count: int) -> list[int]:
        """Return Modbus registers of a family with a register table. Raises SdoAbort."""

    def write_registers(self, register: int, values: Sequence[int]) -> None:
        """Write Modbus registers of a family with a register table. Raises SdoAbort."""

    def indices(self) -> Sequence[int]:
        """Return all object indices, ascending."""

    def subindices(self, index: int) -> Sequence[int]:
        """Return all subindices of an object, ascending. Raises SdoAbort."""

    def entry(self, index: int, subindex: int) -> EntryInfo:
        """Return the description of an entry. Raises SdoAbort."""

    def map_process_data(self, entries: Sequence[int], direction: str) -> ProcessImage:
        """Bind mapping entries (32-bit: index << 16 | subindex << 8 | bits) for "rx" or "tx".

        Raises SdoAbort for entries that cannot be mapped.
        """

    def communication_lost(self, reason: str) -> None:
        """React as the family does when the wire's watchdog expired or the network state fell."""

    def take_emergencies(self) -> list[tuple[int, int, bytes]]:
        """Return emergencies since the last call: (error code, error register, 5 bytes)."""

    def power_cycle(self, off_s: float = 0.0) -> None:
        """Switch off (for a time) and on again: volatile values are lost, NVM is kept."""

    def inject(self, what: str, value: float = 1.0) -> None:
        """Cause a failure by name, such as a fault's code or ``encoder_loss``."""


@runtime_checkable
class StartsWithNetwork(Protocol):
    """A device that applies some parameters when its network starts."""

    def network_started(self) -> None:
        """Handle the transition of the EtherCAT state machine from Init to Pre-Operational."""


@runtime_checkable
class HasShaft(Protocol):
    """A device with a motor, whose true shaft angle is available independently of any object."""

    @property
    def shaft_rev(self) -> float:
        """True angle of the motor's shaft in revolutions."""


def shaft_rev(device: Device) -> float:
    """Return the true shaft angle of this device in revolutions.

    Raises:
        ValueError: it has no shaft.
    """
    if not isinstance(device, HasShaft):
        raise ValueError("this device has no shaft")  # noqa: TRY004 - of a command by name
    return device.shaft_rev
