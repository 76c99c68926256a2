"""An event loop whose time is simulated: who waits for 3 s has waited at once.

Time advances only while nothing is ready to run, to the time of the nearest timer. What threads do
is waited for in the computer's own time. `time.monotonic` is the loop's while it runs.
"""

from __future__ import annotations

import asyncio
import selectors
import time
from collections.abc import Callable, Coroutine
from typing import Any

_THREAD_S = 0.002


class _Selector(selectors.DefaultSelector):
    """Waits by moving the clock."""

    def __init__(self) -> None:
        super().__init__()
        self.now_s = 1000.0
        self.threads = 0

    def select(self, timeout: float | None = None) -> list[Any]:
        ready = super().select(0)
        if ready or (timeout is not None and timeout <= 0):
            return ready
        if self.threads or timeout is None:
            return super().select(_THREAD_S)
        self.now_s += timeout
        return ready


class SimulatedLoop(asyncio.SelectorEventLoop):
    """See the module docstring."""

    def __init__(self) -> None:
        self._waits = _Selector()
        super().__init__(self._waits)

    def time(self) -> float:
        """Simulated seconds."""
        return self._waits.now_s

    def run_in_executor(  # type: ignore[override]
        self, executor: Any, func: Callable[..., Any], *args: Any
    ) -> Any:
        """As asyncio's; simulated time stands meanwhile."""
        self._waits.threads += 1
        future = super().run_in_executor(executor, func, *args)
        future.add_done_callback(self._through)
        return future

    def _through(self, _future: Any) -> None:
        self._waits.threads -= 1


def run_simulated(main: Callable[[], Coroutine[Any, Any, Any]]) -> Any:
    """Run a coroutine in simulated time."""
    ordinary = time.monotonic
    with asyncio.Runner(loop_factory=SimulatedLoop) as runner:
        loop = runner.get_loop()
        time.monotonic = loop.time
        try:
            return runner.run(main())
        finally:
            time.monotonic = ordinary
