"""Reading a large file in a separate process, with lower priority than STOP and the buses.

On a thread of the server such a reading shares the interpreter with the event loop: a regular
expression or a JSON decoder over some megabytes blocks everything else until it ends, and a long
Python loop takes the interpreter back after each step of the event loop.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import pickle
import sys
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

from backend.foundation.work.child import run_child
from drivers.computer.processes import limit_memory, yield_processor
from drivers.errors import NotAllowed
from drivers.texts import limits

P = ParamSpec("P")
T = TypeVar("T")

#: Reading fewer bytes costs less than starting a process.
SMALL_BYTES = 256 << 10
#: Limits of a reading: duration [s] and address space [MiB].
LIMIT_S = 60.0
LIMIT_MIB = 768
#: Readings at a time: each may use one processor fully.
AT_ONCE = 1
_at_once: dict[asyncio.AbstractEventLoop, asyncio.Semaphore] = {}


class ReadingEnded(NotAllowed):
    """Reading a file took too long or too much memory."""


async def read_apart(
    size_bytes: int, work: Callable[P, T], /, *arguments: P.args, **named: P.kwargs
) -> T:
    """Call a module-level function in a separate process; arguments and result must be picklable.

    ``size_bytes`` is the amount to be read: a small file is read on a thread instead. A
    `DriveError` of ``work`` is raised here.

    Raises:
        ReadingEnded: it takes longer than `LIMIT_S` or more memory than `LIMIT_MIB`.
    """
    if size_bytes <= SMALL_BYTES:
        return await asyncio.to_thread(work, *arguments, **named)
    loop = asyncio.get_running_loop()
    async with _at_once.setdefault(loop, asyncio.Semaphore(AT_ONCE)):
        task = await asyncio.to_thread(pickle.dumps, (work, arguments, named))
        try:
            answer = await run_child("backend.foundation.work.apart", sent=task, limit_s=LIMIT_S)
        except TimeoutError:
            raise ReadingEnded("work.reading-time", limit_s=LIMIT_S) from None
    result: T
    try:
        result, error = await asyncio.to_thread(_loaded, answer.out)
    except (EOFError, pickle.UnpicklingError):
        raise ReadingEnded("work.reading-memory", limit=limits.size(LIMIT_MIB << 20)) from None
    if error is not None:
        raise error
    return result


def _loaded(out: bytes) -> tuple[Any, Exception | None]:
    result, error = pickle.loads(out)  # noqa: S301 - from our own child
    return result, error


def main() -> None:
    """Carry out the task of this process: read it from standard input, write the pickled answer."""
    yield_processor()
    limit_memory(LIMIT_MIB << 20)
    answer = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # output printed by a library must not get into the answer
    with contextlib.suppress(MemoryError):
        work, arguments, named = pickle.load(sys.stdin.buffer)  # noqa: S301 - from our own parent
        try:
            out = pickle.dumps((work(*arguments, **named), None))
        except MemoryError:
            raise
        except Exception as error:  # raised again in the parent process
            out = pickle.dumps((None, error))
        answer.write(out)
    answer.close()


if __name__ == "__main__":
    main()
