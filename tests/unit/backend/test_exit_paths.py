"""Ways out of a motion: whatever ends it, nothing enables later and nobody else is stopped."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest

from backend.bench import Bench, Member
from backend.cyclic import CyclicState
from backend.jobs import Progress
from backend.measuring import Exchange, exchange_for
from backend.tools.cyclic_motion import jog_cyclic
from backend.tools.jog import Hold, JogSettings
from drivers.cia402 import Mode, State
from drivers.errors import Busy, LinkTimeout, NotAllowed
from tests.support.servo import STATUS, URL, Servo, bench_with

ENABLED = 0x237
JOG = JogSettings(1, 60.0, 600.0, 5.0, 50.0)


@pytest.fixture
async def servo() -> Servo:
    return Servo()


@pytest.fixture
async def bench(servo: Servo, tmp_path: Path) -> AsyncIterator[Bench]:
    bench, _ = await bench_with(servo, tmp_path)
    yield bench
    servo.mute = False
    servo.gate.set()
    await bench.close()


@pytest.fixture
def x(bench: Bench) -> Member:
    return bench.member("x")


async def turns(count: int = 20) -> None:
    """Let everything that can run do so."""
    for _ in range(count):
        await asyncio.sleep(0)


async def forever(_progress: Progress) -> None:
    await asyncio.Event().wait()


class Loop:
    """An exchange of several drives whose loop owns the control words."""

    def __init__(self, *members: Member) -> None:
        self.running, self.trouble, self.stopped = True, "", 0
        self.state = CyclicState(0.002, None, (), ())
        self.drives = tuple(member.drive for member in members)
        self.by_speed: frozenset[str] = frozenset()
        self.cyclic = self
        self.goals: list[State] = []
        self.broken = False
        for member in members:
            member.axis.session = self  # type: ignore[assignment]

    def power(self) -> Loop:
        return self

    def station(self, _drive: object) -> int:
        return 1

    async def drive_to(self, _station: int, goal: State, _mode: int | None = None) -> None:
        await asyncio.sleep(0)
        self.goals.append(goal)

    async def halt(self, _station: int) -> None:
        if self.broken:
            raise LinkTimeout("the process did not answer 'halt' within 5 s")

    async def stop(self) -> None:
        self.stopped += 1


# --- an exchange that several axes use --------------------------------------------------


async def two_axes(bench: Bench, x: Member) -> tuple[Member, Any]:
    y = await bench.connect(URL, 2, "mms7", "Y")
    await y.monitor.close()
    loop = Loop(x, y)
    bench.sessions[URL] = loop  # type: ignore[assignment]
    return y, loop


async def test_the_end_of_a_measurement_leaves_the_exchange_to_an_axis_that_borrowed_it(
    bench: Bench, x: Member
) -> None:
    """X's measurement started the exchange and ends; Y moves through it and must not be braked."""
    _y, loop = await two_axes(bench, x)
    lent = Exchange(loop, bench, "x", URL, own=True)
    mine = bench.jobs.start("sweep", "Sweep X", forever, drive="x", motion=True)
    moving = bench.jobs.start("move", "Move Y", forever, drive="y", motion=True)
    await lent.end()
    await turns()
    assert loop.stopped == 0
    assert bench.sessions[URL] == loop
    await bench.jobs.cancel(moving)
    await turns()
    assert loop.stopped == 0, "its own job has not come to its end yet"
    await bench.jobs.cancel(mine)
    await turns()
    assert loop.stopped == 1
    assert URL not in bench.sessions
    assert x.axis.session is None


async def test_its_own_job_does_not_keep_an_exchange(bench: Bench, x: Member) -> None:
    _y, loop = await two_axes(bench, x)
    bench.jobs.start("sweep", "Sweep X", forever, drive="x", motion=True)
    await Exchange(loop, bench, "x", URL, own=True).end()
    assert loop.stopped == 1


async def test_a_measurement_borrows_what_runs_and_does_not_end_it(bench: Bench, x: Member) -> None:
    _y, loop = await two_axes(bench, x)
    borrowed = await exchange_for(bench, x, 0.001)
    assert borrowed.session == loop
    await borrowed.end()
    assert loop.stopped == 0


