"""Fault records, terminals and gears of the families whose manuals give them, on the real wire.

The drives are virtual, with the firmware rules of each family; what is expected comes from the
manuals, cited at each test.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from drivers.virtual.wires.netns import unavailable
from profiles.loader import load_profile
from tests.support.station import HANG_S, Station, until

URL = "ethercat://virtual0"
FAMILIES = ("m6l", "r6l", "ep3e")


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    if reason := unavailable():
        pytest.skip(f"no private network here: {reason}")
    folder = Path(tmp_path_factory.mktemp("functions"))
    bench = folder / "bench.toml"
    bench.write_text(
        "".join(
            f'[[axis]]\nname = "{name}"\ndrive = "{name}"\non = "{URL}"\nstation = {number}\n'
            for number, name in enumerate(FAMILIES, 1)
        )
    )
    running = Station(folder, bench, ["--lockstep"])
    running.start()
    for number, name in enumerate(FAMILIES, 1):
        running.add(number, URL, profile=name, name=name)
    yield running
    running.stop()


def cause(station: Station, family: str, code: str) -> None:
    """Raise a fault by its code, and reset it."""
    segment = station.drives.segments[URL]
    segment.command("inject", slave=FAMILIES.index(family), what=code)
    until(lambda: station.state(family)["state"] == "Fault", HANG_S, f"{code} is there")
    station.ok(station.http.post(f"/drives/{family}/fault-reset"))


def raw(station: Station, family: str, key: str) -> Any:
    return station.ok(station.http.get(f"/drives/{family}/parameters/{key}"))["raw"]


def put(station: Station, family: str, key: str, value: int) -> None:
    """By the route that the parameter's motion class has."""
    moves = load_profile(family).by_key[key].motion == "energises"
    door = "motion-settings" if moves else "parameters"
    station.ok(station.http.put(f"/drives/{family}/{door}/{key}", json={"raw": value}))


def terminals(station: Station, family: str) -> dict[str, Any]:
    answer = station.ok(station.http.get(f"/drives/{family}/io"))
    return {terminal["name"]: terminal for terminal in answer["terminals"]}


@pytest.mark.long
def test_m6l_shows_its_three_faults_with_their_snapshots(station: Station) -> None:
    """P10.18 to P10.59: newest first, thirteen values each (000:3497)."""
    cause(station, "m6l", "Er.004")
    cause(station, "m6l", "Er.002")
    info = station.ok(station.http.get("/drives/m6l/fault-history"))
    assert [entry["code"] for entry in info["entries"]] == ["Er.002", "Er.004"]
    newest = info["entries"][0]
    assert newest["name"] == "last fault"
    assert newest["title"] == "Drive main circuit overvoltage"
    assert newest["remedies"]
    assert len(newest["values"]) == 13
    volts = next(value for value in newest["values"] if value["key"] == "200A:16")
    assert volts["raw"] > 0
    # P02.22 = 1 clears it (000:3254).
    station.done(
        station.http.post("/drives/m6l/procedures/clear_history", json={"confirmed": True})
    )
    assert station.ok(station.http.get("/drives/m6l/fault-history"))["entries"] == []


@pytest.mark.long
def test_r6l_shows_its_record_and_leaves_the_selector_alone(station: Station) -> None:
    """P13.35 selects one of ten records (002:12361)."""
    put(station, "r6l", "200D:24", 3)
    cause(station, "r6l", "AL.247")
    # Looking does not write; reading the record does, and is asked for.
    info = station.ok(station.http.get("/drives/r6l/fault-history"))
    assert (info["kind"], info["entries"], info["read_at"]) == ("selected", [], None)
    info = station.ok(station.http.post("/drives/r6l/fault-history/read"))
    assert "AL.247" in [entry["code"] for entry in info["entries"]]
    assert raw(station, "r6l", "200D:24") == 3


def test_ep3e_says_that_nothing_is_known(station: Station) -> None:
    info = station.ok(station.http.get("/drives/ep3e/fault-history"))
    assert (info["kind"], info["entries"]) == ("unknown", [])


