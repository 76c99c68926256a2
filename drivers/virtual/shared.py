"""One virtual drive on two wires: each wire's thread holds the drive's lock during every call."""

from __future__ import annotations

import threading
from collections.abc import Sequence

from drivers.virtual.device import (
    Device,
    EntryInfo,
    ProcessImage,
    StartsWithNetwork,
    shaft_rev,
)
from profiles.schema import Profile


class SharedDevice:
    """A `Device` that several threads may call."""

    def __init__(self, device: Device, lock: threading.RLock) -> None:
        self._device = device
        self._lock = lock
        self.profile: Profile = device.profile

    @property
    def powered(self) -> bool:
        """See `Device`."""
        return self._device.powered

    @powered.setter
    def powered(self, on: bool) -> None:
        with self._lock:
            self._device.powered = on

    @property
    def shaft_rev(self) -> float:
        """See `drivers.virtual.device.HasShaft`."""
        with self._lock:
            return shaft_rev(self._device)

    def advance(self, t_ns: int) -> None:
        """See `Device`."""
        with self._lock:
            self._device.advance(t_ns)

    def read(self, index: int, subindex: int) -> bytes:
        """See `Device`."""
        with self._lock:
            return self._device.read(index, subindex)

    def write(self, index: int, subindex: int, data: bytes) -> None:
        """See `Device`."""
        with self._lock:
            self._device.write(index, subindex, data)

    def read_register(self, register: int, count: int) -> list[int]:
        """See `Device`."""
        with self._lock:
            return self._device.read_register(register, count)

    def write_registers(self, register: int, values: Sequence[int]) -> None:
        """See `Device`."""
        with self._lock:
            self._device.write_registers(register, values)

    def indices(self) -> Sequence[int]:
        """See `Device`."""
        return self._device.indices()

    def subindices(self, index: int) -> Sequence[int]:
        """See `Device`."""
        return self._device.subindices(index)

    def entry(self, index: int, subindex: int) -> EntryInfo:
        """See `Device`."""
        return self._device.entry(index, subindex)

    def map_process_data(self, entries: Sequence[int], direction: str) -> ProcessImage:
        """See `Device`."""
        with self._lock:
            return self._device.map_process_data(entries, direction)

    def communication_lost(self, reason: str) -> None:
        """See `Device`."""
        with self._lock:
            self._device.communication_lost(reason)

    def network_started(self) -> None:
        """See `StartsWithNetwork`."""
        if isinstance(self._device, StartsWithNetwork):
            with self._lock:
                self._device.network_started()

    def take_emergencies(self) -> list[tuple[int, int, bytes]]:
        """See `Device`."""
        with self._lock:
            return self._device.take_emergencies()

    def power_cycle(self, off_s: float = 0.0) -> None:
        """See `Device`."""
        with self._lock:
            self._device.power_cycle(off_s)

    def inject(self, what: str, value: float = 1.0) -> None:
        """See `Device`."""
        with self._lock:
            self._device.inject(what, value)
