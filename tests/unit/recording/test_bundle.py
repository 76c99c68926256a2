"""Triggers, retention order and support bundles, from known samples."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import numpy as np
import pytest

from backend.journal import Entry
from backend.recording.bundle import PLOT_HEIGHT, Evidence, Value, build, curve
from backend.recording.reader import RecordingReader
from backend.recording.recorder import Trigger, fires
from tests.unit.recording.support import block, header


@pytest.mark.parametrize(
    ("kind", "level", "mask", "values", "expected"),
    [
        ("rising", 10, None, [9, 10], True),
        ("rising", 10, None, [10, 11], False),  # it was there before
        ("rising", 10, None, [11, 9], False),
        ("rising", 10, None, [0, 50, 0], True),  # inside one block
        ("falling", 10, None, [11, 10], True),
        ("falling", 10, None, [10, 9], False),
        ("change", 0, None, [5, 5, 5], False),
        ("change", 0, None, [5, 6], True),
        ("change", 0, 0x08, [0x0237, 0x0233], False),
        ("change", 0, 0x08, [0x0237, 0x023F], True),  # bit 3 of the status word: fault
        ("rising", 10, None, [50], False),  # nothing before it is known
    ],
)
def test_triggers(
    kind: str, level: float, mask: int | None, values: list[float], expected: bool
) -> None:
    trigger = Trigger(kind, "x", "606C:00", level, mask)  # type: ignore[arg-type]
    assert fires(trigger, np.array(values, dtype=float)) is expected


def test_a_peak_of_one_sample_is_drawn() -> None:
    values = np.zeros(100_000)
    values[31_337] = 5.0
    drawing = curve(np.arange(100_000) / 4000, values, mark_s=10.0)
    points = re.search(r'points="([^"]+)"', drawing)
    assert points
    heights = [float(p.split(",")[1]) for p in points[1].split()]
    assert min(heights) == 4.0, "the peak reaches the top"
    assert max(heights) == PLOT_HEIGHT - 4
    assert heights.count(4.0) == 1
    assert len(heights) < 4000
    assert 'x1="360.0"' in drawing, "10 s of 25 s is at 360 of 900"


def test_bundle_holds_the_samples_as_a_recording(tmp_path: Path) -> None:
    head = header(2, 1)
    axis = {
        "drive": "x0",
        "name": "X0",
        "state": {"state": "Fault", "faults": []},
        "parameters": [
            {"key": "2002:01", "name": "Gain", "unit": "rad/s", "raw": 20, "value": 20,
             "time": 1_700_000_000.0, "error": ""}
        ],
    }  # fmt: skip
    evidence = Evidence(
        reason="X0: 0x3210",
        time=1_700_000_000.015,
        version="1",
        axes=[axis],
        links=[{"drive": "x0", "timeouts": 3}],
        log=[Entry(1_700_000_000.0, "error", "x0", "", "it broke")],
        history=[Value(1_700_000_000.0, "x0", "6041:00", 0x218)],
        streams=head["streams"],
        blocks=[(0, block(n)) for n in range(3)],
        clock=head["clock"],
    )
    build(evidence, tmp_path / "b.zip")
    assert [p.name for p in tmp_path.iterdir()] == ["b.zip"], "no leftovers"
    with zipfile.ZipFile(tmp_path / "b.zip") as archive:
        archive.extract("samples.sdrec", tmp_path)
        page = archive.read("index.html").decode()
        table = archive.read("samples.csv").decode().splitlines()
        assert "it broke" in archive.read("log.txt").decode()
        assert (
            "2023-11-14T22:13:20.000+00:00,x0,6041:00,536" in archive.read("history.csv").decode()
        )
        assert "2002:01,Gain,20" in archive.read("parameters/x0.csv").decode()
    assert page.count("<polyline") == 2
    assert len(table) == 31
    with RecordingReader(tmp_path / "samples.sdrec") as reader:
        for n, each in enumerate(reader.blocks()):
            assert np.array_equal(each.values, block(n).samples)
