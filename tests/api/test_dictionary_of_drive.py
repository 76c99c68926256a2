"""An EtherCAT drive's own list of objects becomes a profile that is usable at once."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from drivers.virtual.wires.netns import unavailable
from tests.support.station import Station

URL = "ethercat://virtual0"
BENCH = """
[[axis]]
name = "A"
drive = "generic402"
on = "ethercat://virtual0"
station = 1
"""


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    if reason := unavailable():
        pytest.skip(f"no private network here: {reason}")
    folder = Path(tmp_path_factory.mktemp("dictionary"))
    (folder / "bench.toml").write_text(BENCH)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SERVODECK_PROFILES", str(folder / "mine"))
        patch.setenv("SERVODECK_CACHE", str(folder / "cache"))
        running = Station(folder, folder / "bench.toml", steady=True)
        running.start()
        yield running
        running.stop()


@pytest.mark.long
def test_what_the_drive_lists_is_a_profile(station: Station) -> None:
    body = {"url": URL, "station": 1, "profile": "as_reported"}
    made = station.done(station.http.post("/descriptions/from-drive", json=body), 60)
    assert made["links"] == ["ethercat"]
    assert made["parameters"] > 50
    twice = station.http.post("/descriptions/from-drive", json=body)
    assert twice.status_code == 409
    drive = station.add(1, URL, "as_reported", "T")
    try:
        rows = {r["key"]: r for r in station.ok(station.http.get(f"/drives/{drive}/parameters"))}
        assert rows["6083:00"]["type"] == "UINT32"
        written = station.http.put(f"/drives/{drive}/parameters/6083:00", json={"raw": 70_000})
        assert station.ok(written)["raw"] == 70_000
        assert station.state(drive)["state"] == "Switch on disabled"
    finally:
        station.ok(station.http.delete(f"/drives/{drive}"))
