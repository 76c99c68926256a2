"""Ways out of a motion: whatever ends it, nothing enables later and nobody else is stopped."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest

from backend.api.app import make_app
from backend.api.live.live import LiveHub
from backend.api.security.socket import OpenSockets
from backend.axes.axis.cyclic import CyclicState
from backend.axes.functions.gear import write_gear
from backend.axes.restore.identity import identity_of
from backend.axes.restore.store import RestoreStore
from backend.axes.scales.gear_calculator import GearValue
from backend.foundation.people.elapsed import elapsed_s, moment_of
from backend.foundation.people.identity import LOCAL, Actor, acting
from backend.foundation.people.lease import Leases
from backend.foundation.people.rights import Right
from backend.foundation.people.station import People
from backend.foundation.people.support import Support
from backend.foundation.work.jobs import Progress
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from backend.station.measuring import Exchange, exchange_for
from backend.tools.moving.jog.cyclic import jog_cyclic
from backend.tools.moving.jog.release import END_OF_JOG
from backend.tools.moving.jog.run import Hold, JogSettings
from backend.tools.moving.moves.end_search import limited
from drivers.cia402 import Mode, State
from drivers.errors import Busy, LinkTimeout, NotAllowed
from drivers.texts.message import Text, text
from tests.support.servo import POSITION, STATUS, URL, Servo

ENABLED = 0x237
JOG = JogSettings(1, 60.0, 600.0, 5.0, 50.0)


async def turns(count: int = 20) -> None:
    """Let everything that can run do so."""
    for _ in range(count):
        await asyncio.sleep(0)


async def forever(_progress: Progress) -> None:
    await asyncio.Event().wait()


class Loop:
    """An exchange of several drives whose loop owns the control words."""

    def __init__(self, *connected_drives: ConnectedDrive) -> None:
        self.running, self.stopped = True, 0
        self.trouble: Text | None = None
        self.state = CyclicState(0.002, None, (), ())
        self.drives = tuple(connected.drive for connected in connected_drives)
        self.by_speed: frozenset[str] = frozenset()
        self.cyclic = self
        self.goals: list[State] = []
        self.broken = False
        for connected in connected_drives:
            connected.axis.session = self  # type: ignore[assignment]

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


async def two_axes(bench: Bench, x: ConnectedDrive) -> tuple[ConnectedDrive, Any]:
    y = await bench.connect(URL, 2, "mms7", "Y")
    await y.monitor.close()
    loop = Loop(x, y)
    bench.sessions[URL] = loop  # type: ignore[assignment]
    return y, loop


async def test_the_end_of_a_measurement_leaves_the_exchange_to_an_axis_that_uses_it(
    bench: Bench, x: ConnectedDrive
) -> None:
    """X's measurement started the exchange and ends; Y moves through it and must not be braked."""
    _y, loop = await two_axes(bench, x)
    shared = Exchange(loop, bench, "x", URL, own=True)
    mine = bench.jobs.start("sweep", "Sweep X", forever, drive="x", motion=True)
    moving = bench.jobs.start("move", "Move Y", forever, drive="y", motion=True)
    await shared.end()
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


async def test_its_own_job_does_not_keep_an_exchange(bench: Bench, x: ConnectedDrive) -> None:
    _y, loop = await two_axes(bench, x)
    bench.jobs.start("sweep", "Sweep X", forever, drive="x", motion=True)
    await Exchange(loop, bench, "x", URL, own=True).end()
    assert loop.stopped == 1


async def test_a_measurement_borrows_what_runs_and_does_not_end_it(
    bench: Bench, x: ConnectedDrive
) -> None:
    _y, loop = await two_axes(bench, x)
    shared = await exchange_for(bench, x, 0.001)
    assert shared.session == loop
    await shared.end()
    assert loop.stopped == 0


