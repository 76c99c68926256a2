"""Reading a large file in a process of its own, which goes after STOP and the buses.

On a thread of the server such a reading shares the interpreter with the event loop: a regular
expression or a JSON decoder over some megabytes lets nothing else run until it has ended, and a
long loop in Python takes its turn again after each step of the loop.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import pickle
import sys
from collections.abc import Callable
from typing import Any, NamedTuple, ParamSpec, TypeVar

from drivers.computer.processes import limit_memory, yield_processor
from drivers.errors import NotAllowed
from drivers.texts import limits

P = ParamSpec("P")
T = TypeVar("T")

#: A reading of fewer bytes costs less than the start of a process.
SMALL_BYTES = 256 << 10
#: The longest reading, and the address space that it may use.
LIMIT_S = 60.0
LIMIT_MIB = 768
#: Readings at once: each may keep one processor busy.
AT_ONCE = 1
_at_once: dict[asyncio.AbstractEventLoop, asyncio.Semaphore] = {}


class ReadingEnded(NotAllowed):
    """A file whose reading took too long or too much memory."""


async def read_apart(
    size_bytes: int, work: Callable[P, T], /, *arguments: P.args, **named: P.kwargs
) -> T:
    """Call a function of a module with arguments that can be pickled; so can its result.

    ``size_bytes`` is what there is to be read: a small file is read on a thread. A `DriveError` of
    ``work`` is raised here.

    Raises:
        ReadingEnded: it takes longer than `LIMIT_S` or more memory than `LIMIT_MIB`.
    """
    if size_bytes <= SMALL_BYTES:
        return await asyncio.to_thread(work, *arguments, **named)
    loop = asyncio.get_running_loop()
    async with _at_once.setdefault(loop, asyncio.Semaphore(AT_ONCE)):
        task = (work, arguments, named)
        try:
            answer = await answer_of("backend.work.apart", task=task, limit_s=LIMIT_S)
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


class Answer(NamedTuple):
    """What a process printed until its end, and its exit code."""

    out: bytes
    said: bytes
    exit_code: int

    @property
    def last_line(self) -> str:
        """The last line of its error output."""
        return (self.said.decode("utf-8", "replace").strip().splitlines() or ["it said nothing"])[
            -1
        ]


async def answer_of(module: str, *arguments: str, task: object, limit_s: float) -> Answer:
    """Run a module of ours in a process that reads ``task``, pickled; it ends with the caller.

    Raises:
        TimeoutError: it takes longer than ``limit_s``.
    """
    sent = await asyncio.to_thread(pickle.dumps, task)
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        "-m",
        module,
        *arguments,
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
    )
    try:
        async with asyncio.timeout(limit_s):
            out, said = await process.communicate(sent)
        return Answer(out, said, process.returncode or 0)
    finally:
        if process.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await asyncio.shield(process.wait())


def _loaded(out: bytes) -> tuple[Any, Exception | None]:
    result, error = pickle.loads(out)  # noqa: S301 - from our own child
    return result, error


def main() -> None:
    """Carry out the one reading of this process."""
    yield_processor()
    limit_memory(LIMIT_MIB << 20)
    answer = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints is no part of the answer
    with contextlib.suppress(MemoryError):
        work, arguments, named = pickle.load(sys.stdin.buffer)  # noqa: S301 - from our own parent
        try:
            out = pickle.dumps((work(*arguments, **named), None))
        except MemoryError:
            raise
        except Exception as error:  # raised again where the reading was asked for
            out = pickle.dumps((None, error))
        answer.write(out)
    answer.close()


if __name__ == "__main__":
    main()
