"""Recordings and support bundles through the interface, from virtual drives on real wires."""

from __future__ import annotations

import csv
import io
import json
import os
import resource
import signal
import time
import zipfile
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from backend.station.recording import capture
from tests.support.station import HANG_S, Station, until

POSITION, VELOCITY, STATUS = "6064:00", "606C:00", "6041:00"
#: 100 rpm in the unit of 606Ch, at 65536 increments to the revolution (004: default).
RPM_100 = 65536 * 100 / 60


@pytest.fixture(autouse=True)
def nothing_left(station: Station) -> Iterator[None]:
    yield
    for row in listed(station):
        if row["state"] in ("waiting", "recording"):
            station.http.post(f"/recordings/{row['name']}/stop")
    for row in listed(station):
        station.ok(station.http.delete(f"/recordings/{row['name']}"))


def listed(station: Station, **query: str) -> list[dict[str, Any]]:
    answer = station.ok(station.http.get("/recordings", params=query))
    rows: list[dict[str, Any]] = answer["recordings"]
    return rows


def start(station: Station, drive: str, **more: object) -> dict[str, Any]:
    body: dict[str, object] = {
        "channels": [{"drive": drive, "key": POSITION}, {"drive": drive, "key": VELOCITY}]
    }
    row: dict[str, Any] = station.ok(station.http.post("/recordings", json=body | more))
    return row


def samples(station: Station, name: str) -> int:
    return int(next(r["samples"] for r in listed(station) if r["name"] == name))


def exported_csv(station: Station, name: str, kind: str = "csv") -> tuple[list[str], np.ndarray]:
    station.done(station.http.post(f"/recordings/{name}/exports/{kind}"))
    text = station.http.get(f"/recordings/{name}/exports/{kind}").raise_for_status().text
    titles, *rows = list(csv.reader(io.StringIO(text)))
    return titles, np.array([[float(cell or "nan") for cell in row] for row in rows])


@pytest.mark.long
def test_record_list_export_delete(station: Station, x: str) -> None:
    row = start(station, x, name="Axis test", notes="warm machine", tags=["before"])
    assert row["state"] == "recording"
    name = row["name"]
    assert name == "Axis test.sdrec"
    until(lambda: samples(station, name) > 50, HANG_S, "samples arrive")
    assert station.http.get(f"/recordings/{name}/file").status_code == 409, "still growing"
    assert station.http.delete(f"/recordings/{name}").status_code == 409
    ended = station.ok(station.http.post(f"/recordings/{name}/stop"))
    assert (ended["state"], ended["lost"], ended["notes"]) == ("complete", 0, "warm machine")
    assert [c["unit"] for c in ended["channels"]] == ["inc", "inc/s"]

    detail = station.ok(station.http.get(f"/recordings/{name}"))
    settings = {row["key"]: row for row in detail["parameters"][x]}
    shown = station.ok(station.http.get(f"/drives/{x}/parameters/6083:00"))
    assert settings["6083:00"]["raw"] == shown["raw"]
    assert len(settings) > 50, "the settings at the start are in the file"

    assert station.http.get(f"/recordings/{name}/exports/csv").status_code == 404
    titles, table = exported_csv(station, name)
    assert [t.rsplit("[")[-1] for t in titles[1:]] == ["rev]", "rpm]"], "as the scope shows them"
    titles, raw = exported_csv(station, name, "csv_raw")
    assert [t.rsplit("[")[-1] for t in titles[1:]] == ["inc]", "inc/s]"]
    factors = [c["shown_factor"] for c in ended["channels"]]
    assert np.allclose(table[:, 1:], raw[:, 1:] * factors, rtol=1e-14, equal_nan=True)
    assert factors[1] == pytest.approx(factors[0] * 60), "rpm of inc/s, as rev of inc"
    assert len(table) == ended["samples"], "every sample, once"
    assert np.all(np.diff(table[:, 0]) > 0)
    assert table[-1, 0] == pytest.approx(ended["duration_s"], abs=1e-6)

    for words, count in (("WARM axis", 1), ("before x", 1), ("position", 1), ("nothing", 0)):
        assert len(listed(station, search=words)) == count, words
    changed = station.ok(
        station.http.patch(f"/recordings/{name}", json={"notes": "cold", "kept": True})
    )
    assert (changed["notes"], changed["tags"], changed["kept"]) == ("cold", ["before"], True)
    late = station.http.patch(
        f"/recordings/{name}", json={"notes": "warm", "base_notes": "WARM axis"}
    )
    assert (late.status_code, late.json()["value"]) == (409, "cold")
    assert station.ok(station.http.get(f"/recordings/{name}"))["info"]["exports"] == [
        "csv",
        "csv_raw",
    ]
    assert station.http.delete(f"/recordings/{name}").status_code == 204
    assert station.http.get(f"/recordings/{name}").status_code == 404
    assert station.http.get(f"/recordings/{name}/exports/csv").status_code == 404


