"""slcan adapters: python-can's client, extended to report refused frames and bus-off.

python-can drops the adapter's BEL (a frame it could not send) and never reads the status flags, so
a bus-off would only look like silence. It also reads one byte per system call. Source of the
commands: Lawicel CAN232 manual V3, "F" status flags and "t" return values.
"""

from __future__ import annotations

import time

import can
import serial
from can.interfaces.slcan import slcanBus

from drivers.computer.serial_ports.terminals import TERMINAL_ERRORS, flush


class AdapterBlocked(can.CanOperationError):
    """The adapter accepts no more frames: its buffer is full, as it cannot send them."""


class AdapterLost(can.CanOperationError):
    """The adapter no longer responds to the computer."""


#: TypeError: pyserial writes to a descriptor that another thread has closed.
_GONE: tuple[type[Exception], ...] = (OSError, TypeError, *TERMINAL_ERRORS)

_ASK_AGAIN_S = 0.5
_BUS_ERROR = 0x80
_ERROR_PASSIVE = 0x20

ERROR_BUS_OFF = 0x40
ERROR_CONTROLLER = 0x04
ERROR_PROTOCOL = 0x08
ERROR_ACKNOWLEDGE = 0x20
"""Error classes as numbered by Linux SocketCAN (linux/can/error.h)."""


class SlcanBus(slcanBus):
    """As python-can's, but reads the status flags after a BEL and returns them as error frames."""

    _asked_s = float("-inf")

    def _read(self, timeout: float | None) -> str | None:
        try:
            line = self._buffered_line()
            if line is None:
                self.serialPortOrig.timeout = timeout
                self._buffer += self.serialPortOrig.read(1)
                if waiting := self.serialPortOrig.in_waiting:
                    self._buffer += self.serialPortOrig.read(waiting)
                line = self._buffered_line()
        except (OSError, serial.SerialException, TypeError) as error:
            # TypeError: pyserial reads a descriptor that another thread has closed.
            raise AdapterLost(str(error)) from error
        if line == "\a":
            self._ask_for_flags()
        return line

    def _write(self, string: str) -> None:
        try:
            self.serialPortOrig.write(string.encode("ascii") + self.LINE_TERMINATOR)
            while not flush(self.serialPortOrig):
                pass
        except serial.SerialTimeoutException as error:
            raise AdapterBlocked("the adapter takes no more frames") from error
        except _GONE as error:
            raise AdapterLost(str(error)) from error

    def _ask_for_flags(self) -> None:
        """Read the flags, at most twice a second: an adapter without F answers with BEL again."""
        now_s = time.monotonic()
        if now_s - self._asked_s >= _ASK_AGAIN_S:
            self._asked_s = now_s
            self._write("F")

    def _buffered_line(self) -> str | None:
        for position, byte in enumerate(self._buffer):
            if byte in b"\r\a":
                line = bytes(self._buffer[: position + 1])
                del self._buffer[: position + 1]
                return line.decode("ascii", "replace")
        return None

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        line = self._read(timeout)
        if line is None:
            return None, False
        if line[0] == "F":
            return _flags_as_error(line), False
        self._queue.put_nowait(line)
        try:
            message, filtered = super()._recv_internal(0)
        except (ValueError, IndexError):  # noise between two frames on the serial line
            return None, False
        return message, filtered


def _flags_as_error(line: str) -> can.Message | None:
    try:
        flags = int(line[1:3], 16)
    except ValueError:
        return None
    if not flags & (_BUS_ERROR | _ERROR_PASSIVE):
        return None
    kind = ERROR_BUS_OFF if flags & _BUS_ERROR else ERROR_CONTROLLER
    return can.Message(
        arbitration_id=kind, is_extended_id=False, is_error_frame=True, dlc=8, data=bytes(8)
    )
