"""A drive that is not listed: its description becomes a profile, and the drive works by it."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from profiles import load_profile
from profiles.importer import export_eds
from tests.support.jogging import jogged
from tests.support.machine import within
from tests.support.station import Station
from tests.wire.makers_files.samples import SAMPLES
from tests.wire.makers_files.strict_slave import File

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
[axis.mechanics.load_encoder]
counts_per_rev = 131072
"""


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    """A station with an unknown CiA 402 drive, and a profile folder of its own."""
    folder = Path(tmp_path_factory.mktemp("unknown"))
    bench = folder / "bench.toml"
    bench.write_text(BENCH, "utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SERVODECK_PROFILES", str(folder / "mine"))
        patch.setenv("SERVODECK_CACHE", str(folder / "cache"))
        running = Station(folder, bench)
        running.start()
        yield running
        running.stop()


def makers_eds() -> bytes:
    """The file as the maker of this drive might hand it out, not without oddities."""
    text = export_eds(load_profile("generic402"), datetime(2020, 1, 2, 3, 4), "nova.eds")
    text = text.replace("VendorName=any", "VendorName = Nova Motion")
    text = text.replace("ProductName=CiA 402 drive", "ProductName=N-400")
    text += "[2F00]\r\nParameterName=Odd thing\r\nObjectType=7\r\nDataType=0x0777\r\n"
    text += "AccessType=rw\r\n\r\nnot a line of an EDS file\r\n"
    return text.encode("latin-1", "replace")


def imported(station: Station, data: bytes, file: str, **query: Any) -> Any:
    answer = station.http.post("/descriptions", params={"file": file, **query}, content=data)
    return station.done(answer, 60)


@pytest.mark.long
def test_from_the_makers_file_to_a_moving_axis(station: Station) -> None:
    seen = station.done(station.http.post("/scan", json={"url": CAN, "stations": [5]}))["found"]
    assert [drive["station"] for drive in seen] == [5]
    assert all(match["confidence"] != "certain" for match in seen[0]["matches"])

    made = imported(station, makers_eds(), "nova.eds", profile="nova_n400")
    assert (made["profile"], made["title"]) == ("nova_n400", "Nova Motion N-400")
    assert made["links"] == ["canopen"]
    outcomes = {finding["outcome"] for finding in made["findings"]}
    assert "left out" in outcomes, "2F00h has a type that nobody knows"
    assert any("2F00" in f["place"] + f["text"] for f in made["findings"])
    assert Path(made["path"]).is_file()

    again = station.done(station.http.post("/scan", json={"url": CAN, "stations": [5]}))["found"]
    assert "nova_n400" in {match["profile"] for match in again[0]["matches"]}

    drive = station.add(5, CAN, "nova_n400", "N")
    try:
        read = station.done(station.http.post(f"/drives/{drive}/jobs/read_all", json={}), 60)
        assert read["failed"] == {}
        written = station.http.put(f"/drives/{drive}/parameters/6083:00", json={"raw": 500_000})
        assert station.ok(written)["raw"] == 500_000
        _jog(station, drive)
    finally:
        station.remove(drive)


def _jog(station: Station, drive: str) -> None:
    def at_speed(now: Any, start: float) -> bool:
        return now["velocity"] == pytest.approx(120, rel=0.1) and now["position"] - start > 0.5

    limits = {"speed": 120, "acceleration": 1200, "travel_limit": 10, "torque_limit": 100}
    with station.live() as page:
        with jogged(station.http, page, drive, at_speed, **limits) as before:
            page.send(type="jog_stop", drive=drive)
        ended = page.wait("jog_ended", drive=drive)
    assert ended["problem"] is None, ended
    within(3, lambda: abs(float(station.state(drive)["velocity"])) < 2, "it stands again")
    assert float(station.state(drive)["position"]) - before > 0.5


