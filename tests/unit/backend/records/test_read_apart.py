"""A large file is read in a process of its own, and what it answers is as if it were read here."""

from __future__ import annotations

import asyncio
import os
import time

import psutil
import pytest

from backend.axes.parameters import set_file
from backend.axes.parameters.set_file import BadSet
from backend.foundation.work import apart
from backend.foundation.work.apart import SMALL_BYTES, ReadingEnded, read_apart


async def test_large_ones_are_read_elsewhere_and_after_others() -> None:
    assert await read_apart(SMALL_BYTES, os.getpid) == os.getpid()
    assert await read_apart(SMALL_BYTES + 1, os.getpid) != os.getpid()
    if hasattr(os, "nice"):
        assert await read_apart(SMALL_BYTES + 1, os.nice, 0) > os.nice(0)


async def test_what_is_wrong_with_a_file_is_raised_here() -> None:
    data = b"a = " + b"x" * SMALL_BYTES
    with pytest.raises(BadSet) as refused:
        await read_apart(len(data), set_file.parse, data, "a.toml")
    with pytest.raises(BadSet) as here:
        set_file.parse(data, "a.toml")
    assert refused.value.text == here.value.text


async def test_a_reading_ends_after_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(apart, "LIMIT_S", 0.2)
    with pytest.raises(ReadingEnded):
        await read_apart(SMALL_BYTES + 1, time.sleep, 60.0)


async def test_a_process_that_ends_without_an_answer_is_reported() -> None:
    with pytest.raises(ReadingEnded):
        await read_apart(SMALL_BYTES + 1, os._exit, 1)


@pytest.mark.long(keep=10)
@pytest.mark.parametrize("cancellations", [0, 1, 3])
@pytest.mark.parametrize("after_s", [0.0, 0.002, 0.02, 0.3])
def test_a_cancelled_reading_leaves_no_process_and_no_pipe(
    after_s: float, cancellations: int
) -> None:
    """At every moment of its start; the end of the event loop is one more cancellation."""
    before = held()

    async def begun() -> None:
        reading = asyncio.create_task(read_apart(SMALL_BYTES + 1, time.sleep, 60.0))
        await asyncio.sleep(after_s)
        for _ in range(cancellations):
            reading.cancel()
            await asyncio.sleep(0)

    began = time.monotonic()
    asyncio.run(begun())
    assert time.monotonic() - began < 30
    assert held() == before


def held() -> tuple[int, int]:
    process = psutil.Process()
    return process.num_fds(), len(process.children())
