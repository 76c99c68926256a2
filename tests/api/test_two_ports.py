"""DS_C on CANopen and Modbus: one drive, and each parameter goes by the port that carries it."""

from __future__ import annotations

import csv
import io
import itertools
import json
import re
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import pytest

from backend.station.recording import capture
from profiles import load_profile
from tests.support.jogging import jogged
from tests.support.machine import within
from tests.support.station import HANG_S, Station, until

CAN, MODBUS = "canopen://virtual0", "modbus://virtual0"
AXIS, POSITION = "Low-voltage axis", "6064:00"
#: One that only Modbus reaches, and one that CANopen carries.
KEYS = ("PA_38", "6083:00")


@pytest.fixture
def z(station: Station) -> Iterator[str]:
    drive = station.add(3, CAN, "ds_c", "Z")
    yield drive
    station.remove(drive)


@pytest.mark.long
def test_scan_finds_it_on_the_can_bus(station: Station) -> None:
    result = station.done(station.http.post("/scan", json={"url": CAN, "stations": [2, 3, 4]}))
    assert [drive["station"] for drive in result["found"]] == [3]


def test_one_port_says_what_is_missing_and_why(station: Station, z: str) -> None:
    rows = {row["key"]: row for row in station.ok(station.http.get(f"/drives/{z}/parameters"))}
    assert rows["6064:00"]["reachable"]
    assert not rows["PA_38"]["reachable"]
    assert "only over Modbus" in rows["PA_38"]["unreachable_why"]
    answer = station.http.put(f"/drives/{z}/parameters/PA_38", json={"raw": 100})
    assert answer.status_code == 409


def test_two_ports_carry_everything(station: Station, z: str) -> None:
    drive = station.ok(station.http.post(f"/drives/{z}/ports", json={"url": MODBUS, "station": 1}))
    assert [port["kind"] for port in drive["ports"]] == ["canopen", "modbus"]
    answer = station.ok(station.http.put(f"/drives/{z}/parameters/PA_38", json={"raw": 123}))
    assert answer["raw"] == 123
    station.ok(station.http.put(f"/drives/{z}/parameters/6083:00", json={"raw": 250}))
    result = station.done(station.http.post(f"/drives/{z}/jobs/read_all", json={}), 60)
    assert result["failed"] == {}
    again = station.http.post("/drives", json={"url": MODBUS, "station": 1, "profile": "ds_c"})
    assert again.status_code == 409
    assert "already connected as Z" in again.json()["detail"]
    reported = station.ok(station.http.get("/audit?kind=station"))["events"]
    assert [(e["action"], e["axis"], e["target"]) for e in reported[:2]] == [
        ("connected", "Z", f"ds_c, {MODBUS}, station 1"),
        ("connected", "Z", f"ds_c, {CAN}, station 3"),
    ]


def test_a_set_file_goes_back_by_the_port_that_carries_each_value(station: Station, z: str) -> None:
    station.ok(station.http.post(f"/drives/{z}/ports", json={"url": MODBUS, "station": 1}))

    def raws() -> dict[str, int]:
        at = f"/drives/{z}/parameters"
        return {key: station.ok(station.http.get(f"{at}/{key}"))["raw"] for key in KEYS}

    before = raws()
    saved = station.ok(station.http.post(f"/drives/{z}/sets", json={"file": "both ports"}))
    for key in KEYS:
        station.ok(station.http.put(f"/drives/{z}/parameters/{key}", json={"raw": 321}))
    diff = station.ok(station.http.get(f"/drives/{z}/diff", params={"file": saved["file"]}))
    assert {row["key"] for row in diff["rows"] if row["selected"]} == set(KEYS)
    body = {"file": saved["file"], "keys": list(KEYS)}
    report = station.done(station.http.post(f"/drives/{z}/jobs/load_set", json=body), 30)
    assert (report["written"], report["failed"]) == (2, 0)
    assert raws() == before


def test_units_are_rpm_and_times(station: Station, z: str) -> None:
    state = station.state(z)
    assert state["units"]["velocity"] == "rpm"
    assert state["state"] == "Switch on disabled"


@pytest.mark.long
def test_jog_and_move(station: Station, z: str) -> None:
    with station.live() as page:
        limits = {"speed": 200, "acceleration": 4000, "travel_limit": 10, "torque_limit": 100}
        with jogged(station.http, page, z, lambda now, _: 180 < now["velocity"] < 220, **limits):
            page.send(type="jog_stop", drive=z)
        ended = page.wait("jog_ended", drive=z)
        assert ended["problem"] is None, ended
    within(3, lambda: abs(station.state(z)["velocity"]) < 5, "it stands")
    before = float(station.state(z)["position"])
    body = {"mode": "PP", "target": 1.5, "relative": True, "speed": 600, "acceleration": 6000,
            "deceleration": 6000, "travel_limit": 3, "torque_limit": 100}  # fmt: skip
    station.done(station.http.post(f"/drives/{z}/jobs/move", json=body))
    assert float(station.state(z)["position"]) - before == pytest.approx(1.5, abs=0.02)


