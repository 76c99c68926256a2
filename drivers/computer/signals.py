"""Signals: how the system or a person at the terminal asks a process to end."""

from __future__ import annotations

import asyncio
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager


def ignore_interrupt() -> None:
    """Ctrl+C in the terminal is not for this process: its parent ends it in good order."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def on_termination(act: Callable[[], None]) -> None:
    """Call this at the end that a service manager asks for (SIGTERM)."""
    signal.signal(signal.SIGTERM, lambda _number, _frame: act())


def termination_interrupts() -> None:
    """A service manager's end is as orderly as Ctrl+C: both raise KeyboardInterrupt."""

    def end() -> None:
        raise KeyboardInterrupt

    on_termination(end)


@contextmanager
def interruptible() -> Iterator[None]:
    """Within it Ctrl+C and SIGTERM both raise KeyboardInterrupt; afterwards all is as before.

    Also where SIGINT is ignored, as it is for what a shell starts in the background.
    """
    interrupt = signal.signal(signal.SIGINT, signal.default_int_handler)
    before = signal.signal(signal.SIGTERM, lambda *_: signal.raise_signal(signal.SIGINT))
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
        signal.signal(signal.SIGINT, interrupt)


async def until_asked_to_end() -> None:
    """Wait for Ctrl+C or for the end that a service is given (SIGTERM)."""
    over, loop = asyncio.Event(), asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        # Windows' event loop takes no handlers: there a signal is passed on to it.
        if sys.platform == "win32":
            signal.signal(number, lambda *_: loop.call_soon_threadsafe(over.set))
        else:
            loop.add_signal_handler(number, over.set)
    await over.wait()
