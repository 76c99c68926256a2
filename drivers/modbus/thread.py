"""The single thread of a bus: runs blocking jobs one at a time, urgent ones first."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

from drivers.computer.timing.scheduling import fine_timers

T = TypeVar("T")


class BusThread:
    """Jobs from the event loop, executed in order on one thread.

    An urgent job (a write: it may be the stop) overtakes every job that has not begun. Long work
    must be split into many short jobs for this to be effective.
    """

    def __init__(self, name: str) -> None:
        self._executor = ThreadPoolExecutor(
            max_workers=1, thread_name_prefix=name, initializer=fine_timers
        )
        self._urgent: deque[Callable[[], None]] = deque()
        self._normal: deque[Callable[[], None]] = deque()

    async def run(self, job: Callable[[], T], *, urgent: bool = False) -> T:
        """Run ``job`` and return its result. Cancelling drops a job that has not begun."""
        future: Future[T] = Future()

        def execute() -> None:
            if not future.set_running_or_notify_cancel():
                return
            try:
                result = job()
            except BaseException as error:
                future.set_exception(error)
            else:
                future.set_result(result)

        (self._urgent if urgent else self._normal).append(execute)
        self._executor.submit(self._next)
        return await asyncio.wrap_future(future)

    def stop(self) -> None:
        """Accept no more jobs; those waiting are still executed."""
        self._executor.shutdown(wait=False)

    def _next(self) -> None:
        (self._urgent or self._normal).popleft()()
