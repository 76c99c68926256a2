"""Whoever is cancelled while a background task ends is cancelled, and what was to end has ended."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from drivers.errors import LinkLost
from drivers.ethercat.exchange import recovery as recovery_module
from drivers.ethercat.exchange.recovery import Recovery
from drivers.ethercat.exchange.segmentcyclic import EthercatCyclic
from drivers.ethercat.link import EthercatLink
from drivers.ethercat.process.ending import end_task
from drivers.ethercat.process.hostprocess import HostProcess
from drivers.texts.message import text

WHY = text("ethercat.process-ended")


async def turns(count: int) -> None:
    for _ in range(count):
        await asyncio.sleep(0)


async def waits() -> None:
    """Needs some turns of the event loop to end."""
    try:
        await asyncio.Event().wait()
    finally:
        await turns(3)


@pytest.fixture
def begun(monkeypatch: pytest.MonkeyPatch) -> Callable[[Recovery], Awaitable[asyncio.Task[None]]]:
    """Bring a recovery to its attempt."""
    monkeypatch.setattr(recovery_module, "PAUSES_S", (0.0,))

    async def begin(recovery: Recovery) -> asyncio.Task[None]:
        recovery.begin(WHY)
        await turns(5)
        assert recovery._task is not None
        return recovery._task

    return begin


@pytest.mark.parametrize("after", range(8))
async def test_the_end_of_a_recovery_does_not_swallow_the_cancellation_of_its_caller(
    after: int, begun: Callable[[Recovery], Awaitable[asyncio.Task[None]]]
) -> None:
    """STOP cancelled a job that ended the exchange: it went on as if nothing had been."""
    recovery = Recovery(lambda: True, waits, lambda _why, _runs: None)
    task = await begun(recovery)
    went_on: list[bool] = []

    async def caller() -> None:
        await recovery.end()
        await asyncio.sleep(0)
        went_on.append(True)

    ending = asyncio.create_task(caller())
    await turns(after)
    taken = ending.cancel()
    await asyncio.wait([ending])
    assert ending.cancelled() is taken
    assert bool(went_on) is not taken
    if after:
        assert task.cancelled()
    task.cancel()


async def test_the_error_of_an_ended_task_is_that_of_its_end() -> None:
    async def fails() -> None:
        try:
            await asyncio.Event().wait()
        finally:
            raise LinkLost(WHY)

    task = asyncio.create_task(fails())
    await turns(1)
    with pytest.raises(LinkLost):
        await end_task(task)


class Child:
    """A child process that ends when it is waited for."""

    returncode: int | None = None

    async def wait(self) -> None:
        await turns(2)
        self.returncode = 0


@pytest.mark.parametrize("after", [1, 2, 3, 4])
async def test_a_host_process_ends_although_the_caller_is_cancelled(after: int) -> None:
    host = HostProcess("eth9", (), lambda _message: None, lambda _why: None)
    host._wanted = True
    host._process = child = Child()  # type: ignore[assignment]
    host._care = care = asyncio.create_task(waits())
    await turns(1)
    stopping = asyncio.create_task(host.stop())
    await turns(after)
    stopping.cancel()
    await asyncio.wait([stopping])
    assert stopping.cancelled()
    assert care.done()
    assert child.returncode == 0
    assert not host.running


class Host:
    running = True

    def __init__(self) -> None:
        self.calls: list[str] = []

    async def call(self, message: dict[str, Any], _timeout_s: float) -> None:
        if message:
            self.calls.append(message["op"])
            raise LinkLost(WHY)
        await waits()

    async def stop(self) -> None:
        self.calls.append("end")


async def test_an_exchange_is_stopped_although_the_caller_is_cancelled(
    begun: Callable[[Recovery], Awaitable[asyncio.Task[None]]],
) -> None:
    """The attempt to set it up again may just have succeeded."""
    host: Any = Host()
    cyclic = EthercatCyclic(host, {}, lambda _why, _runs: None)
    cyclic._wanted = True
    await begun(cyclic._recovery)
    stopping = asyncio.create_task(cyclic.stop())
    await turns(2)
    stopping.cancel()
    await asyncio.wait([stopping])
    assert stopping.cancelled()
    assert host.calls == ["stop"]


async def test_a_segment_is_let_go_of_although_the_caller_is_cancelled(
    begun: Callable[[Recovery], Awaitable[asyncio.Task[None]]],
) -> None:
    link = EthercatLink("eth9")
    host: Any = Host()
    link._host = link.process_data._host = host
    stopped: list[bool] = []

    class Recorder:
        async def stop(self) -> None:
            stopped.append(True)

    link.recorder = Recorder()  # type: ignore[assignment]
    await begun(link.process_data._recovery)
    closing = asyncio.create_task(link.close())
    await turns(2)
    closing.cancel()
    await asyncio.wait([closing])
    assert closing.cancelled()
    assert host.calls == ["end"]
    assert stopped == [True]
