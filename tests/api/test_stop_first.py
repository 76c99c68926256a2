"""STOP and letting go overtake everything else that a page or a line is busy with."""

from __future__ import annotations

import time

import httpx
import pytest

from tests.support.machine import OwnTime, within
from tests.support.station import HANG_S, Live, Station, until

BODY = {"mode": "PP", "target": 15.0, "relative": True, "speed": 120, "acceleration": 3000,
        "deceleration": 3000, "travel_limit": 20, "torque_limit": 200}  # fmt: skip


def ended(station: Station, job: str) -> bool:
    return bool(station.ok(station.http.get(f"/jobs/{job}"))["state"] != "running")


@pytest.mark.long(keep=4)
@pytest.mark.parametrize("delay_s", [0.0, 0.01, 0.03, 0.06, 0.1, 0.3])
@pytest.mark.parametrize("way", ["http", "websocket"])
def test_stop_in_every_phase_of_a_move(station: Station, x: str, way: str, delay_s: float) -> None:
    """Before enabling, while limits are set, while enabling, at speed: never enabled after it."""
    keys = ["6060:00", "6072:00", "6081:00", "6083:00", "6084:00"]

    def values() -> list[int]:
        return [station.ok(station.http.get(f"/drives/{x}/parameters/{k}"))["raw"] for k in keys]

    before = values()
    with station.live() as page:
        job = station.ok(station.http.post(f"/drives/{x}/jobs/move", json=BODY))["id"]
        time.sleep(delay_s)
        for _ in range(2):  # twice, as the page does
            if way == "http":
                station.http.post("/stop", json={})
            else:
                page.send(type="stop")
        within(6, lambda: ended(station, job), "the job ends")
    now = station.state(x)
    assert now["state"] == "Switch on disabled"
    assert abs(now["velocity"]) < 2
    assert values() == before


def test_stop_during_a_cleanup(station: Station, x: str) -> None:
    job = station.ok(station.http.post(f"/drives/{x}/jobs/move", json=BODY))["id"]
    until(lambda: abs(station.state(x)["velocity"]) > 100, HANG_S)
    impatient = httpx.Timeout(20, read=0.005)
    with pytest.raises(httpx.ReadTimeout):  # it is cancelled, and braking now
        httpx.delete(f"{station.url}/api/v1/jobs/{job}", timeout=impatient)
    station.ok(station.http.post("/stop", json={}))
    within(6, lambda: ended(station, job), "the job ends")
    assert station.state(x)["state"] == "Switch on disabled"


def test_stop_of_a_drive_in_a_fault(station: Station, x: str) -> None:
    station.drives.command(do="inject", axis="Feed screw", what="over_temperature")
    until(lambda: station.state(x)["state"] == "Fault", HANG_S)
    assert station.ok(station.http.post("/stop", json={}))["failed"] == {}
    assert station.state(x)["state"] == "Fault"
    job = station.job(station.http.post(f"/drives/{x}/jobs/move", json=BODY))
    assert job["state"] == "failed"
    assert "fault present" in job["problem"]["detail"]
    station.drives.command(do="inject", axis="Feed screw", what="over_temperature", value=0)
    station.ok(station.http.post(f"/drives/{x}/fault-reset", json={}))


def test_stop_while_everything_is_read(station: Station, x: str) -> None:
    station.ok(station.http.post(f"/drives/{x}/jobs/move", json=BODY))
    until(lambda: abs(station.state(x)["velocity"]) > 100, HANG_S)
    for _ in range(3):
        station.ok(station.http.post(f"/drives/{x}/jobs/read_all", json={}))
    with OwnTime(with_children=True) as took:
        assert station.ok(station.http.post("/stop", json={}))["failed"] == {}
    assert took.s < 0.25


def test_stop_does_not_wait_for_a_scope_that_ends(station: Station, x: str) -> None:
    """Ending a poll of a mute drive takes as long as its time-out."""
    with station.live() as page:
        page.send(type="scope_start", subscription=1, channels=[{"drive": x, "key": "6064:00"}])
        page.wait("scope_info", subscription=1)
        wait_for_samples(page)
        for number in range(20):
            page.send(
                type="scope_start",
                subscription=1 + number % 2,
                channels=[{"drive": x, "key": "6064:00"}],
            )
        with OwnTime(with_children=True) as took:
            page.send(type="stop")
            page.send(type="ping", n=1)
            page.wait("pong", n=1)
        assert took.s < 0.25


def wait_for_samples(page: Live) -> None:
    until(lambda: page.receive() and page.binary, HANG_S)


@pytest.mark.long
def test_the_answers_of_a_stop_carry_the_number_of_its_press(station: Station) -> None:
    with station.live() as page:
        for press in (7, 8):
            page.send(type="stop", press=press)
        # The result of the first may come before the second is taken.
        missing = {(kind, press) for kind in ("stop_taken", "stop_result") for press in (7, 8)}
        until(lambda: missing.discard(answered(page.receive())) or not missing, HANG_S)


def answered(message: dict[str, object]) -> tuple[object, object]:
    return message["type"], message.get("press")
