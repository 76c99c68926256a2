"""What a motion left in a drive that was lost: named, kept, and restored when it answers again."""

from __future__ import annotations

import asyncio
import os
import shutil
import time
from pathlib import Path

import httpx
import pytest

from backend.axes.axis.axis import Envelope
from backend.axes.axis.restoring import RestoreFailed
from backend.axes.drive.identity import read_serial
from backend.foundation.store.files import StorageFailed
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from backend.tools.measuring.temporary import temporary
from drivers.cia402 import Mode
from drivers.errors import LinkLost
from drivers.link import Found
from tests.support.servo import CONTROL, MODE, STATUS, Servo, bench_with

#: Largest torque, and the bandwidth of the speed loop, which acts after "write settings".
TORQUE, SPEED = "6072:00", "2005:03"
WRITE_SETTINGS = (0x200D, 0)
WAS = {TORQUE: 3000, SPEED: 400}


@pytest.fixture
async def servo() -> Servo:
    servo = Servo()
    for key, raw in WAS.items():
        servo.set(place(key), raw)
    return servo


def place(key: str) -> tuple[int, int]:
    index, _, sub = key.partition(":")
    return int(index, 16), int(sub, 16)


def held(servo: Servo) -> dict[str, int]:
    return {key: servo.number(place(key)) for key in WAS}


async def lost_in_the_middle(x: ConnectedDrive, servo: Servo) -> RestoreFailed:
    """Two ways of changing something for a while, and a line that goes dead meanwhile."""

    async def motion() -> None:
        async with x.axis.restoring(TORQUE), temporary(x.axis, {SPEED: 200}):
            await x.drive.write(TORQUE, 800)
            servo.mute = True

    with pytest.raises(RestoreFailed) as reported:
        await motion()
    assert held(servo) == {TORQUE: 800, SPEED: 200}
    return reported.value


