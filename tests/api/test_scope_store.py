"""Set-ups and snapshots of the scope through the interface."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
import pytest

from backend.api.scope import routes as routes_scope
from tests.support.station import Station

SETUP: dict[str, Any] = {
    "traces": [{"id": "c1", "drive": "x", "key": "606C:00", "show": "own", "factor": 0.5,
                "offset": -1, "unit": "mm/s"}],
    "maths": [{"id": "m1", "name": "accel", "unit": "mm/s²", "expression": "derivative(c1)"}],
    "trigger": {"mode": "single", "kind": "leaves", "trace": "c1", "drive": "", "level": -2,
                "high": 2, "bit": 0, "before": 0.5},
    "window_s": 0.2,
    "persistence": 10,
    "ranges": [{"unit": "mm/s", "low": -2.5, "high": 2.5}],
}  # fmt: skip


def snapshot(rows: int = 5, **change: object) -> bytes:
    """A file, put together by hand after the layout in backend/axes/scope/stored.py."""
    header = {
        "created": "2026-11-21T08:00:00Z",
        "notes": "belt loose",
        "origin_s": 12.5,
        "setup": SETUP,
        "traces": [{"label": "X speed", "unit": "rpm", "rows": rows, "synchronous": True}],
    } | change
    text = json.dumps(header).encode()
    columns = np.arange(2 * rows, dtype="<f8").tobytes()
    return b"SDSNAP1\n" + struct.pack("<I", len(text)) + text + columns


@pytest.mark.long
def test_setups_are_kept_under_their_names(station: Station) -> None:
    http = station.http
    assert station.ok(http.get("/scope/setups")) == []
    assert http.put("/scope/setups/Belt axis", json=SETUP).status_code == 204
    (found,) = station.ok(http.get("/scope/setups"))
    assert found["name"] == "Belt axis"
    assert found["setup"] == SETUP
    assert http.put("/scope/setups/Belt axis", json=SETUP | {"window_s": 1}).status_code == 204
    (found,) = station.ok(http.get("/scope/setups"))
    assert found["setup"]["window_s"] == 1
    assert http.delete("/scope/setups/Belt axis").status_code == 204
    assert http.delete("/scope/setups/Belt axis").status_code == 404
    assert station.ok(http.get("/scope/setups")) == []


@pytest.mark.parametrize(
    ("path", "body"),
    [
        ("/scope/setups/..%2Fx", SETUP),
        ("/scope/setups/.hidden", SETUP),
        ("/scope/setups/a", SETUP | {"window_s": 0}),
        ("/scope/setups/a", SETUP | {"traces": [SETUP["traces"][0] | {"id": "z; drop"}]}),
        ("/scope/setups/a", SETUP | {"ranges": [{"unit": "mm/s", "low": 1, "high": 1}]}),
        ("/scope/setups/a", SETUP | {"more": 1}),
        ("/scope/setups/a", SETUP | {"maths": SETUP["maths"] * 17}),
    ],
)
def test_setups_refused(station: Station, path: str, body: dict[str, Any]) -> None:
    assert station.http.put(path, json=body).status_code in (404, 405, 409, 422)
    assert station.ok(station.http.get("/scope/setups")) == []


def test_snapshots_come_back_byte_for_byte(station: Station) -> None:
    http = station.http
    data = snapshot()
    names = [station.ok(http.post("/scope/snapshots/Step", content=data))["name"] for _ in "ab"]
    assert names == ["Step.sdsnap", "Step 2.sdsnap"], "none takes another's place"
    assert http.get("/scope/snapshots/Step.sdsnap").content == data
    listed = station.ok(http.get("/scope/snapshots"))
    assert {row["name"] for row in listed} == set(names)
    assert listed[0]["header"]["notes"] == "belt loose"
    assert listed[0]["header"]["setup"] == SETUP
    (station.folder / "state/scope/snapshots/Step.sdsnap").write_bytes(data[:-1])
    listed = station.ok(http.get("/scope/snapshots"))
    assert {row["name"] for row in listed if row["header"] is None} == {"Step.sdsnap"}
    for name in names:
        assert http.delete(f"/scope/snapshots/{name}").status_code == 204
    assert http.get("/scope/snapshots/Step.sdsnap").status_code == 404


@pytest.mark.parametrize(
    "data",
    [
        b"", b"SDSNAP1\n", b"SDSNAP1\n\xff\xff\xff\xff{}", snapshot()[:-1], snapshot() + b"\0",
        b"X" + snapshot()[1:], snapshot(rows=-1), snapshot(traces=[{"rows": 5}]),
        snapshot(setup={"x": 1}),
    ],
)  # fmt: skip
def test_snapshots_refused(station: Station, data: bytes) -> None:
    answer = station.http.post("/scope/snapshots/bad", content=data)
    assert answer.status_code == 409, answer.text
    assert answer.json()["title"] == "Not a usable snapshot"
    assert station.ok(station.http.get("/scope/snapshots")) == []


def test_snapshots_have_a_largest_size(station: Station, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(routes_scope, "MAX_SNAPSHOT_BYTES", 1000)
    answer = station.http.post("/scope/snapshots/big", content=snapshot(rows=100))
    assert answer.status_code == 422
    assert "too large" in answer.json()["detail"]
