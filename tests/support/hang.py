"""A test that hangs ends, so that the suite does.

pytest-timeout raises its failure once, in whatever the main thread runs at that moment. A
background task of an event loop, or a ``__del__``, may take it, and the test hangs on. And after
a test has failed, it lets go of the clock: fixtures that are taken down then may hang for ever.
"""

from __future__ import annotations

import faulthandler
import os
import signal
from collections.abc import Generator
from typing import Any

import pytest

AGAIN_S = 20.0
"""Between one alarm and the next, s, while a test hangs on."""
LEFT_S = 180.0
"""From a test's own limit to the end of the process, s: time for further alarms and fixtures."""


class EndsWhatHangs:
    """Plugin: repeats the alarm of pytest-timeout, and ends a process that no alarm ends.

    Before it ends the process it prints where each thread stands. A worker of pytest-xdist that
    ends this way is reported with its test, and the others go on.
    """

    def __init__(self) -> None:
        self._stderr = os.dup(2)

    def _end_after(self, seconds: float) -> None:
        faulthandler.dump_traceback_later(seconds, exit=True, file=self._stderr)

    @pytest.hookimpl(hookwrapper=True)
    def pytest_timeout_set_timer(
        self, item: pytest.Item, settings: Any
    ) -> Generator[None, None, None]:
        """Let the alarm come again, and bound what follows it."""
        yield
        limit_s = float(settings.timeout)
        if signal.getitimer(signal.ITIMER_REAL)[0] > 0:
            signal.setitimer(signal.ITIMER_REAL, limit_s, AGAIN_S)
        self._end_after(limit_s + LEFT_S)

    @pytest.hookimpl(hookwrapper=True, tryfirst=True)
    def pytest_exception_interact(self) -> Generator[None, None, None]:
        """pytest itself cancels the bound when a test fails: set it again for the fixtures."""
        yield
        self._end_after(LEFT_S)

    @pytest.hookimpl(hookwrapper=True, tryfirst=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, None, None]:
        """The bound ends with the test and its fixtures, not with the first failure."""
        yield
        faulthandler.cancel_dump_traceback_later()

    def pytest_unconfigure(self) -> None:
        """Close what was opened."""
        os.close(self._stderr)
