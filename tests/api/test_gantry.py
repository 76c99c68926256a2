"""A gantry through the interface: both axes move, and whatever ends one of them ends both.

The segment takes its time from the process data. What moved and what stands is judged by the
angles of the virtual shafts, past every wire and unit.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from backend.axes.parameters.set_file import storable
from drivers.virtual.wires.netns import unavailable
from profiles.loader import load_profile
from tests.support.station import Station, until

URL = "ethercat://virtual0"
JOINT, YAW, SQUARE_RAD, RATED_NM = 25.0, 4.0, 0.12, 1.27
MOTOR_KGM2, BEAM_KGM2 = 5e-5, 2e-4
#: Both joints in series, and the guides beside them.
STIFFNESS = (JOINT / 2) * YAW / (JOINT / 2 + YAW)
AXIS = f"""
[[axis]]
name = "{{name}}"
drive = "mms7"
on = "{URL}"
station = {{station}}
[axis.mechanics.motor]
inertia_kgm2 = {MOTOR_KGM2}
rated_torque_nm = {RATED_NM}
rated_speed_rpm = 3000
brake = true
[axis.mechanics.friction]
viscous_nms = 2e-4
coulomb_nm = 0.03
[axis.mechanics.encoder]
noise_counts = 4
"""
BEAM = f"""
[[gantry]]
axes = ["Left", "Right"]
inertia_kgm2 = {BEAM_KGM2}
yaw_inertia_kgm2 = 4e-5
off_centre = 0.15
joint_stiffness_nm_per_rad = {JOINT}
joint_damping_nms_per_rad = 3e-3
yaw_stiffness_nm_per_rad = {YAW}
yaw_damping_nms_per_rad = 2e-3
square_error_rad = {SQUARE_RAD}
"""
LIMITS = {
    "travel_limit": 3.0,
    "speed_limit": 600.0,
    "torque_limit": 60.0,
    "time_limit_s": 60.0,
}
LEAD_MM = 10.0
ASKED = {**LIMITS, "partner": "Right", "lead_mm": LEAD_MM, "resolution_hz": 5.0}
SKEW_LIMIT_REV = 0.05
NAMES = ("Left", "Right")
PROFILE = load_profile("mms7")
#: What a set of parameters holds, and the mode.
KEYS = [p.key for p in storable(PROFILE, motor_individual=True)] + ["6060:00"]


def connected(station: Station) -> tuple[str, str]:
    """Both axes with loops that a cycle of 1 ms shows whole, and the exchange."""
    drives = station.add(1, URL, name="Left"), station.add(2, URL, name="Right")
    for drive in drives:
        # 80 Hz with the inertia of one motor.
        path = f"/drives/{drive}/parameters/2005:03"
        station.ok(station.http.put(path, json={"value": 80.0}))
        for procedure in ("write_settings", "save"):
            path = f"/drives/{drive}/procedures/{procedure}"
            station.done(station.http.post(path, json={"confirmed": True}))
    body = {"url": URL, "cycle_us": 1000}
    assert station.ok(station.http.post("/buses/cyclic", json=body))["cyclic"]["running"]
    return drives


class Gantry:
    """A station with both axes of a gantry, and the truth of its virtual shafts."""

    def __init__(self, station: Station) -> None:
        self.station = station
        self.left, self.right = connected(station)
        self._before = self.settings()

    def trouble(self, command: str, **arguments: object) -> Any:
        return self.station.drives.segments[URL].command(command, **arguments)

    def shafts(self) -> tuple[float, float]:
        """Angles of both, in revolutions."""
        return self.trouble("shaft", slave=0), self.trouble("shaft", slave=1)

    def start(self, **changes: object) -> Any:
        return self.station.http.post(f"/drives/{self.left}/jobs/gantry", json={**ASKED, **changes})

    def moving(self) -> tuple[Any, tuple[float, float]]:
        """A job whose motion has begun, and where both shafts were before."""
        before = self.shafts()
        job = self.station.ok(self.start())
        until(lambda: self._away(before) or self._ended(job), what="both axes move")
        assert not self._ended(job), self._ended(job)
        return job, before

    def _away(self, before: tuple[float, float]) -> bool:
        return all(abs(a - b) > 0.1 for a, b in zip(self.shafts(), before, strict=True))

    def _ended(self, job: Any) -> Any:
        now = self.station.ok(self.station.http.get(f"/jobs/{job['id']}"))
        return now if now["state"] != "running" else None

    def ended(self, job: Any) -> Any:
        """How the job ended."""
        return until(lambda: self._ended(job), what="the job has ended")

    def stand(self, before: tuple[float, float]) -> None:
        """Both shafts stand, disabled, and as square as they were ``before`` the motion."""

        def still() -> bool:
            began, at = self.trouble("state")["time_s"], self.shafts()
            until(lambda: self.trouble("state")["time_s"] > began + 0.1, what="time of the drives")
            return self.shafts() == pytest.approx(at, abs=1e-4)

        until(still, what="both shafts stand")
        ways = [a - b for a, b in zip(self.shafts(), before, strict=True)]
        assert abs(ways[0] - ways[1]) < SKEW_LIMIT_REV

    def settings(self) -> list[dict[str, Any]]:
        """Every value of both drives that a set of parameters holds, and the mode."""
        found = []
        for drive in (self.left, self.right):
            job = self.station.http.post(f"/drives/{drive}/jobs/read_all", json={"keys": KEYS})
            assert self.station.done(job)["failed"] == {}
            rows = self.station.ok(self.station.http.get(f"/drives/{drive}/parameters"))
            found.append({r["key"]: r["reading"]["raw"] for r in rows if r["key"] in KEYS})
        return found

    def settled(self) -> None:
        """Both drives were asked after now and answered, and nothing is left to restore."""
        now = datetime.now(UTC)

        def calm() -> bool:
            states = [self.station.state(drive) for drive in (self.left, self.right)]
            drives = self.station.ok(self.station.http.get("/drives"))
            jobs = self.station.ok(self.station.http.get("/jobs"))
            return (
                all(s["fresh"] and datetime.fromisoformat(s["time"]) > now for s in states)
                and all(drive["pending_restores"] == [] for drive in drives)
                and all(job["state"] != "running" for job in jobs)
            )

        until(calm, what="everything is restored")
        for drive in (self.left, self.right):
            state = self.station.state(drive)
            assert state["state"] != "Operation enabled"
            assert state["moving_job"] is None

    def restored(self) -> None:
        """Both drives hold again what they held before any motion."""
        self.settled()
        assert self.settings() == self._before


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Gantry]:
    if reason := unavailable():
        pytest.skip(f"no private network here: {reason}")
    folder = Path(tmp_path_factory.mktemp("gantry"))
    bench = folder / "bench.toml"
    axes = "".join(AXIS.format(name=name, station=n) for n, name in enumerate(NAMES, 1))
    bench.write_text(axes + BEAM)
    station = Station(folder, bench, ["--sdo-ms", "0.2", "--eeprom-us", "5"], steady=True)
    station.start()
    try:
        yield Gantry(station)
    finally:
        station.stop()


@pytest.fixture
def gantry(made: Gantry) -> Iterator[Gantry]:
    """Whatever a test left it doing is stopped."""
    yield made
    made.station.http.post("/stop", json={})
    made.settled()


def between(found: Any, truth: float) -> bool:
    low, high = found["ci95"]
    return bool(low <= truth <= high)


@pytest.mark.long
def test_a_gantry_out_of_square_is_measured(gantry: Gantry) -> None:
    """Brakes hold the beam where both motors show the same, which is not where it rests."""
    station = gantry.station
    before = gantry.shafts()
    found = station.done(gantry.start(), 300)
    gantry.stand(before)
    ways = [a - b for a, b in zip(gantry.shafts(), before, strict=True)]
    # Back where they began; without power the beam comes to rest where its guides hold it.
    assert sum(ways) / 2 == pytest.approx(0.0, abs=0.004)
    assert -0.001 < ways[0] - ways[1] < SQUARE_RAD / math.tau
    gantry.restored()
    assert found["partner"] == "Right"
    assert found["findings"][0]["code"] == "out_of_square"
    # Axis 1 would rest ahead of axis 2, so that it is behind where both show the same.
    assert between(found["fight_percent"], -100 * STIFFNESS * SQUARE_RAD / RATED_NM)
    assert between(found["out_of_square_rev"], -SQUARE_RAD / math.tau)
    assert between(found["out_of_square_mm"], -SQUARE_RAD / math.tau * LEAD_MM)
    assert between(found["inertia_kgm2"], 2 * MOTOR_KGM2 + BEAM_KGM2)
    assert between(found["skew_stiffness_nm_per_rad"], STIFFNESS)
    (file,) = found["measurements"]
    again = station.ok(station.http.get(f"/measurements/{file}"))
    assert again["agrees"]
    assert again["result"]["fight_percent"] == found["fight_percent"]


@pytest.mark.long
def test_stop_of_the_partner_ends_both(gantry: Gantry) -> None:
    job, before = gantry.moving()
    other = gantry.station.http.post(f"/drives/{gantry.right}/jobs/friction", json=LIMITS)
    assert other.status_code == 409, other.text
    answer = gantry.station.ok(gantry.station.http.post("/stop", json={"drive": gantry.right}))
    assert gantry.ended(job)["state"] == "cancelled"
    assert {gantry.left, gantry.right} <= set(answer["stopped"])
    gantry.stand(before)
    gantry.restored()


def test_control_of_somebody_else_on_the_partner_refuses(gantry: Gantry) -> None:
    before = gantry.shafts()
    with gantry.station.live() as other:
        other.send(type="lease", drive=gantry.right, take=True)
        path = f"/drives/{gantry.right}"
        until(lambda: gantry.station.http.get(path).json()["lease"]["holder"], what="the lease")
        refused = gantry.start()
    assert refused.status_code == 409
    assert "has control" in refused.json()["detail"]
    assert refused.json()["drive"] == gantry.right
    assert gantry.shafts() == pytest.approx(before, abs=1e-4)


@pytest.mark.parametrize("partner", ["", "Left", "Middle"])
def test_an_axis_that_is_no_partner_refuses(gantry: Gantry, partner: str) -> None:
    refused = gantry.start(partner=partner)
    assert refused.status_code == 409, refused.text


@pytest.mark.long
def test_a_fault_of_the_partner_ends_both(gantry: Gantry) -> None:
    job, before = gantry.moving()
    gantry.trouble("inject", slave=1, what="over_temperature")
    ended = gantry.ended(job)
    assert ended["state"] == "failed"
    assert "Right" in ended["problem"]["detail"]
    gantry.stand(before)
    gantry.restored()
    gantry.trouble("inject", slave=1, what="over_temperature", value=0.0)
    gantry.station.ok(gantry.station.http.post(f"/drives/{gantry.right}/fault-reset", json={}))


@pytest.mark.long
def test_a_power_cycle_of_the_partner_ends_both(gantry: Gantry) -> None:
    job, before = gantry.moving()
    gantry.trouble("power_cycle", slave=1, off_s=1.0)
    ended = gantry.ended(job)
    assert ended["state"] == "failed"
    assert ended["problem"]["detail"]
    gantry.stand(before)
    gantry.restored()
