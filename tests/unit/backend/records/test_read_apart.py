"""A large file is read in a process of its own, and what it answers is as if it were read here."""

from __future__ import annotations

import os
import time

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