def test_moved_axis_is_recorded_with_what_was_changed(station: Station, x: str) -> None:
    name = start(station, x)["name"]
    change = {"value": 2500, "raw": None}
    answer = station.http.put(f"/drives/{x}/parameters/6083:00", json={"value": change["value"]})
    assert answer.is_success, answer.text
    until(lambda: samples(station, name) > 20)
    station.ok(station.http.post(f"/recordings/{name}/stop"))
    events = station.ok(station.http.get(f"/recordings/{name}"))["events"]
    assert any(e["kind"] == "parameter" and "2500" in e["text"] for e in events), events


@pytest.mark.long
def test_trigger_keeps_what_was_before_it(station: Station, x: str) -> None:
    trigger = {"kind": "rising", "drive": x, "key": VELOCITY, "level": RPM_100}
    row = start(station, x, name="step", trigger=trigger, pre_s=0.5, duration_s=0.5)
    assert row["state"] == "waiting"
    time.sleep(0.8)  # what the pre-trigger is to contain must pass
    assert samples(station, row["name"]) == 0
    body = {"mode": "PV", "target": 200, "acceleration": 3000, "deceleration": 3000,
            "travel_limit": 30, "torque_limit": 150, "timeout_s": 3, "consent": True}  # fmt: skip
    station.ok(station.http.post(f"/drives/{x}/jobs/move", json=body))
    until(
        lambda: listed(station, search="step")[0]["state"] == "complete", HANG_S, "it ends itself"
    )
    station.ok(station.http.post("/stop", json={}))
    _, table = exported_csv(station, row["name"], "csv_raw")
    crossing = table[np.argmax(table[:, 2] >= RPM_100), 0]
    assert 0.45 < crossing < 0.75, "half a second before the trigger is there"
    assert table[-1, 0] - crossing == pytest.approx(0.5, abs=0.25)
    assert abs(table[0, 2]) < 0.05 * RPM_100, "it stood before"


@pytest.mark.long
def test_full_disk_ends_it_and_the_axis_goes_on(station: Station, x: str) -> None:
    body = {"mode": "PV", "target": 200, "acceleration": 3000, "deceleration": 3000,
            "travel_limit": 100, "torque_limit": 150, "timeout_s": 20, "consent": True}  # fmt: skip
    job = station.ok(station.http.post(f"/drives/{x}/jobs/move", json=body))
    name = start(station, x, name="full")["name"]
    until(lambda: samples(station, name) > 20)
    file = station.folder / "state" / "recordings" / name
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    # The kernel refuses to write beyond this, as it does on a full disk.
    resource.setrlimit(resource.RLIMIT_FSIZE, (file.stat().st_size + 3000, before[1]))
    try:
        until(lambda: listed(station)[0]["state"] in ("interrupted", "failed"), HANG_S, "it ends")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)
    log = station.ok(station.http.get("/log"))
    assert any(
        e["level"] == "error" and "full.sdrec could not be written" in e["text"] for e in log
    ), log[:5]
    assert station.ok(station.http.get(f"/jobs/{job['id']}"))["state"] == "running"
    turning = [float(station.state(x)["velocity"]) for _ in range(5)]
    assert turning == pytest.approx([200] * 5, rel=0.1)
    assert samples(station, name) > 20, "what was written is there"
    station.ok(station.http.delete(f"/jobs/{job['id']}"))


def test_a_trigger_that_never_came_keeps_nothing(station: Station, x: str) -> None:
    trigger = {"kind": "fault", "drive": x}
    name = start(station, x, trigger=trigger)["name"]
    answer = station.http.post(f"/recordings/{name}/stop")
    assert answer.status_code == 200
    assert answer.json() is None
    assert listed(station) == []


def test_by_hand_begins_a_waiting_one(station: Station, x: str) -> None:
    name = start(station, x, trigger={"kind": "fault", "drive": x}, pre_s=1)["name"]
    station.ok(station.http.post(f"/recordings/{name}/trigger"))
    assert station.http.post(f"/recordings/{name}/trigger").status_code == 409
    until(lambda: samples(station, name) > 5)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"channels": [{"drive": "nobody", "key": POSITION}]}, "nobody"),
        ({"channels": [{"drive": "x", "key": "9999:00"}]}, "9999:00"),
        ({"pre_s": 1.0}, "trigger"),
        ({"trigger": {"kind": "rising", "drive": "x", "key": STATUS}}, "not recorded"),
        ({"name": "../../etc/passwd"}, "not a file name"),
        ({"name": ".hidden"}, "not a file name"),
    ],
)
def test_refused(station: Station, x: str, change: dict[str, Any], words: str) -> None:
    assert x == "x"
    body = {"channels": [{"drive": x, "key": POSITION}]} | change
    answer = station.http.post("/recordings", json=body)
    assert answer.status_code in (404, 409, 422), answer.text
    assert words in answer.json()["detail"]
    assert listed(station) == []


@pytest.mark.parametrize("name", ["..%2Fbench.json", "%2e%2e%2fbench", "a%00b", "none"])
@pytest.mark.parametrize("place", ["recordings", "bundles"])
def test_only_recordings_are_reached(station: Station, name: str, place: str) -> None:
    for tail in ("", "/file", "/exports/csv"):
        answer = station.http.get(f"/{place}/{name}{tail}")
        assert answer.status_code in (404, 409), answer.text
        assert b"drives" not in answer.content


