"""Parameters through the interface, down to the bytes on the wire and back."""

from __future__ import annotations

import pytest

from tests.support.machine import within
from tests.support.station import HANG_S, Station, until


def test_scan_finds_both_drives(station: Station) -> None:
    result = station.done(
        station.http.post("/scan", json={"url": "mlink://virtual0", "stations": [1, 2, 3]})
    )
    found = {drive["station"]: drive for drive in result["found"]}
    assert set(found) == {1, 2}
    assert "mms7" in [match["profile"] for match in found[1]["matches"]]


def test_scan_may_stop_at_the_first_drive(station: Station) -> None:
    body = {"url": "mlink://virtual0", "stations": [1, 2, 3], "stop_after_first": True}
    result = station.done(station.http.post("/scan", json=body))
    assert [drive["station"] for drive in result["found"]] == [1]


def test_read_all(station: Station, x: str) -> None:
    result = station.done(station.http.post(f"/drives/{x}/jobs/read_all", json={}))
    rows = station.ok(station.http.get(f"/drives/{x}/parameters"))
    readable = [row for row in rows if row["access"] != "wo"]
    # MLink has one register for subindex 0 and 1: nobody can distinguish them there.
    beyond = [row for row in readable if not row["reachable"]]
    assert {"2005:00", "1A02:01", "6502:00"} <= {row["key"] for row in beyond}
    assert all("MLink cannot distinguish" in row["unreachable_why"] for row in beyond)
    good = [row for row in readable if row["reachable"]]
    assert result["failed"] == {}
    assert result["read"] == len(good) > 300
    assert all(row["reading"]["raw"] is not None for row in good)
    answer = station.http.put(f"/drives/{x}/parameters/1C12:00", json={"raw": 0})
    assert answer.status_code == 409
    assert "MLink cannot distinguish" in answer.json()["detail"]


def test_write_is_read_back_and_reported_to_everybody(station: Station, x: str) -> None:
    with station.live() as page:
        answer = station.ok(
            station.http.put(f"/drives/{x}/parameters/6081:00", json={"raw": 123456})
        )
        assert answer["raw"] == 123456
        seen: list[int] = []
        while 123456 not in seen:
            reported = page.wait("values", drive=x)
            seen += [v["raw"] for v in reported["values"] if v["key"] == "6081:00"]
    assert station.ok(station.http.get(f"/drives/{x}/parameters/6081:00"))["raw"] == 123456
    # As its digits, from a client that has no exact numbers of 64 bits.
    again = station.http.put(f"/drives/{x}/parameters/6081:00", json={"raw": "123457"})
    assert station.ok(again)["raw"] == 123457


@pytest.mark.parametrize(
    ("key", "body", "status", "words"),
    [
        ("6041:00", {"raw": 1}, 409, "read-only"),
        ("6081:00", {"raw": -1}, 422, "6081:00"),
        ("6081:00", {"raw": "fast"}, 422, "not a UINT32"),
        ("6081:00", {"raw": 1.5}, 422, "whole number"),
        ("6081:00", {}, 422, "either raw or value"),
        ("6081:00", {"raw": 1, "value": 1}, 422, "either raw or value"),
        ("6081:00", {"raw": 1, "speed": 2}, 422, "speed"),
        ("5555:00", {"raw": 1}, 404, "no parameter 5555:00"),
    ],
)
def test_bad_writes_are_problems(
    station: Station, x: str, key: str, body: dict[str, object], status: int, words: str
) -> None:
    answer = station.http.put(f"/drives/{x}/parameters/{key}", json=body)
    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"
    problem = answer.json()
    assert words in problem["detail"]
    assert problem["status"] == status


def test_unknown_drive_is_404(station: Station) -> None:
    answer = station.http.get("/drives/nobody/state")
    assert answer.status_code == 404
    assert "nobody" in answer.json()["detail"]


def test_foreign_host_and_origin_are_refused(station: Station) -> None:
    for headers in ({"Host": "evil.example"}, {"Origin": "http://evil.example"}):
        answer = station.http.get("/drives", headers=headers)
        assert answer.status_code == 403


def test_saved_values_survive_a_power_cut_and_others_do_not(station: Station, x: str) -> None:
    before = station.ok(station.http.get(f"/drives/{x}/parameters/6083:00"))["raw"]
    wanted = before + 1000
    station.ok(station.http.put(f"/drives/{x}/parameters/6083:00", json={"raw": wanted}))
    assert station.ok(station.http.get(f"/drives/{x}"))["unsaved"] == 1
    station.done(station.http.post(f"/drives/{x}/procedures/save", json={"confirmed": True}))
    assert station.ok(station.http.get(f"/drives/{x}"))["unsaved"] == 0
    station.ok(station.http.put(f"/drives/{x}/parameters/6083:00", json={"raw": wanted + 5}))
    station.drives.command(do="power_cycle", axis="Feed screw")
    again = station.ok(station.http.get(f"/drives/{x}/parameters/6083:00"))["raw"]
    assert again == wanted


