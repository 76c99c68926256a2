"""Library and audit through the interface: versions, roll-back, three-way, swap protection."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import pytest

from backend.api.app import make_app
from backend.station.bench import Bench
from drivers.link import Found
from tests.support.servo import Servo, bench_with

GAIN, NAME = "2005:03", "as found.sdset"


@pytest.fixture
async def bench(tmp_path: Path) -> AsyncIterator[Bench]:
    bench, connected = await bench_with(Servo(), tmp_path)  # it has serial number 7
    connected.drive.found = Found(1, vendor_id=0x11, product_code=0x22, revision=3, serial=7)
    yield bench
    await bench.close()


@pytest.fixture
async def http(bench: Bench) -> AsyncIterator[httpx.AsyncClient]:
    transport = httpx.ASGITransport(make_app(bench, hosts=frozenset({"test"})))
    async with httpx.AsyncClient(
        transport=transport, base_url="http://test/api/v1", headers={"Origin": "http://test"}
    ) as client:
        yield client


def set_of(raw: int, *, serial: int = 7, product: int = 0x22, more: str = "") -> bytes:
    return f"""format = "servodeck parameter set"
version = 1
[identity]
profile = "mms7"
drive = "X"
vendor_id = 17
product_code = {product}
serial = {serial}
[about]
saved = 2026-11-21T10:15:00Z
author = "Anna"
notes = ""
[[parameter]]
key = "{GAIN}"
raw = {raw}
{more}
[end]
parameters = 1
""".encode()


async def put(http: httpx.AsyncClient, data: bytes, name: str = NAME) -> Any:
    answer = await http.put(f"/sets/{name}", params={"overwrite": True}, content=data)
    assert answer.is_success, answer.text
    return answer.json()


async def load(http: httpx.AsyncClient, keys: list[str], **body: object) -> Any:
    answer = await http.post("/drives/x/jobs/load_set", json={"file": NAME, "keys": keys, **body})
    assert answer.is_success, answer.text
    async with asyncio.timeout(20):
        while True:
            job = (await http.get(f"/jobs/{answer.json()['id']}")).json()
            if job["state"] != "running":
                return job
            await asyncio.sleep(0.01)


async def test_roll_back_writes_an_earlier_version_and_can_be_undone(
    http: httpx.AsyncClient, bench: Bench
) -> None:
    await put(http, set_of(350))
    assert (await put(http, set_of(400)))["version"] == 2
    assert (await load(http, [GAIN]))["result"]["written"] == 1
    assert (await bench.connected("x").drive.read(GAIN)).raw == 400
    diff = (await http.get("/drives/x/diff", params={"file": NAME, "version": 1})).json()
    row = next(r for r in diff["rows"] if r["key"] == GAIN)
    assert (row["file_raw"], row["drive_raw"], row["selected"]) == (350, 400, True)
    done = await load(http, [GAIN], version=1)
    assert (await bench.connected("x").drive.read(GAIN)).raw == 350
    undo = done["result"]["backup"]
    stored = {s["file"]: s for s in (await http.get("/sets")).json()}
    assert stored[undo]["tags"] == ["undo"]
    assert b"raw = 400" in (await http.get(f"/sets/{undo}")).content
    refused = await http.post(
        "/drives/x/jobs/load_set", json={"file": NAME, "keys": [GAIN], "version": 9}
    )
    assert refused.status_code == 409
    assert "no version 9" in refused.json()["detail"]


async def test_three_way(http: httpx.AsyncClient, bench: Bench) -> None:
    def row(key: str, raw: int) -> str:
        return f'[[parameter]]\nkey = "{key}"\nraw = {raw}\n'

    drive = bench.connected("x").drive
    keys = [p.key for p in drive.profile.parameters
            if p.group == drive.parameter(GAIN).group and p.access == "rw"
            and p.key != GAIN and not p.enum and p.type == "UINT16"][:3]  # fmt: skip
    there, here, clash = keys
    raw = {key: (await drive.read(key)).raw for key in [GAIN, *keys]}
    low = {key: int(drive.parameter(key).raw_limits[0] or 0) for key in [GAIN, *keys]}
    for key in (here, clash):
        await drive.write(key, low[key] + 1)
    base = {there: raw[there], here: low[here] + 2, clash: low[clash] + 3}
    theirs = {there: low[there] + 4, here: low[here] + 2, clash: low[clash] + 5}
    for name, values in (("base", base), ("theirs", theirs)):
        more = "".join(row(key, int(value or 0)) for key, value in values.items())
        await put(http, set_of(int(raw[GAIN] or 0), more=more), name)
    answer = await http.get("/drives/x/three-way", params={"base": "base", "theirs": "theirs"})
    found = {r["key"]: r for r in answer.json()["rows"]}
    assert {key: found[key]["status"] for key in [GAIN, *keys]} == {
        GAIN: "same",
        there: "theirs",
        here: "drive",
        clash: "conflict",
    }
    assert [key for key in [GAIN, *keys] if found[key]["selected"]] == [there]
    assert found[clash]["base_raw"] == low[clash] + 3
    assert found[clash]["theirs_raw"] == low[clash] + 5
    assert found[clash]["drive_raw"] == low[clash] + 1


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (set_of(350, serial=8), "serial number 8, this drive has 7"),
        (set_of(350, product=0x23), "product code 35, this drive has 34"),
    ],
)
async def test_another_drive_s_set_needs_consent(
    http: httpx.AsyncClient, bench: Bench, data: bytes, words: str
) -> None:
    await put(http, data)
    before = (await bench.connected("x").drive.read(GAIN)).raw
    diff = (await http.get("/drives/x/diff", params={"file": NAME})).json()
    assert diff["same_serial"] is False
    assert any(words in text for text in diff["warnings"])
    job = await load(http, [GAIN])
    assert job["state"] == "failed"
    assert words in job["problem"]["detail"]
    assert (await bench.connected("x").drive.read(GAIN)).raw == before
    assert (await load(http, [GAIN], accept_other_identity=True))["state"] == "done"
    assert (await bench.connected("x").drive.read(GAIN)).raw == 350


async def test_values_of_one_motor_stay_with_it(http: httpx.AsyncClient, bench: Bench) -> None:
    profile = bench.connected("x").drive.profile
    own = next(
        p
        for p in profile.parameters
        if p.motor_individual and p.access == "rw" and p.type not in ("STRING", "OCTETS")
    )
    low = own.raw_limits[0]
    value = int(low if low is not None else 0)
    more = f'[[parameter]]\nkey = "{own.key}"\nraw = {value}\n'
    await put(http, set_of(350, serial=8, more=more))
    diff = (await http.get("/drives/x/diff", params={"file": NAME})).json()
    assert not next(r for r in diff["rows"] if r["key"] == own.key)["selected"]
    refused = await load(http, [GAIN, own.key], accept_other_identity=True)
    assert refused["state"] == "failed"
    assert "belongs to the motor" in refused["problem"]["detail"]
    assert (await bench.connected("x").drive.read(GAIN)).raw != 350, "nothing was written"
    accepted = await load(
        http, [GAIN, own.key], accept_other_identity=True, accept_motor_individual=True
    )
    assert accepted["result"]["written"] == 2


async def test_a_swap_is_noticed_before_the_first_write(
    http: httpx.AsyncClient, bench: Bench
) -> None:
    await put(http, set_of(350))
    drive = bench.connected("x").drive
    before = (await drive.read(GAIN)).raw
    # The cables were exchanged: the drive that answers has another serial number.
    drive.found = replace(drive.found or Found(1), serial=6)
    job = await load(http, [GAIN], accept_other_identity=True)
    assert job["state"] == "failed"
    assert "serial number 6" in job["problem"]["detail"]
    assert (await drive.read(GAIN)).raw == before


async def test_library_lists_tags_and_versions(http: httpx.AsyncClient) -> None:
    entry = (await put(http, set_of(350)))["entry"]
    await put(http, set_of(400))
    changed = await http.patch(
        f"/library/{entry}", json={"tags": ["golden"], "notes": "<script>alert(1)</script>"}
    )
    assert changed.json()["notes"] == "<script>alert(1)</script>"
    page = (await http.get("/library", params={"tag": "golden", "kind": "set"})).json()
    assert [(e["name"], e["versions"], e["here"]) for e in page["entries"]] == [(NAME, 2, True)]
    assert page["entries"][0]["latest"]["facts"] == {"parameters": 1}
    versions = (await http.get(f"/library/{entry}/versions")).json()
    assert [v["number"] for v in versions] == [2, 1]
    first = await http.get(f"/library/{entry}/content", params={"version": 1})
    assert first.content == set_of(350)
    assert first.headers["content-disposition"].startswith("attachment;")
    assert (await http.get(f"/library/{entry}/content?version=3")).status_code == 404
    assert (await http.get("/library/999")).status_code == 404
    for address in ("/library", "/audit"):
        answer = await http.get(address, params={"since": "0001-01-01T00:00:00+14:00"})
        assert answer.status_code == 422, "that is in the year 0 of UTC"
    assert (await http.get("/library/tags")).json() == [{"tag": "golden", "count": 1}]
    assert (await http.delete(f"/library/{entry}")).status_code == 204
    assert (await http.get("/library")).json()["total"] == 0
    assert (await http.get("/library?deleted=true")).json()["total"] == 1
    back = await http.patch(f"/library/{entry}", json={"deleted": False})
    assert back.json()["deleted"] is None


@pytest.mark.long
async def test_notes_that_another_person_changed_are_not_overwritten(
    http: httpx.AsyncClient,
) -> None:
    entry = (await put(http, set_of(350)))["entry"]

    async def change(**body: object) -> httpx.Response:
        return await http.patch(f"/library/{entry}", json=body)

    assert (await change(notes="first", base_notes="")).status_code == 200
    # Both had read the empty notes.
    late = await change(notes="second", base_notes="")
    assert (late.status_code, late.json()["type"]) == (409, "urn:servodeck:changed-meanwhile")
    assert (late.json()["parameter"], late.json()["value"]) == ("notes", "first")
    assert (await http.get(f"/library/{entry}")).json()["notes"] == "first"
    assert (await change(notes="first", base_notes="")).status_code == 200, "the same text"
    assert (await change(notes="second", base_notes="first")).json()["notes"] == "second"
    assert (await change(tags=["b", "a"], base_tags=[])).status_code == 200
    late = await change(tags=["c"], base_tags=[])
    assert (late.status_code, late.json()["parameter"]) == (409, "tags")
    assert (await change(tags=["c"], base_tags=["a", "b"])).json()["tags"] == ["c"]


async def test_files_of_the_station_are_listed_and_not_copied(
    http: httpx.AsyncClient, tmp_path: Path
) -> None:
    reports = tmp_path / "reports"
    reports.mkdir()
    name = "20261121-101500-report-Feed-axis.html"
    (reports / name).write_text("<script>alert(1)</script>")
    (tmp_path / "measurements").mkdir()
    (tmp_path / "measurements" / "bad.sdmeas").write_bytes(b"no zip")
    page = (await http.get("/library")).json()
    by_name = {e["name"]: e for e in page["entries"]}
    assert by_name[name]["latest"]["axis"]["name"] == "Feed-axis"
    assert "bad.sdmeas" in by_name["bad.sdmeas"]["latest"]["facts"]["problem"]
    assert by_name["bad.sdmeas"]["latest"]["problem_message"]["code"].startswith("library.")
    report = await http.get(f"/library/{by_name[name]['id']}/content")
    assert report.text == "<script>alert(1)</script>"
    assert report.headers["content-disposition"].startswith("attachment;")
    (reports / name).unlink()
    assert (await http.get(f"/library/{by_name[name]['id']}/content")).status_code == 404
    assert (await http.get("/library?kind=report")).json()["total"] == 0


async def test_the_audit_tells_who_wrote_what(http: httpx.AsyncClient, bench: Bench) -> None:
    drive = bench.connected("x").drive
    before = (await drive.read(GAIN)).raw
    assert (await http.put(f"/drives/x/parameters/{GAIN}", json={"raw": 360})).is_success
    # No waiting here: the answer came when the entry was stored.
    page = (await http.get("/audit", params={"kind": "write"})).json()
    event = page["events"][0]
    assert (event["axis"], event["target"], event["old"], event["new"], event["outcome"]) == (
        "X",
        GAIN,
        before,
        360,
        "",
    )
    assert event["person"] == "local user"
    await put(http, set_of(350))
    await load(http, [GAIN])
    await http.post("/stop", json={})
    await bench.audit.settled(5.0)
    events = (await http.get("/audit")).json()["events"]
    seen = [(e["kind"], e["action"], e["target"]) for e in reversed(events)]
    assert ("file", "saved", NAME) in seen
    assert ("write", "written", GAIN) in seen
    assert [k for k, a, t in seen if t.startswith("load_set")] == ["job", "job"]
    assert ("stop", "pressed", "") in seen
    assert (await http.get("/audit/verify")).json()["ok"] is True
    head = (await http.get("/audit/verify")).json()["head"]
    assert (await http.get("/audit/verify", params={"anchor": head})).json()["ok"] is True
    wrong = f"1:{'0' * 64}"
    assert (await http.get("/audit/verify", params={"anchor": wrong})).json()["broken"] == 1
    names = (await http.get("/audit/names")).json()
    assert names["axes"] == ["X"]
    lines = (await http.get("/audit/export", params={"format": "jsonl"})).text.splitlines()
    assert [json.loads(line)["number"] for line in lines] == list(range(1, len(events) + 1))
    table = (await http.get("/audit/export", params={"kind": "stop"})).text.splitlines()
    assert len(table) == 2


async def test_no_change_of_files_or_station_is_forgotten(
    http: httpx.AsyncClient, bench: Bench
) -> None:
    answer = await http.patch("/drives/x", json={"notes": "greased"})
    assert answer.is_success, answer.text
    assert (await http.patch("/drives/nothing", json={"notes": ""})).status_code == 404
    events = (await http.get("/audit?kind=station")).json()["events"]
    assert [(e["action"], e["axis"], e["target"], e["person"]) for e in events] == [
        ("changed", "X", "/drives/x", "local user")
    ]
    assert (events[0]["old"], events[0]["new"]) == (
        '{"name":"X","notes":""}',
        '{"notes":"greased"}',
    )


async def audit_status(http: httpx.AsyncClient, *, troubled: bool) -> Any:
    async with asyncio.timeout(20):
        while True:
            status = (await http.get("/audit/status")).json()
            if bool(status["problem"]) == troubled:
                return status
            await asyncio.sleep(0.02)


@pytest.mark.long
async def test_a_database_that_cannot_be_used_is_reported_and_motion_goes_on(
    tmp_path: Path, http: httpx.AsyncClient, bench: Bench
) -> None:
    await bench.audit.settled(5.0)
    bench.records.store.close()
    file = tmp_path / "servodeck.db"
    file.write_bytes(b"this is no database" * 100)
    for name in ("servodeck.db-wal", "servodeck.db-shm"):
        (tmp_path / name).unlink(missing_ok=True)
    answer = await http.get("/library")
    assert answer.status_code == 409
    assert answer.json()["type"] == "urn:servodeck:storage-failed"
    assert "not a database" in answer.json()["detail"]
    assert (await http.put(f"/drives/x/parameters/{GAIN}", json={"raw": 361})).is_success
    answer = (await http.post("/stop", json={})).json()
    assert (answer["stopped"], answer["failed"]) == (["x"], {})
    status = await audit_status(http, troubled=True)
    assert "not a database" in status["problem"]
    assert status["pending"] > 0
    file.unlink()
    await audit_status(http, troubled=False)
    events = (await http.get("/audit")).json()["events"]
    assert {"write", "stop"} <= {e["kind"] for e in events}
