"""Recordings of other programs through the interface: columns, storage, hostile files."""

from __future__ import annotations

import gzip
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.station import Station

REAL = Path(__file__).parents[1] / "data" / "two_mass_bench_a.csv.gz"
QUERY = {
    "name": "two_mass_bench_a.csv.gz", "time": "time_s", "input": "iq_A",
    "output": "motor_speed_rad_s", "input_unit": "A", "output_unit": "rad/s",
    "structure": "motor_speed", "output_filter_hz": 20, "current_bandwidth_hz": 500,
    "loop_delay_s": 0.0004,
}  # fmt: skip


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    running = Station(tmp_path_factory.mktemp("imports"))
    running.start()
    yield running
    running.stop()


@pytest.mark.long
def test_columns_are_shown_before_anything_is_stored(station: Station) -> None:
    found = station.ok(
        station.http.post(
            "/measurements/import/preview", params={"name": "a.csv.gz"}, content=REAL.read_bytes()
        )
    )
    assert found["rows"] == 50000
    assert [c["name"] for c in found["columns"]][:3] == ["time_s", "iq_ref_A", "iq_A"]
    assert [c["rises"] for c in found["columns"]] == [True] + [False] * 6
    assert found["columns"][0]["unit"] == "s"
    assert station.ok(station.http.get("/measurements")) == []


@pytest.mark.long
def test_an_import_is_stored_and_evaluated_anew(station: Station) -> None:
    info = station.ok(
        station.http.post(
            "/measurements/import", params=QUERY, content=REAL.read_bytes(), timeout=90
        )
    )
    assert info["kind"] == "imported-response"
    assert info["drive"] == "two_mass_bench_a.csv.gz"
    content = station.ok(station.http.get(f"/measurements/{info['file']}", timeout=90))
    assert content["agrees"] is True
    result = content["result"]
    modes = {row["kind"]: row["frequency_hz"] for row in result["resonances"]}
    assert modes["antiresonance"] == pytest.approx(53, abs=1)
    assert modes["resonance"] == pytest.approx(77, abs=1)
    assert result["unit"] == "(rad/s)/A"
    assert result["axis"]["verdict"] == "sound"
    low, high = result["axis"]["inertia_ci95"]
    assert low < result["axis"]["inertia"] < high
    assert result["axis"]["candidates"]
    assert station.http.delete(f"/measurements/{info['file']}").status_code == 204


@pytest.mark.long
def test_a_filtered_speed_gives_no_inertia(station: Station) -> None:
    query = {k: v for k, v in QUERY.items() if k != "output_filter_hz"}
    info = station.ok(
        station.http.post(
            "/measurements/import", params=query, content=REAL.read_bytes(), timeout=90
        )
    )
    result = station.ok(station.http.get(f"/measurements/{info['file']}", timeout=90))["result"]
    assert result["axis"]["verdict"] == "not-collocated"
    assert "inertia" not in result["axis"]
    assert abs(result["axis"]["contradiction"]["phase_deg"]) > 90
    assert any("±90°" in each for each in result["warnings"])
    station.http.delete(f"/measurements/{info['file']}")


@pytest.mark.long
@pytest.mark.parametrize(
    "content",
    [b"", os.urandom(1 << 16), gzip.compress(b"\0" * (300 << 20), 1), b"1,2\n" * 10, b"{}" * 999],
    ids=["empty", "binary", "bomb", "short", "json"],
)
def test_hostile_files_are_refused_and_the_server_answers(station: Station, content: bytes) -> None:
    answer = station.http.post("/measurements/import", params=QUERY, content=content, timeout=60)
    assert answer.status_code == 409, answer.text
    problem = answer.json()
    assert problem["type"] == "urn:servodeck:bad-recording"
    assert problem["remedy"]
    assert station.ok(station.http.get("/measurements")) == []


@pytest.mark.long
@pytest.mark.parametrize("name", ["../../etc/passwd", "C:\\x\\y.csv", "", "测量.csv", "a" * 200])
def test_a_name_makes_no_path(station: Station, name: str) -> None:
    rows = "\n".join(f"{i / 1000},{(i * i) % 97},{(i * i * i) % 89}" for i in range(2000))
    answer = station.http.post(
        "/measurements/import",
        params={"name": name, "time": "1", "input": "2", "output": "3"},
        content=rows.encode(),
        timeout=60,
    )
    assert answer.status_code in (201, 409)
    if answer.status_code == 201:
        file = answer.json()["file"]
        assert "/" not in file
        assert "\\" not in file
        station.http.delete(f"/measurements/{file}")
