"""Computing while an axis moves to where it must be anyway."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

_T = TypeVar("_T")


async def meanwhile(compute: Callable[[], _T], motion: Coroutine[Any, Any, None]) -> _T:
    """What ``compute`` returns, computed in a thread during ``motion``, which always ends first.

    Raises:
        Exception: of the motion, whatever was computed; else of the computing.
    """
    computing = asyncio.ensure_future(asyncio.to_thread(compute))
    try:
        await motion
    except BaseException:
        computing.cancel()
        raise
    return await computing
