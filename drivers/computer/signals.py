"""Signals: requests of the system or of a person at the terminal to end a process."""

from __future__ import annotations

import asyncio
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager


def ignore_interrupt() -> None:
    """Ignore Ctrl+C in the terminal: the parent ends this process in an orderly way."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def on_termination(act: Callable[[], None]) -> None:
    """Call this when a service manager ends the process (SIGTERM)."""
    signal.signal(signal.SIGTERM, lambda _number, _frame: act())


def termination_interrupts() -> None:
    """Make SIGTERM of a service manager raise KeyboardInterrupt, as Ctrl+C does."""

    def end() -> None:
        raise KeyboardInterrupt

    on_termination(end)


@contextmanager
def interruptible() -> Iterator[None]:
    """Make Ctrl+C and SIGTERM raise KeyboardInterrupt within the block; then restore both.

    Also where SIGINT is ignored, as in processes that a shell starts in the background.
    """
    interrupt = signal.signal(signal.SIGINT, signal.default_int_handler)
    before = signal.signal(signal.SIGTERM, lambda *_: signal.raise_signal(signal.SIGINT))
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
        signal.signal(signal.SIGINT, interrupt)


async def until_asked_to_end() -> None:
    """Wait for Ctrl+C or for SIGTERM."""
    over, loop = asyncio.Event(), asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        # Windows' event loop accepts no handlers: there a signal is passed on to it.
        if sys.platform == "win32":
            signal.signal(number, lambda *_: loop.call_soon_threadsafe(over.set))
        else:
            loop.add_signal_handler(number, over.set)
    await over.wait()
