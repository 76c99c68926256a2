"""A serial port whose data are recorded in a ring."""

from __future__ import annotations

import time
from typing import Protocol

from drivers.flight.ring import FrameRing


class BytesPort(Protocol):
    """As `drivers.modbus.port.Port`."""

    def read(self, timeout_s: float) -> bytes:
        """Return the bytes received."""

    def write(self, data: bytes) -> None:
        """Send all of ``data``."""

    def close(self) -> None:
        """Release the port."""


class RecordedPort:
    """Passes all data on and records them."""

    def __init__(self, port: BytesPort, ring: FrameRing) -> None:
        self._port = port
        self._ring = ring

    def read(self, timeout_s: float) -> bytes:
        """See `drivers.modbus.port.Port.read`."""
        data = self._port.read(timeout_s)
        if data:
            self._ring.put(time.time_ns(), False, data)
        return data

    def write(self, data: bytes) -> None:
        """See `drivers.modbus.port.Port.write`."""
        self._port.write(data)
        self._ring.put(time.time_ns(), True, data)

    def close(self) -> None:
        """See `drivers.modbus.port.Port.close`."""
        self._port.close()
