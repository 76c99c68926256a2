"""Motion through the interface: the axis moves as reported, and stops in every way it must."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import AbstractContextManager
from typing import Any

import pytest

from tests.api.test_scope_streams import blocks
from tests.support import jogging
from tests.support.jogging import There, fast
from tests.support.machine import OwnTime, within
from tests.support.station import HANG_S, Live, Station, until

JOG = {"speed": 300.0, "acceleration": 3000.0, "travel_limit": 20.0, "torque_limit": 150.0}
#: v·T + v²/2a of JOG in revolutions, with T = 0.2 s.
LEAD_REV = 5.0 * 0.2 + 5.0**2 / (2 * 50.0)


def position(station: Station, drive: str) -> float:
    return float(station.state(drive)["position"])


def moving(station: Station, drive: str) -> bool:
    return abs(float(station.state(drive)["velocity"])) > 100


def at_rest(station: Station, drive: str) -> bool:
    return abs(float(station.state(drive)["velocity"])) < 2


@pytest.fixture
def page(station: Station, x: str) -> Iterator[Live]:
    with station.live() as live:
        yield live


def start_jog(page: Live, x: str, **changes: object) -> None:
    page.send(type="jog_start", drive=x, direction=1, **(JOG | changes))


def jogged(
    station: Station, page: Live, x: str, there: There, **changes: object
) -> AbstractContextManager[float]:
    return jogging.jogged(station.http, page, x, there, **(JOG | changes))


def test_jog_moves_at_speed_and_stops_on_release(station: Station, x: str, page: Live) -> None:
    speeds: list[float] = []
    steady: list[float] = []  # when, in a row

    def at_speed(now: Any, _start: float) -> bool:
        speeds.append(float(now["velocity"]))
        if speeds[-1] == pytest.approx(300, rel=0.05):
            steady.append(time.monotonic())
        else:
            steady.clear()
        return len(steady) >= 5 and steady[-1] - steady[0] > 0.5

    with jogged(station, page, x, at_speed, travel_limit=150.0):
        page.send(type="jog_stop", drive=x)
    ended = page.wait("jog_ended", drive=x)
    assert max(speeds) < 300 * 1.05
    assert ended["problem"] is None
    assert ended["reason_message"]["code"] == "jog.end-released"
    now = station.state(x)
    assert abs(now["velocity"]) < 2
    assert now["state"] == "Switch on disabled", "the power state is as it was"


@pytest.mark.long
def test_jog_stops_when_the_renewals_stop(station: Station, x: str, page: Live) -> None:
    with jogged(station, page, x, fast):
        pass
    with OwnTime(with_children=True) as took:
        ended = page.wait("jog_ended", drive=x)
    # Braked after 200 ms without a sign of life, 100 ms at 3000 rpm/s; ended after 500 ms.
    assert took.s < 1.0
    assert "500 ms" in ended["reason"]
    assert at_rest(station, x)


def test_jog_stops_when_the_page_is_gone(station: Station, x: str) -> None:
    with station.live() as page, jogged(station, page, x, fast):
        pass
    within(1.0, lambda: at_rest(station, x), "the axis stands")
    lease = station.ok(station.http.get(f"/drives/{x}"))["lease"]
    assert lease["holder"] is None


@pytest.mark.long
def test_stop_works_for_everyone_and_nothing_enables_again(
    station: Station, x: str, page: Live
) -> None:
    with jogged(station, page, x, fast):
        answer = station.ok(station.http.post("/stop", json={}))  # another client, no lease
        assert x in answer["stopped"]
        time.sleep(0.5)  # the button is still held
    page.wait("jog_ended", drive=x)
    now = station.state(x)
    assert abs(now["velocity"]) < 2
    assert now["state"] != "Operation enabled"


@pytest.mark.long
def test_jog_keeps_the_travel_limit(station: Station, x: str, page: Live) -> None:
    with jogged(station, page, x, stands_after_half_a_turn, travel_limit=0.5) as start:
        time.sleep(0.3)  # and there it stays
        assert position(station, x) - start == pytest.approx(0.5, abs=0.02)
        page.send(type="jog_stop", drive=x)
    page.wait("jog_ended", drive=x)


def stands_after_half_a_turn(now: Any, start: float) -> bool:
    return abs(now["velocity"]) < 2 and abs(now["position"] - start - 0.5) < 0.02


def test_jog_restores_what_it_changed(station: Station, x: str, page: Live) -> None:
    keys = ["6060:00", "6081:00", "6083:00", "6084:00"]

    def read() -> list[int]:
        rows = [station.ok(station.http.get(f"/drives/{x}/parameters/{k}")) for k in keys]
        return [row["raw"] for row in rows]

    before = read()
    with jogged(station, page, x, fast):
        page.send(type="jog_stop", drive=x)
    page.wait("jog_ended", drive=x)
    assert read() == before


@pytest.mark.long
def test_pulled_cable_ends_within_the_lead(station: Station, x: str, page: Live) -> None:
    """No watchdog in the drive: its own profile generator must brake (architecture)."""
    with jogged(station, page, x, fast):
        station.drives.command(do="pull", wire="mlink://virtual0")
        near = past_the_wire(station)
        time.sleep(1.0)
    station.drives.command(do="heal", wire="mlink://virtual0")
    until(lambda: station.state(x)["fresh"], HANG_S, "the drive answers again")
    within(3, lambda: at_rest(station, x), "the axis stands")
    assert past_the_wire(station) - near < LEAD_REV


def past_the_wire(station: Station) -> float:
    """The drive's own position, in revolutions."""
    reported = station.drives.command(do="read", axis="Feed screw", index=0x6064, subindex=0)
    return int.from_bytes(bytes.fromhex(str(reported)), "little", signed=True) / 65536


