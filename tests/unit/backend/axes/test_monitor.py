"""What an axis reports next to a cyclic exchange: process data, and the drive itself."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Iterable, Sequence
from functools import partial
from typing import cast

import pytest

from backend.axes.axis.cyclic import CyclicSession
from backend.axes.drive.drive import Drive
from backend.axes.drive.readings import Reading
from backend.foundation.work.journal import Journal
from backend.station.drives import monitor as watching
from backend.station.drives.connected_drive import ConnectedDrive
from drivers.cia402 import State
from drivers.texts.message import text
from tests.support.servo import STATUS, Servo

STATUS_KEY, POSITION_KEY, ERROR_KEY = "6041:00", "6064:00", "603F:00"


class Exchange:
    """An exchange that brings ``values`` with every cycle."""

    running = True

    def __init__(self, values: dict[str, int | float]) -> None:
        self.values = values

    def newest(self, drive: Drive, keys: Sequence[str], within_s: float) -> dict[str, int | float]:
        return {key: raw for key, raw in self.values.items() if key in keys}

    def power(self) -> None:
        return None


class Clock:
    def __init__(self) -> None:
        self.now_s = 1000.0

    def monotonic(self) -> float:
        return self.now_s

    def time(self) -> float:
        return 1.7e9 + self.now_s


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(watching, "time", clock)
    return clock


@pytest.fixture
async def exchange(x: ConnectedDrive, servo: Servo, clock: Clock) -> Exchange:
    """Of a drive that was looked at as a whole just now."""
    exchange = Exchange({STATUS_KEY: servo.number(STATUS), POSITION_KEY: 0, ERROR_KEY: 0})
    x.axis.session = cast(CyclicSession, exchange)
    await polled(x)
    return exchange


async def polled(x: ConnectedDrive) -> watching.Snapshot:
    return await x.monitor._poll(x.monitor._read_what_changes)


async def test_what_every_cycle_brings_is_not_asked_for(
    x: ConnectedDrive, servo: Servo, exchange: Exchange, clock: Clock
) -> None:
    asked: list[int | None] = []
    servo.on_read = lambda place: asked.append(place[0])
    exchange.values[POSITION_KEY] = 12_345
    clock.now_s += 0.1
    snapshot = await polled(x)
    assert snapshot.fresh
    assert snapshot.values["position"] == (await x.axis.units()).position(12_345)
    assert not {0x6041, 0x6064, 0x603F} & set(asked)
    assert x.drive.readings[POSITION_KEY].raw == 12_345, "the parameter table shows it, too"


async def test_a_dead_mailbox_is_reported_although_process_data_go_on(
    x: ConnectedDrive, servo: Servo, exchange: Exchange, clock: Clock
) -> None:
    servo.mute = True
    clock.now_s += watching.ASKED_S
    snapshot = await polled(x)
    assert not snapshot.fresh
    assert "no answer" in str(snapshot.problem)
    clock.now_s += 0.1
    assert not (await polled(x)).fresh, "until the drive itself has answered"
    servo.mute = False
    clock.now_s += 0.1
    assert (await polled(x)).fresh


async def test_why_the_status_word_is_not_known_stays_a_message(
    x: ConnectedDrive, monkeypatch: pytest.MonkeyPatch
) -> None:
    gone = text("ethercat.station-no-longer-answers")

    async def unread(keys: Iterable[str]) -> dict[str, Reading]:
        return {key: Reading(key, None, None, None, gone) for key in keys}

    monkeypatch.setattr(x.drive, "read_many", unread)
    assert (await x.monitor.refresh()).problem == gone


@pytest.mark.parametrize("key", [STATUS_KEY, ERROR_KEY])
async def test_a_change_has_everything_asked_for(
    x: ConnectedDrive, servo: Servo, exchange: Exchange, clock: Clock, key: str
) -> None:
    servo.enable()
    exchange.values[key] = {STATUS_KEY: servo.number(STATUS), ERROR_KEY: 0x7305}[key]
    clock.now_s += 0.1
    assert (await polled(x)).state is State.OPERATION_ENABLED, "as the drive itself says"


async def test_bits_of_a_motion_are_no_change_of_state(
    x: ConnectedDrive, servo: Servo, exchange: Exchange, clock: Clock
) -> None:
    servo.mute = True
    exchange.values[STATUS_KEY] = servo.number(STATUS) | 0x0400
    clock.now_s += 0.1
    snapshot = await polled(x)
    assert snapshot.target_reached


async def test_process_data_that_end_are_no_values(
    x: ConnectedDrive, servo: Servo, exchange: Exchange, clock: Clock
) -> None:
    """A lost station, an invalid cycle or old data: then the drive is asked, and is silent."""
    exchange.values.clear()
    servo.mute = True
    clock.now_s += 0.1
    assert not (await polled(x)).fresh


def test_axes_are_asked_one_after_the_other(x: ConnectedDrive, clock: Clock) -> None:
    period_s = watching.WATCHED_S
    monitors = [watching.Monitor(x.axis, Journal(), lambda _: None, lambda: None) for _ in range(5)]
    due_s = []
    for moment in range(10):
        clock.now_s = 1000.0 + 0.37 * moment
        waits = [monitor._until_due(period_s) for monitor in monitors]
        assert all(0.5 * period_s <= wait <= 1.5 * period_s for wait in waits)
        due_s.append(sorted((clock.now_s + wait) % period_s for wait in waits))
    for places in due_s:
        # Five evenly spread ones would be 0.2 apart; by the golden ratio the nearest are 0.14.
        around = [*places, places[0] + period_s]
        assert min(b - a for a, b in itertools.pairwise(around)) > 0.1 * period_s


async def test_a_monitor_that_is_hurried_as_it_is_closed_ends(x: ConnectedDrive) -> None:
    """Else whoever removes the drive waits for ever: found by chaos, as a removal without answer.

    The wake-up reaches the waiting task some turns of the event loop after `hurry`; a cancellation
    in each of them must end it.
    """
    for turns in range(6):
        seen = asyncio.Event()
        reported = partial(_set, seen)
        monitor = watching.Monitor(x.axis, Journal(), reported, lambda: None)
        monitor.start()
        await seen.wait()
        for _ in range(20):
            await asyncio.sleep(0)
        monitor.hurry()
        for _ in range(turns):
            await asyncio.sleep(0)
        async with asyncio.timeout(5):
            await monitor.close()


def _set(event: asyncio.Event, _snapshot: object) -> None:
    event.set()


async def test_a_fault_that_two_ask_for_at_once_is_logged_once(
    x: ConnectedDrive, servo: Servo
) -> None:
    await x.monitor.refresh()
    assert x.monitor.snapshot.fresh
    overheated(servo)
    both = await asyncio.gather(x.monitor.refresh(), polled(x))
    await x.monitor.refresh()
    assert all(each.faults for each in both)
    assert faults_logged(x) == 1


async def test_what_was_asked_before_a_fault_does_not_take_it_back(
    x: ConnectedDrive, servo: Servo
) -> None:
    await x.monitor.refresh()
    before = x.monitor.snapshot
    held, answered = asyncio.Event(), asyncio.Event()

    async def slow() -> watching.Snapshot:
        held.set()
        await answered.wait()
        return before

    late = asyncio.create_task(x.monitor._poll(slow))
    await held.wait()
    overheated(servo)
    await x.monitor.refresh()
    answered.set()
    assert (await late).faults, "the newer one"
    await x.monitor.refresh()
    assert faults_logged(x) == 1


def overheated(servo: Servo) -> None:
    servo.trip()
    servo.set((0x603F, 0), 0x4210)


def faults_logged(x: ConnectedDrive) -> int:
    return sum(entry.message.code == "station.fault" for entry in x.monitor._journal.entries())


async def test_a_state_that_cannot_be_formed_is_not_shown_as_the_present_one(
    x: ConnectedDrive, monkeypatch: pytest.MonkeyPatch
) -> None:
    await x.monitor.refresh()
    assert x.monitor.snapshot.fresh
    sent: list[watching.Snapshot] = []
    arrived = asyncio.Event()

    def changed(snapshot: watching.Snapshot) -> None:
        sent.append(snapshot)
        arrived.set()
        raise KeyError("and so does what listens")

    def broken(*_arguments: object) -> None:
        raise ValueError("a defect")

    monkeypatch.setattr(x.monitor, "_changed", changed)
    monkeypatch.setattr(watching, "active_faults", broken)
    x.monitor.start()
    async with asyncio.timeout(10):
        await arrived.wait()
        arrived.clear()
        x.monitor.hurry()
        await arrived.wait()
    await x.monitor.close()
    assert [snapshot.fresh for snapshot in sent] == [False, False]
    assert sent[0].problem is not None
    assert "a defect" in sent[0].problem.words()