async def test_a_line_too_slow_for_putting_back_names_what_is_left(
    x: ConnectedDrive, servo: Servo, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a dead serial line or CAN bus each try takes its time-out: none is left for the rest."""
    monkeypatch.setattr("backend.tools.measuring.temporary.CLEANUP_TIMEOUT_S", 0.02)

    async def motion() -> None:
        async with temporary(x.axis, {SPEED: 200}):
            servo.gate.clear()
            raise LinkLost("samples did not come")

    with pytest.raises(
        RestoreFailed, match=f"^samples did not come; .*{SPEED} .was 400"
    ) as reported:
        await motion()
    assert "running server restores them" in (reported.value.remedy or "")
    assert [entry.key for entry in x.drive.pending_restores.entries] == [SPEED]


async def motion_in_a_motion(x: ConnectedDrive, servo: Servo, *, again: bool) -> RestoreFailed:
    """Both change the same value for their length; the line may come back between the cleanups."""

    async def motion() -> None:
        async with x.axis.restoring(TORQUE):
            await x.drive.write(TORQUE, 2000)
            try:
                async with x.axis.restoring(TORQUE):
                    await x.drive.write(TORQUE, 800)
                    servo.mute = True
            finally:
                servo.mute = not again

    with pytest.raises(RestoreFailed) as reported:
        await motion()
    return reported.value


async def test_a_value_that_two_motions_changed_is_named_as_it_was_before_both(
    x: ConnectedDrive, servo: Servo
) -> None:
    reported = await motion_in_a_motion(x, servo, again=False)
    assert f"{TORQUE} (was {WAS[TORQUE]})" in reported.message
    assert f"{TORQUE} (was 2000)" not in reported.message, "nobody should write that by hand"
    assert [entry.raw for entry in x.drive.pending_restores.entries] == [WAS[TORQUE]]


async def test_what_the_outer_of_two_motions_put_back_is_pending_no_more(
    x: ConnectedDrive, servo: Servo
) -> None:
    await motion_in_a_motion(x, servo, again=True)
    assert held(servo) == WAS
    assert not x.drive.pending_restores


async def back(bench: Bench, servo: Servo) -> None:
    """The drive answers again, and everything that this brings about is over."""
    servo.mute = False
    servo.written.clear()
    bench.reconnection.returned("x")
    await asyncio.gather(*(job.wait() for job in bench.jobs.all()))


async def test_it_is_named_and_put_back_by_itself(
    bench: Bench, x: ConnectedDrive, servo: Servo
) -> None:
    reported = await lost_in_the_middle(x, servo)
    for key, raw in WAS.items():
        assert f"{key} (was {raw})" in reported.message
        assert f"{key}（原为 {raw}）" in reported.text.words("zh")
    assert {entry.key: entry.raw for entry in x.drive.pending_restores.entries} == WAS
    await back(bench, servo)
    assert held(servo) == WAS
    assert not x.drive.pending_restores
    assert CONTROL not in dict(servo.written), "nothing is enabled or disabled by it"
    lines = [entry.text for entry in bench.journal.entries("x")]
    assert any("restored: " in line and f"{TORQUE} = 3000" in line for line in lines)


async def test_a_drive_that_answers_twice_in_a_row_is_read_and_put_back(
    bench: Bench, x: ConnectedDrive, servo: Servo
) -> None:
    await lost_in_the_middle(x, servo)
    bench.reconnection.returned("x")
    await back(bench, servo)
    await asyncio.gather(*(job.wait() for job in bench.jobs.all()))
    assert [job.state for job in bench.jobs.all() if job.state != "done"] == []
    assert held(servo) == WAS
    assert not x.drive.pending_restores


async def test_a_drive_that_restarted_with_its_stored_values_owes_nothing(
    bench: Bench, x: ConnectedDrive, servo: Servo
) -> None:
    await lost_in_the_middle(x, servo)
    for key, raw in WAS.items():
        servo.set(place(key), raw)
    await back(bench, servo)
    assert not x.drive.pending_restores
    assert place(TORQUE) not in dict(servo.written)


async def test_what_somebody_else_has_changed_is_offered_not_done(
    bench: Bench, x: ConnectedDrive, servo: Servo, http: httpx.AsyncClient
) -> None:
    await lost_in_the_middle(x, servo)
    servo.set(place(TORQUE), 1234)  # at the panel
    await back(bench, servo)
    assert held(servo) == {TORQUE: 1234, SPEED: 400}
    summary = (await http.get("/drives/x")).json()
    assert [(each["key"], each["raw"]) for each in summary["pending_restores"]] == [(TORQUE, 3000)]
    assert (await http.post("/drives/x/jobs/put-back")).status_code == 202
    await asyncio.gather(*(job.wait() for job in bench.jobs.all()))
    assert held(servo) == WAS
    assert (await http.get("/drives/x")).json()["pending_restores"] == []
    assert (await http.post("/drives/x/jobs/put-back")).status_code == 409


async def test_it_may_stay_as_it_is(
    bench: Bench, x: ConnectedDrive, servo: Servo, http: httpx.AsyncClient
) -> None:
    await lost_in_the_middle(x, servo)
    servo.set(place(TORQUE), 1234)
    await back(bench, servo)
    assert (await http.delete("/drives/x/pending-restores")).json()["pending_restores"] == []
    await back(bench, servo)
    assert held(servo) == {TORQUE: 1234, SPEED: 400}


async def test_stop_stands_until_a_person_takes_it_back(
    bench: Bench, x: ConnectedDrive, servo: Servo
) -> None:
    await lost_in_the_middle(x, servo)
    x.axis.stopped = True
    await back(bench, servo)
    # Settings move nothing.
    assert held(servo) == WAS
    assert x.axis.stopped


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("how", ["enabled", "moving", "held by a job"])
async def test_an_axis_that_does_not_stand_free_is_left_alone(
    bench: Bench, x: ConnectedDrive, servo: Servo, how: str
) -> None:
    await lost_in_the_middle(x, servo)
    other = None
    if how == "enabled":
        servo.enable()
    if how == "moving":
        servo.speed_inc = 5000
    if how == "held by a job":
        never = asyncio.Event()

        async def work(_progress: object) -> None:
            await never.wait()

        other = bench.jobs.start("jog", "Jog", work, drive="x", motion=True)
    servo.mute = False
    servo.written.clear()
    bench.reconnection.returned("x")
    ends = [job.wait() for job in bench.jobs.all() if job is not other]
    await asyncio.gather(*ends)
    assert held(servo) == {TORQUE: 800, SPEED: 200}
    assert {entry.key for entry in x.drive.pending_restores.entries} == set(WAS)


async def test_it_is_put_back_as_soon_as_the_axis_stands_free(
    bench: Bench, x: ConnectedDrive, servo: Servo
) -> None:
    """A drive that answered while still enabled kept its temporary value until it was lost."""
    await lost_in_the_middle(x, servo)
    servo.enable()
    await back(bench, servo)
    await x.monitor.refresh()
    await asyncio.gather(*(job.wait() for job in bench.jobs.all()))
    assert held(servo) == {TORQUE: 800, SPEED: 200}
    servo.set(STATUS, 0x250)
    await x.monitor.refresh()
    await asyncio.gather(*(job.wait() for job in bench.jobs.all()))
    assert held(servo) == WAS
    assert not x.drive.pending_restores


async def test_another_drive_at_its_place_gets_nothing(
    bench: Bench, x: ConnectedDrive, servo: Servo
) -> None:
    await bench.accept_identity("x")
    await lost_in_the_middle(x, servo)
    servo.set((0x1018, 4), 8)
    await back(bench, servo)
    assert held(servo) == {TORQUE: 800, SPEED: 200}
    # Once it is accepted, what was in the other one is no matter of this one.
    await bench.accept_identity("x")
    assert not x.drive.pending_restores


async def test_what_is_back_but_does_not_act_is_pending_too(
    bench: Bench, x: ConnectedDrive, servo: Servo
) -> None:
    def lose_the_next(at: tuple[int, int], _value: int) -> None:
        if at == place(SPEED):
            servo.write_errors.append(LinkLost("the cable is pulled"))

    with pytest.raises(RestoreFailed, match="write settings: "):
        async with temporary(x.axis, {SPEED: 200}):
            servo.on_write = lose_the_next
    assert held(servo) == WAS
    assert [(entry.key, entry.unapplied) for entry in x.drive.pending_restores.entries] == [
        (SPEED, True)
    ]
    await x.drive.read(SPEED)
    assert x.drive.pending_restores
    await back(bench, servo)
    assert [at for at, _data in servo.written] == [WRITE_SETTINGS]
    assert not x.drive.pending_restores


async def killed(x: ConnectedDrive, servo: Servo, state: Path, left_by_it: Path) -> None:
    """What a server killed in the middle of a motion leaves: its state folder and the drive."""
    x.drive.found = Found(1, serial=await read_serial(x.drive))
    async with x.axis.restoring(TORQUE), temporary(x.axis, {SPEED: 200}):
        await x.drive.write(TORQUE, 800)
        shutil.copytree(state, left_by_it)
        midway = held(servo)
    assert midway == {TORQUE: 800, SPEED: 200}
    for key, raw in midway.items():
        servo.set(place(key), raw)


async def test_the_next_server_puts_back_what_a_killed_one_left(
    x: ConnectedDrive, servo: Servo, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    state = tmp_path_factory.mktemp("killed") / "state"
    await killed(x, servo, tmp_path, state)
    assert not any((tmp_path / "restore").iterdir()), "an orderly end leaves no note"
    again, connected = await bench_with(servo, state)
    assert {entry.key: entry.raw for entry in connected.drive.pending_restores.entries} == WAS
    await back(again, servo)
    assert held(servo) == WAS
    assert not connected.drive.pending_restores
    assert not any((state / "restore").iterdir())
    await again.close()


@pytest.mark.parametrize("then", ["untouched", "chosen by somebody"])
async def test_the_mode_that_a_killed_server_left_comes_back_by_itself(
    x: ConnectedDrive,
    servo: Servo,
    tmp_path: Path,
    tmp_path_factory: pytest.TempPathFactory,
    then: str,
) -> None:
    """6060h is written as a command, without being read back: it needed a press."""
    servo.set(MODE, Mode.PV)
    state = tmp_path_factory.mktemp("killed") / "state"
    async with x.axis.enabled(Mode.PP, Envelope(1.0, 100.0, 50.0, 5.0)):
        shutil.copytree(tmp_path / "restore", state / "restore")
    assert servo.number(MODE) == Mode.PV
    left = Mode.PP if then == "untouched" else Mode.HM
    servo.set(MODE, left)
    again, connected = await bench_with(servo, state)
    await back(again, servo)
    assert servo.number(MODE) == (Mode.PV if then == "untouched" else Mode.HM)
    assert {entry.key for entry in connected.drive.pending_restores.entries} == (
        set() if then == "untouched" else {"6060:00"}
    )
    await again.close()


async def test_set_points_leave_no_trace_of_themselves(x: ConnectedDrive) -> None:
    """A jog sends a thousand of them in a minute."""
    with x.axis.granted("a jog") as grant:
        for target in range(50):
            await x.drive.command("607A:00", target, grant)
    x.drive.pending_restores.add({"607A:00": 0})
    assert x.drive.pending_restores.entries[0].left == frozenset()


@pytest.mark.parametrize(("age_s", "stops"), [(0.0, True), (3600.0, False)])
async def test_the_next_server_stops_what_a_killed_one_left_moving(
    x: ConnectedDrive,
    servo: Servo,
    tmp_path: Path,
    tmp_path_factory: pytest.TempPathFactory,
    age_s: float,
    stops: bool,
) -> None:
    """A homing that looks for a switch goes on in the drive; later it may be somebody else's."""
    state = tmp_path_factory.mktemp("killed") / "state"
    await killed(x, servo, tmp_path, state)
    for note in (state / "restore").iterdir():
        os.utime(note, (time.time() - age_s,) * 2)
    servo.enable()
    servo.written.clear()
    again, connected = await bench_with(servo, state)
    await connected.monitor.refresh()
    assert servo.words() == ([2] if stops else [])
    assert not connected.axis.stop_pending
    await again.close()


async def test_a_stop_that_is_pending_outlives_the_server(
    x: ConnectedDrive, servo: Servo, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """The line was dead when the motion ended, and the server ended before it came back."""
    x.axis.stop_pending = True
    await lost_in_the_middle(x, servo)
    state = tmp_path_factory.mktemp("ended") / "state"
    shutil.copytree(tmp_path, state)
    servo.mute = False
    servo.enable()
    servo.written.clear()
    again, connected = await bench_with(servo, state)
    await connected.monitor.refresh()
    assert servo.words() == [2]
    await again.close()


async def test_what_was_changed_after_the_kill_is_offered_not_done(
    x: ConnectedDrive, servo: Servo, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    state = tmp_path_factory.mktemp("killed") / "state"
    await killed(x, servo, tmp_path, state)
    servo.set(place(TORQUE), 1234)
    again, connected = await bench_with(servo, state)
    await back(again, servo)
    assert held(servo) == {TORQUE: 1234, SPEED: 400}
    assert [(entry.key, entry.raw) for entry in connected.drive.pending_restores.entries] == [
        (TORQUE, 3000)
    ]
    await again.close()


async def test_another_drive_in_its_place_owes_nothing(
    x: ConnectedDrive, servo: Servo, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    state = tmp_path_factory.mktemp("killed") / "state"
    await killed(x, servo, tmp_path, state)
    servo.set((0x1018, 4), servo.number((0x1018, 4)) + 1)
    again, connected = await bench_with(servo, state)
    await back(again, servo)
    assert "had serial number 7" in str(connected.drive.identity_warning)
    assert held(servo) == {TORQUE: 800, SPEED: 200}, "nothing is written to it"
    await again.accept_identity("x")
    assert not connected.drive.pending_restores
    await again.close()


async def test_on_a_full_disk_nothing_is_changed_for_a_motion(
    bench: Bench, x: ConnectedDrive, servo: Servo, tmp_path: Path
) -> None:
    """After a kill nobody would know what to restore."""
    (tmp_path / "restore").write_text("in the way")
    servo.written.clear()
    with pytest.raises(StorageFailed) as refused:
        async with temporary(x.axis, {SPEED: 200}):
            raise AssertionError("it was changed")
    assert refused.value.code == "restore.not-kept"
    assert servo.written == []
    assert not x.drive.pending_restores.in_motion
    assert x.drive.pending_restores.outstanding == ()
    (tmp_path / "restore").unlink()
    async with temporary(x.axis, {SPEED: 200}):
        assert held(servo)[SPEED] == 200
    assert held(servo) == WAS


async def test_a_disk_that_fills_up_in_a_motion_ends_nothing_and_is_reported(
    bench: Bench, x: ConnectedDrive, servo: Servo, tmp_path: Path
) -> None:
    async with temporary(x.axis, {SPEED: 200}):
        for file in (tmp_path / "restore").iterdir():
            file.unlink()
        (tmp_path / "restore").rmdir()
        (tmp_path / "restore").write_text("in the way")
        await x.drive.write(SPEED, 210)
    assert held(servo) == WAS
    lines = [entry.message.code for entry in bench.journal.entries("x")]
    assert lines.count("journal.restore-list-not-kept") == 1
