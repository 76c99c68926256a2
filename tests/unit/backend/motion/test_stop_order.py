"""STOP takes precedence by order: what was begun or asked for before it writes nothing after it.

Against a servo in memory, whose link does writes in the order in which they were given to it.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

import httpx
import pytest

from backend.axes.axis.axis import Envelope
from backend.axes.axis.stop.facts import StepCode
from backend.axes.motion.grant import NotGranted
from backend.foundation.work.jobs import Progress
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from drivers.cia402 import Mode
from drivers.errors import Rejected
from drivers.texts.message import text
from tests.support.servo import MODE, POSITION, STATUS, TARGET, VELOCITY_TARGET, Servo

ENVELOPE = Envelope(5.0, 100.0, 50.0, 10.0)
QUICK_STOP, HALT = 2, 0x10F
OPTION = (0x605A, 0)
#: Functions of terminals and the jog by bus of an MMS7: what energises and is no command object.
TRIGGER = (0x2031, 2)
_ENDED = text("motion.stop-was-pressed")
_MOVE = b'{"mode": "PP", "target": 1, "travel_limit": 2, "torque_limit": 10}'


async def until(condition: object) -> None:
    async with asyncio.timeout(60):
        while not condition():  # type: ignore[operator]  # noqa: ASYNC110
            await asyncio.sleep(0)


async def test_work_that_stop_ended_gets_no_grant_anew_and_writes_no_setpoint(
    bench: Bench, x: ConnectedDrive, servo: Servo
) -> None:
    refused: list[Exception] = []

    async def stubborn(_progress: Progress) -> None:
        with pytest.raises(asyncio.CancelledError):
            async with x.axis.enabled(Mode.PP, ENVELOPE):
                await asyncio.Event().wait()
        servo.written.clear()
        for mode in (Mode.PP, Mode.PV):
            try:
                async with x.axis.enabled(mode, ENVELOPE):
                    raise AssertionError("enabled after STOP")
            except NotGranted as error:
                refused.append(error)

    job = bench.jobs.start("move", "Move", stubborn, drive="x", motion=True)
    await until(lambda: servo.number(STATUS) == 0x237)
    await bench.motion.stop(["x"])
    await job.wait()
    assert len(refused) == 2
    assert job.error is None
    moved = {MODE, TARGET, VELOCITY_TARGET}
    assert [place for place, _ in servo.written if place in moved] == []
    assert 0x0F not in {word & 0x0F for word in servo.words()}


async def test_a_write_that_first_reads_is_not_sent_when_stop_came_meanwhile(
    bench: Bench, x: ConnectedDrive, servo: Servo
) -> None:
    def stop_while_it_reads(place: tuple[int, int]) -> None:
        if place == TRIGGER:
            bench.authority.revoke("x", _ENDED)

    with x.axis.granted("a trigger") as grant:
        servo.on_read = stop_while_it_reads
        with pytest.raises(NotGranted):
            await x.drive.energise("2031:02", 1, grant)
    assert TRIGGER not in {place for place, _ in servo.written}


async def test_a_write_that_waits_for_its_turn_is_not_sent_when_stop_came_meanwhile(
    bench: Bench, x: ConnectedDrive, servo: Servo
) -> None:
    await x.drive.read("2031:02")
    alone = asyncio.Event()

    async def stores() -> None:
        async with x.drive.exclusive.alone(1.0):
            await alone.wait()

    storing = asyncio.create_task(stores())
    await until(lambda: x.drive.exclusive.held)

    async def writes() -> None:
        with x.axis.granted("a trigger") as grant:
            await x.drive.energise("2031:02", 1, grant)

    writing = asyncio.create_task(writes())
    await until(lambda: bench.authority.grant_of("x"))
    bench.authority.revoke("x", _ENDED)
    alone.set()
    await storing
    with pytest.raises(NotGranted):
        await writing
    assert TRIGGER not in {place for place, _ in servo.written}


async def test_halt_never_follows_a_quick_stop(x: ConnectedDrive, servo: Servo) -> None:
    """Halt has the bits of Enable operation: CiA 402-2 transition 16 leaves the quick stop."""
    servo.enable()
    servo.set(OPTION, 0)
    await x.drive.read("605A:00")
    await x.axis.state()
    await x.axis.stop()
    assert servo.words() == [HALT, QUICK_STOP]
    # Another tool coasts it again, and the status word that was read last is still the old one.
    servo.set(OPTION, 0)
    await x.drive.read("605A:00")
    await x.axis.quick_stop()
    assert servo.words() == [HALT, QUICK_STOP, QUICK_STOP]


async def test_halt_brakes_again_once_a_new_command_was_given(
    x: ConnectedDrive, servo: Servo
) -> None:
    for _ in range(2):
        servo.written.clear()
        servo.enable()
        servo.set(OPTION, 0)
        await x.drive.read("605A:00")
        await x.axis.state()
        await x.axis.stop()
        assert servo.words() == [HALT, QUICK_STOP]
        x.axis.permit()


async def test_a_motion_whose_request_was_on_its_way_when_stop_was_pressed_does_not_begin(
    bench: Bench, servo: Servo, http: httpx.AsyncClient
) -> None:
    coming, rest = asyncio.Event(), asyncio.Event()

    async def slowly() -> AsyncIterator[bytes]:
        yield _MOVE[:10]
        coming.set()
        await rest.wait()
        yield _MOVE[10:]

    head = {"Content-Type": "application/json", "Content-Length": str(len(_MOVE))}
    move = asyncio.create_task(http.post("/drives/x/jobs/move", content=slowly(), headers=head))
    await coming.wait()
    assert (await http.post("/stop", json={})).is_success
    servo.written.clear()
    rest.set()
    answer = await move
    assert answer.status_code == 409
    assert answer.json()["code"] == "axis.stop-pressed-since"
    assert bench.jobs.moving("x") is None
    assert bench.connected("x").axis.stopped
    assert servo.words() == []


@pytest.mark.long
async def test_a_motion_that_is_asked_for_after_stop_begins(
    bench: Bench, servo: Servo, http: httpx.AsyncClient
) -> None:
    assert (await http.post("/stop", json={})).is_success
    head = {"Content-Type": "application/json"}
    answer = await http.post("/drives/x/jobs/move", content=_MOVE, headers=head)
    assert answer.status_code == 202
    assert not bench.connected("x").axis.stopped
    await bench.jobs.close()
    assert POSITION in servo.objects


async def test_a_drive_that_refuses_halt_gets_its_quick_stop(
    x: ConnectedDrive, servo: Servo
) -> None:
    servo.enable()
    servo.set(OPTION, 0)
    await x.drive.read("605A:00")
    await x.axis.state()
    refused = Rejected("refused", abort_code=0x06090030)
    servo.write_errors.append(refused)
    await x.axis.stop()
    assert servo.words()[-1] == QUICK_STOP
    assert not x.axis.stop_pending
    steps = {step.code: step.done for step in x.axis.stop_steps}
    assert not steps[StepCode.HALT]
    assert steps[StepCode.QUICK_STOP]


async def test_a_defect_at_one_axis_does_not_hide_the_stop_of_another(
    bench: Bench, x: ConnectedDrive, servo: Servo, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = Servo()
    bench.buses.wires["mlink://virtual1"] = lambda: other
    y = await bench.connect("mlink://virtual1", 1, "mms7", "Y")
    await y.monitor.close()
    other.enable()

    async def broken() -> None:
        raise ValueError("a defect")

    monkeypatch.setattr(x.axis, "stop", broken)
    problems = await bench.motion.stop([x.drive.id, y.drive.id])
    assert "a defect" in str(problems[x.drive.id])
    assert problems[y.drive.id] is None
    assert other.words() == [QUICK_STOP]
    monkeypatch.setattr(x.axis, "let_go", broken)
    await bench.motion.let_go_of_all()
    assert x.axis.stop_pending
