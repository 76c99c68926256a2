"""The motion authority: what a grant permits, when it ends, and that nothing goes past it."""

from __future__ import annotations

import ast
import asyncio
import time
from pathlib import Path

import httpx
import pytest

from backend.axes.axis.axis import Axis
from backend.axes.drive.drive import Drive
from backend.axes.drive.ports import Port
from backend.axes.functions.assign import assign
from backend.axes.motion.authority import UNATTENDED_S, MotionAuthority
from backend.axes.motion.grant import Grant, NotGranted
from backend.axes.motion.stopping import stops
from backend.foundation.work.jobs import JobResult, Progress
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from drivers.cia402 import Mode, State
from drivers.errors import Busy, NotAllowed
from drivers.texts.message import Text, text
from profiles.loader import load_profile
from tests.support.firmware_link import STATION, FirmwareLink
from tests.support.servo import Servo

TARGET, MODE, CONTROL = "607A:00", "6060:00", "6040:00"


# --- what a grant permits ---------------------------------------------------------------


async def test_a_grant_made_by_hand_permits_nothing(x: ConnectedDrive) -> None:
    forged = Grant("x", "", "a forgery", time.monotonic() + 60)
    with pytest.raises(NotGranted, match="does not cover it"):
        await x.drive.command(TARGET, 1000, forged)


async def test_a_grant_is_for_one_drive(x: ConnectedDrive) -> None:
    with (
        x.drive.authority.granted("y", "Y", "move Y") as other,
        pytest.raises(NotGranted, match="does not cover it"),
    ):
        await x.drive.command(TARGET, 1000, other)


async def test_a_grant_for_some_objects_is_for_no_other(x: ConnectedDrive) -> None:
    with x.axis.granted("force outputs", keys=frozenset({"60FE:01"})) as grant:
        await x.drive.energise("60FE:01", 0, grant)
        with pytest.raises(NotGranted):
            await x.drive.command(TARGET, 1000, grant)


async def test_a_grant_that_was_given_back_permits_nothing(x: ConnectedDrive, servo: Servo) -> None:
    with x.axis.granted("move") as grant:
        await x.drive.command(TARGET, 1000, grant)
    servo.written.clear()
    with pytest.raises(NotGranted):
        await x.drive.command(TARGET, 2000, grant)
    assert servo.written == []


async def test_nothing_enables_without_a_grant(x: ConnectedDrive, servo: Servo) -> None:
    with pytest.raises(NotGranted):
        await x.axis.go_to(State.OPERATION_ENABLED)
    assert await x.axis.state() is not State.OPERATION_ENABLED
    assert servo.words() == [6, 7]
    await x.axis.go_to(State.SWITCH_ON_DISABLED)


async def test_others_do_not_hold_the_grant_of_a_motion(
    x: ConnectedDrive, bench: Bench, http: httpx.AsyncClient
) -> None:
    held: list[Grant | None] = []

    async def work(_progress: Progress) -> JobResult | None:
        held.append(bench.authority.held("x"))
        await asyncio.Event().wait()
        return None

    job = bench.jobs.start("move", "Move X", work, drive="x", motion=True)
    await asyncio.sleep(0.01)
    assert held[0] is not None
    assert bench.authority.grant_of("x") is held[0]
    assert bench.authority.held("x") is None
    with pytest.raises(Busy, match="Move X"), x.axis.granted("another motion"):
        pass
    answer = await http.put("/drives/x/parameters/6084:00", json={"raw": 5})
    assert "Move X" in answer.json()["detail"]
    await bench.jobs.cancel(job)
    assert bench.authority.grant_of("x") is None


async def test_work_that_keeps_its_axis_still_has_no_grant(bench: Bench) -> None:
    held: list[Grant | None] = []

    async def work(_progress: Progress) -> JobResult | None:
        held.append(bench.authority.held("x"))
        return None

    job = bench.jobs.start("load_set", "Load", work, drive="x", motion=True, stoppable=False)
    await job.wait()
    assert held == [None]


