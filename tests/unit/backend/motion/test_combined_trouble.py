"""Races that `benchmarks.chaos` and reading for it found, each in its smallest form."""

from __future__ import annotations

import asyncio
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from backend.api.live.connection import Connection
from backend.api.live.live import LiveHub
from backend.api.live.messages import ScopeChannel, ScopeStart
from backend.api.security.socket import OpenSockets
from backend.axes.axis.axis import Envelope
from backend.axes.axis.cyclic import CyclicSession
from backend.foundation.people.identity import LOCAL, Actor, acting
from backend.foundation.people.station import People
from backend.foundation.work.jobs import JobRunner, Progress
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from backend.station.drives.monitor import Snapshot
from backend.station.measuring import Exchange
from drivers.cia402 import Mode, State
from drivers.errors import Busy, LinkTimeout, NotAllowed
from drivers.link import CyclicSignal
from tests.support.servo import CONTROL, STATUS, URL, Servo

ENABLED = 0x237
QUICK, PROFILE = (0x6085, 0), (0x6084, 0)


async def nothing(_progress: Progress) -> None:
    """Work that would move."""


async def turns(count: int = 20) -> None:
    """Let everything that can run do so."""
    for _ in range(count):
        await asyncio.sleep(0)


def begin(bench: Bench) -> None:
    bench.jobs.start("move", "Move X", nothing, drive="x", motion=True)


async def test_an_axis_that_left_the_bench_unstopped_is_stopped_when_it_comes_back(
    bench: Bench, x: ConnectedDrive, servo: Servo
) -> None:
    """Taken off while its cable was pulled and connected again: it stayed enabled."""
    await x.axis.transition(State.OPERATION_ENABLED, Mode.PP)
    servo.mute = True
    await bench.remove("x")
    servo.mute = False
    assert servo.number(STATUS) == ENABLED
    again = await bench.connect(URL, 1, "mms7", "X")
    await again.monitor.close()
    await again.monitor.refresh()
    assert servo.number(STATUS) != ENABLED
    assert not again.axis.stop_pending
    await bench.remove("x")
    servo.enable()
    third = await bench.connect(URL, 1, "mms7", "X")
    await third.monitor.close()
    await third.monitor.refresh()
    assert servo.number(STATUS) == ENABLED, "a stop is pending once"


class SlowSession:
    """An exchange whose end takes as long as ``gate`` is shut."""

    def __init__(self, *, running: bool) -> None:
        self.running, self.gate, self.stopped = running, asyncio.Event(), 0
        self.drives: tuple[object, ...] = ()

    async def stop(self) -> None:
        self.stopped += 1
        await self.gate.wait()

    def power(self) -> None: ...


async def test_nothing_begins_to_move_on_its_way_off_the_bench(
    bench: Bench, x: ConnectedDrive, servo: Servo
) -> None:
    """STOP reaches the drives of the bench: one that moved after it left would be out of reach."""
    await x.axis.transition(State.OPERATION_ENABLED, Mode.PP)
    servo.gate.clear()
    removing = asyncio.create_task(bench.remove("x"))
    async with asyncio.timeout(60):
        while not bench.motion._parting:  # noqa: ASYNC110 - a set has no event
            await asyncio.sleep(0)
    await asyncio.sleep(0.05)
    with pytest.raises(Busy, match="removed from the axis list"):
        begin(bench)
    with pytest.raises(Busy, match="removed from the axis list"):
        await bench.remove("x")
    servo.gate.set()
    await removing
    assert "x" not in bench.connected_drives
    assert servo.number(STATUS) != ENABLED


async def test_no_motion_begins_while_the_exchange_ends(bench: Bench) -> None:
    """The loop brakes and disables until it has ended; a motion by mailbox would fight it."""
    session = SlowSession(running=True)
    bench.sessions[URL] = session  # type: ignore[assignment]
    ending = asyncio.create_task(bench.stop_cyclic(URL))
    await turns()
    with pytest.raises(Busy, match="just being"):
        begin(bench)
    with pytest.raises(Busy, match="just being changed"):
        await bench.stop_cyclic(URL)
    with pytest.raises(Busy, match="just being changed"):
        await bench.start_cyclic(URL, 0.001)
    session.gate.set()
    await ending
    begin(bench)


async def test_of_two_starts_of_the_exchange_one_is_refused(bench: Bench) -> None:
    """Both found the old exchange broken off and waited for its end."""
    session = SlowSession(running=False)
    bench.sessions[URL] = session  # type: ignore[assignment]
    first = asyncio.create_task(bench.start_cyclic(URL, 0.001))
    await turns()
    with pytest.raises(Busy, match="just being changed"):
        await bench.start_cyclic(URL, 0.001)
    session.gate.set()
    with pytest.raises(NotAllowed, match="no cyclic process data"):
        await first  # this servo has none
    assert session.stopped == 1
    begin(bench)


