"""Why a job was cancelled: a code and its facts, the same for page, command line, log and audit."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import pytest

from backend.api.live.live import LiveHub
from backend.api.live.page import Page
from backend.api.live.watch import _LOOK_S, SILENCE_S, SILENT_END_S
from backend.api.messages import convert
from backend.api.security.socket import OpenSockets
from backend.commands.base.remote import _not_done
from backend.foundation.people.identity import LOCAL, Actor, acting
from backend.foundation.people.station import People
from backend.foundation.work.jobs import Job, JobRunner, Progress
from backend.records.audit.facts import Fact
from backend.records.audit.recorder import AuditRecorder
from backend.station.bench import Bench
from drivers.texts.message import Text, speaking, text


class Pages:
    """What a cancelling needs of a live connection."""

    def __init__(self, name: str, heard: float) -> None:
        self.id, self.heard, self.identity = name, heard, LOCAL

    def release(self, drive: str | None, reason: Text) -> None:
        """It holds no jog."""

    def later(self, kind: str, key: str, news: object) -> None:
        """It is shown nothing."""


async def forever(_progress: Progress) -> None:
    await asyncio.Event().wait()


def start(bench: Bench) -> Job:
    acting.set(Actor(replace(LOCAL, session="visit"), "c1"))
    return bench.jobs.start("move", "Move X", forever, drive="x", motion=True)


@pytest.fixture
def hub(bench: Bench, tmp_path: Path) -> LiveHub:
    return LiveHub(bench, People(tmp_path), OpenSockets())


def page(heard: float) -> Page:
    made: Any = Pages("c1", heard)
    return made  # type: ignore[no-any-return]


Ending = Callable[[Bench, LiveHub, Job], Awaitable[object]]


async def silent(_bench: Bench, hub: LiveHub, _job: Job) -> None:
    hub.people._fell_silent(page(0.0))


async def gone(_bench: Bench, hub: LiveHub, _job: Job) -> None:
    hub.people.left(page(0.0))


async def stopped(bench: Bench, _hub: LiveHub, _job: Job) -> None:
    await bench.motion.stop(["x"])


async def taken(bench: Bench, _hub: LiveHub, _job: Job) -> None:
    await bench.motion.stop(["x"], text("work.control-taken", person="Boris"))


async def session_over(bench: Bench, hub: LiveHub, _job: Job) -> None:
    hub._ended("visit")


async def role_lowered(bench: Bench, hub: LiveHub, _job: Job) -> None:
    hub._lowered("visit")


async def by_command(bench: Bench, _hub: LiveHub, job: Job) -> None:
    await bench.jobs.cancel(job)


async def server_ends(bench: Bench, _hub: LiveHub, _job: Job) -> None:
    await bench.jobs.close()


CAUSES: list[tuple[Ending, str, str, str]] = [
    (silent, "work.page-not-reachable", "was not reachable for 2 s", "2 s 无法连通"),
    (gone, "work.page-gone", "closed or lost its connection", "已关闭或断开连接"),
    (stopped, "motion.stop-was-pressed", "STOP was pressed", "已按下“停止”（STOP）"),
    (taken, "work.control-taken", "Boris took control", "Boris 接管"),
    (session_over, "motion.session-is-over", "session", "会话已结束"),
    (role_lowered, "motion.account-has-another-role", "role", "角色已更改"),
    (by_command, "work.cancelled-by-command", "by a command", "由命令取消"),
    (server_ends, "work.server-ends", "shut down", "服务器已关闭"),
]


@pytest.mark.long(keep=3)
@pytest.mark.parametrize(("end", "code", "english", "chinese"), CAUSES)
async def test_every_way_to_cancel_a_motion_states_its_cause_and_a_remedy(
    bench: Bench, hub: LiveHub, end: Ending, code: str, english: str, chinese: str
) -> None:
    job = start(bench)
    await asyncio.sleep(0)
    await end(bench, hub, job)
    async with asyncio.timeout(5):
        await job.wait()
    assert job.state == "cancelled"
    shown = convert.job(job)
    assert shown.problem is None
    assert shown.cancellation is not None
    assert shown.cancellation.cause_message.code == code
    assert english in shown.cancellation.cause
    assert shown.cancellation.remedy
    with speaking("zh"):
        assert (again := convert.job(job).cancellation) is not None
    assert chinese in again.cause
    assert again.remedy
    assert again.remedy != shown.cancellation.remedy


async def test_a_grant_whose_time_is_over_is_the_cause(bench: Bench) -> None:
    job = start(bench)
    await asyncio.sleep(0)
    for record in list(bench.authority._records["x"]):
        bench.authority._expire(record)
    async with asyncio.timeout(5):
        await job.wait()
    assert job.cancel_cause is not None
    assert job.cancel_cause.code == "motion.time-is-over"


async def test_the_first_cause_is_kept(bench: Bench, hub: LiveHub) -> None:
    """STOP is pressed, and the page closes while the axis brakes: STOP was the cause."""
    job = start(bench)
    await asyncio.sleep(0)
    job.cancel(text("motion.stop-was-pressed"))
    hub.people.left(page(0.0))
    async with asyncio.timeout(5):
        await job.wait()
    assert job.cancel_cause == text("motion.stop-was-pressed")


async def test_work_that_is_done_has_no_cause() -> None:
    """Cancelled at its last step, it came to its end all the same."""

    async def work(_progress: Progress) -> None:
        try:
            await asyncio.Event().wait()
        except asyncio.CancelledError:
            return

    runner = JobRunner()
    job = runner.start("move", "Move", work)
    await asyncio.sleep(0)
    await runner.cancel(job)
    assert job.state == "done"
    assert convert.job(job).cancellation is None


async def test_cancelled_before_its_first_step_the_cause_is_known() -> None:
    runner = JobRunner()
    job = runner.start("move", "Move", forever)
    job.cancel(text("motion.stop-was-pressed"))
    await job.wait()
    await asyncio.sleep(0)
    assert job.state == "cancelled"
    assert convert.job(job).cancellation is not None


def test_the_time_that_is_shown_is_the_time_that_counts() -> None:
    assert SILENCE_S + _LOOK_S <= SILENT_END_S


class Log:
    """Keeps what is added."""

    def __init__(self) -> None:
        self.facts: list[Fact] = []

    def add(self, fact: Fact) -> None:
        self.facts.append(fact)


async def test_the_audit_names_the_cause() -> None:
    log: Any = Log()
    recorder = AuditRecorder(log, str)
    runner = JobRunner(recorder.job_changed)
    job = runner.start("move", "Move X", forever, drive="x", motion=True)
    await asyncio.sleep(0)
    await runner.cancel(job, text("work.page-not-reachable", silent_s=2.0))
    began, ended = log.facts
    assert (began.action, began.outcome) == ("started", None)
    assert ended.action == "cancelled"
    assert ended.outcome == text("work.page-not-reachable", silent_s=2.0)


@pytest.mark.parametrize(
    ("cause", "english", "chinese"),
    [
        (
            text("work.page-not-reachable", silent_s=2.0),
            "Move X was cancelled: the page that started it was not reachable for 2 s",
            "Move X已取消：启动它的页面有 2 s 无法连通",
        ),
        (None, "Move X was cancelled", "Move X已取消"),
    ],
)
async def test_the_command_line_names_the_cause(
    cause: Text | None, english: str, chinese: str
) -> None:
    runner = JobRunner()
    job = runner.start("move", "Move X", forever)
    await asyncio.sleep(0)
    assert job.task is not None
    if cause is None:
        job.task.cancel()
    else:
        job.cancel(cause)
    await job.wait()
    error = _not_done(convert.job(job))
    assert error.text.words("en") == english
    assert error.text.words("zh") == chinese
    assert (remedy := error.remedy_text) is not None
    assert remedy.words("en") != remedy.words("zh")


async def test_who_cancels_by_the_interface_is_named(bench: Bench, http: httpx.AsyncClient) -> None:
    job = start(bench)
    await asyncio.sleep(0)
    answer = (await http.delete(f"/jobs/{job.id}")).json()
    assert answer["state"] == "cancelled"
    cause = answer["cancellation"]["cause_message"]
    assert cause == {"code": "work.cancelled-by", "params": {"person": "local user"}}
    assert job.cancel_cause is not None
    assert answer["cancellation"]["cause"] == "local user cancelled it"