@pytest.mark.long
def test_findings_are_in_the_language_of_whoever_asks(station: Station) -> None:
    answer = station.http.post(
        "/descriptions", params={"file": "nova.eds", "profile": "spoken"}, content=makers_eds()
    )
    job = station.job(answer, 60)

    def read(language: str) -> Any:
        headers = {"Accept-Language": language}
        return station.ok(station.http.get(f"/jobs/{job['id']}", headers=headers))["result"]

    english, chinese = read("en"), read("zh")
    facts = [(each["place"], each["text_message"]) for each in english["findings"]]
    assert facts == [(each["place"], each["text_message"]) for each in chinese["findings"]]
    assert len(facts) >= 2
    assert "data type 0x0777 is unknown" in [each["text"] for each in english["findings"]]
    assert "数据类型 0x0777 未知" in [each["text"] for each in chinese["findings"]]
    assert "left out" in english["summary"]
    assert "忽略" in chinese["summary"]


@pytest.mark.long
def test_an_edited_profile_is_used_without_a_restart(station: Station) -> None:
    made = imported(station, makers_eds(), "nova.eds", profile="edited")
    path = Path(made["path"])
    text = path.read_text("utf-8")
    path.write_text(text.replace("title: Nova Motion N-400", "title: My own words"), "utf-8")
    profiles = {p["profile"]: p for p in station.ok(station.http.get("/profiles"))}
    assert profiles["edited"]["title"] == "My own words"
    assert profiles["edited"]["own"]
    assert not profiles["mms7"]["own"]


@pytest.mark.long
def test_a_person_classifies_an_object_of_an_imported_profile(station: Station) -> None:
    extra = b"[2F01]\r\nParameterName=Gain\r\nDataType=0x0006\r\nAccessType=rw\r\n"
    imported(station, makers_eds() + extra, "nova.eds", profile="classified")
    drive = station.add(5, CAN, "classified", "C")
    where = "/profiles/classified/parameters/2F01:00/motion"
    try:
        before = station.ok(station.http.get(where))
        assert (before["motion"], before["origin"]) == ("energises", "unclassified")
        assert before["changeable"]
        wrong = {"motion": "energises", "safe_in_motion": True, "reason": "page 1"}
        assert station.http.put(where, json=wrong).status_code == 422
        assert station.http.put(where, json={"motion": "none"}).status_code == 422
        body = {"motion": "at_enable", "safe_in_motion": True, "reason": "page 12"}
        now = station.ok(station.http.put(where, json=body))
        assert (now["motion"], now["origin"], now["reason"]) == ("at_enable", "person", "page 12")
        reported = station.ok(station.http.get("/audit"))["events"]
        line = next(each for each in reported if each["target"] == where)
        assert (line["action"], line["kind"]) == ("changed", "station")
        assert "energises" in str(line["old"])
        assert "page 12" in str(line["new"])
        # The drive on the bench has it at once.
        bench = station.bench
        assert bench is not None
        assert bench.connected_drives[drive].drive.profile.by_key["2F01:00"].motion == "at_enable"
        back = station.ok(station.http.delete(where))
        assert (back["motion"], back["origin"]) == ("energises", "unclassified")
        assert bench.connected_drives[drive].drive.profile.by_key["2F01:00"].motion == "energises"
    finally:
        station.remove(drive)


@pytest.mark.parametrize(
    ("profile", "key", "status"),
    [
        ("generic402", "6040:00", 409),
        ("m6l", "2003:02", 409),
        ("m6l", "9999:00", 404),
        ("nobody", "6040:00", 404),
    ],
)
def test_classes_of_manual_and_standard_are_nobodys_to_change(
    station: Station, profile: str, key: str, status: int
) -> None:
    where = f"/profiles/{profile}/parameters/{key}/motion"
    answer = station.http.put(where, json={"motion": "none", "reason": "I say so"})
    assert answer.status_code == status, answer.text
    assert station.http.delete(where).status_code == status


@pytest.mark.long
def test_a_broken_own_profile_spoils_only_itself(station: Station) -> None:
    made = imported(station, makers_eds(), "nova.eds", profile="broken_one")
    path = Path(made["path"])
    path.write_text(path.read_text("utf-8").replace("title:", "titel:"), "utf-8")
    try:
        profiles = {p["profile"]: p for p in station.ok(station.http.get("/profiles"))}
        assert "titel" in profiles["broken_one"]["problem"]
        found = station.done(station.http.post("/scan", json={"url": CAN, "stations": [5]}))
        assert len(found["found"]) == 1
        assert "broken_one" not in {m["profile"] for m in found["found"][0]["matches"]}
    finally:
        path.unlink()


