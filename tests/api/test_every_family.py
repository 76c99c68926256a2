"""Five makers on three kinds of bus, each through a whole working day over the interface:
find, read all, units, limits, homing, moves in every mode, jog, gains, save, power-cycle, restore,
a fault with its name, cause and remedy, and its reset.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from drivers.texts.profile_words import FAULT_BY_RECORD
from drivers.virtual.wires.netns import unavailable
from profiles import load_profile
from tests.support.jogging import jogged
from tests.support.machine import Stopwatch, within
from tests.support.station import HANG_S, Station, until

ETHERCAT = "ethercat://virtual0"
#: What the product says, rightly, when this machine keeps a process from running.
STALLED = ("no valid process data", "not renewed in time")
JOG = {"speed": 300.0, "acceleration": 3000.0, "travel_limit": 20.0, "torque_limit": 200.0}


@dataclass(frozen=True)
class Maker:
    """One drive of the bench and what its manual lets it do."""

    family: str
    url: str
    station: int
    modes: tuple[str, ...]
    homing: int
    gain: tuple[str, int]
    fault: str
    slave: int | None = None
    before: dict[str, int] = field(default_factory=dict)
    bus_fault: str = ""
    """What the drive keeps when its process data stayed away while it was enabled."""


MAKERS = (
    Maker("mms7", "mlink://virtual0", 1, ("PP", "PV", "PT"), 33, ("2005:03", 1500), "overload"),
    Maker("ds_c", "canopen://virtual0", 3, ("PP", "PV", "PT"), 35, ("6083:00", 333), "overload"),
    Maker(
        "m6l", ETHERCAT, 1, ("PP", "PV", "PT", "CSP", "CSV", "CST"), 35, ("2008:01", 333),
        "Er.032", slave=0, bus_fault="Er.036",
    ),
    Maker(
        "r6l", ETHERCAT, 2, ("PP", "PV", "PT", "CSP", "CSV", "CST"), 35, ("2006:01", 333),
        "AL.247", slave=1, bus_fault="AL.293",
    ),
    Maker(
        "ep3e", ETHERCAT, 3, ("CSP", "CSV", "CST"), 35, ("2005:00", 77), "Err4", slave=2,
        bus_fault="Err60",
    ),
)  # fmt: skip


def _bench() -> str:
    rows = [
        f'[[axis]]\nname = "{m.family}"\ndrive = "{m.family}"\non = "{m.url}"\n'
        f"station = {m.station}\n"
        for m in MAKERS
    ]
    return "\n".join(rows)


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    if reason := unavailable():
        pytest.skip(f"no private network here: {reason}")
    folder = Path(tmp_path_factory.mktemp("family"))
    bench = folder / "bench.toml"
    bench.write_text(_bench())
    running = Station(folder, bench, ["--sdo-ms", "0.2"], steady=True)
    running.start()
    yield running
    running.stop()


@dataclass
class Day:
    """A connected drive and the shortcuts of a working day."""

    station: Station
    maker: Maker
    id: str

    def post(self, path: str, body: dict[str, Any] | None = None) -> Any:
        return self.station.http.post(f"/drives/{self.id}/{path}", json=body or {})

    def read(self, key: str) -> int:
        row = self.station.ok(self.station.http.get(f"/drives/{self.id}/parameters/{key}"))
        return int(row["raw"])

    def write(self, key: str, raw: int) -> Any:
        path = f"/drives/{self.id}/parameters/{key}"
        return self.station.ok(self.station.http.put(path, json={"raw": raw}))

    def procedure(self, name: str, timeout_s: float = 40.0) -> None:
        self.station.done(self.post(f"procedures/{name}", {"confirmed": True}), timeout_s)

    def state(self) -> Any:
        return self.station.state(self.id)

    def job(self, path: str, body: dict[str, Any], timeout_s: float = 60.0) -> Any:
        """A motion; one that a machine without time for it ended is done again."""
        for _ in range(5):
            watch = Stopwatch()
            job = self.station.job(self.post(path, body), timeout_s)
            problem = job.get("problem")
            if problem is None:
                return job
            stalled = problem["status"] in (503, 504) or any(
                s in problem["detail"] for s in STALLED
            )
            until(self._reachable, HANG_S, "the drive answers again")
            lost = self.maker.bus_fault in [fault["code"] for fault in self.faults()]
            if not (stalled or lost) or not watch.busy():
                return job
            if lost:  # a drive that was enabled then keeps it until it is reset by hand
                self.station.ok(self.post("fault-reset"))
        raise AssertionError(job)

    def faults(self) -> Any:
        return self.station.ok(self.station.http.get(f"/drives/{self.id}/faults"))

    def moved(self, path: str, body: dict[str, Any]) -> Any:
        job = self.job(path, body)
        assert job["state"] == "done", job["problem"]
        return job["result"]

    def power_cycle(self) -> None:
        drives = self.station.drives
        if self.maker.slave is None:
            drives.command(do="power_cycle", axis=self.maker.family, off_s=0.2)
        else:
            drives.segments[ETHERCAT].command("power_cycle", slave=self.maker.slave, off_s=0.3)
        time.sleep(0.5)
        until(self._reachable, HANG_S, "the drive answers after its power cycle")

    def _reachable(self) -> bool:
        answer = self.station.http.get(f"/drives/{self.id}/parameters/6041:00")
        fresh = answer.is_success and "raw" in answer.json()
        return fresh and bool(self.state()["fresh"])

    def inject(self, what: str) -> None:
        drives = self.station.drives
        if self.maker.slave is None:
            drives.command(do="inject", axis=self.maker.family, what=what)
        else:
            drives.segments[ETHERCAT].command("inject", slave=self.maker.slave, what=what)


@pytest.fixture(params=MAKERS, ids=lambda maker: maker.family)
def day(station: Station, request: pytest.FixtureRequest) -> Iterator[Day]:
    maker: Maker = request.param
    job = station.job(station.http.post("/scan", json={"url": maker.url}), 60)
    if job["state"] != "done":  # a stalling machine: once more
        job = station.job(station.http.post("/scan", json={"url": maker.url}), 60)
    result = job["result"]
    found = next(f for f in result["found"] if f["station"] == maker.station)
    assert maker.family in [match["profile"] for match in found["matches"]]
    drive = station.add(maker.station, maker.url, profile=maker.family, name=maker.family)
    yield Day(station, maker, drive)
    station.http.post("/stop", json={})
    if maker.slave is not None:
        station.http.delete("/buses/cyclic", params={"url": maker.url})
    station.remove(drive)


@pytest.mark.long(keep=["ds_c"])
def test_a_working_day(day: Day) -> None:
    read_all(day)
    home(day)
    for mode in day.maker.modes:
        if mode in ("PP", "PV", "PT"):
            profile_move(day, mode)
    if day.maker.slave is not None:
        cyclic_moves(day)
    jog(day)
    save_and_power_cycle(day)
    fault(day)
    restore(day)


def read_all(day: Day) -> None:
    result = day.station.done(day.post("jobs/read_all"), 120)
    # Entries of 1C32h and 1C33h that the virtual controller has not.
    absent = ("1C32:", "1C33:")
    assert [why for why in result["failed"].values() if not any(a in why for a in absent)] == []
    assert day.state()["state"] == "Switch on disabled"


def home(day: Day) -> None:
    """A method that needs no switch; the position is zero afterwards."""
    body = {
        "method": day.maker.homing,
        "speed_switch": 60.0,
        "speed_zero": 30.0,
        "acceleration": 3000.0,
        "travel_limit": 3.0,
        "torque_limit": 200.0,
    }
    day.moved("jobs/home", body)
    assert abs(float(day.state()["position"])) < 0.02


def profile_move(day: Day, mode: str) -> None:
    limits = {"travel_limit": 30.0, "torque_limit": 200.0}
    ramps = {"acceleration": 3000.0, "deceleration": 3000.0}
    before = float(day.state()["position"])
    if mode == "PP":
        body = {"mode": mode, "target": 1.5, "relative": True, "speed": 300.0, **ramps, **limits}
        result = day.moved("jobs/move", body)
        # From its own start: a move that a stall ended may have run before it was repeated.
        assert result["end_rev"] - result["start_rev"] == pytest.approx(1.5, abs=0.02)
        assert float(day.state()["position"]) == pytest.approx(result["end_rev"], abs=0.02)
    elif mode == "PV":
        body = {"mode": mode, "target": 120.0, "timeout_s": 1.0, "consent": True, **ramps, **limits}
        job = day.job("jobs/move", body)
        assert job["state"] in ("done", "failed"), job
        assert float(day.state()["position"]) - before > 0.5
    else:
        body = {"mode": mode, "target": 8.0, "speed": 600.0, "timeout_s": 1.0, "consent": True,
                **limits}  # fmt: skip
        day.job("jobs/move", body)
        assert abs(float(day.state()["position"]) - before) > 0.05
    within(10, lambda: abs(float(day.state()["velocity"])) < 3, "at rest after the move")


def start_exchange(day: Day) -> None:
    """A computer that is kept busy by others may keep a drive from answering SOEM in time."""
    body = {"url": day.maker.url, "cycle_us": 2000}

    def begun() -> Any:
        answer = day.station.http.post("/buses/cyclic", json=body)
        assert answer.is_success or answer.status_code in (502, 503, 504), answer.text
        return answer.is_success and answer.json()

    assert until(begun, HANG_S, "the exchange runs")["cyclic"]["running"]


def cyclic_moves(day: Day) -> None:
    """One value per cycle in CSP, CSV and CST; the exchange is ended again."""
    url = day.maker.url
    start_exchange(day)
    for mode, amplitude in (("CSP", 0.25), ("CSV", 120.0), ("CST", 6.0)):
        body = {
            "mode": mode, "shape": "sine", "amplitude": amplitude, "duration_s": 1.0,
            "frequency_hz": 2.0, "travel_limit": 5, "speed_limit": 1500, "torque_limit": 250,
        }  # fmt: skip
        result = day.moved("jobs/generate", body)
        assert result["cycles"] == 500
    day.station.ok(day.station.http.delete("/buses/cyclic", params={"url": url}))


def jog(day: Day) -> None:
    """Hold to run, let go to stop. The EP3E has cyclic modes only and is jogged cyclically."""
    cyclic = "PP" not in day.maker.modes
    if cyclic:
        start_exchange(day)
    with day.station.live() as page:
        with jogged(day.station.http, page, day.id, third_of_a_turn, **JOG):
            page.send(type="jog_stop", drive=day.id)
        page.wait("jog_ended", drive=day.id)
    within(5, lambda: abs(float(day.state()["velocity"])) < 3, "at rest after the jog")
    if cyclic:
        day.station.ok(day.station.http.delete("/buses/cyclic", params={"url": day.maker.url}))


def third_of_a_turn(now: Any, start: float) -> bool:
    return float(now["position"]) - start > 0.3


def save_and_power_cycle(day: Day) -> None:
    """What is saved is there after the power was off."""
    key, raw = day.maker.gain
    day.write(key, raw)
    assert day.read(key) == raw
    day.procedure("save")
    day.power_cycle()
    assert day.read(key) == raw


def fault(day: Day) -> None:
    """Name, cause and remedy from the manual; then the reset."""
    day.inject(day.maker.fault)
    faults = until(day.faults, HANG_S, "a fault")
    named = {f.code: f for f in load_profile(day.maker.family).faults}
    shown = next(f for f in faults if f["code"] in named)
    expected = named[shown["code"]]
    assert shown["name"] == expected.name
    # A code that the drive reports in its log only has its source before its causes.
    source = [str(FAULT_BY_RECORD)] if day.maker.family == "r6l" else []
    assert shown["causes"] == [*source, *expected.causes]
    assert shown["remedies"] == list(expected.remedies)
    assert day.state()["state"] == "Fault"
    day.station.ok(day.post("fault-reset"))
    within(5, lambda: day.state()["state"] == "Switch on disabled", "the fault is gone")


def restore(day: Day) -> None:
    """The factory's values are back."""
    key, raw = day.maker.gain
    day.procedure("restore")
    until(lambda: day.read(key) != raw, HANG_S, "the start value")
    printed = load_profile(day.maker.family).by_key[key].default_raw
    if printed is not None:
        assert day.read(key) == printed
