"""Recording every cycle of an EtherCAT segment, and what a support bundle keeps of it."""

from __future__ import annotations

import csv
import io
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivers.virtual.wires.netns import unavailable
from tests.api.test_ethercat import BENCH, URL
from tests.support.station import Station, until

POSITION, VELOCITY = "6064:00", "606C:00"


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    if reason := unavailable():
        pytest.skip(f"no private network here: {reason}")
    folder = Path(tmp_path_factory.mktemp("ethercat"))
    bench = folder / "bench.toml"
    bench.write_text(BENCH)
    running = Station(folder, bench, ["--lockstep"])
    running.start()
    yield running
    running.stop()


@pytest.fixture
def cyclic(station: Station) -> Iterator[tuple[str, str]]:
    names = station.add(1, URL, name="A"), station.add(2, URL, name="B")
    bus = station.ok(station.http.post("/buses/cyclic", json={"url": URL, "cycle_us": 1000}))
    assert bus["cyclic"]["running"]
    yield names
    station.http.delete("/buses/cyclic", params={"url": URL})
    station.remove(*names)


def table(text: str) -> tuple[list[str], np.ndarray]:
    titles, *rows = list(csv.reader(io.StringIO(text)))
    return titles, np.array([[float(cell or "nan") for cell in row] for row in rows])


@pytest.mark.long
def test_every_cycle_of_both_axes_is_on_the_disk(station: Station, cyclic: tuple[str, str]) -> None:
    body = {"channels": [{"drive": d, "key": k} for d in cyclic for k in (POSITION, VELOCITY)]}
    name = station.ok(station.http.post("/recordings", json=body))["name"]

    def row() -> dict[str, Any]:
        rows = station.ok(station.http.get("/recordings"))["recordings"]
        return dict(next(r for r in rows if r["name"] == name))

    until(lambda: row()["samples"] > 4000, 60, "two seconds of both axes")
    ended = station.ok(station.http.post(f"/recordings/{name}/stop"))
    assert all(channel["synchronous"] for channel in ended["channels"])
    # A computer that is kept busy by other tests leaves out cycles; they are counted as lost.
    assert ended["lost"] % 2 == 0, "by both axes alike"
    station.done(station.http.post(f"/recordings/{name}/exports/csv"))
    titles, rows = table(station.http.get(f"/recordings/{name}/exports/csv").text)
    assert titles[-2:] == ["A valid", "B valid"]
    both = rows[~np.isnan(rows).any(axis=1)]
    assert len(both) * 2 >= ended["samples"] - 200, "both axes share their times"
    assert (
        np.count_nonzero(~np.isnan(rows[:, 1])) + np.count_nonzero(~np.isnan(rows[:, 3]))
        == (ended["samples"])
    ), "every sample once"
    for column in (1, 3):
        times = rows[~np.isnan(rows[:, column]), 0]
        assert np.median(np.diff(times)) == pytest.approx(0.001, rel=0.01)
    station.ok(station.http.delete(f"/recordings/{name}"))


@pytest.mark.long
def test_a_bundle_has_every_cycle_of_the_last_seconds(
    station: Station, cyclic: tuple[str, str]
) -> None:
    time.sleep(1.5)  # what the bundle is to show must pass
    made = station.ok(station.http.post("/bundles", json={"reason": "looked at"}))
    data = station.http.get(f"/bundles/{made['name']}").raise_for_status().content
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        _, rows = table(archive.read("samples.csv").decode())
        page = archive.read("index.html").decode()
    assert len(rows) > 500
    assert "<polyline" in page
    assert "A Position actual value" in page
    assert "B Position actual value" in page, "the other axes' story too"