def test_somebody_else_cannot_move_a_held_axis(station: Station, x: str, page: Live) -> None:
    page.send(type="lease", drive=x, take=True)
    until(lambda: station.ok(station.http.get(f"/drives/{x}"))["lease"]["holder"], HANG_S)
    answer = station.http.put(f"/drives/{x}/parameters/6081:00", json={"raw": 1})
    assert answer.status_code == 409
    assert "has control" in answer.json()["detail"]
    with station.live() as other:
        start_jog(other, x)
        refused = other.wait("refused", request="jog_start")
        assert "has control" in refused["problem"]["detail"]
    mine = {"X-Servodeck-Connection": page.connection}
    station.ok(
        station.http.put(f"/drives/{x}/parameters/6081:00", json={"raw": 1000}, headers=mine)
    )


def test_position_move_arrives(station: Station, x: str) -> None:
    before = position(station, x)
    body = {"mode": "PP", "target": 2.0, "relative": True, "speed": 600, "acceleration": 6000,
            "deceleration": 6000, "travel_limit": 3, "torque_limit": 200}  # fmt: skip
    station.done(station.http.post(f"/drives/{x}/jobs/move", json=body))
    assert position(station, x) - before == pytest.approx(2.0, abs=0.01)
    assert station.state(x)["state"] == "Switch on disabled"


def test_move_outside_the_envelope_does_not_start(station: Station, x: str) -> None:
    before = position(station, x)
    body = {"mode": "PP", "target": 5.0, "relative": True, "travel_limit": 1, "torque_limit": 100}
    job = station.job(station.http.post(f"/drives/{x}/jobs/move", json=body))
    assert job["state"] == "failed"
    assert "travel limit" in job["problem"]["detail"]
    assert position(station, x) == pytest.approx(before, abs=0.001)


