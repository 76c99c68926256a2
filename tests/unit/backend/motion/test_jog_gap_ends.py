"""What happens in the gap of a jog decides over it: signs of life that come back do not.

Without a cyclic exchange, in simulated time: the page falls silent after 0.3 s of motion, something
happens 0.3 s later, and its signs are back 0.4 s after the gap's begin, in time to go on.
"""

from __future__ import annotations

import asyncio
import tempfile
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from backend.api.live.jog import Jogs
from backend.api.live.messages import JogRenew, JogStart
from backend.foundation.people.identity import LOCAL, Actor, acting
from backend.foundation.work.jobs import Job, JobResult, Progress
from backend.station.bench import Bench
from backend.tools.moving.jog.release import END_OF_JOG
from backend.tools.moving.jog.run import Hold, JogSettings, jog
from benchmarks.stopping.clock import run_simulated
from drivers.errors import Busy
from drivers.texts.message import text
from tests.support.servo import CONTROL, STATUS, TARGET, Servo, bench_with

SETTINGS = JogSettings(1, 60.0, 600.0, 5.0, 50.0)
ENABLED, ENABLES, HALT = 0x237, 0x0F, 0x100
SIGN_S, SILENT_S, HAPPENS_S, BACK_S = 0.04, 0.3, 0.62, 0.7


@dataclass
class Jogged:
    """An axis in the gap of a jog; ``hold`` is that of the page."""

    bench: Bench
    servo: Servo
    hold: Hold
    job: Job
    patch: pytest.MonkeyPatch

    async def end_the_grant(self) -> None:
        """The grant has ended, and other work has one for the axis before the signs are back."""
        self.bench.authority.end_motion("x", text("motion.session-is-over"))
        grant = self.bench.authority.standing(
            "x", "another motion", lasts_s=60.0, ended=lambda _why: None
        )
        asyncio.get_running_loop().call_later(1.0, self.bench.authority.end, grant)

    async def nothing(self) -> None:
        """The page was busy, and no more."""

    async def stop(self) -> None:
        """Anybody pressed STOP."""
        await self.bench.motion.stop(["x"])

    async def lose_the_right(self) -> None:
        """The log-in ended."""
        self.bench.authority.end_of("visit", text("motion.session-is-over"))

    async def trip(self) -> None:
        """The drive has a fault."""
        self.servo.trip()

    async def release(self) -> None:
        """The button was let go."""
        self.hold.release(END_OF_JOG["released"], 1)

    async def set_the_clock(self) -> None:
        """The computer's clock was set forward by an hour."""
        self._set_the_clock(3600.0)

    async def set_the_clock_back(self) -> None:
        """The same the other way."""
        self._set_the_clock(-3600.0)

    def _set_the_clock(self, by_s: float) -> None:
        now = time.time
        self.patch.setattr(time, "time", lambda: now() + by_s)

    async def lose_power_elsewhere(self) -> None:
        """Another program took the power off."""
        self.servo.set(STATUS, 0x250)


def after_gap(happens: Callable[[Jogged], Awaitable[None]]) -> tuple[list[int], bool, Job]:
    """Control words and whether there were new targets after it, and the job."""
    found: list[tuple[list[int], bool, Job]] = []

    async def main() -> None:
        acting.set(Actor(replace(LOCAL, session="visit")))
        with tempfile.TemporaryDirectory() as folder:
            servo = Servo()
            bench, x = await bench_with(servo, Path(folder))
            hold = Hold(1, clock=asyncio.get_running_loop().time)

            async def work(progress: Progress) -> JobResult:
                return await jog(x.axis, SETTINGS, hold, progress)

            async def page() -> None:
                while servo.number(STATUS) != ENABLED:
                    hold.renew(1)
                    await asyncio.sleep(SIGN_S)
                for number in range(int(1.5 / SIGN_S)):
                    if not SILENT_S < number * SIGN_S < BACK_S:
                        hold.renew(1)
                    await asyncio.sleep(SIGN_S)
                hold.release(END_OF_JOG["released"], 1)

            job = bench.jobs.start("jog", "Jog", work, drive="x", motion=True)
            signs = asyncio.create_task(page())
            while servo.number(STATUS) != ENABLED:  # noqa: ASYNC110 - in simulated time
                await asyncio.sleep(0.01)
            await asyncio.sleep(HAPPENS_S)
            assert servo.words()[-1] & HALT, "the gap has braked the axis"
            count = len(servo.written)
            with pytest.MonkeyPatch.context() as patch:
                await happens(Jogged(bench, servo, hold, job, patch))
                await asyncio.gather(job.wait(), signs)
            late = servo.written[count:]
            words = [int.from_bytes(data, "little") for place, data in late if place == CONTROL]
            found.append((words, any(place == TARGET for place, _ in late), job))
            assert servo.number(STATUS) != ENABLED, "it has power after the end"
            await bench.close()

    run_simulated(main)
    return found[0]


@pytest.mark.parametrize(
    "happens", [Jogged.nothing, Jogged.set_the_clock, Jogged.set_the_clock_back]
)
def test_a_gap_in_which_nothing_happens_is_gone_over(
    happens: Callable[[Jogged], Awaitable[None]],
) -> None:
    """The time of day is no matter of the hold and its grant."""
    words, targets, job = after_gap(happens)
    assert targets
    assert any(word & ENABLES == ENABLES and not word & HALT for word in words)
    assert job.state == "done"


@pytest.mark.parametrize(
    "happens",
    [
        Jogged.stop,
        Jogged.lose_the_right,
        Jogged.end_the_grant,
        Jogged.trip,
        Jogged.release,
        Jogged.lose_power_elsewhere,
    ],
)
def test_what_happens_in_a_gap_is_final(happens: Callable[[Jogged], Awaitable[None]]) -> None:
    words, targets, _job = after_gap(happens)
    assert not targets, "a new target would move it on"
    # Halt may be written again; a word that enables without it would end the halt.
    assert all(word & HALT for word in words if word & ENABLES == ENABLES), words


async def test_the_signs_of_one_page_keep_no_jog_of_another_alive(tmp_path: Path) -> None:
    """Two pages of one person hold their buttons for the same axis."""
    bench, _x = await bench_with(Servo(), tmp_path)
    first, second = (Jogs(bench, name, lambda _message: None) for name in ("page 1", "page 2"))
    request = JogStart(
        drive="x",
        direction=1,
        speed=60.0,
        acceleration=600.0,
        travel_limit=5.0,
        torque_limit=50.0,
        press=1,
    )
    first.start(request, "Anna")
    hold = first._holds["x"]
    try:
        with pytest.raises(Busy):
            second.start(request, "Anna")
        alive = hold._alive
        second.renew(JogRenew(drive="x", press=1, sign=1))
        assert hold._alive == alive, "a sign of the other page"
        second.release("x", END_OF_JOG["released"], 1)
        assert hold.released is None
        first.release("x", END_OF_JOG["released"], 1)
        assert hold.released == END_OF_JOG["released"]
        first.renew(JogRenew(drive="x", press=1, sign=2))
        assert hold.ended() == END_OF_JOG["released"]
    finally:
        await bench.close()
