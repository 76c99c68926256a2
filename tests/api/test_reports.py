"""Stored measurements and reports through the interface, on a drive that never moves."""

from __future__ import annotations

import io
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from pypdf import PdfReader

from backend.axes.drive.drive import Drive
from drivers.link import Found
from profiles.loader import load_profile
from tests.support import measurements as known
from tests.support.station import Station

NOW = datetime.now(UTC)


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    running = Station(tmp_path_factory.mktemp("reports"))
    running.start()
    yield running
    running.stop()


@pytest.fixture(scope="module")
def drive(station: Station) -> str:
    return station.add(1, name="Feed <screw>")


def _upload(station: Station, drive: str, name: str, made: Any, minutes: float = 0.0) -> Any:
    """A file as this very drive would have left it."""
    serial = station.ok(station.http.get(f"/drives/{drive}"))["serial"]
    origin = Drive(drive, "Feed <screw>", load_profile("mms7"), [])
    origin.found = Found(1, serial=serial)
    data = known.file_of(origin, made, NOW + timedelta(minutes=minutes))
    return station.http.post("/measurements", params={"name": name}, content=data)


@pytest.mark.long
def test_a_stored_measurement_is_evaluated_anew(station: Station, drive: str) -> None:
    info = station.ok(_upload(station, drive, "step", known.step()))
    content = station.ok(station.http.get(f"/measurements/{info['file']}"))
    assert content["result"]["step"]["rise_s"] == pytest.approx(known.RISE_S, abs=2e-4)
    assert content["agrees"] is None
    assert content["profile_version"]
    assert content["settings"]["envelope"]["torque_percent"] == 80.0