def test_a_frequency_response_needs_consent_and_leaves_the_bus_as_it_was(
    station: Station, z: str
) -> None:
    limits = {"travel_limit": 3.0, "speed_limit": 600.0, "torque_limit": 50.0, "cycle_ms": 4.0}

    def buses() -> dict[str, Any]:
        return {b["url"]: b["cyclic"] for b in station.ok(station.http.get("/buses"))}

    before = buses()[CAN]
    answer = station.http.post(f"/drives/{z}/jobs/sweep", json=limits)
    assert answer.status_code == 409
    assert "no watchdog" in answer.json()["detail"]
    assert buses()[CAN] == before
    assert station.state(z)["state"] != "Operation enabled"


def test_the_scope_knows_which_bit_is_the_alarm(station: Station, z: str) -> None:
    """003:305: bit 7, not bit 3 as CiA 402-2 has it."""
    x = station.add(1, name="X")
    try:
        with station.live() as page:
            for drive, key, bit in ((z, "6041:00", 7), (x, "6041:00", 3), (z, POSITION, None)):
                channels = [{"drive": drive, "key": key}]
                page.send(type="scope_start", subscription=1, channels=channels)
                (channel,) = page.wait("scope_info")["channels"]
                assert channel["fault_bit"] == bit
    finally:
        station.ok(station.http.delete(f"/drives/{x}"))


def test_unplugged_adapter_recovers(station: Station, z: str) -> None:
    station.drives.command(do="pull", wire=CAN)
    within(5, lambda: not station.state(z)["fresh"], "its silence is reported")
    station.drives.command(do="heal", wire=CAN)
    until(lambda: station.state(z)["fresh"], HANG_S, "the drive answers again")


def test_the_missing_port_is_named_with_what_only_it_reaches(station: Station, z: str) -> None:
    missing = station.ok(station.http.get(f"/drives/{z}/missing-ports"))
    assert [port["kind"] for port in missing] == ["modbus"]
    rows = station.ok(station.http.get(f"/drives/{z}/parameters"))
    assert missing[0]["parameters"] == sum(not row["reachable"] for row in rows) > 0
    assert "RS232" in missing[0]["wiring"]
    station.ok(station.http.post(f"/drives/{z}/ports", json={"url": MODBUS, "station": 1}))
    assert station.ok(station.http.get(f"/drives/{z}/missing-ports")) == []


def test_a_second_port_where_nobody_answers_is_refused(station: Station, z: str) -> None:
    answer = station.http.post(f"/drives/{z}/ports", json={"url": MODBUS, "station": 9})
    assert answer.status_code == 504
    assert "nothing can be read at station 9" in answer.json()["detail"]
    assert len(station.ok(station.http.get(f"/drives/{z}"))["ports"]) == 1


def test_a_restarted_node_is_reported_and_read_anew(station: Station, z: str) -> None:
    key = "6083:00"
    station.ok(station.http.put(f"/drives/{z}/parameters/{key}", json={"raw": 777}))
    station.drives.command(do="power_cycle", axis="Low-voltage axis", off_s=0.3)

    def reported() -> bool:
        texts = [entry["text"] for entry in station.ok(station.http.get("/log"))]
        return any("restarted" in text for text in texts)

    until(reported, HANG_S, "the log tells of the restart")

    # What was not saved is gone, and the page must not show it any more.
    def row() -> Any:
        rows = station.ok(station.http.get(f"/drives/{z}/parameters"))
        return next(r["reading"] for r in rows if r["key"] == key)

    until(lambda: row()["raw"] not in (None, 777), HANG_S, "the value that the drive has now")
    until(lambda: station.state(z)["fresh"], HANG_S)
    assert not station.ok(station.http.get(f"/drives/{z}"))["unsaved"]


@pytest.mark.long
def test_a_mute_node_is_named_with_a_remedy(station: Station, z: str) -> None:
    station.drives.command(do="mute", wire=CAN, on=True)
    try:
        answer = station.http.put(f"/drives/{z}/parameters/6083:00", json={"raw": 321})
        assert answer.status_code == 504, answer.text
        problem = answer.json()
        # The second is said where the monitor's question was the first that stayed without answer.
        assert re.search("did not answer|has not answered", problem["detail"]), problem
        assert problem["drive"] == "Z"
        assert problem["parameter"] == "6083:00"
        assert problem["remedy"]
    finally:
        station.drives.command(do="mute", wire=CAN, on=False)
    until(lambda: station.state(z)["fresh"], HANG_S)


