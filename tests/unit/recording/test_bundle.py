"""Triggers, retention order and support bundles, from known samples."""

from __future__ import annotations

import asyncio
import re
import zipfile
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from backend.foundation.work.journal import Entry, Journal
from backend.records.recording.bundle import build_apart
from backend.records.recording.bundle_page import PLOT_HEIGHT, curve
from backend.records.recording.evidence import Evidence, Value
from backend.records.recording.reader import RecordingReader
from backend.station.recording import capture
from backend.station.recording.recorder import Trigger, fires
from drivers.cia402 import State
from drivers.texts.answers import sentence
from drivers.texts.message import profile_text, prose, text
from drivers.texts.profile_words import ProfileWords
from drivers.texts.states import state_text
from profiles.loader import load_profile
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


#: Named by the profile, and so in both languages.
VOLTAGE = load_profile("mms7").parameter("6079:00").name
OVER_VOLTAGE = next(f for f in load_profile("mms7").faults if f.code == "0x3210")


@pytest.mark.long
def test_bundle_holds_the_samples_as_a_recording(tmp_path: Path) -> None:
    head = header(2, 1)
    axis = {
        "drive": "x0",
        "name": "X0",
        "profile": "mms7",
        "state": {
            **sentence("state", state_text(State.FAULT)),
            "fresh": True,
            "status_word": 0x218,
            "values": {"dc_voltage": 310.5, "torque": None},
            "units": {"dc_voltage": "V"},
            "faults": [{"kind": "fault", "code": OVER_VOLTAGE.code, "name": OVER_VOLTAGE.name,
                        "causes": list(OVER_VOLTAGE.causes), "source": OVER_VOLTAGE.source,
                        "remedies": list(OVER_VOLTAGE.remedies)}],
        },
        "past_faults": {"why": "", "records": [
            {"name": "last fault", "code": "Er.002", "title": "Overvoltage", "error": "",
             "values": [{"key": "200A:16", "name": "DC voltage", "unit": "V", "value": 411.2,
                         "error": None}]},
            {"name": "second fault", "code": "", "title": "", "values": [],
             "error": "no answer"},
        ]},
        "parameters": [
            {"key": "2002:01", "name": "Gain", "unit": "rad/s", "raw": 20, "value": 20,
             "time": 1_700_000_000.0, "error": ""}
        ],
    }  # fmt: skip
    reason = text("bundle.fault-of", axis="X0", faults="0x3210")
    evidence = Evidence(
        reason=reason,
        time=1_700_000_000.015,
        version="1",
        axes=[axis],
        links=[{"drive": "x0", "timeouts": 3}],
        log=[
            Entry(1_700_000_000.0, "error", "x0", "", prose("it broke")),
            Entry(1_700_000_000.0, "error", "x0", "", reason),
        ],
        history=[
            Value(1_700_000_000.0, "x0", "6041:00", 0x218),
            *(Value(1_700_000_000.0 + n, "x0", "6079:00", 310.0 + n) for n in range(3)),
            *(Value(1_700_000_000.0 + n, "x0", "2001:00", 7) for n in range(3)),
        ],
        streams=head["streams"],
        blocks=[(0, block(n)) for n in range(3)],
        clock=head["clock"],
        names={
            ("x0", "6079:00"): text(
                "bundle.quantity-unit", axis="X0", name=profile_text("mms7", VOLTAGE), unit="V"
            )
        },
    )
    asyncio.run(build_apart(evidence, tmp_path / "b.zip"))
    assert [p.name for p in tmp_path.iterdir()] == ["b.zip"], "no leftovers"
    with zipfile.ZipFile(tmp_path / "b.zip") as archive:
        archive.extract("samples.sdrec", tmp_path)
        page = archive.read("index.html").decode()
        chinese = archive.read("index.zh.html").decode()
        table = archive.read("samples.csv").decode().splitlines()
        assert "it broke" in archive.read("log.txt").decode()
        assert "X0：0x3210" in archive.read("log.zh.txt").decode()
        assert (
            "2023-11-14T22:13:20.000+00:00,x0,6041:00,536" in archive.read("history.csv").decode()
        )
        assert "2002:01,Gain,20" in archive.read("parameters/x0.csv").decode()
    # Two channels of every cycle, and of what was read one by one that which changed.
    assert page.count("<polyline") == 3
    assert f"<h3>X0 {VOLTAGE} [V]</h3>" in page
    assert "<td>last fault<td>Er.002 Overvoltage<td>DC voltage 411.2 V" in page
    assert "<td>second fault<td> <td>no answer" in page
    assert "310 … 312, 2.000 s" in page
    assert f"Causes: {'; '.join(OVER_VOLTAGE.causes)}" in page
    # The same in Chinese, with the profile's translations.
    words = ProfileWords("mms7", "zh")
    assert "<h1>X0：0x3210</h1>" in chinese
    assert words(VOLTAGE) != VOLTAGE
    assert f"<h3>X0 {words(VOLTAGE)} [V]</h3>" in chinese
    assert f"可能原因：{'；'.join(map(words, OVER_VOLTAGE.causes))}" in chinese
    assert f"处理方法：{'；'.join(map(words, OVER_VOLTAGE.remedies))}" in chinese
    assert "<th>状态<td>故障" in chinese
    assert "<th>数值为最新<td>是" in chinese
    assert "<th>超时<td>3" in chinese
    assert "<th>状态字<td>0x0218" in chinese
    assert "<th>数值<td>母线电压 310.5 V<" in chinese
    assert '<a href="index.html" lang="en">English</a>' in chinese
    for english in ("Causes", "Remedies", "Signals", "Files", "No ", "parameters<", "yes"):
        assert english not in chinese, english
    assert len(table) == 31
    with RecordingReader(tmp_path / "samples.sdrec") as reader:
        for n, each in enumerate(reader.blocks()):
            assert np.array_equal(each.values, block(n).samples)