def test_retention_deletes_the_oldest_but_not_the_kept(station: Station, x: str) -> None:
    before = station.ok(station.http.get("/recordings"))["retention"]
    names = []
    for number in range(3):
        name = start(station, x, name=f"run {number}")["name"]
        until(lambda name=name: samples(station, name) > 2)
        station.ok(station.http.post(f"/recordings/{name}/stop"))
        names.append(name)
    station.ok(station.http.patch(f"/recordings/{names[0]}", json={"kept": True}))
    folder = station.folder / "state" / "recordings"
    grown = folder / names[1]
    times = grown.stat()
    os.truncate(grown, 2_000_000)
    os.utime(grown, ns=(times.st_atime_ns, times.st_mtime_ns))
    try:
        bounds = {"max_total_bytes": 1_000_000, "keep_days": None}
        station.ok(station.http.put("/recordings/retention", json=bounds))
        fresh = start(station, x, name="fresh")["name"]
        assert {row["name"] for row in listed(station)} == {names[0], names[2], fresh}
    finally:
        station.ok(station.http.put("/recordings/retention", json=before))


@pytest.mark.long
def test_fault_freezes_the_last_seconds(station: Station, x: str) -> None:
    name = start(station, x, trigger={"kind": "fault", "drive": x}, pre_s=2)["name"]
    until(lambda: station.state(x)["fresh"])
    station.drives.command(do="inject", axis="Feed screw", what="over_temperature")
    try:
        until(lambda: listed(station)[0]["state"] == "recording", HANG_S, "the recording began")
        rows = until(
            lambda: station.ok(station.http.get("/bundles"))["bundles"], HANG_S, "the bundle"
        )
    finally:
        station.drives.command(do="inject", axis="Feed screw", what="over_temperature", value=0)
        station.ok(station.http.post(f"/drives/{x}/fault-reset", json={}))
    station.ok(station.http.post(f"/recordings/{name}/stop"))
    data = station.http.get(f"/bundles/{rows[0]['name']}").raise_for_status().content
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        assert archive.testzip() is None
        files = set(archive.namelist())
        page = archive.read("index.html").decode()
        facts = json.loads(archive.read("facts.json"))
        history = list(csv.DictReader(io.StringIO(archive.read("history.csv").decode())))
        settings = list(csv.DictReader(io.StringIO(archive.read(f"parameters/{x}.csv").decode())))
        log = archive.read("log.txt").decode()
    assert {"index.html", "facts.json", "history.csv", "log.txt", f"parameters/{x}.csv"} <= files
    assert facts["axes"][0]["state"]["faults"], "the fault itself"
    assert facts["links"][0]["transactions"] > 0
    assert any(row["key"] == POSITION for row in history), "what was read before"
    assert sum(1 for row in settings if row["raw"]) > 50
    assert "connected X" in log
    assert facts["axes"][0]["state"]["faults"][0]["code"] in page
    assert "the drive has no record that can be read" in page, "004:1648 prints no object"


def test_bundle_by_hand(station: Station, x: str) -> None:
    made = station.ok(station.http.post("/bundles", json={"reason": "<b>odd noise</b>"}))
    data = station.http.get(f"/bundles/{made['name']}").raise_for_status().content
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        page = archive.read("index.html").decode()
    assert "<h1>&lt;b&gt;odd noise&lt;/b&gt;</h1>" in page
    assert station.http.delete(f"/bundles/{made['name']}").status_code == 204
    assert station.http.get(f"/bundles/{made['name']}").status_code == 404


@pytest.mark.long
def test_bundle_of_a_mute_drive(station: Station, x: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is not waited for without end; what was known before goes in, with its time."""
    monkeypatch.setattr(capture, "READ_TIMEOUT_S", 0.5)
    read = "6083:00"
    known = station.ok(station.http.get(f"/drives/{x}/parameters/{read}"))
    station.drives.command(do="mute", wire="mlink://virtual0", on=True)
    try:
        until(lambda: not station.state(x)["fresh"], HANG_S, "its silence is noticed")
        made = station.ok(station.http.post("/bundles", json={"reason": "mute"}))
    finally:
        station.drives.command(do="mute", wire="mlink://virtual0", on=False)
    data = station.http.get(f"/bundles/{made['name']}").raise_for_status().content
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        facts = json.loads(archive.read("facts.json"))
        rows = list(csv.DictReader(io.StringIO(archive.read(f"parameters/{x}.csv").decode())))
    (axis,) = facts["axes"]
    assert not axis["state"]["fresh"]
    assert axis["state"]["problem"]
    (row,) = [row for row in rows if row["key"] == read]
    assert row["raw"] == str(known["raw"])
    assert any(row["error"] for row in rows), "what was never read says so"
    assert facts["links"][0]["timeouts"] > 0
    station.ok(station.http.delete(f"/bundles/{made['name']}"))
    until(lambda: station.state(x)["fresh"], HANG_S, "it answers again")