async def test_an_axis_does_not_take_the_exchange_of_another_off_the_bench(
    bench: Bench, x: Member
) -> None:
    _y, loop = await two_axes(bench, x)
    moving = bench.jobs.start("move", "Move Y", forever, drive="y", motion=True)
    with pytest.raises(Busy, match="shares its cyclic exchange with Y"):
        await bench.remove("x")
    assert loop.stopped == 0
    await bench.jobs.cancel(moving)
    await bench.remove("x")
    assert loop.stopped == 1


async def test_no_motion_begins_on_a_bus_that_is_searched(
    bench: Bench, x: Member, servo: Servo, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A scan asks for axes that stand; one that began after the question was reset as it moved."""
    gate = asyncio.Event()

    async def scan(*_what: object) -> list[object]:
        await gate.wait()
        return []

    monkeypatch.setattr(servo, "scan", scan)
    searching = asyncio.create_task(bench.scan(URL, None, lambda _share, _text: None))
    await turns()
    with pytest.raises(Busy, match="looked for"):
        bench.jobs.start("move", "Move X", forever, drive="x", motion=True)
    gate.set()
    await searching
    bench.jobs.start("move", "Move X", forever, drive="x", motion=True)


# --- enabling through the loop ------------------------------------------------------------


async def test_what_was_not_enabled_in_time_is_not_enabled_later(x: Member) -> None:
    """No main power: the loop tried on, and enabled by itself when the power came."""
    loop = Loop(x)
    with pytest.raises(NotAllowed, match="does not go to"):
        await x.axis.go_to_cyclic(loop, State.OPERATION_ENABLED, Mode.CSP, 0.01)  # type: ignore[arg-type]
    assert loop.goals == [State.OPERATION_ENABLED, State.SWITCH_ON_DISABLED]


async def test_an_enabling_that_was_cancelled_does_not_go_on(x: Member) -> None:
    loop = Loop(x)
    enabling = asyncio.create_task(
        x.axis.go_to_cyclic(loop, State.OPERATION_ENABLED, Mode.CSP, 5.0)  # type: ignore[arg-type]
    )
    while not loop.goals:  # noqa: ASYNC110 - a list has no event
        await asyncio.sleep(0)
    enabling.cancel()
    await asyncio.wait([enabling])
    assert enabling.cancelled()
    assert loop.goals[-1] is State.SWITCH_ON_DISABLED


async def test_a_disabling_that_fails_enables_nothing(x: Member, servo: Servo) -> None:
    loop = Loop(x)
    servo.enable()
    with pytest.raises(NotAllowed):
        await x.axis.go_to_cyclic(loop, State.SWITCH_ON_DISABLED, None, 0.01)  # type: ignore[arg-type]
    assert loop.goals == [State.SWITCH_ON_DISABLED]


def owes_stop(member: Member) -> bool:
    """Whether it is told to stop as soon as it answers."""
    return member.axis.owes_stop


# --- leaving ------------------------------------------------------------------------------


async def test_a_motion_whose_loop_does_not_take_its_halt_owes_a_stop(
    x: Member, servo: Servo
) -> None:
    """Nobody knows what still moves: the drive is told by itself as soon as it can be."""
    loop, hold = Loop(x), Hold()
    loop.broken = True
    servo.enable()
    hold.release("released")
    with pytest.raises(LinkTimeout):
        await jog_cyclic(x.axis, loop, JOG, hold, Progress(lambda: None))  # type: ignore[arg-type]
    assert owes_stop(x)
    x.axis.session = None
    await x.monitor.refresh()
    assert not owes_stop(x)
    assert servo.words() == [2]
    assert servo.number(STATUS) != ENABLED


async def test_an_exchange_that_broke_off_in_a_motion_owes_a_stop(x: Member) -> None:
    loop = Loop(x)
    loop.running, loop.trouble = False, "the process died"
    await x.axis.leave_cyclic(loop, 1.0)  # type: ignore[arg-type]
    assert x.axis.owes_stop


async def test_an_exchange_that_was_ended_in_order_owes_none(x: Member) -> None:
    loop = Loop(x)
    loop.running = False
    await x.axis.leave_cyclic(loop, 1.0)  # type: ignore[arg-type]
    assert not x.axis.owes_stop
