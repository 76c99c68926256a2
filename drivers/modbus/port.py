"""The serial port of a line: opened by pyserial, read and written as directly as possible.

On POSIX the bytes go through the file descriptor with ``poll``; pyserial's own read takes three
times as long per answer. Elsewhere pyserial's read and write are used. Foreign exceptions are
translated here.
"""

from __future__ import annotations

import errno
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol

import serial

from drivers.adapters import ports_found, serial_device
from drivers.computer.serial_ports.terminals import (
    TERMINAL_ERRORS,
    Readiness,
    deliver_soon,
    has_descriptor,
    port_errno,
    port_options,
)
from drivers.errors import DriveError, LinkLost, OutOfRange

Parity = Literal["N", "E", "O"]

#: 1.75 ms above 19200 baud: MODBUS over Serial Line V1.02, clause 2.5.1.1.
STANDARD_SILENCE_S = 0.00175


@dataclass(frozen=True, slots=True)
class LineSettings:
    """Settings and timing of a serial line.

    ``timeout_s`` is the time in which a drive must start its answer, in addition to the time of the
    bytes on the wire. ``silence_s`` is the pause before each request; None means 3.5 character
    times. ``gap_s`` is the longest pause within an answer (USB adapters deliver in portions up to
    16 ms apart). ``late_s`` is how long after a time-out its answer may still come.
    """

    device: str
    baudrate: int = 115_200
    parity: Parity = "N"
    stopbits: Literal[1, 2] = 1
    timeout_s: float = 0.1
    scan_timeout_s: float = 0.03
    silence_s: float | None = None
    gap_s: float = 0.03
    late_s: float = 2.0
    retries: int = 2

    @property
    def bits_per_char(self) -> int:
        """Start, 8 data, parity and stop bits."""
        return 9 + (self.parity != "N") + self.stopbits

    @property
    def char_s(self) -> float:
        """Time of one character on the wire."""
        return self.bits_per_char / self.baudrate

    @property
    def pause_s(self) -> float:
        """Pause before each request."""
        return 3.5 * self.char_s if self.silence_s is None else self.silence_s


class Port(Protocol):
    """Bytes in and out. All methods raise LinkLost when the adapter is gone."""

    def read(self, timeout_s: float) -> bytes:
        """Return the bytes received, waiting up to ``timeout_s`` for the first; empty if none."""

    def write(self, data: bytes) -> None:
        """Send all of ``data``."""

    def close(self) -> None:
        """Release the port. Further calls have no effect."""


def open_port(settings: LineSettings) -> Port:
    """Open the adapter named in ``settings``.

    Raises:
        LinkLost: no such port, not a serial port, no permission, in use.
        OutOfRange: the adapter does not support this baud rate or parity, or its name is not a
            port's.
    """
    device = serial_device(settings.device)
    parity = "N" if is_pseudo_terminal(device) else settings.parity
    try:
        port = serial.Serial(
            device,
            settings.baudrate,
            parity=parity,
            stopbits=settings.stopbits,
            timeout=0,
            write_timeout=1.0,
            **port_options(),
        )
    except ValueError as error:
        raise _unsuitable(settings, str(error)) from error
    except OSError as error:  # includes SerialException
        raise _explain(settings, error) from error
    except TERMINAL_ERRORS as error:
        # An adapter that is unplugged while it is being set up.
        raise _gone(settings.device, error) from error
    deliver_soon(port)
    return (
        _PosixPort(port, settings.device) if has_descriptor() else SerialPort(port, settings.device)
    )


def is_pseudo_terminal(device: str) -> bool:
    """Return whether ``device`` leads to a pty: it transfers bytes and so has no parity."""
    return str(Path(device).resolve()).startswith("/dev/pts/")


def _unsuitable(settings: LineSettings, text: str) -> OutOfRange:
    line = f"{settings.baudrate} baud, parity {settings.parity}, {settings.stopbits} stop bits"
    return OutOfRange("modbus.cannot-set", value=line, device=settings.device, text=text)


def _explain(settings: LineSettings, error: OSError) -> DriveError:
    device, text = settings.device, str(error)
    number = port_errno(error)
    if number == errno.ENOENT:
        return LinkLost("modbus.no-serial-port", device=device, ports_found=ports_found())
    if number == errno.EACCES:
        return LinkLost("modbus.no-permission-open", device=device)
    if number in (errno.EAGAIN, errno.EBUSY) or "exclusively lock" in text:
        return LinkLost("modbus.use-another-program", device=device)
    if number == errno.EINVAL or "baud" in text:
        return _unsuitable(settings, text)
    return LinkLost("modbus.cannot-opened", device=device, text=text)


def _gone(device: str, error: Exception | None) -> LinkLost:
    detail = f" ({error})" if error else ""
    return LinkLost("modbus.serial-port-gone", device=device, detail=detail)


class _PosixPort:
    """Read and write by file descriptor."""

    def __init__(self, port: serial.Serial, device: str) -> None:
        self._port = port
        self._device = device
        self._fd: int = port.fileno()
        self._ready = Readiness(self._fd)

    def read(self, timeout_s: float) -> bytes:
        """See `Port.read`."""
        if not self._ready.readable(timeout_s):
            return b""
        try:
            data = os.read(self._fd, 4096)
        except BlockingIOError:
            return b""
        except OSError as error:
            raise _gone(self._device, error) from error
        if not data:  # readable, but no data: hung up
            raise _gone(self._device, None)
        return data

    def write(self, data: bytes) -> None:
        """See `Port.write`."""
        sent = 0
        while sent < len(data):
            try:
                sent += os.write(self._fd, data[sent:])
            except BlockingIOError:
                if not self._ready.writable(1.0):
                    raise _gone(self._device, None) from None
            except OSError as error:
                raise _gone(self._device, error) from error

    def close(self) -> None:
        """See `Port.close`."""
        self._port.close()


class SerialPort:
    """Read and write by pyserial, where there is no file descriptor (Windows)."""

    def __init__(self, port: serial.Serial, device: str) -> None:
        self._port = port
        self._device = device

    def read(self, timeout_s: float) -> bytes:
        """See `Port.read`."""
        try:
            self._port.timeout = max(0.0, timeout_s)
            first: bytes = self._port.read(1)
            return first + self._port.read(self._port.in_waiting) if first else b""
        except (OSError, TypeError) as error:
            raise _gone(self._device, error) from error

    def write(self, data: bytes) -> None:
        """See `Port.write`."""
        try:
            self._port.write(data)
        except OSError as error:
            raise _gone(self._device, error) from error

    def close(self) -> None:
        """See `Port.close`."""
        self._port.close()
