"""Computing during a motion that is necessary anyway."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

_T = TypeVar("_T")


async def meanwhile(compute: Callable[[], _T], motion: Coroutine[Any, Any, None]) -> _T:
    """Run ``compute`` in a thread during ``motion``; return its result once both are done.

    Raises:
        Exception: that of the motion, else that of ``compute``.
    """
    computing = asyncio.ensure_future(asyncio.to_thread(compute))
    try:
        await motion
    except BaseException:
        computing.cancel()
        raise
    return await computing
