"""Polled signals of the scope: whatever one subscriber or one reading does, the others go on."""

from __future__ import annotations

import asyncio
import time

import pytest

from backend.axes.scope.hub import ScopeHub
from backend.station.drives.connected_drive import ConnectedDrive

KEY = "6064:00"


async def _block(hub: ScopeHub, period_s: float) -> float:
    """Time [s] until a new subscriber has its first block."""
    [(stream, _)] = hub.subscribe("x", [KEY], period_s)
    began_s = time.monotonic()
    async with asyncio.timeout(20):
        await stream.ready.wait()
    return time.monotonic() - began_s


async def test_a_fast_subscriber_does_not_wait_for_a_slow_one(x: ConnectedDrive) -> None:
    hub = ScopeHub(lambda _drive: x.axis)
    await _block(hub, 10.0)
    await asyncio.sleep(0.05)
    assert await _block(hub, 0.0) < 5.0
    await hub.close()


async def test_a_reading_that_fails_unexpectedly_ends_no_stream(
    x: ConnectedDrive, monkeypatch: pytest.MonkeyPatch
) -> None:
    read, failures = x.drive.read_many, iter([ValueError("a defect")])

    async def broken(*arguments: object) -> object:
        for failure in failures:
            raise failure
        return await read(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(x.drive, "read_many", broken)
    hub = ScopeHub(lambda _drive: x.axis)
    await _block(hub, 0.0)
    await hub.close()