# --- when it ends -----------------------------------------------------------------------


async def test_stop_ends_every_grant_but_lets_temporary_values_be_restored(
    x: ConnectedDrive, bench: Bench
) -> None:
    drive = x.drive
    with x.axis.granted("move") as grant, drive.pending_restores.temporary({MODE: 1}):
        await bench.motion.stop(["x"])
        assert bench.authority.grant_of("x") is None
        with pytest.raises(NotGranted, match="STOP was pressed"):
            await drive.command(TARGET, 1000, grant)
        with pytest.raises(NotGranted, match="STOP was pressed"):
            await drive.energise(MODE, 3, grant)
        assert (await drive.put_back(MODE, 1)).raw == 1


async def test_a_motion_whose_time_is_over_is_ended(bench: Bench) -> None:
    authority = bench.authority
    ended: list[Text] = []
    with authority.granted("x", "X", "move", lasts_s=0.02, ended=ended.append) as grant:
        await asyncio.sleep(0.05)
        assert ended == [text("motion.time-is-over")]
        assert authority.grant_of("x") is None
        with pytest.raises(NotGranted, match="reached its longest time"):
            authority.require(grant, "x", "X", TARGET)


async def test_an_inner_grant_lasts_no_longer_than_the_outer() -> None:
    authority = MotionAuthority()
    with (
        authority.granted("x", "X", "job", lasts_s=1.0) as outer,
        authority.granted("x", "X", "move", lasts_s=60.0) as inner,
    ):
        assert inner.until == outer.until
        assert authority.grant_of("x") is inner


