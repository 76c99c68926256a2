"""Serial ports as the system's terminals: their errors, and how soon they deliver."""

from __future__ import annotations

import errno
import os
import sys
from contextlib import suppress

import serial

if sys.platform != "win32":
    import termios

    #: No OSError: pyserial lets it through where it sets up a terminal that has just gone.
    TERMINAL_ERRORS: tuple[type[Exception], ...] = (termios.error,)
else:
    TERMINAL_ERRORS = ()


def flush(port: serial.Serial) -> bool:
    """Wait until everything is on the line; False where a signal of this process broke it off.

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
    """Have the adapter hand over at once what it has (ASYNC_LOW_LATENCY); False where it cannot.

    USB chips hold answers back for up to 16 ms otherwise. Pseudo-terminals cannot be asked, macOS
    knows no such setting; on Windows it is one of the device (latency timer, Device Manager).
    """
    if sys.platform != "linux":
        return False
    try:
        port.set_low_latency_mode(True)
    except (OSError, ValueError):
        return False
    return True


def own_terminals() -> set[str]:
    """The terminals that this process itself was started in; Windows knows none by name."""
    found: set[str] = set()
    if sys.platform != "win32":
        for descriptor in (0, 1, 2):
            with suppress(OSError):
                found.add(os.ttyname(descriptor))
    return found
