"""Scales through the interface: refused by every job, taught by a small move, kept, forgotten."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.support.station import Station

CAN = "canopen://virtual0"
BENCH = """
[[axis]]
name = "Unknown"
drive = "generic402"
on = "canopen://virtual0"
station = 5
[axis.mechanics.motor]
inertia_kgm2 = 5e-5
rated_torque_nm = 1.27
rated_speed_rpm = 3000
[axis.mechanics.friction]
viscous_nms = 2e-4
coulomb_nm = 0.03
[axis.mechanics.rough_feedback]
velocity_unit = 0xFFB44700
lacks = ["6092", "608F", "60A9", "60AA"]
"""
LIMITS = {"travel_limit": 3, "speed_limit": 100, "torque_limit": 50}


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    """A drive in 0.1 rpm that says nothing of it, 10 000 increments to the revolution."""
    folder = Path(tmp_path_factory.mktemp("scales"))
    bench = folder / "bench.toml"
    bench.write_text(BENCH, "utf-8")
    running = Station(folder, bench)
    running.start()
    yield running
    running.stop()


def scales(station: Station, drive: str) -> Any:
    return station.ok(station.http.get(f"/drives/{drive}/scales"))


@pytest.mark.long
def test_from_refused_to_taught(station: Station) -> None:
    drive = station.add(5, CAN, "generic402", "N")
    before = scales(station, drive)
    assert not before["certain"]
    assert {s["uncertainty"] for s in before["scales"]} == {"no_resolution", "not_stated"}
    assert all(s["remedy"] for s in before["scales"])

    for job, body in {
        "move": {"mode": "PP", "target": 1, "travel_limit": 3, "torque_limit": 50, "speed": 60},
        "inertia": LIMITS,
        "sweep": LIMITS,
    }.items():
        answer = station.http.post(f"/drives/{drive}/jobs/{job}", json=body)
        if answer.status_code == 202:
            ended = station.job(answer, 60)
            assert ended["state"] == "failed", job
            problem = ended["problem"]
        else:
            problem = answer.json()
        assert "is not certain" in problem["detail"], job

    too_far = station.http.post(f"/drives/{drive}/jobs/small_move", json={"increments": 5000})
    assert "1 to 1000 increments now" in station.job(too_far, 60)["problem"]["detail"]
    for increments in (1000, 5000):
        body = {"increments": increments}
        moved = station.done(station.http.post(f"/drives/{drive}/jobs/small_move", json=body), 60)
        assert abs(moved["moved_increments"] - increments) < 20

    said = station.ok(
        station.http.post(f"/drives/{drive}/scales/confirm", json={"turned_rev": 0.5})
    )
    by_name = {s["quantity"]: s for s in said["scales"]}
    assert said["certain"]
    assert by_name["position"]["raw_per_unit"] == pytest.approx(10_000, rel=0.01)
    assert by_name["position"]["origin"] == "user"
    assert (by_name["velocity"]["raw_per_unit"], by_name["velocity"]["origin"]) == (10, "measured")
    assert station.state(drive)["units"]["velocity"] == "rpm"

    forgotten = station.ok(station.http.delete(f"/drives/{drive}/scales"))
    assert not forgotten["certain"]
    stated = station.ok(
        station.http.put(
            f"/drives/{drive}/scales", json={"counts_per_rev": 10000, "raw_per_rpm": 10}
        )
    )
    assert stated["certain"]
    assert stated["scales"][0]["origin"] == "user"
    assert station.http.put(f"/drives/{drive}/scales", json={"raw_per_rpm": -1}).status_code == 422