class LateCyclic:
    """An exchange that is running, but whose answer comes too late."""

    def __init__(self) -> None:
        self.running = False
        self.power = self.speeds = None

    async def configure(
        self, inputs: list[CyclicSignal], _outputs: object, _cycle_s: float
    ) -> tuple[CyclicSignal, ...]:
        return tuple(inputs)

    async def start(self) -> None:
        self.running = True
        raise LinkTimeout("no answer in 25 s")

    async def stop(self) -> None:
        self.running = False


async def test_an_exchange_that_started_too_late_is_ended(x: ConnectedDrive, servo: Servo) -> None:
    """Nobody would know that it owns the drives' control words."""
    servo.cyclic = cyclic = LateCyclic()  # type: ignore[assignment]
    session = CyclicSession(servo, [x.drive])
    with pytest.raises(LinkTimeout):
        await session.start(0.001)
    assert not cyclic.running
    assert session.state is None


async def test_a_measurement_cancelled_before_its_first_step_ends_its_exchange() -> None:
    """A task that is cancelled then never comes to its ``finally``."""
    ended: list[str] = []

    async def stop_when_idle(url: str, _session: object, _but: str) -> None:
        ended.append(url)

    bench = SimpleNamespace(exchanges=SimpleNamespace(stop_when_idle=stop_when_idle))
    exchange = Exchange(None, bench, "x", URL, own=True)  # type: ignore[arg-type]
    job = JobRunner().start("sweep", "Sweep X", nothing, drive="x", motion=True)
    exchange.ends_with(job)
    assert job.task is not None
    job.task.cancel()
    await turns()
    assert job.state == "cancelled"
    assert ended == [URL]


# --- a page that is gone ------------------------------------------------------------------


class Page:
    """A live connection, as far as people are concerned."""

    def __init__(self, name: str) -> None:
        self.id, self.identity, self.page, self.heard = name, LOCAL, "", 0.0

    def send(self, _message: object) -> None: ...

    def later(self, *_what: object) -> None: ...

    def release(self, *_what: object) -> None: ...


async def _enabled_by(x: ConnectedDrive, page: Page) -> None:
    acting.set(Actor(LOCAL, page.id))
    await x.axis.transition(State.OPERATION_ENABLED, Mode.PP)


async def _left(bench: Bench, tmp_path: Path, *pages: Page) -> Any:
    hub = LiveHub(bench, People(tmp_path), OpenSockets())
    for page in pages:
        hub.people.left(page)  # type: ignore[arg-type]
    await asyncio.gather(*hub.people._motions._tasks)
    return hub


async def test_what_a_page_enabled_loses_its_power_with_it(
    bench: Bench, x: ConnectedDrive, servo: Servo, tmp_path: Path
) -> None:
    page = Page("c1")
    await _enabled_by(x, page)
    assert servo.number(STATUS) == ENABLED
    await _left(bench, tmp_path, page)
    assert servo.number(STATUS) != ENABLED
    assert any("is disabled" in entry.text for entry in bench.journal.entries())


async def test_who_controls_the_axis_looks_after_it_from_then_on(
    bench: Bench, x: ConnectedDrive, servo: Servo, tmp_path: Path
) -> None:
    first, second = Page("c1"), Page("c2")
    await _enabled_by(x, first)
    bench.leases.take("x", second.id, "Kim")
    await _left(bench, tmp_path, first)
    assert servo.number(STATUS) == ENABLED
    await _left(bench, tmp_path, second)
    assert servo.number(STATUS) != ENABLED


async def test_what_no_page_enabled_stays_as_it_is(
    bench: Bench, x: ConnectedDrive, servo: Servo, tmp_path: Path
) -> None:
    """A script enables for itself, and other masters do on their own."""
    acting.set(Actor(LOCAL, None))
    await x.axis.transition(State.OPERATION_ENABLED, Mode.PP)
    await _left(bench, tmp_path, Page("c1"))
    assert servo.number(STATUS) == ENABLED


# --- what a page looks at -----------------------------------------------------------------


class Silent:
    """The wire of a page."""

    async def send_bytes(self, _data: bytes) -> None: ...


def connection(bench: Bench, tmp_path: Path) -> Connection:
    hub = LiveHub(bench, People(tmp_path), OpenSockets())
    return Connection("c1", Silent(), bench, hub.people, People(tmp_path), LOCAL)  # type: ignore[arg-type]


async def test_a_drive_put_back_on_the_bench_is_watched_as_often_as_before(
    bench: Bench, tmp_path: Path
) -> None:
    """It has another monitor; a count of watchers went below zero with the page that left."""
    page = connection(bench, tmp_path)
    page._watch({"x"})
    await bench.remove("x")
    again = await bench.connect(URL, 1, "mms7", "X")
    await again.monitor.close()
    page._watch({"x"})
    assert again.monitor.watchers == {"c1"}
    page._watch({"x"})
    assert again.monitor.watchers == {"c1"}
    await page.close()
    assert not again.monitor.watchers