def test_set_file_from_save_to_load(station: Station, x: str) -> None:
    info = station.ok(
        station.http.post(f"/drives/{x}/sets", json={"file": "as found", "author": "Anna"})
    )
    assert info["count"] > 50
    key = "6083:00"
    old = station.ok(station.http.get(f"/drives/{x}/parameters/{key}"))["raw"]
    station.ok(station.http.put(f"/drives/{x}/parameters/{key}", json={"raw": old + 7}))
    diff = station.ok(station.http.get(f"/drives/{x}/diff", params={"file": "as found.sdset"}))
    changed = [row for row in diff["rows"] if row["selected"]]
    assert [row["key"] for row in changed] == [key]
    body = {"file": "as found.sdset", "keys": [key]}
    report = station.done(station.http.post(f"/drives/{x}/jobs/load_set", json=body))
    assert (report["written"], report["failed"]) == (1, 0)
    assert station.ok(station.http.get(f"/drives/{x}/parameters/{key}"))["raw"] == old
    text = station.http.get("/sets/as found.sdset").text
    cut = station.http.put("/sets/cut", content=text[: len(text) // 2])
    assert cut.status_code == 409
    assert "truncated" in cut.json()["detail"] or "damaged" in cut.json()["detail"]
    names = [file["file"] for file in station.ok(station.http.get("/sets"))]
    assert "cut.sdset" not in names


def test_compare_with_defaults_and_with_another_axis(station: Station, x: str) -> None:
    y = station.add(2, name="Y")
    try:
        station.ok(station.http.put(f"/drives/{y}/parameters/6084:00", json={"raw": 4242}))
        diff = station.ok(station.http.get(f"/drives/{x}/diff", params={"against": f"drive:{y}"}))
        assert "6084:00" in [r["key"] for r in diff["rows"] if r["status"] == "differs"]
        diff = station.ok(station.http.get(f"/drives/{y}/diff", params={"against": "defaults"}))
        assert "6084:00" in [r["key"] for r in diff["rows"] if r["status"] == "differs"]
    finally:
        station.ok(station.http.delete(f"/drives/{y}"))


def test_pulled_cable_is_reported_and_recovers(station: Station, x: str) -> None:
    with station.live() as page:
        page.send(type="watch_state", drives=[x])
        page.wait("state")
        station.drives.command(do="pull", wire="mlink://virtual0")
        try:
            message = page.wait("state")
            while message["state"]["fresh"]:
                message = page.wait("state")
            assert message["state"]["problem"]
            answer = station.http.get(f"/drives/{x}/parameters/6041:00")
            assert answer.status_code in (503, 504)
            assert answer.json()["drive"] == "X"
        finally:
            station.drives.command(do="heal", wire="mlink://virtual0")
        while not message["state"]["fresh"]:
            message = page.wait("state", timeout_s=15)


def test_drives_are_back_after_a_restart_of_the_server(station: Station, x: str) -> None:
    station.ok(station.http.patch(f"/drives/{x}", json={"notes": "belt side"}))
    station.stop_server()
    station.start_server()
    (drive,) = station.ok(station.http.get("/drives"))
    assert (drive["id"], drive["name"], drive["notes"]) == (x, "X", "belt side")


def test_exchanged_drive_is_noticed_before_anything_is_written(station: Station) -> None:
    """The cable is moved to another drive: both of the wire answer with their own serial."""
    x = station.add(1, name="Swapped")
    try:
        station.drives.command(do="swap", wire="mlink://virtual0", first=1, second=2)
        station.drives.command(do="pull", wire="mlink://virtual0")
        within(5, lambda: not station.state(x)["fresh"], "its silence is reported")
        station.drives.command(do="heal", wire="mlink://virtual0")
        warned = until(
            lambda: station.ok(station.http.get(f"/drives/{x}"))["identity_warning"], HANG_S
        )
        assert "serial number" in warned
        answer = station.http.put(f"/drives/{x}/parameters/6081:00", json={"raw": 1000})
        assert answer.status_code == 409
        assert "nothing is written" in answer.json()["detail"]
        station.ok(station.http.patch(f"/drives/{x}", json={"accept_identity": True}))
        station.ok(station.http.put(f"/drives/{x}/parameters/6081:00", json={"raw": 1000}))
    finally:
        station.drives.command(do="swap", wire="mlink://virtual0", first=1, second=2)
        station.ok(station.http.delete(f"/drives/{x}"))


@pytest.mark.long
def test_a_set_goes_to_other_tools_and_comes_back(station: Station, x: str) -> None:
    saved = station.ok(station.http.post(f"/drives/{x}/sets", json={"file": "for export"}))
    for kind in ("csv", "dcf"):
        exported = station.http.get(f"/sets/{saved['file']}/list", params={"format": kind})
        assert exported.status_code == 200
        assert f'filename="for export.{kind}"' in exported.headers["content-disposition"]
        missing = station.http.get(f"/sets/{saved['file']}/list/left-out", params={"format": kind})
        assert station.ok(missing) == []
        stored = station.ok(
            station.http.post(
                "/sets/list",
                params={"file": f"as {kind}", "profile": "mms7"},
                content=exported.content,
            )
        )
        assert (stored["parameters"], stored["problems"]) == (saved["count"], [])
        diff = station.ok(station.http.get(f"/drives/{x}/diff", params={"file": stored["file"]}))
        assert not [row["key"] for row in diff["rows"] if row["status"] != "same"]
    listed = b"key,raw\n6083:00,250\nPA_02,1\n"
    of_modbus = {"file": "of modbus", "profile": "ds_c"}
    station.ok(station.http.post("/sets/list", params=of_modbus, content=listed))
    (missing,) = station.ok(
        station.http.get("/sets/of modbus.sdset/list/left-out", params={"format": "dcf"})
    )
    assert missing["reason_message"]["code"] == "sets.left-out-no-object"
    assert missing["reason"].startswith("only Modbus reaches it")
    refused = station.http.post(
        "/sets/list", params={"file": "none", "profile": "mms7"}, content=b"hello,world\n"
    )
    assert refused.status_code == 409
    assert "has no value of" in refused.json()["detail"]
    assert station.http.get("/sets/missing.sdset/list").status_code == 404
    unknown = station.http.post("/sets/list", params={"file": "n", "profile": "x"}, content=b"")
    assert unknown.status_code == 404