# --- what a fault leaves ----------------------------------------------------------------


@dataclass(frozen=True)
class Bundle:
    """What is in a support bundle."""

    files: set[str]
    page: str
    facts: dict[str, Any]
    tables: dict[str, list[dict[str, str]]]


def opened(data: bytes) -> Bundle:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        assert archive.testzip() is None
        texts = {
            n: archive.read(n).decode()
            for n in archive.namelist()
            if not n.endswith((".sdrec", ".pcapng"))
        }
        return Bundle(
            set(archive.namelist()),
            texts["index.html"],
            json.loads(texts["facts.json"]),
            {
                name: list(csv.DictReader(io.StringIO(text)))
                for name, text in texts.items()
                if name.endswith(".csv")
            },
        )


@pytest.fixture
def bundle_of(
    station: Station, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Callable[[str], Bundle]]:
    """Breaks the axis, and brings the bundle that the fault made by itself."""
    monkeypatch.setattr(capture, "AFTER_S", 0.3)

    def broken(drive: str) -> Bundle:
        old = {row["name"] for row in station.ok(station.http.get("/bundles"))["bundles"]}
        station.drives.command(do="inject", axis=AXIS, what="overload")

        def fresh() -> str | None:
            rows = station.ok(station.http.get("/bundles"))["bundles"]
            return next((row["name"] for row in rows if row["name"] not in old), None)

        name = until(fresh, HANG_S, "the bundle of the fault")
        station.ok(station.http.post(f"/drives/{drive}/fault-reset", json={}))
        return opened(station.http.get(f"/bundles/{name}").raise_for_status().content)

    yield broken
    for row in station.ok(station.http.get("/bundles"))["bundles"]:
        station.http.delete(f"/bundles/{row['name']}")


def reported_of(bundle: Bundle, drive: str) -> None:
    """The fault with its remedy from the manual, the axis' settings, and where it was read."""
    (axis,) = bundle.facts["axes"]
    (shown,) = axis["state"]["faults"]
    known = next(f for f in load_profile("ds_c").faults if f.code == shown["code"])
    assert known.causes[0] in bundle.page
    assert known.remedies[0] in bundle.page
    settings = bundle.tables[f"parameters/{drive}.csv"]
    assert [row["key"] for row in settings if row["error"]] == []
    assert next(row for row in settings if row["key"] == "6083:00")["raw"]
    (link,) = bundle.facts["links"]
    assert (link["drive"], link["url"]) == (drive, axis["ports"][0]["url"])
    assert link["transactions"] > 0


@pytest.mark.long
@pytest.mark.parametrize(("url", "number", "only_here"), [(CAN, 3, False), (MODBUS, 1, True)])
def test_a_fault_keeps_what_was_read(
    station: Station, bundle_of: Callable[[str], Bundle], url: str, number: int, only_here: bool
) -> None:
    drive = station.add(number, url, "ds_c", f"Broken {url[:3]}")
    try:
        until(lambda: station.state(drive)["fresh"], HANG_S)
        bundle = bundle_of(drive)
    finally:
        station.ok(station.http.delete(f"/drives/{drive}"))
    reported_of(bundle, drive)
    assert "samples.csv" not in bundle.files, "no cyclic exchange ran"
    times = [row["time"] for row in bundle.tables["history.csv"] if row["key"] == POSITION]
    assert len(times) > 2
    assert times == sorted(times)
    keys = {row["key"] for row in bundle.tables[f"parameters/{drive}.csv"]}
    assert ("PA_38" in keys) is only_here, "what only the other port reaches is left out"


@pytest.mark.long
def test_a_fault_keeps_every_cycle_of_a_can_bus(
    station: Station, z: str, bundle_of: Callable[[str], Bundle]
) -> None:
    body = {"url": CAN, "cycle_us": 4000}
    bus = station.ok(station.http.post("/buses/cyclic", json=body))
    assert bus["cyclic"]["running"]
    try:
        until(lambda: station.state(z)["fresh"], HANG_S)
        bundle = bundle_of(z)
    finally:
        station.http.delete("/buses/cyclic", params={"url": CAN})
    reported_of(bundle, z)
    seconds = [float(next(iter(row.values()))) for row in bundle.tables["samples.csv"]]
    steps = sorted(b - a for a, b in itertools.pairwise(seconds))
    assert steps[len(steps) // 2] == pytest.approx(0.004, rel=0.05)
    assert "<polyline" in bundle.page