@pytest.mark.long
def test_r6l_forces_an_output_that_has_the_function_for_it(station: Station) -> None:
    """60FEh acts on outputs with function 31 (002:14003); DO1 is the brake by default."""
    path = "/drives/r6l/io/forcing/outputs"
    station.ok(station.http.post(path, json={"confirmed": True}))
    for values, words in (({"DO1": True}, "brake"), ({"DO2": True}, "universal output")):
        answer = station.http.put(path, json={"values": values})
        assert answer.status_code == 409
        assert words in answer.json()["detail"]
    before = raw(station, "r6l", "2002:23")
    put(station, "r6l", "2002:23", 31)
    station.ok(station.http.put(path, json={"values": {"DO2": True}}))
    assert raw(station, "r6l", "60FE:02") == 1 << 17
    assert raw(station, "r6l", "60FE:01") == 1 << 17
    station.ok(station.http.delete(path))
    assert raw(station, "r6l", "60FE:02") == 0
    put(station, "r6l", "2002:23", before)


@pytest.mark.long
def test_m6l_forces_outputs_only_while_process_data_run(station: Station) -> None:
    """60FEh acts in OP (000:3101)."""
    path = "/drives/m6l/io/forcing/outputs"
    answer = station.http.post(path, json={"confirmed": True})
    assert answer.status_code == 409
    assert "process data" in answer.json()["detail"]
    before = raw(station, "m6l", "2003:10")
    put(station, "m6l", "2003:10", 28)
    station.ok(station.http.post("/buses/cyclic", json={"url": URL, "cycle_us": 2000}))
    try:
        station.ok(station.http.post(path, json={"confirmed": True}))
        station.ok(station.http.put(path, json={"values": {"DO1": True}}))
        until(lambda: raw(station, "m6l", "200B:0E") & 1, HANG_S, "DO1 is on")
        station.ok(station.http.delete(path))
        assert raw(station, "m6l", "200B:0E") & 1 == 0
    finally:
        station.ok(station.http.delete("/buses/cyclic", params={"url": URL}))
    put(station, "m6l", "2003:10", before)


@pytest.mark.long
def test_m6l_switches_a_virtual_input_on(station: Station) -> None:
    """P03.14 switches DI1 to DI9 on next to their pins (000:3276)."""
    path = "/drives/m6l/io/forcing/simulation"
    station.ok(station.http.post(path, json={"confirmed": True}))
    assert terminals(station, "m6l")["DI9"]["on"] is False
    station.ok(station.http.put(path, json={"values": {"DI9": True}}))
    assert raw(station, "m6l", "2003:0F") == 1 << 8
    assert terminals(station, "m6l")["DI9"]["on"] is True
    station.ok(station.http.delete(path))
    assert raw(station, "m6l", "2003:0F") == 0
    assert terminals(station, "m6l")["DI9"]["on"] is False


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(
    ("family", "expected"),
    [
        # 000:1322: command units of one revolution, 6091h 1:1.
        ("m6l", {"2005:06": 5000, "6091:01": 1, "6091:02": 1}),
        # 002:2569: 131072 / 5000.
        ("r6l", {"6091:01": 16384, "6091:02": 625}),
        # 001:1040: feed of one revolution.
        ("ep3e", {"6091:01": 1, "6091:02": 1, "6092:01": 5000, "6092:02": 1}),
    ],
)
def test_a_gear_is_written_and_what_it_means_follows(
    station: Station, family: str, expected: dict[str, int]
) -> None:
    screw = {"kind": "screw", "lead_mm": 5.0}
    written = station.ok(station.http.post(f"/drives/{family}/gear/write", json=screw))
    assert {key: raw(station, family, key) for key in expected} == expected
    # One motor revolution is 5000 increments now, so the axis' numbers are read that way.
    assert set(written["before"]) <= set(expected)
    for key, value in reversed(written["before"].items()):
        put(station, family, key, value)