def test_what_came_long_ago_is_no_evidence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bench: Any = SimpleNamespace(
        journal=Journal(),
        connected_drives={},
        on_snapshot=[],
        on_readings=[],
        on_drives=[],
        buses=SimpleNamespace(opened={}),
    )
    reading: Any = SimpleNamespace(time=1000.0, key="6079:00", value=310.0)
    clock = SimpleNamespace(time=lambda: 1000.5, monotonic=lambda: 50.0)
    monkeypatch.setattr(capture, "time", clock)

    async def play() -> list[int]:
        armed = capture.FaultCapture(bench, tmp_path, lambda _drive, _text: None)
        armed._readings("x", [reading])
        seen = []
        for after_s in (0.0, 11.0, 13.0):
            clock.time = lambda after_s=after_s: 1000.5 + after_s
            seen.append(len((await armed._evidence(prose("why"), 1000.0)).history))
        return seen

    assert asyncio.run(play()) == [1, 1, 0]


def test_what_a_full_disk_does_not_take_is_held_until_it_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    journal = Journal()
    bench: Any = SimpleNamespace(
        journal=journal,
        connected_drives={},
        on_snapshot=[],
        on_readings=[],
        on_drives=[],
        buses=SimpleNamespace(opened={}),
    )
    free, written = [0], "the data held in memory are stored in"
    monkeypatch.setattr(capture, "free_bytes", lambda _folder: free[0])
    monkeypatch.setattr(capture, "AGAIN_S", 0.01)

    async def play() -> None:
        armed = capture.FaultCapture(bench, tmp_path / "bundles", lambda _drive, _text: None)
        await armed._keep(prose("X: 0x3210"), 1_700_000_000.0)
        await armed._keep(prose("X: 0x7300"), 1_700_000_001.0)
        await asyncio.sleep(0.05)
        assert armed.names() == []
        free[0] = 1 << 40
        async with asyncio.timeout(60):
            while not any(written in entry.text for entry in journal.entries()):  # noqa: ASYNC110 - it has no event
                await asyncio.sleep(0.01)
        await armed.close()
        assert armed.names() == ["2023-11-14 22-13-20 X 0x3210.zip"], "the first cause"

    asyncio.run(play())
    reported = [entry.text for entry in journal.entries()]
    assert sum("no support bundle" in text for text in reported) == 2
