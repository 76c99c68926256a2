"""The end of a background task, with the cancellation of whoever waits for it kept apart."""

from __future__ import annotations

import asyncio


async def end_task(task: asyncio.Task[None]) -> None:
    """Cancel a task and return when it has ended.

    ``await task`` does not distinguish the two cancellations: that of the caller would be lost.

    Raises:
        asyncio.CancelledError: the caller was cancelled meanwhile; the task has ended nevertheless.
        Exception: the error with which the task ended.
    """
    task.cancel()
    ours: asyncio.CancelledError | None = None
    while not task.done():
        try:
            await asyncio.wait([task])
        except asyncio.CancelledError as error:
            ours = error
    failure = None if task.cancelled() else task.exception()
    if ours is not None:
        raise ours
    if failure is not None:
        raise failure
