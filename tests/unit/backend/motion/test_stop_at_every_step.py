"""STOP at each access of a motion to its drive: nothing that enables or moves follows it.

A servo in memory answers after a moment, one access after the other, in simulated time. Each
motion runs once to count its accesses, cleanup included, and then once for each of them (of those
in the middle, where the same ones come again and again, for every tenth).
"""

from __future__ import annotations

import asyncio
import tempfile
from collections.abc import Awaitable, Callable, Coroutine
from pathlib import Path

import pytest

from backend.axes.axis.axis import Envelope
from backend.foundation.work.jobs import JobResult, Progress
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from backend.tools.moving.jog.release import END_OF_JOG
from backend.tools.moving.jog.run import Hold, JogSettings, jog
from backend.tools.moving.moves.move import MoveSettings, move
from benchmarks.stopping.clock import run_simulated
from drivers.cia402 import Mode, State
from drivers.errors import DriveError
from drivers.link import Address
from tests.support.servo import (
    CONTROL,
    MODE,
    POSITION,
    STATUS,
    TARGET,
    VELOCITY_TARGET,
    Servo,
    bench_with,
)

ENABLE_BIT, QUICK_STOP, ENABLED = 0x08, 0x02, 0x237
ENVELOPE = Envelope(5.0, 100.0, 50.0, 0.3)
DISABLED = 0x250
ACCESS_S = 0.001
#: At the beginning and at the end of a motion each access is tried.
EDGE = 20
Work = Callable[[Progress], Coroutine[object, object, JobResult]]
Motion = Callable[["Steps"], Awaitable[None]]


class SteppedServo(Servo):
    """Takes one access at a time, in order; ``on_access`` is called when one is asked for."""

    def __init__(self) -> None:
        super().__init__()
        self.accesses = 0
        self.on_access: Callable[[int], None] = lambda _number: None
        self.given: list[tuple[tuple[int, int], int]] = []
        self._turn = asyncio.Lock()

    async def _wait(self) -> None:
        await asyncio.sleep(ACCESS_S)

    def _count(self) -> None:
        self.accesses += 1
        self.on_access(self.accesses)

    async def read(self, station: int, address: Address) -> bytes:
        self._count()
        async with self._turn:
            await self._wait()
            return await super().read(station, address)

    async def write(self, station: int, address: Address, data: bytes) -> None:
        place = (address.index or 0, address.subindex)
        self.given.append((place, int.from_bytes(data, "little", signed=place != CONTROL)))
        self._count()
        async with self._turn:
            await self._wait()
            await super().write(station, address, data)


class Steps:
    """One axis, and STOP pressed at an access of it."""

    def __init__(self, bench: Bench, x: ConnectedDrive, servo: SteppedServo) -> None:
        self.bench, self.x, self.servo = bench, x, servo
        self._stops: list[asyncio.Task[object]] = []
        self._given_at_stop = 0

    async def job(self, work: Work, *, cancel_after_s: float | None = None) -> None:
        """A motion job from its beginning to its end."""
        job = self.bench.jobs.start("move", "Move", work, drive="x", motion=True)
        if cancel_after_s is not None:
            await asyncio.sleep(cancel_after_s)
            await self.bench.jobs.cancel(job)
        await job.wait()

    async def run(self, motion: Motion, stop_at: int | None, turns: int) -> int:
        """Run it from a drive at standstill; returns how many accesses it took without STOP."""
        servo, axis = self.servo, self.x.axis
        servo.set(STATUS, ENABLED if motion is move_while_enabled else DISABLED)
        servo.set(MODE, int(Mode.PV))
        servo.written.clear()
        servo.given.clear()
        self._stops.clear()
        servo.accesses = 0

        def look(number: int) -> None:
            if number == stop_at and not self._stops:
                self._stops.append(asyncio.ensure_future(self._stop(turns)))

        servo.on_access = look
        axis.permit()
        try:
            await motion(self)
        except DriveError:
            assert self._stops, "it fails only by STOP"
        servo.on_access = lambda _number: None
        count = servo.accesses
        await asyncio.gather(*self._stops)
        await self.bench.motion.standstill(["x"])
        await asyncio.sleep(0.05)
        return count

    async def _stop(self, turns: int) -> None:
        for _ in range(turns):
            await asyncio.sleep(0)
        # What is given to the link from here on is given after STOP.
        self._given_at_stop = len(self.servo.given)
        await self.bench.motion.stop(["x"])

    def require_stopped(self, where: str) -> None:
        late = self.servo.given[self._given_at_stop :]
        words = [value for place, value in late if place == CONTROL]
        assert QUICK_STOP in words, where
        assert [word for word in words if word & ENABLE_BIT] == [], where
        setpoints = [(p, v) for p, v in late if p in (TARGET, VELOCITY_TARGET) and v]
        assert setpoints == [], where
        assert {v for p, v in late if p == MODE} <= {int(Mode.PV)}, where
        received = self.servo.words()
        after = received[received.index(QUICK_STOP) :]
        assert [word for word in after if word & ENABLE_BIT] == [], where
        assert self.servo.number(STATUS) != ENABLED, where


async def enable(steps: Steps) -> None:
    """As the Motion page enables: no job that STOP could cancel."""
    await steps.x.axis.transition(State.OPERATION_ENABLED, Mode.PP)


async def move_and_cancel(steps: Steps) -> None:
    """The target is never reached; whoever asked for it ends it, and its cleanup halts."""

    async def work(progress: Progress) -> JobResult:
        return await move(steps.x.axis, MoveSettings("PP", 1.0, ENVELOPE), progress)

    await steps.job(work, cancel_after_s=0.12)


async def jog_and_release(steps: Steps) -> None:
    """Held, a hiccup of the page, held on, released."""
    time_s = asyncio.get_running_loop().time
    hold = Hold(clock=time_s)
    settings = JogSettings(1, 60.0, 600.0, 5.0, 50.0)

    async def page() -> None:
        for number in range(11):
            await asyncio.sleep(0.04)
            if not 2 <= number < 8:
                hold.renew()
        hold.release(END_OF_JOG["released"])

    async def work(progress: Progress) -> JobResult:
        holding = asyncio.create_task(page())
        try:
            return await jog(steps.x.axis, settings, hold, progress)
        finally:
            holding.cancel()

    await steps.job(work)


async def move_while_enabled(steps: Steps) -> None:
    """The same move of an axis that had power before: its cleanup keeps the power on."""
    await move_and_cancel(steps)


def tried(count: int) -> list[int]:
    """Numbers of the accesses at which STOP is pressed."""
    return [n for n in range(1, count + 1) if n <= EDGE or n > count - EDGE or n % 10 == 0]


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("motion", [enable, move_and_cancel, jog_and_release, move_while_enabled])
def test_nothing_enables_or_moves_after_stop_at_any_access(motion: Motion) -> None:
    async def every_access() -> None:
        with tempfile.TemporaryDirectory() as folder:
            servo = SteppedServo()
            bench, x = await bench_with(servo, Path(folder))
            steps = Steps(bench, x, servo)
            servo.set(POSITION, 0)
            try:
                count = await steps.run(motion, None, 0)
                assert any(word & ENABLE_BIT for word in servo.words())
                assert count > 10
                for number in tried(count):
                    await steps.run(motion, number, number % 3)
                    if steps._stops:
                        steps.require_stopped(f"STOP at access {number} of {count}")
            finally:
                await bench.close()

    run_simulated(every_access)