async def test_a_scope_of_a_drive_that_goes_while_it_is_begun_is_refused_and_leaves_nothing(
    bench: Bench, x: ConnectedDrive, servo: Servo, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It ended the page's whole connection, and the drive was polled for ever."""
    page = connection(bench, tmp_path)

    async def gone(_drive: str) -> None:
        del bench.connected_drives["x"]

    monkeypatch.setattr(page.scopes, "_units", gone)
    request = ScopeStart(subscription=1, channels=[ScopeChannel(drive="x", key="6064:00")])
    before = asyncio.all_tasks()
    await page.scopes._start(request)
    bench.connected_drives["x"] = x
    assert not page.scopes._running[1].streams
    assert asyncio.all_tasks() <= before
    await page.close()


async def test_a_signal_is_polled_under_its_makers_number_too(tmp_path: Path) -> None:
    """The sampler looked for the number among the keys, and ended without a word."""
    servo = Servo("r6l")
    servo.kind = "ethercat"
    bench = Bench(tmp_path, {URL: lambda: servo})
    x = await bench.connect(URL, 1, "r6l", "X")
    parameter = x.drive.parameter("2006:01")
    assert parameter.number
    ((stream, places),) = bench.scope.subscribe("x", [parameter.number], 0.2)
    assert places == (0,)
    async with asyncio.timeout(60):
        await stream.ready.wait()
    block = stream.queue.popleft()
    assert block.samples[0, 0] == x.drive.readings["2006:01"].value
    await bench.scope.unsubscribe(stream)
    await bench.close()


async def test_a_page_that_goes_while_its_scope_is_begun_leaves_no_poll(
    bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = connection(bench, tmp_path)
    waiting = asyncio.Event()

    async def never(_drive: str) -> None:
        waiting.set()
        await asyncio.Event().wait()

    monkeypatch.setattr(page.scopes, "_units", never)
    request = ScopeStart(subscription=1, channels=[ScopeChannel(drive="x", key="6064:00")])
    before = asyncio.all_tasks()
    beginning = asyncio.create_task(page.scopes._start(request))
    await waiting.wait()
    beginning.cancel()
    await asyncio.wait([beginning])
    await page.close()
    assert asyncio.all_tasks() <= before


# --- STOP ---------------------------------------------------------------------------------


class BreakingOff:
    """An exchange that ends between the question whether it runs and the halt."""

    def __init__(self) -> None:
        self.running = True
        self.cyclic = self

    def power(self) -> BreakingOff:
        return self

    def station(self, _drive: object) -> int:
        return 1

    async def halt(self, _station: int) -> None:
        self.running = False
        raise NotAllowed("the cyclic exchange does not run")


async def test_a_stop_that_an_ending_exchange_refused_is_sent_again(
    x: ConnectedDrive, servo: Servo
) -> None:
    servo.enable()
    x.axis.session = BreakingOff()  # type: ignore[assignment]
    with pytest.raises(NotAllowed):
        await x.axis.stop()
    assert servo.number(STATUS) == ENABLED
    await x.monitor.refresh()
    assert servo.number(STATUS) != ENABLED
    assert [word & 0xF for word in servo.words()] == [2]


async def test_stop_brakes_at_least_as_hard_as_the_motion_that_it_stops(
    x: ConnectedDrive, servo: Servo
) -> None:
    """An R6L is shipped with 60 rpm/s (002: 6085h): STOP from 300 rpm would take 5 s."""
    servo.set(QUICK, 65536)
    servo.set(PROFILE, 3 * 65536)
    async with x.axis.enabled(Mode.PP, Envelope(5.0, 100.0, 50.0, 10.0)):
        assert servo.number(QUICK) == 3 * 65536
    assert servo.number(QUICK) == 65536
    servo.set(QUICK, 9 * 65536)
    async with x.axis.enabled(Mode.PP, Envelope(5.0, 100.0, 50.0, 10.0)):
        assert servo.number(QUICK) == 9 * 65536, "none is lowered"


async def test_a_cancelled_stop_is_sent_again(x: ConnectedDrive, servo: Servo) -> None:
    servo.enable()
    servo.gate.clear()
    stopping = asyncio.create_task(x.axis.quick_stop())
    await turns()
    stopping.cancel()
    await asyncio.wait([stopping])
    servo.gate.set()
    await x.monitor.refresh()
    assert servo.number(STATUS) != ENABLED
    assert CONTROL in [place for place, _ in servo.written]


def shown(connected: ConnectedDrive) -> Snapshot:
    """What pages see of the axis."""
    return connected.monitor.snapshot


async def test_the_watch_over_a_drive_does_not_end_unseen(
    x: ConnectedDrive, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """The last state would be shown as the present one for ever."""
    assert (await x.monitor.refresh()).fresh

    async def broken() -> object:
        raise KeyError("a defect")

    monkeypatch.setattr(x.monitor, "_read", broken)
    x.monitor.start()
    async with asyncio.timeout(60):
        while shown(x).fresh:  # noqa: ASYNC110 - polls what it shows
            await asyncio.sleep(0.01)
    assert "a defect" in str(shown(x).problem)
    assert "cannot be shown" in caplog.text
    monkeypatch.undo()
    x.monitor.hurry()
    async with asyncio.timeout(60):
        while not shown(x).fresh:  # noqa: ASYNC110 - polls what it shows
            await asyncio.sleep(0.01)
    await x.monitor.close()