@pytest.mark.long
def test_a_move_and_a_jog_typed_in_millimetres(station: Station, x: str, page: Live) -> None:
    """A screw of 5 mm behind 2:1: 2.5 mm per motor revolution, and answers in mm."""
    body = {"mode": "PP", "target": 2.5, "relative": True, "speed": 25, "acceleration": 250,
            "deceleration": 250, "travel_limit": 5, "torque_limit": 200, "unit": "mm"}  # fmt: skip
    path = f"/drives/{x}/jobs/move"
    refused = station.http.post(path, json=body)
    assert refused.status_code == 409
    assert "mechanics" in refused.json()["detail"]
    screw = {"mechanics": {"kind": "screw", "lead_mm": 5, "motor_turns": 2}}
    station.ok(station.http.put(f"/drives/{x}/mechanics", json=screw))
    before = position(station, x)
    station.done(station.http.post(path, json=body))
    assert position(station, x) - before == pytest.approx(1.0, abs=0.01)
    job = station.job(station.http.post(path, json=body | {"target": 6}))
    assert (
        "+6 mm from the start point is outside the travel limit of 5 mm"
        in (job["problem"]["detail"])
    )
    short = {"speed": 25.0, "acceleration": 250.0, "travel_limit": 1.25, "unit": "mm"}
    with jogged(station, page, x, stands_after_half_a_turn, **short) as start:
        time.sleep(0.3)
        assert position(station, x) - start == pytest.approx(0.5, abs=0.02)
        page.send(type="jog_stop", drive=x)
    page.wait("jog_ended", drive=x)
    station.ok(station.http.put(f"/drives/{x}/mechanics", json={"mechanics": None}))


def test_velocity_needs_consent_where_the_drive_has_no_watchdog(station: Station, x: str) -> None:
    body = {"mode": "PV", "target": 300, "acceleration": 5000, "deceleration": 5000,
            "travel_limit": 10, "torque_limit": 200, "timeout_s": 0.5}  # fmt: skip
    job = station.job(station.http.post(f"/drives/{x}/jobs/move", json=body))
    assert job["state"] == "failed"
    assert "no watchdog" in job["problem"]["detail"]
    result = station.done(
        station.http.post(f"/drives/{x}/jobs/move", json=body | {"consent": True})
    )
    # 300 rpm for 0.5 s with 60 ms ramps: 2.5 rev less half a ramp, plus the stop.
    assert result["end_rev"] - result["start_rev"] == pytest.approx(2.5, abs=0.6)
    assert at_rest(station, x)


@pytest.mark.long
def test_homing_to_the_present_position(station: Station, x: str) -> None:
    methods = station.ok(station.http.get(f"/drives/{x}/homing-methods"))
    assert {33, 34} <= {method["method"] for method in methods}
    body = {"method": 33, "speed_switch": 120, "speed_zero": 60, "acceleration": 3000,
            "travel_limit": 5, "torque_limit": 150}  # fmt: skip
    result = station.done(station.http.post(f"/drives/{x}/jobs/home", json=body))
    assert result["method"] == 33
    answer = station.http.post(f"/drives/{x}/jobs/home", json=body | {"method": 99})
    assert answer.status_code == 409


@pytest.mark.long
def test_back_and_forth(station: Station, x: str) -> None:
    start = position(station, x)
    body = {"first": start, "second": start + 0.5, "speed": 600, "acceleration": 10000,
            "dwell_s": 0.05, "count": 2, "travel_limit": 1, "torque_limit": 200}  # fmt: skip
    result = station.done(station.http.post(f"/drives/{x}/jobs/sequence", json=body))
    assert result["cycles"] == 2
    assert position(station, x) == pytest.approx(start + 0.5, abs=0.01)


def test_cancelled_move_stops_and_restores(station: Station, x: str) -> None:
    body = {"mode": "PP", "target": 15.0, "relative": True, "speed": 120, "acceleration": 3000,
            "deceleration": 3000, "travel_limit": 20, "torque_limit": 200}  # fmt: skip
    job = station.ok(station.http.post(f"/drives/{x}/jobs/move", json=body))
    until(lambda: moving(station, x), HANG_S)
    ended = station.ok(station.http.delete(f"/jobs/{job['id']}"))
    assert ended["state"] == "cancelled"
    now = station.state(x)
    assert abs(now["velocity"]) < 2
    assert now["state"] == "Switch on disabled"


