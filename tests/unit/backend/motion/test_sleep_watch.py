"""Waking of a computer that slept: its event loop has not seen the time, and every motion ends."""

from __future__ import annotations

import asyncio

import pytest

from backend.commands.base import session
from backend.foundation.work import sleep_watch
from backend.foundation.work.jobs import Progress
from backend.foundation.work.sleep_watch import LONGEST_S, PERIOD_S, SleepWatch
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from drivers.errors import NotAllowed
from drivers.texts.message import text
from tests.support.servo import Servo

NIGHT_S = 8 * 3600.0


class Ticks:
    """Clock that goes on while the computer sleeps; the event loop's does not."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def test_a_night_is_noticed_once_and_a_busy_computer_is_not() -> None:
    ticks, gaps = Ticks(), list[float]()
    watch = SleepWatch(gaps.append, ticks)
    for gap_s in (PERIOD_S, LONGEST_S, NIGHT_S, PERIOD_S):
        ticks.now_s += gap_s
        watch.look()
    assert gaps == [NIGHT_S]


async def test_on_waking_the_axis_is_stopped_and_its_job_names_the_cause(
    bench: Bench, x: ConnectedDrive, servo: Servo
) -> None:
    servo.enable()

    async def work(_progress: Progress) -> None:
        await asyncio.Event().wait()

    job = bench.jobs.start("move", text("motion.time-is-over"), work, drive="x", motion=True)
    await asyncio.sleep(0)
    assert bench.authority.grant_of("x") is not None
    bench.motion.awoke(NIGHT_S)
    async with asyncio.timeout(10):
        while servo.words() != [2]:  # noqa: ASYNC110
            await asyncio.sleep(0.005)
    assert x.axis.stopped
    assert job.cancel_cause is not None
    assert job.cancel_cause.code == "station.computer-slept"


async def test_an_axis_that_nobody_enabled_is_left_alone(
    bench: Bench, x: ConnectedDrive, servo: Servo
) -> None:
    bench.motion.awoke(NIGHT_S)
    await asyncio.sleep(0)
    assert not x.axis.stopped
    assert servo.words() == []


async def test_a_command_is_cancelled_and_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    ticks, ended = Ticks(), list[str]()
    monkeypatch.setattr(sleep_watch.SleepWatch.__init__, "__defaults__", (ticks,))
    monkeypatch.setattr(sleep_watch, "PERIOD_S", 0.001)

    async def work() -> None:
        try:
            ticks.now_s += NIGHT_S
            await asyncio.Event().wait()
        finally:
            ended.append("restored")

    with pytest.raises(NotAllowed, match="slept") as raised:
        await session._unless_asleep(work)
    assert raised.value.text.params["gap_s"] == NIGHT_S
    assert ended == ["restored"]


async def test_a_command_that_is_cancelled_otherwise_stays_cancelled() -> None:
    async def work() -> None:
        task = asyncio.current_task()
        assert task is not None
        task.cancel()
        await asyncio.Event().wait()

    with pytest.raises(asyncio.CancelledError):
        await session._unless_asleep(work)
