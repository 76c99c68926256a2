"""Serial ports as terminals of the system: errors, latency, pseudo-terminals and speeds."""

from __future__ import annotations

import errno
import os
import re
import sys
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import serial

from drivers.errors import NotAllowed

TERMINAL_ERRORS: tuple[type[Exception], ...]
if sys.platform != "win32":
    import select
    import termios
    import tty

    _NAMED = {
        getattr(termios, name): int(name[1:])
        for name in dir(termios)
        if name[0] == "B" and name[1:].isdigit()
    }
    #: Not an OSError: pyserial lets it through when it sets up a terminal that has just
    #: disappeared.
    TERMINAL_ERRORS = (termios.error,)
else:
    TERMINAL_ERRORS = ()
_OPENING_ERRORS: tuple[type[Exception], ...] = (OSError, ValueError, *TERMINAL_ERRORS)

#: Rates of Linux (asm-generic/termbits.h) without a name in Python's termios.
_LINUX_SPEEDS = {
    0o010005: 500_000, 0o010006: 576_000, 0o010007: 921_600, 0o010010: 1_000_000,
    0o010011: 1_152_000, 0o010012: 1_500_000, 0o010013: 2_000_000, 0o010014: 2_500_000,
    0o010015: 3_000_000, 0o010016: 3_500_000, 0o010017: 4_000_000,
}  # fmt: skip


def flush(port: serial.Serial) -> bool:
    """Wait until everything has been sent; return False if a signal interrupted the wait.

    Python does not repeat tcdrain(3) by itself, as it does with most calls (PEP 475).

    Raises:
        OSError: the adapter is gone; also an error of `TERMINAL_ERRORS`.
    """
    try:
        port.flush()
    except TERMINAL_ERRORS as error:
        if error.args[0] == errno.EINTR:
            return False
        raise
    return True


def deliver_soon(port: serial.Serial) -> bool:
    """Make the adapter deliver data at once (ASYNC_LOW_LATENCY); return False if it cannot.

    Otherwise USB chips hold answers back for up to 16 ms. Pseudo-terminals do not support it, macOS
    has no such setting; on Windows it is a device setting (latency timer, Device Manager).
    """
    if sys.platform != "linux":
        return False
    try:
        port.set_low_latency_mode(True)
    except (OSError, ValueError):
        return False
    return True


#: How pyserial's message on Windows ends: the WinError with its errno, text, file and own number.
_WIN_ERROR = re.compile(r"\w*Error\(\d+, .*, None, (\d+)\)", re.DOTALL)
#: ERROR_FILE_NOT_FOUND, ERROR_ACCESS_DENIED (a COM port has one user at a time),
#: ERROR_INVALID_PARAMETER (of SetCommState).
_WIN_ERRNO = {2: errno.ENOENT, 5: errno.EBUSY, 87: errno.EINVAL}


def port_errno(error: BaseException) -> int:
    """Return the errno of an error on opening a serial port; 0 if it is not known.

    On Windows pyserial keeps only the text of the system's error. There a port that another program
    has open is EBUSY; the system itself calls it "access denied".
    """
    text = str(error)
    windows = _WIN_ERROR.search(text)
    if windows is not None:
        return _WIN_ERRNO.get(int(windows[1]), 0)
    stated = getattr(error, "errno", None)
    if isinstance(stated, int):
        return stated
    posix = re.search(r"\[Errno (\d+)\]", text)
    return int(posix[1]) if posix else 0


def may_open(device: str) -> bool:
    """Return whether this user may open a serial port; on Windows every user may.

    A COM port is no file there: its permissions cannot be asked for.
    """
    return sys.platform == "win32" or os.access(device, os.R_OK | os.W_OK)


def is_in_use(device: str) -> bool:
    """Return whether a program has this serial port open; the port is opened for an instant."""
    try:
        serial.Serial(device, timeout=0, **port_options()).close()
    except _OPENING_ERRORS as error:
        return port_errno(error) in (errno.EBUSY, errno.EAGAIN)
    return False


def own_terminals() -> set[str]:
    """Return the terminals in which this process was started; empty on Windows."""
    found: set[str] = set()
    if sys.platform != "win32":
        for descriptor in (0, 1, 2):
            with suppress(OSError):
                found.add(os.ttyname(descriptor))
    return found


def port_options() -> dict[str, Any]:
    """Return pyserial's options besides the line settings: exclusive use of the port.

    A COM port is always exclusive; pyserial rejects the option there.
    """
    return {} if sys.platform == "win32" else {"exclusive": True}


def has_descriptor() -> bool:
    """Return whether a serial port is a descriptor that can be waited for (not on Windows)."""
    return sys.platform != "win32"


if sys.platform != "win32":

    def _poll(descriptor: int, event: int) -> Callable[[float], object]:
        poll = select.poll()
        poll.register(descriptor, event)
        return poll.poll


class Readiness:
    """Waits until a descriptor can be read or written (poll(2)); not on Windows."""

    def __init__(self, descriptor: int) -> None:
        self._readable: Callable[[float], object]
        self._writable: Callable[[float], object]
        if sys.platform == "win32":
            raise NotAllowed("computer.serial-port-no-file", limit="POSIX")
        else:  # noqa: RET506 - type checkers follow the branches of a system
            self._readable = _poll(descriptor, select.POLLIN)
            self._writable = _poll(descriptor, select.POLLOUT)

    def readable(self, timeout_s: float) -> bool:
        """Return whether there is something to read within this time."""
        return bool(self._readable(max(0.0, timeout_s) * 1000))

    def writable(self, timeout_s: float) -> bool:
        """Return whether data can be written within this time."""
        return bool(self._writable(max(0.0, timeout_s) * 1000))


def require_pseudo_terminals() -> None:
    """Require pseudo-terminals, which virtual serial drives need.

    Raises:
        NotAllowed: the system has none (Windows).
    """
    if sys.platform == "win32":
        raise NotAllowed("computer.virtual-serial-drives-need", limit="Linux, macOS")


def open_pair() -> tuple[int, int]:
    """Open a raw pseudo-terminal; return its master and slave end.

    Raises:
        NotAllowed: the system has none (Windows).
    """
    if sys.platform == "win32":
        raise NotAllowed("computer.windows-no-pseudo-terminals", limit="Linux, macOS")
    else:  # noqa: RET506 - type checkers follow the branches of a system
        master, slave = os.openpty()
        tty.setraw(slave)
        return master, slave


def terminal_name(descriptor: int) -> str:
    """Return the path of a terminal; empty on Windows, where it has none."""
    if sys.platform == "win32":
        return ""
    else:  # noqa: RET505 - type checkers follow the branches of a system
        return os.ttyname(descriptor)


def output_speed(descriptor: int) -> int | None:
    """Return the baud rate set in a terminal; None if the system has no name for it."""
    if sys.platform == "win32":
        return None
    else:  # noqa: RET505 - type checkers follow the branches of a system
        try:
            code = termios.tcgetattr(descriptor)[5]
        except termios.error:
            return None
        return (_NAMED | _LINUX_SPEEDS).get(code)