async def test_an_axis_left_enabled_by_a_script_loses_its_power(
    x: ConnectedDrive, bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert UNATTENDED_S == 600.0
    monkeypatch.setattr("backend.axes.axis.axis.UNATTENDED_S", 0.05)
    await x.axis.transition(State.OPERATION_ENABLED, Mode.PV)
    standing = bench.authority.grant_of("x")
    assert standing is not None
    assert standing.standing
    assert bench.authority.mover_of("x") is None
    async with asyncio.timeout(30):
        while await x.axis.state() is State.OPERATION_ENABLED:  # noqa: ASYNC110 - no event
            await asyncio.sleep(0.01)
    assert bench.authority.grant_of("x") is None


async def test_only_a_live_grant_permits_an_axis_left_enabled_to_turn(
    x: ConnectedDrive, bench: Bench
) -> None:
    assert not bench._may_turn("x")
    await x.axis.transition(State.OPERATION_ENABLED, Mode.PV)
    assert bench._may_turn("x")
    bench.authority.revoke("x", text("motion.time-is-over"))
    assert x.axis.left_enabled
    assert not bench._may_turn("x")


# --- classes ----------------------------------------------------------------------------


async def test_limits_are_not_written_with_power(x: ConnectedDrive, servo: Servo) -> None:
    """605Ah = 0 was taken during a jog, and STOP then coasted."""
    servo.enable()
    for key, raw in (("605A:00", 0), ("607D:01", -(2**31)), ("6065:00", 0xFFFFFFFF)):
        servo.written.clear()
        with pytest.raises(NotAllowed, match="only while the motor is not enabled"):
            await x.drive.write(key, raw)
        assert servo.written == []


@pytest.mark.parametrize(
    ("key", "raw", "harmless"),
    [
        (CONTROL, 0x00, True), (CONTROL, 0x02, True), (CONTROL, 0x06, True),
        (CONTROL, 0x80, True), (CONTROL, 0x107, True), (CONTROL, 0x0F, False),
        (CONTROL, 0x1F, False), (CONTROL, 0x0B, False), (CONTROL, 0x10F, False),
        (CONTROL, 0x800, False), ("60FF:00", 0, True), ("60FF:00", 1, False),
        (TARGET, 0, False), (MODE, 0, False), ("60FE:01", 0, True),
    ],
)  # fmt: skip
def test_what_only_stops(key: str, raw: int, harmless: bool) -> None:
    """CiA 402-2 table 29: bit 3 enables; zero is a place for 607Ah, and no mode for 6060h."""
    profile = load_profile("mms7")
    assert stops(profile, profile.by_key[key], raw) is harmless


# --- settings that can start a motion ---------------------------------------------------


def an_m6l() -> tuple[Axis, FirmwareLink]:
    link = FirmwareLink("m6l", "ethercat", real_time=True)
    profile = load_profile("m6l")
    return Axis(Drive("x", "X", profile, [Port(link, STATION, profile.link("ethercat"))])), link


async def test_an_input_that_is_on_gets_no_function() -> None:
    """M6-L 2003:02 = 17 is "forward jog" of DI2: it turned with a status word "disabled", and the
    drive lets the function not be removed while it turns."""
    axis, link = an_m6l()
    link.device.inject("di2", 1.0)
    start = link.angle_rad
    with pytest.raises(NotAllowed, match="DI2 is on"):
        await assign(axis, "2003:02", 17)
    link.pass_s(1.0)
    assert abs(link.angle_rad - start) < 1e-3


async def test_a_setting_that_turns_the_shaft_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    async def not_seen(*_what: object) -> None: ...

    monkeypatch.setattr("backend.axes.functions.assign._require_inputs_off", not_seen)
    axis, link = an_m6l()
    link.device.inject("di2", 1.0)
    with pytest.raises(NotAllowed, match="began to turn") as reported:
        await assign(axis, "2003:02", 17)
    assert "emergency stop" in (reported.value.remedy or "")


async def test_a_terminal_is_assigned_while_its_input_is_off() -> None:
    axis, link = an_m6l()
    start = link.angle_rad
    assert (await assign(axis, "2003:02", 17)).raw == 17
    link.pass_s(1.0)
    assert abs(link.angle_rad - start) < 1e-3


async def test_commands_are_no_settings() -> None:
    axis, _ = an_m6l()
    for key in (CONTROL, MODE, TARGET, "2003:0F", "2001:15"):
        with pytest.raises(NotGranted, match="is a command"):
            await assign(axis, key, 0)


# --- nothing goes past it ---------------------------------------------------------------

ROOT = Path(__file__).resolve().parents[4] / "backend"
#: Who may call the loop or write to a link past `Drive`, and why.
ALLOWED = {
    "drive_to": {"axes/axis/loop.py"},
    "play": {"axes/axis/loop.py"},
}


@pytest.mark.parametrize("method", sorted(ALLOWED))
def test_nothing_commands_the_loop_past_the_authority(method: str) -> None:
    found = set()
    for path in ROOT.rglob("*.py"):
        name = path.relative_to(ROOT).as_posix()
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)):
                continue
            owner = node.func.value
            of_module = isinstance(owner, ast.Name) and owner.id == "loop"
            if node.func.attr == method and not of_module:
                found.add(name)
    assert found == ALLOWED[method]


def test_nothing_writes_to_a_link_past_the_drive() -> None:
    """STOP by any port is the one exception: it must not wait for anything."""
    found = set()
    for path in ROOT.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)):
                continue
            owner = node.func.value
            of_link = isinstance(owner, ast.Attribute) and owner.attr == "link"
            if node.func.attr == "write" and of_link:
                found.add(path.relative_to(ROOT).as_posix())
    assert found == {"axes/drive/drive.py", "axes/axis/power.py"}


def test_only_stop_brakes_without_a_grant() -> None:
    """`Drive.stop_by` writes what could move an axis at another time."""
    found = set()
    house = ROOT.parent
    for room in ("backend", "drivers", "profiles", "benchmarks"):
        for path in (house / room).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text("utf-8"))):
                # Also a mention that is no call: a bound method can be handed on.
                if isinstance(node, ast.Attribute) and node.attr == "stop_by":
                    found.add(path.relative_to(house).parent.as_posix())
    assert found == {"backend/axes/stopping", "backend/axes/axis/stop"}
