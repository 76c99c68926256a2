"""The task that hands queued blocks to one page."""

from __future__ import annotations

import asyncio
from typing import cast

import numpy as np
import pytest
from fastapi import WebSocketDisconnect

from backend.api.live.messages import ScopeChannel, ScopeStart
from backend.api.live.scope import ScopeStreams, _Running
from backend.axes.scope.hub import QUEUE_BLOCKS, Subscription
from backend.commands.drive.samples import decode
from backend.station.bench import Bench


def request() -> ScopeStart:
    channels = [ScopeChannel(drive="x", key="6064:00")]
    return ScopeStart(type="scope_start", subscription=1, channels=channels)


class Line:
    """A connection that breaks with its third write; who sends hears of it a turn later, as from
    asyncio's transports, which warn of every write in between.
    """

    def __init__(self) -> None:
        self.writes = 0
        self.reported = False

    async def send(self, _frame: bytes) -> None:
        if self.reported:
            raise WebSocketDisconnect
        self.writes += 1
        if self.writes == 3:
            asyncio.get_running_loop().call_soon(self._lost)

    def _lost(self) -> None:
        self.reported = True


async def test_nothing_more_goes_to_a_line_that_broke_while_much_was_queued(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("backend.api.live.scope.FRAME_BYTES", 1)  # each block in a frame of its own
    line = Line()
    streams = ScopeStreams(cast("Bench", None), "c1", lambda _: None, line.send)
    stream = Subscription("x", ("6064:00",), 0.0)
    for _ in range(QUEUE_BLOCKS):
        stream.put(np.zeros((10, 1)), 0.0, 0.001, None)
    streams._running[1] = _Running(request(), None, [(stream, (0,))])
    streams._ready.set()
    await asyncio.wait_for(streams._pump(), 60)
    assert line.writes == 3


def test_what_came_together_goes_together() -> None:
    streams = ScopeStreams(cast("Bench", None), "c1", lambda _: None, Line().send)
    first, second = (Subscription(name, ("6064:00",), 0.0) for name in "xy")
    for number, stream in enumerate((first, second), 1):
        streams._running[number] = _Running(request(), None, [(stream, (0,))])
        for start in (0.0, 0.01):
            stream.put(np.full((10, 1), float(number)), start, 0.001, None)
    found = decode(streams._waiting())
    assert [(float(b.times_s[0]), float(b.values[0, 0])) for b in found] == [
        (0.0, 1.0),
        (0.01, 1.0),
        (0.0, 2.0),
        (0.01, 2.0),
    ]
    assert streams._waiting() == b""
