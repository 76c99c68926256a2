"""Opening a segment that is cancelled leaves nothing behind that holds the interface."""

from __future__ import annotations

import asyncio

import pytest

from drivers.ethercat.link import EthercatLink


class Host:
    def __init__(self) -> None:
        self.calls: list[str] = []

    async def start(self) -> None:
        self.calls.append("start")

    async def stop(self) -> None:
        self.calls.append("stop")


class Recorder:
    def __init__(self) -> None:
        self.starting, self.stopped = asyncio.Event(), False

    async def start(self) -> None:
        self.starting.set()
        await asyncio.Event().wait()

    async def stop(self) -> None:
        self.stopped = True


async def test_a_search_cancelled_while_the_bus_opens_lets_go_of_the_interface() -> None:
    link = EthercatLink("eth9", raw_frames=True)
    host, recorder = Host(), Recorder()
    link._host, link.recorder = host, recorder  # type: ignore[assignment]
    opening = asyncio.create_task(link.open())
    await recorder.starting.wait()
    opening.cancel()
    with pytest.raises(asyncio.CancelledError):
        await opening
    assert host.calls == ["start", "stop"]
    assert recorder.stopped