@pytest.mark.long
def test_what_is_no_description_is_refused_in_words(station: Station) -> None:
    job = station.job(
        station.http.post("/descriptions", params={"file": "a.xml"}, content=b"<EtherCATInfo>")
    )
    assert job["state"] == "failed"
    assert "not well-formed" in job["problem"]["detail"]
    assert job["problem"]["type"] == "urn:servodeck:bad-description"
    entities = b'<!DOCTYPE a [<!ENTITY b "c">]><EtherCATInfo>&b;</EtherCATInfo>'
    job = station.job(
        station.http.post("/descriptions", params={"file": "b.xml"}, content=entities)
    )
    assert job["state"] == "failed"
    empty = station.http.post("/descriptions", params={"file": "a.eds"}, content=b"")
    assert (empty.status_code, empty.json()["title"]) == (409, "Not a usable description")


def test_too_large_a_file_is_refused_before_it_is_read(station: Station) -> None:
    answer = station.http.post(
        "/descriptions", params={"file": "huge.xml"}, content=b" " * ((32 << 20) + 1)
    )
    assert answer.status_code == 409
    assert "larger than 32 MiB" in answer.json()["detail"]


@pytest.mark.parametrize("name", ["../evil", "Upper", "a b", "mms7"])
def test_names_of_profiles(station: Station, name: str) -> None:
    answer = station.http.post(
        "/descriptions", params={"file": "a.eds", "profile": name}, content=makers_eds()
    )
    assert answer.status_code in (409, 422), answer.text
    assert not (station.folder / "evil").exists()


def test_a_can_drive_without_an_eds_inside_says_so(station: Station) -> None:
    body = {"url": CAN, "station": 5, "profile": "from_inside"}
    job = station.job(station.http.post("/descriptions/from-drive", json=body))
    assert job["state"] == "failed"
    assert "cannot list its own objects" in job["problem"]["detail"]
    nobody = {"url": CAN, "station": 9, "profile": "from_inside"}
    job = station.job(station.http.post("/descriptions/from-drive", json=nobody))
    assert "nothing answers at station 9" in job["problem"]["detail"]


def test_a_profile_is_exported_as_eds(station: Station) -> None:
    answer = station.http.get("/profiles/ds_c/eds")
    assert answer.status_code == 200
    assert 'filename="ds_c.eds"' in answer.headers["content-disposition"]
    assert "[6083]" in answer.text
    assert station.http.get("/profiles/nobody/eds").status_code == 404
    assert station.http.get("/profiles/..%2Fmms7/eds").status_code in (404, 422)


def test_an_imported_profile_is_exported_as_esi(station: Station) -> None:
    """Read by the strict slave's reader, which shares nothing with the importer."""
    original = SAMPLES["two_pulses"]
    made = imported(station, original, "a.xml", profile="with_two_pulses")
    assert "ethercat" in made["links"]
    answer = station.http.get("/profiles/with_two_pulses/esi")
    assert answer.status_code == 200
    assert 'filename="with_two_pulses.xml"' in answer.headers["content-disposition"]
    ours, theirs = read(answer.content), read(original)
    assert (ours.pdos, ours.managers, ours.modes) == (theirs.pdos, theirs.managers, theirs.modes)


def test_there_is_no_esi_of_a_drive_without_ethercat(station: Station) -> None:
    answer = station.http.get("/profiles/ds_c/esi")
    assert answer.status_code == 409
    assert "without EtherCAT" in answer.json()["detail"]
    assert station.http.get("/profiles/nobody/esi").status_code == 404


def read(data: bytes) -> File:
    """The device of an ESI file."""
    device = ElementTree.fromstring(data).find("Descriptions/Devices/Device")
    assert device is not None
    return File(device)