async def test_an_axis_does_not_take_the_exchange_of_another_off_the_bench(
    bench: Bench, x: ConnectedDrive
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
    bench: Bench, x: ConnectedDrive, servo: Servo, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A scan asks for axes that stand; one that began after the question was reset as it moved."""
    gate = asyncio.Event()

    async def scan(*_what: object, **_how: object) -> list[object]:
        await gate.wait()
        return []

    monkeypatch.setattr(servo, "scan", scan)
    searching = asyncio.create_task(bench.buses.scan(URL, None, lambda _share, _text: None))
    await turns()
    with pytest.raises(Busy, match="a scan is running"):
        bench.jobs.start("move", "Move X", forever, drive="x", motion=True)
    gate.set()
    await searching
    bench.jobs.start("move", "Move X", forever, drive="x", motion=True)


# --- enabling through the loop ------------------------------------------------------------


async def test_what_was_not_enabled_in_time_is_not_enabled_later(x: ConnectedDrive) -> None:
    """No main power: the loop tried on, and enabled by itself when the power came."""
    loop = Loop(x)
    with x.axis.granted("a test"), pytest.raises(NotAllowed, match="does not change to"):
        await x.axis.go_to_cyclic(loop, State.OPERATION_ENABLED, Mode.CSP, 0.01)  # type: ignore[arg-type]
    assert loop.goals == [State.OPERATION_ENABLED, State.SWITCH_ON_DISABLED]


async def test_an_enabling_that_was_cancelled_does_not_go_on(x: ConnectedDrive) -> None:
    loop = Loop(x)
    with x.axis.granted("a test"):
        enabling = asyncio.create_task(
            x.axis.go_to_cyclic(loop, State.OPERATION_ENABLED, Mode.CSP, 5.0)  # type: ignore[arg-type]
        )
        while not loop.goals:  # noqa: ASYNC110 - a list has no event
            await asyncio.sleep(0)
        enabling.cancel()
        await asyncio.wait([enabling])
    assert enabling.cancelled()
    assert loop.goals[-1] is State.SWITCH_ON_DISABLED


async def test_a_disabling_that_fails_enables_nothing(x: ConnectedDrive, servo: Servo) -> None:
    loop = Loop(x)
    servo.enable()
    with pytest.raises(NotAllowed):
        await x.axis.go_to_cyclic(loop, State.SWITCH_ON_DISABLED, None, 0.01)  # type: ignore[arg-type]
    assert loop.goals == [State.SWITCH_ON_DISABLED]


def stop_pending(connected: ConnectedDrive) -> bool:
    """Whether it is commanded to stop as soon as it answers."""
    return connected.axis.stop_pending


# --- leaving ------------------------------------------------------------------------------


async def test_a_motion_whose_loop_does_not_take_its_halt_owes_a_stop(
    x: ConnectedDrive, servo: Servo
) -> None:
    """It is not known what still moves: the drive is shown by itself as soon as it can be."""
    loop, hold = Loop(x), Hold()
    loop.broken = True
    servo.enable()
    hold.release(END_OF_JOG["released"])
    with pytest.raises(LinkTimeout):
        await jog_cyclic(x.axis, loop, JOG, hold, Progress(lambda: None))  # type: ignore[arg-type]
    assert stop_pending(x)
    x.axis.session = None
    await x.monitor.refresh()
    assert not stop_pending(x)
    assert servo.words() == [2]
    assert servo.number(STATUS) != ENABLED


async def test_an_exchange_that_broke_off_in_a_motion_owes_a_stop(x: ConnectedDrive) -> None:
    loop = Loop(x)
    loop.running, loop.trouble = False, text("event.process-died", status=1)
    await x.axis.leave_cyclic(loop, 1.0)  # type: ignore[arg-type]
    assert x.axis.stop_pending


async def test_an_exchange_that_was_ended_in_order_owes_none(x: ConnectedDrive) -> None:
    loop = Loop(x)
    loop.running = False
    await x.axis.leave_cyclic(loop, 1.0)  # type: ignore[arg-type]
    assert not x.axis.stop_pending


class QuickStopping(Loop):
    """The halt ends in ``state``, and the axis has the power until it is disabled."""

    def __init__(self, x: ConnectedDrive, servo: Servo, state: int) -> None:
        super().__init__(x)
        self._servo, self._state = servo, state

    async def halt(self, _station: int) -> None:
        self._servo.set(STATUS, self._state)

    async def drive_to(self, station: int, goal: State, mode: int | None = None) -> None:
        await super().drive_to(station, goal, mode)
        self._servo.set(STATUS, 0x250)


QUICK_STOP = 0x217


def long_ramp(passed_s: float, _reads: int, _off: bool) -> float:
    return 40e6 * passed_s - 8e6 * passed_s**2


def oscillates(_passed_s: float, reads: int, off: bool) -> float:
    return 0.0 if off else 5000.0 * (-1) ** reads


def falls(passed_s: float, _reads: int, off: bool) -> float:
    return 0.0 if off else 1e6 + 8e6 * passed_s**2


def runs_on(passed_s: float, _reads: int, _off: bool) -> float:
    return 10e6 * passed_s


@pytest.mark.parametrize(
    ("course", "state", "goals", "refused"),
    [
        (long_ramp, QUICK_STOP, [], True),
        (oscillates, QUICK_STOP, [State.SWITCH_ON_DISABLED], False),
        (falls, QUICK_STOP, [State.SWITCH_ON_DISABLED], False),
        (runs_on, QUICK_STOP, [State.SWITCH_ON_DISABLED], True),
        (runs_on, ENABLED, [State.SWITCH_ON_DISABLED], True),
        # Without power before: its load swings, and nothing is taken from it.
        (runs_on, 0x231, [State.SWITCH_ON_DISABLED], False),
    ],
)
async def test_an_axis_that_its_drive_still_brakes_keeps_its_power(
    x: ConnectedDrive,
    servo: Servo,
    monkeypatch: pytest.MonkeyPatch,
    course: Callable[[float, int, bool], float],
    state: int,
    goals: list[State],
    refused: bool,
) -> None:
    """It coasted on from 2 s after the halt, and its motion ended as if nothing was."""
    for name, seconds in (("_HALT_S", 0.1), ("_RAMP_S", 0.1), ("_COAST_S", 0.1)):
        monkeypatch.setattr(f"backend.axes.axis.axis.{name}", seconds)
    began_s, reads = time.monotonic(), 0

    def moves(place: tuple[int, int]) -> None:
        nonlocal reads
        if place == POSITION:
            reads += 1
            off = servo.number(STATUS) == 0x250
            servo.set(POSITION, round(course(time.monotonic() - began_s, reads, off)))

    servo.enable()
    servo.on_read = moves
    loop = QuickStopping(x, servo, state)
    if refused:
        with pytest.raises(LinkTimeout, match="still moves"):
            await x.axis.leave_cyclic(loop, 5.0)  # type: ignore[arg-type]
    else:
        await x.axis.leave_cyclic(loop, 5.0)  # type: ignore[arg-type]
    assert loop.goals == goals
    assert stop_pending(x) is refused


# --- settings that change together --------------------------------------------------------


async def test_nothing_begins_to_move_while_its_settings_change(
    bench: Bench, x: ConnectedDrive, servo: Servo
) -> None:
    """The gear was asked for as the axis stood, and written as a jog had begun."""
    transport = httpx.ASGITransport(make_app(bench, hosts=frozenset({"test"})))
    servo.gate.clear()
    async with httpx.AsyncClient(transport=transport, base_url="http://test/api/v1") as http:
        ramp = asyncio.create_task(http.put("/drives/x/parameters/6083:00", json={"raw": 70000}))
        while not bench.motion._still["x"]:  # noqa: ASYNC110 - a count has no event
            await asyncio.sleep(0)
        with pytest.raises(Busy, match="settings are just being changed"):
            bench.jobs.start("move", "Move X", forever, drive="x", motion=True)
        servo.gate.set()
        assert (await ramp).is_success
    bench.jobs.start("move", "Move X", forever, drive="x", motion=True)


async def half_a_gear(
    x: ConnectedDrive, servo: Servo
) -> tuple[asyncio.Task[object], dict[str, int]]:
    """The second of two values is on its way to the drive."""
    keys = ("6091:01", "6091:02")
    before = {key: await x.drive.raw(key) for key in keys}
    values = [GearValue(x.drive.parameter(key), raw + 1) for key, raw in before.items()]

    def hold(_place: tuple[int, int], _value: int) -> None:
        servo.gate.clear()

    servo.on_write = hold
    writing = asyncio.create_task(write_gear(x.axis, values))
    while servo.gate.is_set():  # noqa: ASYNC110 - is cleared by a write
        await asyncio.sleep(0)
    servo.on_write = lambda _place, _value: None
    await turns()
    return writing, before


async def test_a_gear_whose_writing_is_cancelled_is_as_it_was(
    x: ConnectedDrive, servo: Servo
) -> None:
    """Half a gear is another scale: the next move would go to another place."""
    writing, before = await half_a_gear(x, servo)
    writing.cancel()
    await turns()
    servo.gate.set()
    await asyncio.wait([writing])
    assert writing.cancelled()
    assert {key: await x.drive.raw(key) for key in before} == before
    assert not x.drive.pending_restores


async def test_a_gear_that_cannot_be_taken_back_is_pending(x: ConnectedDrive, servo: Servo) -> None:
    writing, before = await half_a_gear(x, servo)
    servo.mute = True
    servo.gate.set()
    with pytest.raises(LinkTimeout, match="not restored"):
        await writing
    assert {entry.key: entry.raw for entry in x.drive.pending_restores.entries} == before


async def test_a_server_killed_with_half_a_gear_has_noted_it(
    bench: Bench, x: ConnectedDrive, servo: Servo, tmp_path: Path
) -> None:
    del bench
    writing, before = await half_a_gear(x, servo)
    noted = RestoreStore(tmp_path, "a server").list_of(identity_of(x.drive), "x").pending.values
    assert {value.key: value.raw for value in noted} == before
    servo.gate.set()
    await writing
    noted = RestoreStore(tmp_path, "a server").list_of(identity_of(x.drive), "x").pending.values
    assert not noted, "a gear that was written stays"


@pytest.mark.parametrize(
    ("now", "allowed"), [(3000, 200), (100, 100), (-3000, -200), (-100, -100), (0, 0)]
)
def test_the_search_for_an_end_is_weak_both_ways(now: int, allowed: int) -> None:
    """A negative limit that is kept below zero stayed at its −300 %."""
    assert limited(now, 200) == allowed


async def test_a_motion_that_a_fault_ended_names_the_fault(x: ConnectedDrive, servo: Servo) -> None:
    """The loop sees only that the drive left Operation enabled; 603Fh states why (004: 3230h)."""
    servo.enable()

    async def motion() -> None:
        async with x.axis.enabled_cyclic(Loop(x), Mode.CSP, 1.0):  # type: ignore[arg-type]
            servo.trip()
            servo.set((0x603F, 0), 0x3230)
            raise NotAllowed("station 1: the drive left Operation enabled: Fault")

    with pytest.raises(NotAllowed, match=r"enabled: Fault \(0x3230 Overload\)"):
        await motion()


async def test_a_motion_that_went_well_until_a_fault_at_its_end_did_not_go_well(
    x: ConnectedDrive, servo: Servo
) -> None:
    """No setpoint was to come any more, so that nobody looked: it ended as if nothing was."""
    servo.enable()

    async def motion() -> None:
        async with x.axis.enabled_cyclic(Loop(x), Mode.CSP, 1.0):  # type: ignore[arg-type]
            servo.trip()
            servo.set((0x603F, 0), 0x3230)

    with pytest.raises(NotAllowed, match=r"end of its motion \(0x3230 Overload\)"):
        await motion()
    assert not stop_pending(x)


# --- clocks that are set ------------------------------------------------------------------


@pytest.mark.parametrize("jump_s", [-86_400.0, 86_400.0])
def test_what_lasts_so_long_lasts_so_long_whatever_the_clock_is_set_to(
    monkeypatch: pytest.MonkeyPatch, jump_s: float
) -> None:
    """Set back by a day, a grant of five minutes lasted a day and five minutes."""
    now, wall = [1000.0], [1.7e9]
    monkeypatch.setattr("time.time", lambda: wall[0])
    support, leases = Support(lambda: now[0]), Leases(ticks=lambda: now[0])
    secret, made = support.invite("Anna", "Guest", frozenset({Right.MOTION}), 3600.0)
    support.join(secret, made.code, "10.0.0.1")
    support.grant(made.id, "Anna", frozenset({Right.MOTION}), 300.0, None)
    leases.take("x", "c1", "Anna")
    leases.hand("x", "c1", "c2", "Ben", 300.0)
    leases.take("y", "c1", "Anna")
    leases.ask("y", "c2", "Ben")

    def tick() -> tuple[bool, str, str]:
        support.tick()
        leases.tick(lambda _drive: False)
        holders = [leases.holder(drive) for drive in "xy"]
        x, y = (holder.person if holder else "" for holder in holders)
        return support.running(made) is not None, x, y

    wall[0] += jump_s
    now[0] += 29.0
    assert tick() == (True, "Ben", "Anna")
    now[0] += 2.0
    assert tick() == (True, "Ben", "Ben")
    now[0] += 268.0
    assert tick() == (True, "Ben", "Ben")
    now[0] += 2.0
    assert tick() == (False, "Anna", "Ben")
    states = [str(made.state)]
    now[0] += 3600.0
    tick()
    assert [*states, made.state] == ["joined", "ended"]


def test_moments_are_shown_by_the_clock_of_now(monkeypatch: pytest.MonkeyPatch) -> None:
    end = elapsed_s() + 60.0
    monkeypatch.setattr("time.time", lambda: 5000.0)
    assert moment_of(end) == pytest.approx(5060.0, abs=1.0)


# --- the watch over pages -----------------------------------------------------------------


class Page:
    """A live connection that was heard of ``ago_s`` ago."""

    def __init__(self, name: str, ago_s: float) -> None:
        self.id, self.identity, self.page = name, LOCAL, ""
        self.heard = time.monotonic() - ago_s
        self.released: list[Text] = []

    def send(self, _message: object) -> None: ...

    def later(self, *_what: object) -> None: ...

    def release(self, _drive: str | None, reason: Text) -> None:
        self.released.append(reason)


@pytest.fixture
def hub(bench: Bench, tmp_path: Path) -> LiveHub:
    return LiveHub(bench, People(tmp_path), OpenSockets())


async def test_a_defect_does_not_end_the_watch_over_silent_pages(
    bench: Bench, hub: LiveHub, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """The dead-man of every motion lived in a task that one exception ended for good."""
    monkeypatch.setattr("backend.api.live.watch._LOOK_S", 0.001)
    broken = iter([True, True])

    def tick(*_what: object) -> None:
        if next(broken, False):
            raise KeyError("a defect")

    monkeypatch.setattr(bench.leases, "tick", tick)
    watch = asyncio.create_task(hub.people.run())
    await asyncio.sleep(0.02)
    acting.set(Actor(LOCAL, "c1"))
    job = bench.jobs.start("move", "Move X", forever, drive="x", motion=True)
    silent: Any = Page("c1", 2.0)
    hub.connections["c1"] = silent
    async with asyncio.timeout(5):
        await job.wait()
    assert job.state == "cancelled"
    assert not watch.done()
    assert "a defect" in caplog.text
    del hub.connections["c1"]
    watch.cancel()
    await asyncio.wait([watch])


async def test_a_page_that_goes_ends_its_motion_whatever_else_fails(
    bench: Bench, hub: LiveHub, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_what: object) -> None:
        raise KeyError("a defect")

    monkeypatch.setattr(hub.people._support, "release_all", broken)
    acting.set(Actor(LOCAL, "c1"))
    job = bench.jobs.start("move", "Move X", forever, drive="x", motion=True)
    bench.leases.take("x", "c1", "Anna")
    gone: Any = Page("c1", 0.0)
    with pytest.raises(KeyError, match="a defect"):
        hub.people.left(gone)
    async with asyncio.timeout(5):
        await job.wait()
    assert job.state == "cancelled"
    assert bench.leases.holder("x") is None


async def test_what_fails_at_the_end_of_the_server_keeps_nothing_else_from_its_end(
    bench: Bench, x: ConnectedDrive, servo: Servo, monkeypatch: pytest.MonkeyPatch
) -> None:
    await x.axis.transition(State.OPERATION_ENABLED, Mode.PP)

    async def broken() -> None:
        raise OSError("no space left on device")

    monkeypatch.setattr(bench.scope, "close", broken)
    closed: list[bool] = []

    async def close() -> None:
        closed.append(True)

    monkeypatch.setattr(servo, "close", close)
    with pytest.raises(OSError, match="no space"):
        await bench.close()
    monkeypatch.undo()
    assert servo.number(STATUS) != ENABLED
    assert closed == [True]


async def test_a_measurement_is_answered_although_its_exchange_is_never_set_up(
    bench: Bench, x: ConnectedDrive, http: httpx.AsyncClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A segment that was killed as it was set up left a request unanswered for half a minute."""
    monkeypatch.setattr("backend.station.measuring.SET_UP_S", 0.1)
    begun: list[str] = []

    async def never(_session: object, _cycle_s: float) -> None:
        begun.append("set up")
        await asyncio.Event().wait()

    monkeypatch.setattr("backend.axes.axis.cyclic.CyclicSession.__init__", lambda *_args: None)
    monkeypatch.setattr("backend.axes.axis.cyclic.CyclicSession.start", never)
    limits = {"travel_limit": 3, "speed_limit": 300, "torque_limit": 60, "time_limit_s": 20}
    for _ in range(2):
        answer = await http.post("/drives/x/jobs/inertia", json=limits)
        assert answer.status_code == 504
        assert answer.json()["code"] == "station.exchange-not-set-up"
    assert len(begun) == 2, "the bus is not kept by the first"
    assert bench.jobs.moving("x") is None
    bench.exchanges.require_calm("X", [URL])


@pytest.mark.long
async def test_a_measurement_does_not_begin_when_stop_was_pressed_as_its_exchange_was_set_up(
    bench: Bench, x: ConnectedDrive, http: httpx.AsyncClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    _y, loop = await two_axes(bench, x)
    begins, goes_on = asyncio.Event(), asyncio.Event()

    async def slowly(bench: Bench, _connected: object, _cycle_s: float) -> Exchange:
        begins.set()
        await goes_on.wait()
        return Exchange(loop, bench, "x", URL, own=True)

    monkeypatch.setattr("backend.api.tuning.measure.exchange_for", slowly)
    monkeypatch.setattr(
        "backend.tools.tuning.sweep.profile_speed.require_consent", lambda *_args: None
    )
    limits = {"travel_limit": 3, "speed_limit": 300, "torque_limit": 60, "time_limit_s": 20}
    measuring = asyncio.create_task(http.post("/drives/x/jobs/inertia", json=limits))
    await begins.wait()
    x.axis.session = None
    await bench.motion.stop(["x"])
    goes_on.set()
    answer = await measuring
    assert answer.status_code == 409
    assert answer.json()["code"] == "axis.stop-pressed-since"
    assert bench.jobs.moving("x") is None
    assert loop.stopped == 1, "the exchange that was set up for it is ended"
