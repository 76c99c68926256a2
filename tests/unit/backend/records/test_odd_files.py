"""Files in the state folder that servodeck did not write itself: one does not hide the others."""

from __future__ import annotations

import io
import json
import os
import zipfile
from collections.abc import Callable
from pathlib import Path

import httpx
import numpy as np
import pytest

from backend.api.app import make_app
from backend.records.recording.chunks import (
    HEADER,
    MAGIC,
    SAMPLES,
    frame,
    json_chunk,
    samples_chunk,
)
from backend.records.recording.library import RecordingLibrary, Retention
from backend.station.bench import Bench
from tests.unit.recording.support import block, header

SET = """format = "servodeck parameter set"
version = 1
[identity]
profile = "mms7"
[about]
saved = 2020-01-01T00:00:00Z
[[parameter]]
key = "6064:00"
raw = 1
[end]
parameters = 1
"""
MEASURED = {"version": 1, "kind": "sweep", "saved": "2020-01-01T00:00:00+00:00", "drive": "x"}
KINDS = {
    "recordings": ".sdrec",
    "measurements": ".sdmeas",
    "sets": ".sdset",
    "reports": ".html",
}


def _recording(**changed: object) -> bytes:
    return MAGIC + json_chunk(HEADER, header() | changed) + samples_chunk(0, block(0))


def _measurement(**changed: object) -> bytes:
    out, part = io.BytesIO(), io.BytesIO()
    np.save(part, np.frombuffer(json.dumps(MEASURED | changed).encode(), np.uint8))
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr("meta.npy", part.getvalue())
    return out.getvalue()


def _set(saved: str = "2020-01-01T00:00:00Z", version: str = "1") -> bytes:
    text = SET.replace("2020-01-01T00:00:00Z", saved).replace("version = 1", f"version = {version}")
    return text.encode()


GOOD: dict[str, Callable[[], bytes]] = {
    "recordings": _recording,
    "measurements": _measurement,
    "sets": _set,
    "reports": lambda: b"<!doctype html>",
}
CONTENTS = {
    "recordings": {
        "far": _recording(clock={"sample_s": 0.0, "epoch_s": 1e20}),
        "no time": _recording(clock={"sample_s": 0.0, "epoch_s": float("nan")}),
        "made": _recording(created=1e300),
        "axis": _recording(axes=[1]),
        "part of an axis": _recording(axes=[{"drive": "x"}]),
        "tags": _recording(tags=1),
        "half": MAGIC + frame(HEADER, json.dumps(header(notes="\ud800")).encode()),
        "short": MAGIC + json_chunk(HEADER, header()) + frame(SAMPLES, bytes(4)),
        "other": MAGIC + json_chunk(HEADER, header()) + frame(SAMPLES, b"\1" * 50),
    },
    "measurements": {
        "early": _measurement(saved="0001-01-01T00:00:00+05:00"),
        "plain": _measurement(saved="0001-01-01T00:00:00"),
        "late": _measurement(saved="9999-12-31T23:59:59-05:00"),
        "half": _measurement(person="\ud800"),
    },
    "sets": {
        "early": _set(saved="0001-01-01T00:00:00+05:00"),
        "plain": _set(saved="0001-01-01T00:00:00"),
        "list": _set(version="[1]"),
        "date": _set(version="2020-01-01"),
    },
    "reports": {},
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for kind, suffix in KINDS.items():
        place = tmp_path / kind
        place.mkdir()
        (place / f"good{suffix}").write_bytes(GOOD[kind]())
    return tmp_path


async def _named(folder: Path) -> dict[str, set[str]]:
    """Names that each list of the server has."""
    bench = Bench(folder)
    app = make_app(bench, hosts=frozenset({"localhost"}))
    wire = httpx.ASGITransport(app)
    found: dict[str, set[str]] = {}
    async with (
        app.router.lifespan_context(app),
        httpx.AsyncClient(transport=wire, base_url="http://localhost/api/v1") as client,
    ):
        for kind in (*KINDS, "library"):
            answer = await client.get(f"/{kind}")
            assert answer.status_code == 200, (kind, answer.text)
            rows = answer.json()
            if kind in ("recordings", "library"):
                rows = rows["recordings" if kind == "recordings" else "entries"]
            found[kind] = {row.get("name") or row["file"] for row in rows}
    return found


@pytest.mark.long
async def test_a_name_that_is_not_one_of_ours_hides_nothing(folder: Path) -> None:
    for kind, suffix in KINDS.items():
        place = folder / kind
        (place / f"copy (1){suffix}").write_bytes(GOOD[kind]())
        (place / os.fsdecode(b"\xff" + suffix.encode())).write_bytes(GOOD[kind]())
        (place / f"folder{suffix}").mkdir()
        (place / f"gone{suffix}").symlink_to("/nonexistent")
    found = await _named(folder)
    for kind, suffix in KINDS.items():
        assert {f"good{suffix}", f"copy (1){suffix}"} <= found[kind]
        assert f"good{suffix}" in found["library"]


async def test_odd_contents_hide_nothing(folder: Path) -> None:
    for kind, files in CONTENTS.items():
        for name, data in files.items():
            (folder / kind / f"{name}{KINDS[kind]}").write_bytes(data)
    found = await _named(folder)
    for kind, files in CONTENTS.items():
        assert found[kind] >= {f"{name}{KINDS[kind]}" for name in ("good", *files)}
        assert f"good{KINDS[kind]}" in found["library"]


def test_a_foreign_file_does_not_keep_old_recordings_from_being_deleted(folder: Path) -> None:
    place = folder / "recordings"
    (place / "copy (1).sdrec").write_bytes(_recording())
    library = RecordingLibrary(place)
    library.set_retention(Retention(max_total_bytes=0))
    assert library.prune() == ["good.sdrec"]
    assert [each.name for each in library.entries()] == ["copy (1).sdrec"]
