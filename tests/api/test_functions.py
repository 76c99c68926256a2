"""Terminals, fault history, gear, watch list and braking through the interface."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from backend.axes.functions import forcing
from tests.support.station import Station, until


def terminals(station: Station, drive: str) -> dict[str, Any]:
    answer = station.ok(station.http.get(f"/drives/{drive}/io"))
    return {terminal["name"]: terminal for terminal in answer["terminals"]}


def raw(station: Station, drive: str, key: str) -> Any:
    return station.ok(station.http.get(f"/drives/{drive}/parameters/{key}"))["raw"]


def put(station: Station, drive: str, key: str, value: int) -> None:
    station.ok(station.http.put(f"/drives/{drive}/parameters/{key}", json={"raw": value}))


@pytest.fixture
def simulation(station: Station, x: str) -> Iterator[str]:
    path = f"/drives/{x}/io/forcing/simulation"
    station.ok(station.http.post(path, json={"confirmed": True}))
    yield path
    if station.http.get(f"/drives/{x}/io").json()["forcing"][1]["running"]:
        station.ok(station.http.delete(path))


@pytest.mark.long
def test_functions_are_described(station: Station, x: str) -> None:
    functions = station.ok(station.http.get(f"/drives/{x}/functions"))
    assert functions["history"]["kind"] == "unreadable"
    assert {group["name"] for group in functions["groups"]} >= {"stopping", "modulo", "impedance"}


def test_terminals_and_twins(station: Station, x: str) -> None:
    found = terminals(station, x)
    assert set(found) == {"DI1", "DI2", "DI3", "DI4", "DO1", "DO2"}
    assert found["DI1"]["on"] in (True, False)
    for key in ("2030:01", "2030:02"):
        put(station, x, key, 3)
    found = terminals(station, x)
    assert found["DI1"]["function_name"] == "home switch"
    assert found["DI1"]["same_function"] == ["DI2"]
    for key in ("2030:01", "2030:02"):
        put(station, x, key, 0)
    assert terminals(station, x)["DI1"]["same_function"] == []


def test_forcing_needs_agreement(station: Station, x: str) -> None:
    answer = station.http.post(f"/drives/{x}/io/forcing/outputs", json={})
    assert answer.status_code == 409
    assert "needs your agreement" in answer.json()["detail"]


def test_forced_output_is_on_and_put_back(station: Station, x: str) -> None:
    path = f"/drives/{x}/io/forcing/outputs"
    before = raw(station, x, "60FE:01"), raw(station, x, "60FE:02")
    station.ok(station.http.post(path, json={"confirmed": True}))
    info = station.ok(station.http.put(path, json={"values": {"DO1": True}}))
    assert info["values"] == {"DO1": True}
    assert raw(station, x, "60FE:02") >> 16 & 1
    station.ok(station.http.delete(path))
    assert (raw(station, x, "60FE:01"), raw(station, x, "60FE:02")) == before
    assert station.http.put(path, json={"values": {}}).status_code == 404


def test_a_page_that_falls_silent_lets_go(
    station: Station, x: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(forcing, "SILENT_S", 0.5)
    path = f"/drives/{x}/io/forcing/outputs"
    station.ok(station.http.post(path, json={"confirmed": True}))
    station.ok(station.http.put(path, json={"values": {"DO1": True}}))
    until(lambda: raw(station, x, "60FE:02") == 0, 15, "the output is let go")
    log = station.ok(station.http.get(f"/drives/{x}/log"))
    assert any("Force outputs" in entry["text"] for entry in log)


def test_simulated_limit_switch_is_written_and_put_back(
    station: Station, x: str, simulation: str
) -> None:
    put(station, x, "2030:01", 2)
    settings = station.http.post(f"/drives/{x}/procedures/write_settings", json={})
    station.done(settings)
    station.ok(station.http.put(simulation, json={"values": {"DI1": True}}))
    assert raw(station, x, "2031:02") & 1
    station.ok(station.http.delete(simulation))
    assert raw(station, x, "2031:02") == 0
    put(station, x, "2030:01", 0)
    station.done(station.http.post(f"/drives/{x}/procedures/write_settings", json={}))


def test_touch_probe_is_set_up(station: Station, x: str) -> None:
    body = {"on": True, "continuous": True, "rising": True}
    value = station.ok(station.http.put(f"/drives/{x}/io/probes/1", json=body))
    # 004:4670: 0013h.
    assert value["raw"] == 0x13
    value = station.ok(station.http.put(f"/drives/{x}/io/probes/1", json={"on": False}))
    assert value["raw"] & 1 == 0
    assert station.http.put(f"/drives/{x}/io/probes/3", json=body).status_code == 409


def test_history_that_cannot_be_read_says_so(station: Station, x: str) -> None:
    info = station.ok(station.http.get(f"/drives/{x}/fault-history"))
    assert (info["kind"], info["size"], info["clear"]) == ("unreadable", 20, "clear_history")
    assert info["entries"] == []
    answer = station.http.post(f"/drives/{x}/fault-history/read")
    assert answer.status_code == 409


SCREW = {"kind": "screw", "lead_mm": 10.0, "resolution": 0.001}


def test_gear_is_planned_written_and_taken_back(station: Station, x: str) -> None:
    keys = ("6091:01", "6091:02", "6092:01", "6092:02")
    before = {key: raw(station, x, key) for key in keys}
    plan = station.ok(station.http.post(f"/drives/{x}/gear/plan", json=SCREW))
    assert {value["key"]: value["raw"] for value in plan["values"]} == {
        "6091:01": 1,
        "6091:02": 1,
        "6092:01": 10000,
        "6092:02": 1,
    }
    assert "607D:01" in plan["counted"]
    # 3000 rpm (6080h, 004) times 10 mm.
    assert plan["max_speed"] == pytest.approx(plan["max_speed_rpm"] / 60 * 10)
    assert {key: raw(station, x, key) for key in keys} == before
    written = station.ok(station.http.post(f"/drives/{x}/gear/write", json=SCREW))
    assert written["before"] == {key: before[key] for key in ("6092:01",)}
    assert raw(station, x, "6092:01") == 10000
    record = station.ok(station.http.get(f"/drives/{x}/record"))
    assert (record["travel_unit"], record["travel_per_motor_turn"]) == ("mm", 10)
    for key, value in written["before"].items():
        put(station, x, key, value)
    station.ok(station.http.put(f"/drives/{x}/mechanics", json={"mechanics": None}))


def test_gear_is_not_changed_under_power(station: Station, x: str) -> None:
    body = {"goal": "Operation enabled"}
    station.ok(station.http.post(f"/drives/{x}/transition", json=body))
    answer = station.http.post(f"/drives/{x}/gear/write", json=SCREW)
    assert answer.status_code == 409
    assert "enabled" in answer.json()["detail"]
    station.ok(station.http.post(f"/drives/{x}/transition", json={"goal": "Switch on disabled"}))


def test_bad_mechanics_are_problems(station: Station, x: str) -> None:
    for body in (
        {"kind": "screw"},
        {"kind": "screw", "lead_mm": -1},
        {"kind": "screw", "lead_mm": 1e9},
        {"kind": "lever"},
        {**SCREW, "motor_turns": 0},
    ):
        assert station.http.post(f"/drives/{x}/gear/plan", json=body).status_code == 422, body


def test_watch_list_is_kept_over_a_restart(station: Station, x: str) -> None:
    keys = ["6064:00", "6077:00", "6064:00"]
    record = station.ok(station.http.put(f"/drives/{x}/watch", json={"keys": keys}))
    assert record["watch"] == ["6064:00", "6077:00"]
    assert (station.folder / "state" / "axes" / f"{x}.json").is_file()
    assert station.http.put(f"/drives/{x}/watch", json={"keys": ["5555:00"]}).status_code == 404
    assert station.ok(station.http.get(f"/drives/{x}/record"))["watch"] == record["watch"]
    station.ok(station.http.put(f"/drives/{x}/watch", json={"keys": []}))


def test_braking_is_calculated(station: Station) -> None:
    body = {
        "inertia_kgm2": 5e-4, "speed_rpm": 3000, "deceleration_s": 0.1, "cycle_s": 1,
        "capacitor_j": 0.3, "built_in_ohm": 250, "built_in_w": 4, "min_external_ohm": 100,
        "max_external_w": 10,
    }  # fmt: skip
    answer = station.ok(station.http.post("/calculate/braking", json=body))
    assert answer["verdict"] == "beyond"
    assert answer["average_w"] == pytest.approx(2 * (24.674 - 0.3), abs=0.01)
    assert station.http.post("/calculate/braking", json={**body, "cycle_s": 0}).status_code == 422


@pytest.mark.long
def test_the_drive_identifies_by_itself(station: Station, x: str) -> None:
    body = {"travel_limit": 100, "timeout_s": 60}
    refused = station.job(station.http.post(f"/drives/{x}/jobs/identify", json=body))
    assert "agreement" in refused["problem"]["detail"]
    result = station.done(
        station.http.post(f"/drives/{x}/jobs/identify", json={**body, "confirmed": True}), 60
    )
    # Motor and load of the bench are 1500 g·cm² behind a soft coupling: a coarse method.
    found = raw(station, x, "200C:0A")
    assert found == pytest.approx(1500, rel=0.25)
    assert raw(station, x, "2001:06") == found
    assert raw(station, x, "200C:05") == 12
    assert result["changed"]
    assert station.state(x)["state"] == "Switch on disabled"


@pytest.mark.long
def test_an_identification_that_goes_too_far_is_ended(station: Station, x: str) -> None:
    body = {"travel_limit": 0.2, "timeout_s": 60, "confirmed": True}
    job = station.job(station.http.post(f"/drives/{x}/jobs/identify", json=body))
    assert job["state"] == "failed"
    assert "0.2 rev" in job["problem"]["limit"]
    assert station.state(x)["state"] == "Switch on disabled"