def test_damage_and_absence_are_distinguished(station: Station, drive: str) -> None:
    station.ok(_upload(station, drive, "whole", known.step()))
    data = station.http.get("/measurements/whole.sdmeas/file").content
    answer = station.http.post("/measurements", params={"name": "cut"}, content=data[:-100])
    assert answer.status_code == 409
    problem = answer.json()
    assert problem["type"] == "urn:servodeck:bad-measurement"
    assert "cut.sdmeas is damaged" in problem["detail"]
    assert "undamaged copy" in problem["remedy"]
    for path in ("/measurements/none.sdmeas", "/measurements/none.sdmeas/file"):
        assert station.http.get(path).status_code == 404
    # Damage that came later: the file is listed with its problem, or refused when it is opened.
    file = station.folder / "state" / "measurements" / "whole.sdmeas"
    broken = bytearray(data)
    broken[len(broken) // 2] ^= 0xFF
    file.write_bytes(broken)
    assert station.http.get("/measurements/whole.sdmeas").status_code == 409
    assert station.http.get("/measurements").status_code == 200
    station.ok(station.http.delete("/measurements/whole.sdmeas"))


def test_changes_stand_in_the_report(station: Station, drive: str) -> None:
    station.ok(_upload(station, drive, "before", known.step(80.0), -5))
    gains = station.ok(station.http.get(f"/drives/{drive}/gains"))
    level = next(each for each in gains["levels"] if each != gains["level"])
    undo = station.ok(station.http.put(f"/drives/{drive}/gains", json={"level": level}))
    body = {"format": "html", "machine": "Press 4", "person": "Ann <i>", "notes": "loose\nfixed"}
    made = station.ok(station.http.post(f"/drives/{drive}/reports", json=body))
    answer = station.http.get(f"/reports/{made['file']}")
    assert answer.headers["content-type"] == "text/html; charset=utf-8"
    assert "sandbox" in answer.headers["content-security-policy"]
    page = answer.text
    assert "Feed &lt;screw&gt;" in page
    assert "Ann &lt;i&gt;" in page
    for key in undo["before"]:
        raw = station.ok(station.http.get(f"/drives/{drive}/parameters/{key}"))["raw"]
        assert (f"<td>{key}</td>" in page) is (raw != undo["before"][key])
    assert "no loop was measured afterwards" in page
    assert "not saved in its memory" in page
    chinese = station.ok(
        station.http.post(f"/drives/{drive}/reports", json=body | {"language": "zh"})
    )
    page = station.http.get(f"/reports/{chinese['file']}").text
    names = [load_profile("mms7").by_key[key].name for key in undo["before"]]
    assert not [name for name in names if f"<td>{name}</td>" in page]

    # Undone, nothing of it is left to show.
    station.ok(station.http.post(f"/drives/{drive}/tune/undo", json=undo))
    made = station.ok(station.http.post(f"/drives/{drive}/reports", json=body))
    assert "Tuning changed no setting." in station.http.get(f"/reports/{made['file']}").text


def test_nothing_is_taken_back_over_what_somebody_wrote_since(station: Station, drive: str) -> None:
    gains = station.ok(station.http.get(f"/drives/{drive}/gains"))
    level = next(each for each in gains["levels"] if each != gains["level"])
    undo = station.ok(station.http.put(f"/drives/{drive}/gains", json={"level": level}))
    key = next(k for k in undo["before"] if undo["before"][k] != undo["after"][k])
    hers = undo["after"][key] + 1
    path = f"/drives/{drive}/parameters/{key}"
    station.ok(station.http.put(path, json={"raw": hers}))
    refused = station.http.post(f"/drives/{drive}/tune/undo", json=undo)
    assert refused.status_code == 409
    problem = refused.json()
    assert problem["parameter"] == key
    assert f"is {hers} now" in problem["detail"]
    assert problem["remedy"]
    for each, raw in undo["after"].items():
        now = station.ok(station.http.get(f"/drives/{drive}/parameters/{each}"))["raw"]
        assert now == (hers if each == key else raw)
    # Whoever has seen it may take it back all the same.
    station.ok(station.http.post(f"/drives/{drive}/tune/undo", json={"before": undo["before"]}))
    assert station.ok(station.http.get(path))["raw"] == undo["before"][key]


def test_a_report_as_pdf_in_chinese(station: Station, drive: str) -> None:
    station.ok(_upload(station, drive, "loop", known.speed_loop(), 1))
    body = {"format": "pdf", "language": "zh", "measurements": ["loop.sdmeas"]}
    made = station.ok(station.http.post(f"/drives/{drive}/reports", json=body))
    answer = station.http.get(f"/reports/{made['file']}")
    assert answer.headers["content-type"] == "application/pdf"
    assert len(answer.content) == made["size_bytes"]
    text = "\n".join(p.extract_text() for p in PdfReader(io.BytesIO(answer.content)).pages)
    assert "速度环频率响应" in text
    assert "loop.sdmeas" in text
    assert "step.sdmeas" not in text
    assert made["file"] in [r["file"] for r in station.ok(station.http.get("/reports"))]
    station.ok(station.http.delete(f"/reports/{made['file']}"))
    assert station.http.get(f"/reports/{made['file']}").status_code == 404


def test_another_drives_measurement_is_refused(
    station: Station, drive: str, tmp_path: Path
) -> None:
    origin = Drive("other", "Other", load_profile("mms7"), [])
    origin.found = Found(1, serial=1)
    data = known.file_of(origin, known.step(), NOW)
    station.ok(station.http.post("/measurements", params={"name": "other"}, content=data))
    body = {"measurements": ["other.sdmeas"]}
    answer = station.http.post(f"/drives/{drive}/reports", json=body)
    assert answer.status_code == 409
    assert "was not measured on Feed <screw>" in answer.json()["detail"]
    answer = station.http.post(f"/drives/{drive}/reports", json={"measurements": ["no.sdmeas"]})
    assert answer.status_code == 404


@pytest.mark.parametrize("name", ["..%2Fbench.json", "x.exe", ".pdf", "none.html"])
def test_nothing_but_reports_is_handed_out(station: Station, name: str) -> None:
    assert station.http.get(f"/reports/{name}").status_code == 404
    assert station.http.delete(f"/reports/{name}").status_code == 404
