"""A child process that works for a task of the event loop and ends with it.

The pipes are read on a thread. `asyncio.create_subprocess_exec` is not used here: cancelled while
it connects the pipes, it waits forever on Python before 3.12.4 (CPython issue 119710), and a second
cancellation leaves the killed child and its pipes behind.
"""

from __future__ import annotations

import asyncio
import contextlib
import subprocess
import sys
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import IO, NamedTuple

#: Callback with a line of the child's standard output, on the event loop.
Line = Callable[[bytes], None]


class Answer(NamedTuple):
    """Standard output, error output and exit code of a process."""

    out: bytes
    said: bytes
    exit_code: int

    @property
    def last_line(self) -> str:
        """The last line of the process's error output, else its exit code."""
        lines = self.said.decode("utf-8", "replace").strip().splitlines()
        return lines[-1] if lines else f"exit code {self.exit_code}"


async def run_child(
    module: str,
    *arguments: str,
    sent: bytes = b"",
    limit_s: float | None = None,
    on_line: Line | None = None,
) -> Answer:
    """Run one of our modules with ``sent`` on its standard input, and return its answer.

    With ``on_line`` the lines of its output go there as they come, and `Answer.out` is empty. When
    the caller is cancelled, however often, the child is killed and gone when this returns.

    Raises:
        TimeoutError: it takes longer than ``limit_s`` [s].
        OSError: the process cannot be started.
    """
    loop = asyncio.get_running_loop()
    with tempfile.TemporaryFile() as errors, ThreadPoolExecutor(1, "child") as pool:
        process = _started([sys.executable, "-m", module, *arguments], errors)

        def pass_on(line: bytes) -> None:
            if on_line is not None:
                loop.call_soon_threadsafe(on_line, line)

        reading = loop.run_in_executor(
            pool, _output, process, sent, limit_s, None if on_line is None else pass_on
        )
        try:
            out = await asyncio.shield(reading)
        finally:
            while not reading.done():
                process.kill()
                # A further cancellation changes nothing: the first one is raised.
                with contextlib.suppress(asyncio.CancelledError):
                    await asyncio.wait([reading])
        errors.seek(0)
        return Answer(out, errors.read(), process.returncode)


def _started(command: list[str], errors: IO[bytes]) -> subprocess.Popen[bytes]:
    pipe = subprocess.PIPE
    return subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=errors)


def _output(
    process: subprocess.Popen[bytes], sent: bytes, limit_s: float | None, on_line: Line | None
) -> bytes:
    """Feed the process and read its output to the end; the process has ended on return."""
    with process:
        if on_line is not None:
            assert process.stdin is not None
            assert process.stdout is not None
            process.stdin.close()
            for line in process.stdout:
                on_line(line)
            return b""
        try:
            return process.communicate(sent, limit_s)[0]
        except subprocess.TimeoutExpired as error:
            process.kill()
            raise TimeoutError from error
