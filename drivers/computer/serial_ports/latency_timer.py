"""The latency timer of a USB serial adapter: read, changed, and put into force.

A chip of FTDI delivers received bytes when its buffer is full or this timer has run out: 1 to 255
ms, 16 ms by default (FTDI AN232B-04). Chips of other makers have no such setting.

Windows: FTDI's driver keeps it in the registry, one key for each port of a chip (FTDI knowledge
base, "Setting a Custom Default Latency Timer Value"; FTDI AN_107)::

    HKLM\\SYSTEM\\CurrentControlSet\\Enum\\FTDIBUS\\VID_0403+PID_6001+A50285BIA\\0000
        Service = FTSER2K
        Device Parameters\\PortName = COM3, LatencyTimer = 16

The key of an adapter stays after it has been unplugged, so that two of them can name one port; the
key ``Enum`` of the driver's service lists the instances that are present. The driver reads the
timer when the device starts: ``pnputil /restart-device`` from Windows 10 version 2004 on
(learn.microsoft.com, "PnPUtil Command Syntax"), or the adapter is unplugged. Both writing and the
restart need an administrator.

Linux: the driver ftdi_sio has it as ``latency_timer`` of the port in sysfs, in force at once. It
reads 1 while a program has set ASYNC_LOW_LATENCY. macOS has no such setting.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from drivers.computer.registry import REGISTRY, Registry
from drivers.computer.serial_ports.terminals import is_in_use

LATENCY_MS = (1, 255)
"""Range of the timer [ms]."""
DEFAULT_MS = 16
"""Timer of the driver where the registry states none [ms]."""

_BUS = r"SYSTEM\CurrentControlSet\Enum\FTDIBUS"
_SERVICES = r"SYSTEM\CurrentControlSet\Services"
_PARAMETERS = "Device Parameters"
#: Only these are ever written, whatever a restore list on the disk contains.
_KEY = re.compile(
    r"SYSTEM\\CurrentControlSet\\Enum\\(FTDIBUS\\VID_[0-9A-F]{4}\+PID_[0-9A-F]{4}[^\\/\x00-\x1f]*"
    r"\\[0-9A-F]{4})\\Device Parameters",
    re.IGNORECASE,
)
_FILE = re.compile(r"sys/bus/usb-serial/devices/ttyUSB\d{1,4}/latency_timer")
_COM = re.compile(r"(?:\\\\\.\\)?(COM[1-9]\d{0,2})", re.IGNORECASE)
#: First build of Windows 10 version 2004.
_RESTARTS_SINCE = 19041
_RESTART_S = 30.0


class InForce(StrEnum):
    """Whether a changed timer is in force: now, or only after the adapter was plugged in again."""

    NOW = "now"
    AFTER_REPLUG = "after_replug"


@dataclass(frozen=True, slots=True)
class LatencyTimer:
    """The timer of one adapter [ms]; ``place`` is where the system keeps it.

    ``instance`` is the device that must be restarted for a change; empty where none is.

    Raises:
        ValueError: ``place`` is neither such a key of the registry nor such a file of sysfs.
    """

    device: str
    ms: int
    place: str

    def __post_init__(self) -> None:
        if _KEY.fullmatch(self.place) is None and _FILE.fullmatch(self.place) is None:
            raise ValueError(f"{self.place!r} is not the place of a latency timer")

    @property
    def instance(self) -> str:
        """Return the device instance that must be restarted for a change; empty on Linux."""
        key = _KEY.fullmatch(self.place)
        return key[1] if key else ""


def restart_device(instance: str) -> bool:
    """Restart a device of Windows; return False if the system did not do it.

    False with a Windows before version 2004, without an administrator (exit code 5), and where the
    computer must be restarted for it (3010).
    """
    if sys.platform == "win32":
        if sys.getwindowsversion().build < _RESTARTS_SINCE:
            return False
        # Its full path: this process can be an administrator's.
        program = Path(os.environ.get("SYSTEMROOT", r"C:\Windows"), "System32", "pnputil.exe")
        try:
            done = subprocess.run(
                [str(program), "/restart-device", instance],
                capture_output=True,
                check=False,
                timeout=_RESTART_S,
                creationflags=subprocess.CREATE_NO_WINDOW,
            )
        except (OSError, subprocess.TimeoutExpired):
            return False
        return done.returncode == 0
    else:  # noqa: RET505 - type checkers follow the branches of a system
        return False


@dataclass(frozen=True, slots=True)
class LatencyTimers:
    """The latency timers of one computer. Tests replace the parts of the system."""

    registry: Registry = REGISTRY
    root: Path = Path("/")
    restart: Callable[[str], bool] = restart_device
    in_use: Callable[[str], bool] = is_in_use

    def of(self, device: str) -> LatencyTimer | None:
        """Return the timer of the adapter of a serial port; None if it has none that is known."""
        com = _COM.fullmatch(device)
        if com is not None:
            return self._of_registry(device, com[1].upper())
        name = os.path.realpath(device).removeprefix("/dev/")
        place = f"sys/bus/usb-serial/devices/{name}/latency_timer"
        if _FILE.fullmatch(place) is None:
            return None
        try:
            ms = int((self.root / place).read_text("ascii"))
        except (OSError, ValueError):
            return None
        return LatencyTimer(device, ms, place)

    def set(self, timer: LatencyTimer, ms: int) -> InForce:
        """Set a timer, and restart its device where a change needs that.

        The device must not be in use: a restart interrupts it.

        Raises:
            OSError: not permitted, or the adapter is gone.
            ValueError: outside of `LATENCY_MS`.
        """
        if not LATENCY_MS[0] <= ms <= LATENCY_MS[1]:
            raise ValueError(f"{ms} ms")
        if not timer.instance:
            # Written without creating it: the file of an adapter that is gone does not exist.
            descriptor = os.open(self.root / timer.place, os.O_WRONLY | os.O_TRUNC)
            try:
                os.write(descriptor, f"{ms}\n".encode())
            finally:
                os.close(descriptor)
            return InForce.NOW
        self.registry.write(timer.place, "LatencyTimer", ms)
        return InForce.NOW if self.restart(timer.instance) else InForce.AFTER_REPLUG

    def _of_registry(self, device: str, port: str) -> LatencyTimer | None:
        named = [
            rf"{_BUS}\{adapter}\{instance}"
            for adapter in self.registry.keys(_BUS)
            for instance in self.registry.keys(rf"{_BUS}\{adapter}")
            if self._port_of(rf"{_BUS}\{adapter}\{instance}\{_PARAMETERS}") == port
        ]
        presence = {key: self._present(key) for key in named}
        chosen = [key for key in named if presence[key]]
        if not chosen:
            # Presence that the registry does not state; a device that it denies is an old one.
            chosen = [key for key in named if presence[key] is None]
        if len(chosen) != 1:
            return None
        place = rf"{chosen[0]}\{_PARAMETERS}"
        ms = self.registry.value(place, "LatencyTimer")
        if _KEY.fullmatch(place) is None or not isinstance(ms, int | None):
            return None
        return LatencyTimer(device, DEFAULT_MS if ms is None else ms, place)

    def _port_of(self, key: str) -> str:
        name = self.registry.value(key, "PortName")
        # Some drivers store the closing NUL, too.
        return name.rstrip("\0 ").upper() if isinstance(name, str) else ""

    def _present(self, key: str) -> bool | None:
        """Return whether a device is plugged in; None if the registry does not state it."""
        service = self.registry.value(key, "Service")
        if not isinstance(service, str) or "\\" in service:
            return None
        listed = rf"{_SERVICES}\{service}\Enum"
        count = self.registry.value(listed, "Count")
        if not isinstance(count, int):
            # The key vanishes with the last device; a service that is not there states nothing.
            known = self.registry.value(rf"{_SERVICES}\{service}", "ImagePath")
            return None if known is None else False
        wanted = key.removeprefix(r"SYSTEM\CurrentControlSet\Enum" + "\\").upper()
        names = (self.registry.value(listed, str(number)) for number in range(count))
        return any(isinstance(name, str) and name.upper() == wanted for name in names)
