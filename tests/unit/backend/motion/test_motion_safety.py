"""STOP, restoring and enabling against a servo in memory: each test is a way to be hurt."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from typing import Literal

import httpx
import pytest

from backend.axes.axis.axis import Envelope
from backend.axes.axis.cyclic import CyclicState
from backend.axes.drive.ports import Port
from backend.foundation.people.identity import LOCAL, Actor, acting
from backend.foundation.work.jobs import Progress
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from backend.tools.moving.jog import run as jogging
from backend.tools.moving.jog.cyclic import GeneratorSettings, generate, jog_cyclic
from backend.tools.moving.jog.release import END_OF_JOG
from backend.tools.moving.jog.run import Hold, JogSettings, jog
from backend.tools.moving.moves import move as moving
from drivers.cia402 import Mode, State
from drivers.errors import DriveError, NotAllowed, OutOfRange
from drivers.texts.message import text
from tests.support.servo import (
    CONTROL,
    MODE,
    POSITION,
    STATUS,
    TARGET,
    VELOCITY_TARGET,
    Servo,
)

ENVELOPE = Envelope(5.0, 100.0, 50.0, 10.0)
JOG = JogSettings(1, 60.0, 600.0, 5.0, 50.0)
ENABLES = 0x0F
ENABLED = 0x237


def enabling(servo: Servo) -> int:
    return sum(word & ENABLES == ENABLES for word in servo.words())


async def eventually(condition: object) -> None:
    async with asyncio.timeout(60):
        while not condition():  # type: ignore[operator]  # noqa: ASYNC110
            await asyncio.sleep(0.005)


# --- STOP -----------------------------------------------------------------------------


async def test_stop_is_sent_even_when_its_asker_is_gone(
    bench: Bench, x: ConnectedDrive, servo: Servo
) -> None:
    servo.enable()
    servo.gate.clear()
    asking = asyncio.create_task(bench.motion.stop(["x"]))
    await asyncio.sleep(0)
    asking.cancel()  # the page closed right after Esc
    servo.gate.set()
    await eventually(lambda: servo.words() == [2])


@pytest.mark.long
async def test_a_command_begun_before_stop_never_enables_even_after_a_new_one(
    bench: Bench, servo: Servo, http: httpx.AsyncClient
) -> None:
    servo.gate.clear()
    enable = asyncio.create_task(
        http.post("/drives/x/transition", json={"goal": "Operation enabled"})
    )
    await eventually(lambda: bench.jobs.moving("x"))
    stop = asyncio.create_task(http.post("/stop", json={}))
    await eventually(lambda: bench.connected("x").axis.stopped)
    other = asyncio.create_task(
        http.post("/drives/x/transition", json={"goal": "Switch on disabled"})
    )
    await asyncio.sleep(0.05)
    servo.gate.set()
    assert (await stop).json()["stopped"] == ["x"]
    assert (await enable).status_code == 409
    await other
    assert enabling(servo) == 0
    assert servo.number(STATUS) == 0x250


async def test_no_job_begins_while_the_power_state_is_changed(
    bench: Bench, x: ConnectedDrive, servo: Servo, http: httpx.AsyncClient
) -> None:
    servo.gate.clear()
    first = asyncio.create_task(
        http.post("/drives/x/transition", json={"goal": "Operation enabled"})
    )
    await eventually(lambda: bench.jobs.moving("x"))
    body = {"mode": "PP", "target": 1, "travel_limit": 2, "torque_limit": 10}
    assert (await http.post("/drives/x/jobs/move", json=body)).status_code == 409
    assert (await http.post("/drives/x/fault-reset", json={})).status_code == 409
    servo.gate.set()
    assert (await first).json()["state"] == "Operation enabled"


async def test_work_that_swallows_its_cancellation_cannot_enable_again(
    bench: Bench, x: ConnectedDrive, servo: Servo
) -> None:
    async def stubborn(_progress: Progress) -> None:
        for _ in range(2):
            try:
                async with x.axis.enabled(Mode.PP, ENVELOPE):
                    await asyncio.Event().wait()
            except asyncio.CancelledError:
                servo.written.clear()

    job = bench.jobs.start("move", "Move", stubborn, drive="x", motion=True)
    await eventually(lambda: servo.number(STATUS) == 0x237)
    await bench.motion.stop(["x"])
    await job.wait()
    assert enabling(servo) == 0
    assert isinstance(job.error, NotAllowed)


async def test_stop_that_did_not_reach_the_drive_is_sent_when_it_answers(
    bench: Bench, x: ConnectedDrive, servo: Servo
) -> None:
    servo.enable()
    servo.mute = True
    assert "no answer" in str((await bench.motion.stop(["x"]))["x"])
    await x.monitor.refresh()
    assert servo.words() == []
    servo.mute = False
    await x.monitor.refresh()
    assert servo.words() == [2]
    await x.monitor.refresh()
    assert servo.words() == [2], "once is enough"


async def test_motion_whose_end_was_lost_is_stopped_when_the_drive_answers(
    x: ConnectedDrive, servo: Servo
) -> None:
    with pytest.raises(DriveError):
        async with x.axis.enabled(Mode.PV, ENVELOPE):
            servo.mute = True
    servo.mute = False
    servo.written.clear()
    await x.monitor.refresh()
    assert servo.words() == [2]


async def test_stop_goes_over_the_second_port_when_the_first_is_dead(
    x: ConnectedDrive, servo: Servo
) -> None:
    second = Servo()
    second.enable()
    x.drive.ports = (*x.drive.ports, Port(second, 1, x.drive.ports[0].spec))
    servo.mute = True
    await x.axis.stop()
    assert second.words() == [2]


async def test_after_stop_power_is_not_cut_while_the_axis_still_moves(
    bench: Bench, x: ConnectedDrive, servo: Servo, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("backend.axes.axis.axis.CLEANUP_TIMEOUT_S", 0.4)

    async def turn(_progress: Progress) -> None:
        async with x.axis.enabled(Mode.PV, ENVELOPE):
            await asyncio.Event().wait()

    job = bench.jobs.start("move", "Move", turn, drive="x", motion=True)
    await eventually(lambda: servo.number(STATUS) == 0x237)
    servo.on_write = lambda _place, _value: setattr(servo, "speed_inc", 500)
    servo.written.clear()
    await bench.motion.stop(["x"])
    await job.wait()
    assert 0 not in servo.words(), "Disable voltage lets a moving axis coast"
    assert isinstance(job.error, DriveError)
    assert "emergency stop" in job.error.remedy


# --- enabling -------------------------------------------------------------------------


async def test_enabling_does_not_reset_a_fault(x: ConnectedDrive, servo: Servo) -> None:
    servo.trip()
    with pytest.raises(NotAllowed, match="Fault"):
        await x.axis.go_to(State.OPERATION_ENABLED)
    assert servo.words() == []


async def test_a_drive_that_trips_on_enabling_is_not_enabled_again(
    x: ConnectedDrive, servo: Servo
) -> None:
    servo.trips = True
    with x.axis.granted("a test"), pytest.raises(NotAllowed):
        async with asyncio.timeout(5):
            await x.axis.go_to(State.OPERATION_ENABLED)
    assert enabling(servo) == 1


async def test_fault_reset_does_not_cut_the_power_of_a_healthy_axis(
    x: ConnectedDrive, servo: Servo
) -> None:
    servo.enable()
    await x.axis.reset_fault()
    assert servo.words() == []


async def test_mode_change_of_an_enabled_axis_takes_no_stale_speed(
    servo: Servo, http: httpx.AsyncClient, bench: Bench
) -> None:
    servo.enable()
    servo.set(VELOCITY_TARGET, 100_000)
    seen: list[int] = []

    def note(place: tuple[int, int], _value: int) -> None:
        if place == MODE:
            seen.append(servo.number(VELOCITY_TARGET))

    servo.on_write = note
    answer = await http.post(
        "/drives/x/transition", json={"goal": "Operation enabled", "mode": int(Mode.PV)}
    )
    assert answer.status_code == 200, answer.text
    assert seen == [0]


async def test_motion_of_an_enabled_axis_takes_no_stale_speed(
    x: ConnectedDrive, servo: Servo
) -> None:
    servo.enable()
    servo.set(VELOCITY_TARGET, 100_000)
    seen: list[int] = []

    def note(place: tuple[int, int], _value: int) -> None:
        if place == MODE:
            seen.append(servo.number(VELOCITY_TARGET))

    servo.on_write = note
    async with x.axis.enabled(Mode.PV, ENVELOPE):
        pass
    assert seen[0] == 0


# --- restoring ------------------------------------------------------------------------


async def test_everything_that_could_not_be_restored_is_named(
    x: ConnectedDrive, servo: Servo
) -> None:
    servo.set(MODE, 3)
    with pytest.raises(DriveError) as caught:
        async with x.axis.restoring("6081:00"), x.axis.enabled(Mode.PP, ENVELOPE):
            servo.mute = True
    for key in ("6060:00", "6072:00", "60E0:00", "60E1:00", "6081:00"):
        assert key in str(caught.value)


@pytest.mark.long
async def test_a_cleanup_that_takes_too_long_names_what_it_leaves(
    x: ConnectedDrive, servo: Servo, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("backend.axes.axis.axis.CLEANUP_TIMEOUT_S", 0.05)

    async def work() -> None:
        async with x.axis.restoring("6081:00"):
            await x.drive.write("6081:00", 5)
            servo.gate.clear()

    with pytest.raises(DriveError, match="6081:00"):
        await work()


async def test_another_drive_at_the_place_gets_nothing_restored(
    x: ConnectedDrive, servo: Servo
) -> None:
    from drivers.link import Found

    x.drive.found = Found(1, serial=7)

    async def work() -> None:
        async with x.axis.restoring("6081:00"):
            await x.drive.write("6081:00", 5)
            servo.set((0x1018, 4), 8)
            servo.written.clear()

    with pytest.raises(DriveError, match="serial number 7"):
        await work()
    assert servo.written == []


# --- parameters during motion ---------------------------------------------------------


async def forever(_progress: Progress) -> None:
    await asyncio.Event().wait()


@pytest.mark.parametrize(
    "key", ["6091:01", "6092:01", "607E:00", "6060:00", "6040:00", "607A:00", "6081:00", "60E0:00"]
)
async def test_what_a_motion_relies_on_is_not_written_meanwhile(
    bench: Bench, servo: Servo, http: httpx.AsyncClient, key: str
) -> None:
    job = bench.jobs.start("move", "Move X", forever, drive="x", motion=True)
    answer = await http.put(f"/drives/x/parameters/{key}", json={"raw": 1})
    assert answer.status_code == 409, answer.text
    # What commands motion is refused whether something moves or not.
    commands = key in ("6060:00", "6040:00", "607A:00")
    assert ("can energise the motor" if commands else "Move X") in answer.json()["detail"]
    assert servo.written == []
    await bench.jobs.cancel(job)


async def test_gains_may_be_written_while_the_axis_moves(
    bench: Bench, http: httpx.AsyncClient
) -> None:
    job = bench.jobs.start("move", "Move X", forever, drive="x", motion=True)
    answer = await http.put("/drives/x/parameters/2005:03", json={"raw": 300})
    assert answer.status_code == 200, answer.text
    await bench.jobs.cancel(job)


async def test_units_are_read_anew_whoever_wrote_the_gearing(x: ConnectedDrive) -> None:
    before = (await x.axis.units()).counts_per_rev
    assert before is not None
    revolutions = await x.drive.raw("6092:01")
    await x.drive.write("6092:01", 2 * revolutions)  # as the loading of a set does
    assert (await x.axis.units()).counts_per_rev == 2 * before


# --- numbers --------------------------------------------------------------------------

_MOVE = {"mode": "PP", "target": 1.0, "travel_limit": 2.0, "torque_limit": 10.0}


@pytest.mark.parametrize("mode", ["PV", "PT", "PP"])
@pytest.mark.parametrize("had_power", [False, True])
async def test_a_motion_whose_permission_ends_is_braked_and_loses_its_power(
    bench: Bench, x: ConnectedDrive, servo: Servo, mode: Literal["PP", "PV", "PT"], had_power: bool
) -> None:
    """Log-out, a revoked token, the end of its time: halt has the bits that enable, so it may not
    follow; a drive in profile velocity would turn for ever.
    """
    if had_power:
        servo.enable()

    async def work(progress: Progress) -> dict[str, object]:
        await moving.move(x.axis, moving.MoveSettings(mode, 1.0, ENVELOPE, consent=True), progress)
        return {}

    acting.set(Actor(replace(LOCAL, session="visit")))
    job = bench.jobs.start("move", "Move", work, drive="x", motion=True)
    setpoint = {"PV": VELOCITY_TARGET, "PT": (0x6071, 0), "PP": TARGET}[mode]
    async with asyncio.timeout(60):
        await eventually(lambda: any(p == setpoint and any(data) for p, data in servo.written))
        bench.authority.end_of("visit", text("motion.session-is-over"))
        await job.wait()
    assert servo.words()[-1] & ENABLES != ENABLES
    assert {2, 11} & set(servo.words()), servo.words()
    assert servo.number(STATUS) != ENABLED
    assert x.axis.drive.pending_restores.entries == ()
    assert job.state == "cancelled", job.error
    assert job.cancel_cause == text("motion.session-is-over")


async def test_a_gear_changed_by_another_program_ends_the_motion(
    bench: Bench, x: ConnectedDrive, servo: Servo
) -> None:
    """6064h and 606Ch count in the same new increments: comparing the two shows nothing."""
    async with asyncio.timeout(60):
        await x.axis.units()

        async def work(progress: Progress) -> dict[str, object]:
            await jog(x.axis, JOG, hold, progress)
            return {}

        hold = Hold(clock=lambda: 0.0)
        job = bench.jobs.start("jog", "Jog", work, drive="x", motion=True)
        await eventually(lambda: servo.number(STATUS) == ENABLED)
        assert bench.authority.mover_of("x") is not None
        servo.set((0x6091, 1), 7)
        await x.monitor.refresh()
        await job.wait()
    assert job.state == "cancelled", (job.error, servo.words())
    assert job.cancel_cause is not None
    assert job.cancel_cause.code == "scales.changed-in-motion"
    assert x.axis.drive.pending_restores.entries == ()
    assert servo.number(STATUS) != ENABLED
    assert any(
        entry.message.code == "scales.changed-in-motion" for entry in bench.journal.entries()
    )


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity", "1e300"])
@pytest.mark.parametrize("field", ["target", "speed", "acceleration", "travel_limit"])
async def test_numbers_that_are_none_are_refused(
    http: httpx.AsyncClient, servo: Servo, field: str, number: str
) -> None:
    import json

    text = json.dumps(_MOVE | {field: "?"}).replace('"?"', number)
    answer = await http.post(
        "/drives/x/jobs/move", content=text, headers={"content-type": "application/json"}
    )
    assert answer.status_code == 422, answer.text
    assert servo.written == []


@pytest.mark.parametrize("body", ['{"raw": NaN}', '{"value": Infinity}', '{"value": 1e308}'])
async def test_a_parameter_takes_no_number_that_is_none(
    http: httpx.AsyncClient, servo: Servo, body: str
) -> None:
    answer = await http.put(
        "/drives/x/parameters/2005:03", content=body, headers={"content-type": "application/json"}
    )
    assert answer.status_code == 422, answer.text
    assert servo.written == []


async def test_stop_without_a_body_stops_everything(
    http: httpx.AsyncClient, servo: Servo, bench: Bench
) -> None:
    servo.enable()
    answer = await http.post("/stop")
    assert answer.status_code == 200, answer.text
    assert servo.words() == [2]


# --- jog and moves --------------------------------------------------------------------


def quiet() -> Progress:
    return Progress(lambda: None)


async def test_jog_released_before_it_is_enabled_enables_nothing(
    x: ConnectedDrive, servo: Servo
) -> None:
    hold = Hold()
    hold.release(END_OF_JOG["released"])
    assert (await jog(x.axis, JOG, hold, quiet()))["reason_message"] == END_OF_JOG[
        "released"
    ].to_wire()
    assert enabling(servo) == 0


async def test_jog_released_while_enabling_aims_nowhere(x: ConnectedDrive, servo: Servo) -> None:
    hold = Hold()
    targets: list[int] = []

    def note(place: tuple[int, int], value: int) -> None:
        if place == CONTROL and value & ENABLES == ENABLES:
            hold.release(END_OF_JOG["released"])
        if place == TARGET:
            targets.append(value)

    servo.on_write = note
    assert (await jog(x.axis, JOG, hold, quiet()))["reason_message"] == END_OF_JOG[
        "released"
    ].to_wire()
    assert set(targets) == {servo.number(POSITION)}


async def test_jog_ends_at_the_end_of_the_number_range(x: ConnectedDrive, servo: Servo) -> None:
    servo.set(POSITION, 2**31 - 100)
    hold = Hold(clock=lambda: 0.0)
    targets: list[int] = []

    def note(place: tuple[int, int], value: int) -> None:
        if place == TARGET:
            targets.append(value)
            if len(targets) > 3:
                hold.release(END_OF_JOG["released"])

    servo.on_write = note
    task = asyncio.create_task(jog(x.axis, JOG, hold, quiet()))
    await eventually(lambda: 2**31 - 1 in targets or task.done())
    hold.release(END_OF_JOG["released"])
    assert (await task)["reason_message"] == END_OF_JOG["released"].to_wire()


async def test_jog_needs_a_known_resolution(x: ConnectedDrive, servo: Servo) -> None:
    servo.set((0x6092, 1), 0)
    with pytest.raises(NotAllowed, match="increments per revolution"):
        await jog(x.axis, JOG, Hold(), quiet())
    assert servo.written == []


async def test_jog_slower_than_the_drive_can_count_is_refused(
    x: ConnectedDrive, servo: Servo
) -> None:
    with pytest.raises(OutOfRange, match="below the resolution"):
        await jog(x.axis, replace(JOG, speed_rpm=1e-6), Hold(), quiet())
    assert servo.written == []


@pytest.mark.parametrize("target", [40_000.0, -40_000.0])
async def test_target_outside_the_number_range_enables_nothing(
    x: ConnectedDrive, servo: Servo, target: float
) -> None:
    wide = Envelope(1e9, 100.0, 50.0, 10.0)
    settings = moving.MoveSettings("PP", target, wide, relative=True)
    with pytest.raises(OutOfRange):
        await moving.move(x.axis, settings, quiet())
    assert enabling(servo) == 0


async def test_back_and_forth_checks_both_places_before_it_moves(
    x: ConnectedDrive, servo: Servo
) -> None:
    settings = moving.SequenceSettings(0.5, 50.0, 60.0, 600.0, 0.0, 2, ENVELOPE)
    with pytest.raises(OutOfRange):
        await moving.sequence(x.axis, settings, quiet())
    assert enabling(servo) == 0


@pytest.mark.parametrize("mode", ["PV", "PT"])
async def test_a_watchdog_that_watches_the_exchange_is_none_without_it(
    x: ConnectedDrive, servo: Servo, mode: Literal["PV", "PT"]
) -> None:
    """004:4824: the watchdog is that of the process data; SDO commands do not feed it."""
    spec = x.drive.profile.link("ethercat")
    assert spec is not None
    assert spec.watchdog.present
    x.drive.ports = (Port(servo, 1, spec),)
    settings = moving.MoveSettings(mode, 10.0, ENVELOPE)
    with pytest.raises(NotAllowed, match="watchdog"):
        await moving.move(x.axis, settings, quiet())
    assert servo.written == []


def test_lead_is_what_the_architecture_says() -> None:
    # 60 rpm = 1 rev/s; T = 0.2 s; a = 10 rev/s²: 0.2 + 1/20
    assert JOG.lead_rev == pytest.approx(0.25)
    assert jogging.GAP_S == 0.2


# --- the cyclic jog -------------------------------------------------------------------


class Exchange:
    """A cyclic exchange that takes its time to enable, and notes what is played."""

    running = True

    def __init__(self) -> None:
        self.state = CyclicState(0.001, None, (), ())
        self.played: list[object] = []
        self.cyclic = self

    def power(self) -> None:
        return None

    def station(self, _drive: object) -> int:
        return 1

    async def play(self, trajectories: list[object]) -> int:
        self.played += trajectories
        return 0

    async def halt(self, _station: int) -> None: ...

    async def renew(self, _station: int) -> None: ...


async def test_cyclic_jog_released_while_enabling_plays_nothing(
    x: ConnectedDrive, servo: Servo
) -> None:
    exchange, hold = Exchange(), Hold()
    enables = {"seen": False}

    def note(place: tuple[int, int], value: int) -> None:
        if place == CONTROL and value & ENABLES == ENABLES:
            enables["seen"] = True
            hold.release(END_OF_JOG["released"])

    servo.on_write = note
    result = await jog_cyclic(x.axis, exchange, JOG, hold, quiet())  # type: ignore[arg-type]
    assert enables["seen"]
    assert result["reason_message"] == END_OF_JOG["released"].to_wire()
    assert exchange.played == []
    assert servo.number(STATUS) == 0x250


async def test_a_signal_outside_its_envelope_enables_nothing(
    x: ConnectedDrive, servo: Servo
) -> None:
    settings = GeneratorSettings("CSP", "sine", 6.0, 1.0, ENVELOPE)
    with pytest.raises(OutOfRange, match="envelope"):
        await generate(x.axis, Exchange(), settings, quiet())  # type: ignore[arg-type]
    assert servo.written == []


async def test_a_gap_halts_the_polled_jog_and_a_new_target_ends_the_halt(
    x: ConnectedDrive, servo: Servo
) -> None:
    """6040h bit 8 while no sign of life comes; afterwards a target from where it halted."""
    now = {"s": 0.0}
    hold = Hold(1, lambda: now["s"])
    words: list[tuple[str, int]] = []

    def note(place: tuple[int, int], value: int) -> None:
        words.append(("target" if place == TARGET else "control", value))

    servo.on_write = note
    task = asyncio.create_task(jog(x.axis, JOG, hold, quiet()))
    await eventually(lambda: ("control", 0x3F) in words)
    words.clear()
    now["s"] = 0.25
    await eventually(lambda: ("control", 0x10F) in words)
    assert not task.done()
    words.clear()
    now["s"] = 0.40
    hold.renew(1)
    await asyncio.sleep(0.1)
    assert not [word for word in words if word[1] & 0x10], "one sign alone moves nothing"
    now["s"] = 0.46
    hold.renew(1)
    await eventually(lambda: ("control", 0x3F) in words)
    assert words[0][0] == "target"
    hold.release(END_OF_JOG["released"], 1)
    assert (await task)["reason_message"] == END_OF_JOG["released"].to_wire()
