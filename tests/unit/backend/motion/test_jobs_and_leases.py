"""Jobs and leases: one motion per axis, cancelling waits for cleanup, one holder per axis."""

from __future__ import annotations

import asyncio

import pytest

from backend.axes.axis.restoring import shielded
from backend.foundation.people.lease import Leases, Notice
from backend.foundation.work.jobs import JobRunner, Progress
from drivers.errors import Busy, LinkLost, LinkTimeout, NotAllowed, OutOfRange


async def forever(_progress: Progress) -> None:
    await asyncio.Event().wait()


async def test_one_motion_per_axis() -> None:
    runner = JobRunner()
    first = runner.start("move", "Move X", forever, drive="x", motion=True)
    with pytest.raises(Busy, match="Move X"):
        runner.start("jog", "Jog X", forever, drive="x", motion=True)
    runner.start("move", "Move Y", forever, drive="y", motion=True)
    runner.start("read", "Read X", forever, drive="x")
    await runner.cancel(first)
    assert first.state == "cancelled"
    runner.start("jog", "Jog X", forever, drive="x", motion=True)
    await runner.close()


async def test_failure_is_kept_in_words() -> None:
    async def fails(_progress: Progress) -> None:
        raise OutOfRange("too fast")

    runner = JobRunner()
    job = runner.start("move", "Move", fails)
    await job.wait()
    assert job.state == "failed"
    assert str(job.error) == "too fast"


async def test_cleanup_survives_a_second_cancel() -> None:
    steps: list[str] = []

    async def cleanup() -> None:
        for number in range(5):
            await asyncio.sleep(0)
            steps.append(str(number))

    async def work(_progress: Progress) -> None:
        try:
            await asyncio.Event().wait()
        finally:
            await shielded(cleanup, 1.0, "x")

    runner = JobRunner()
    job = runner.start("move", "Move", work)
    await asyncio.sleep(0)
    assert job.task is not None
    job.task.cancel()
    await asyncio.sleep(0)
    job.task.cancel()
    await job.wait()
    assert len(steps) == 5
    assert job.state == "cancelled"


async def test_cleanup_has_a_deadline() -> None:
    with pytest.raises(LinkTimeout, match="restoring took longer"):
        await shielded(asyncio.Event().wait, 0.01, "x")  # type: ignore[arg-type]


async def test_a_cleanup_that_fails_does_not_hide_why_it_was_due() -> None:
    async def lost() -> None:
        raise LinkLost("the drive does not answer", remedy="check the cable")

    async def braked() -> None:
        raise NotAllowed("the axis was braked", remedy="see the Alarms page")

    async def work(_progress: Progress) -> None:
        try:
            try:
                await braked()
            finally:
                await shielded(asyncio.Event().wait, 0.01, "x")  # type: ignore[arg-type]
        finally:
            await shielded(lost, 1.0, "x")

    runner = JobRunner()
    job = runner.start("jog", "Jog", work)
    await job.wait()
    assert isinstance(job.error, LinkLost)
    assert str(job.error) == (
        "the axis was braked; x: restoring took longer than 0.01 s and was aborted;"
        " the drive does not answer"
    )
    assert job.error.remedy is not None
    assert job.error.remedy.startswith("see the Alarms page; check the axis")


def test_leases() -> None:
    reported: list[str] = []
    leases = Leases(reported.append)
    leases.require("x", None)
    leases.take("x", "c1", "Anna")
    leases.take("x", "c1", "Anna")
    with pytest.raises(Busy, match="Anna has control"):
        leases.take("x", "c2", "Ben")
    with pytest.raises(Busy):
        leases.require("x", None)
    leases.give("x", "c2")
    leases.require("x", "c1")
    assert leases.drop("c1") == ["x"]
    leases.require("x", "c2")
    assert reported == ["x", "x"]


def test_who_asks_is_informed_when_somebody_else_gets_control() -> None:
    now = 0.0
    notices: list[Notice] = []
    leases = Leases(ticks=lambda: now)
    leases.on_notice.append(notices.append)

    def received(connection: str) -> list[tuple[str, str]]:
        return [(each.kind, each.person) for each in notices if each.connection == connection]

    leases.take("x", "c1", "Anna")
    leases.ask("x", "c2", "Ben")
    leases.hand("x", "c1", "c3", "Cara", 60.0)
    assert leases.asked("x") is None
    assert received("c2") == [("refused", "Cara")]
    leases.ask("x", "c2", "Ben")
    leases.override("x", "c4", "Dora")
    assert received("c2")[1:] == [("refused", "Dora")]
    leases.ask("x", "c2", "Ben")
    leases.hand("x", "c4", "c2", "Ben", 5.0)
    assert received("c2")[2:] == [("given", "Dora")]
    leases.ask("x", "c3", "Cara")
    now = 6.0
    leases.tick(lambda _drive: False)
    assert leases.holder("x") is not None
    assert received("c3")[-1] == ("refused", "Dora"), "control returned to the giver"


def test_who_asks_gets_control_that_cannot_return() -> None:
    now = 0.0
    leases = Leases(ticks=lambda: now)
    leases.take("x", "c1", "Anna")
    leases.hand("x", "c1", "c2", "Ben", 5.0)
    leases.ask("x", "c3", "Cara")
    leases.drop("c1")
    now = 6.0
    leases.tick(lambda _drive: False)
    holder = leases.holder("x")
    assert holder is not None
    assert holder.person == "Cara"


async def test_a_job_that_moves_two_axes_holds_both() -> None:
    permitted: list[str] = []
    runner = JobRunner(permit=permitted.append)

    async def work(_progress: Progress) -> None:
        await asyncio.sleep(60)

    job = runner.start("gantry", "two axes", work, drive="l", partner="r", motion=True)
    assert permitted == ["l", "r"]
    assert job.moved == ("l", "r")
    assert runner.moving("l") is runner.moving("r") is job
    for drive, partner in (("r", None), ("x", "l")):
        with pytest.raises(Busy):
            runner.start("jog", "one axis", work, drive=drive, partner=partner, motion=True)
    assert runner.moving("x") is None
    await runner.cancel(job)
    assert runner.moving("r") is None