def test_two_motions_at_once_are_refused(station: Station, x: str) -> None:
    body = {"mode": "PP", "target": 5.0, "relative": True, "speed": 120, "acceleration": 3000,
            "travel_limit": 20, "torque_limit": 200}  # fmt: skip
    first = station.ok(station.http.post(f"/drives/{x}/jobs/move", json=body))
    second = station.http.post(f"/drives/{x}/jobs/move", json=body)
    assert second.status_code == 409
    assert "already moved" in second.json()["detail"]
    station.ok(station.http.delete(f"/jobs/{first['id']}"))


def test_enabling_while_a_fault_is_present_gives_the_cause(station: Station, x: str) -> None:
    station.drives.command(do="inject", axis="Feed screw", what="over_temperature")
    until(lambda: station.state(x)["faults"], HANG_S, "the fault shows")
    now = station.state(x)
    assert now["state"] == "Fault"
    assert now["faults"][0]["causes"]
    assert now["faults"][0]["remedies"]
    assert any("fault present" in cause for cause in now["blocked_by"])
    assert "axis.cause-fault" in [message["code"] for message in now["blocked_by_messages"]]
    station.drives.command(do="inject", axis="Feed screw", what="over_temperature", value=0)
    state = station.ok(station.http.post(f"/drives/{x}/fault-reset", json={}))
    assert state["state"] == "Switch on disabled"


def test_scope_delivers_samples_with_their_times(station: Station, x: str, page: Live) -> None:
    channels = [{"drive": x, "key": "6064:00"}, {"drive": x, "key": "606C:00"}]
    page.send(type="scope_start", subscription=5, channels=channels)
    info = page.wait("scope_info", subscription=5)
    assert [c["synchronous"] for c in info["channels"]] == [False, False]
    until(lambda: page.receive() and len(page.binary) >= 5, HANG_S)
    page.send(type="scope_stop", subscription=5)
    import struct

    sequences = []
    for head, rest in (block for frame in page.binary for block in blocks(frame)):
        magic, subscription, sequence, dropped, rows, count, flags, _t0, dt = head
        assert (magic, subscription, dropped, count, flags) == (0x424B4353, 5, 0, 2, 1)
        assert len(rest) == 8 * rows + 4 * rows * count
        times = struct.unpack_from(f"<{rows}d", rest)
        assert list(times) == sorted(times)
        assert dt >= 0
        sequences.append(sequence)
    assert sequences == list(range(1, len(sequences) + 1))


@pytest.mark.long
def test_power_cut_while_jogging(station: Station, x: str, page: Live) -> None:
    with jogged(station, page, x, fast):
        station.drives.command(do="power_cycle", axis="Feed screw", off_s=0.5)
        time.sleep(1.0)
    ended = page.wait("jog_ended", drive=x)
    assert ended["problem"] is not None
    until(lambda: station.state(x)["fresh"], HANG_S, "the drive answers again")
    now = until(lambda: at_rest(station, x) and station.state(x), HANG_S)
    assert now["state"] != "Operation enabled"
    with jogged(station, page, x, fast):  # and it can be moved again without a restart of anything
        page.send(type="jog_stop", drive=x)
    ended = page.wait("jog_ended", drive=x)
    assert ended["problem"] is None, ended


@pytest.mark.long
def test_setpoints_of_an_enabled_axis_are_not_written_by_hand(station: Station, x: str) -> None:
    station.ok(
        station.http.post(f"/drives/{x}/transition", json={"goal": "Operation enabled", "mode": 3})
    )
    answer = station.http.put(f"/drives/{x}/parameters/60FF:00", json={"raw": 100000})
    assert answer.status_code == 409
    assert answer.json()["type"] == "urn:servodeck:not-granted"
    assert at_rest(station, x)
    station.ok(station.http.post(f"/drives/{x}/transition", json={"goal": "Switch on disabled"}))
    # Nor of one that is not: the write that enables it would then move it.
    answer = station.http.put(f"/drives/{x}/parameters/60FF:00", json={"raw": 0})
    assert answer.json()["type"] == "urn:servodeck:not-granted"
