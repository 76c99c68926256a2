"""Exports, read back with the formats' own libraries, sample by sample."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from backend.foundation.store.files import StorageFailed
from backend.records.recording.export import export
from backend.records.recording.writer import RecordingWriter
from drivers.link import ScopeBlock
from tests.unit.recording.support import block, header

T0_NS = 1_700_000_000_000_000_000
POLLED_S = [100.0005, 100.0102, 100.0199]


def fail(error: StorageFailed) -> None:
    raise AssertionError(error.message)


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """Two axes sampled together, 30 samples each, and a third polled at times of its own."""
    head = header(2, 3)
    head["streams"][2]["synchronous"] = False
    path = tmp_path / "test run.sdrec"
    writer = RecordingWriter(path, head, fail)
    for n in range(3):
        writer.put(0, block(n))
        writer.put(1, block(n))
    polled = np.array([[1.5, np.nan], [-2.25, 0.1], [1e300, -0.0]])
    writer.put(2, ScopeBlock(1, POLLED_S[0], 0.01, ("a", "b"), polled, times_s=np.array(POLLED_S)))
    writer.event({"kind": "parameter", "t_s": 100.01, "text": "X0: gain 20 -> 30"})
    writer.close({"reason": "stopped"})
    return path


def run(source: Path, kind: str) -> Path:
    target = source.with_name("exports") / f"out.{kind}"
    seen: list[float] = []
    export(source, target, kind, seen.append)
    assert seen[-1] == pytest.approx(1.0, abs=0.02)
    assert [p.name for p in target.parent.iterdir()] == [target.name], "no leftovers"
    return target


def expected() -> np.ndarray:
    return np.concatenate([block(n).samples for n in range(3)])


def test_csv(recording: Path) -> None:
    with run(recording, "csv").open(newline="", encoding="utf-8") as file:
        titles, *rows = list(csv.reader(file))
    assert titles[0] == "time_s (0 = 2023-11-14T22:13:20+00:00)"
    assert titles[1:3] == ["X0 signal 0 [inc]", "X0 signal 1 [rpm]"]
    assert titles[7:] == ["X0 valid", "X1 valid"]
    together = [row for row in rows if row[1]]
    assert [float(row[0]) for row in together] == pytest.approx(np.arange(30) * 0.001, abs=1e-9)
    for columns in ((1, 2), (3, 4)):
        values = np.array([[float(row[c]) for c in columns] for row in together])
        assert np.array_equal(values, expected()), "both axes on the same row, exactly"
    alone = [row for row in rows if row[5]]
    assert [float(row[0]) for row in alone] == pytest.approx([0.0005, 0.0102, 0.0199], abs=1e-9)
    assert [row[5] for row in alone] == ["1.5", "-2.25", "1e+300"]
    assert [row[6] for row in alone] == ["nan", "0.1", "-0.0"]
    assert len(rows) == 33
    assert [float(row[0]) for row in rows] == sorted(float(row[0]) for row in rows)


def test_units_of_the_scope_beside_the_drives_own(tmp_path: Path) -> None:
    """60FF in inc/s of a drive with 131072 increments a turn is shown in rpm."""
    head = header(2, 1)
    head["streams"][0]["channels"][1] |= {"shown_unit": "rpm", "shown_factor": 60 / 131072}
    head["streams"][0]["channels"][1]["unit"] = "inc/s"
    path = tmp_path / "a.sdrec"
    writer = RecordingWriter(path, head, fail)
    raw = np.array([[0.1, 131072.0], [np.nan, -65536.0], [2.0, 1.0]])
    writer.put(0, ScopeBlock(1, 100.0, 0.001, ("a", "b"), raw))
    writer.close({"reason": "stopped"})
    read = {}
    for kind in ("csv", "csv_raw"):
        with run(path, kind).open(newline="", encoding="utf-8") as file:
            titles, *rows = list(csv.reader(file))
        run(path, kind).unlink()
        read[kind] = (titles[1:3], [row[1:3] for row in rows])
    assert read["csv"] == (
        ["X0 signal 0 [inc]", "X0 signal 1 [rpm]"],
        [["0.1", "60"], ["nan", "-30"], ["2.0", "0.000457763671875"]],
    )
    assert read["csv_raw"] == (
        ["X0 signal 0 [inc]", "X0 signal 1 [inc/s]"],
        [["0.1", "131072.0"], ["nan", "-65536.0"], ["2.0", "1.0"]],
    )


def test_mcap(recording: Path) -> None:
    from mcap.reader import make_reader

    with run(recording, "mcap").open("rb") as file:
        reader = make_reader(file)
        messages: dict[str, list[tuple[int, dict[str, object]]]] = {}
        for _, channel, message in reader.iter_messages():
            assert channel.message_encoding == "json"
            row = (message.log_time, json.loads(message.data))
            messages.setdefault(channel.topic, []).append(row)
        metadata = {m.name: m.metadata for m in reader.iter_metadata()}
    assert set(messages) == {"/x0/cyclic", "/x1/cyclic", "/x2/polled", "/events"}
    for axis in ("0", "1"):
        rows = messages[f"/x{axis}/cyclic"]
        assert [t for t, _ in rows] == [T0_NS + n * 1_000_000 for n in range(30)]
        names = (f"X{axis} signal 0", f"X{axis} signal 1")
        assert np.array_equal([[row[n] for n in names] for _, row in rows], expected())
    polled = messages["/x2/polled"]
    assert [t - T0_NS for t, _ in polled] == [500_000, 10_200_000, 19_900_000]
    assert [row["X2 signal 0"] for _, row in polled] == [1.5, -2.25, 1e300]
    assert [row["X2 signal 1"] for _, row in polled] == [None, 0.1, -0.0]
    assert messages["/events"][0][1]["text"] == "X0: gain 20 -> 30"
    assert json.loads(metadata["servodeck"]["header"])["format"] == 1


def test_rrd(recording: Path) -> None:
    from rerun.chunk import RrdReader

    reader = RrdReader(run(recording, "rrd"))
    assert [store.recording_id for store in reader.recordings()] == ["test run"]
    assert len(reader.blueprints()) == 1
    seen: dict[str, list[tuple[int, object]]] = {}
    for chunk in reader.stream().to_chunks():
        if "time" not in chunk.timeline_names:
            continue
        batch = chunk.to_record_batch()
        component = next(k for k in batch.schema.names if k.split(":")[-1] in ("scalars", "text"))
        times = batch.column("time").cast("int64").to_pylist()
        rows = list(zip(times, batch.column(component).to_pylist(), strict=True))
        seen.setdefault(chunk.entity_path.strip("/"), []).extend(rows)
    values = expected()
    for axis in ("x0", "x1"):
        for column, unit in ((0, "inc"), (1, "rpm")):
            rows = sorted(seen[f"{axis}/{unit}"], key=lambda row: row[0])
            assert [t for t, _ in rows] == [T0_NS + n * 1_000_000 for n in range(30)]
            assert [cell for _, cell in rows] == [[v] for v in values[:, column]]
    polled = sorted(seen["x2/inc"], key=lambda row: row[0])
    assert [cell for _, cell in polled] == [[1.5], [-2.25], [1e300]]
    assert [t - T0_NS for t, _ in polled] == [500_000, 10_200_000, 19_900_000]
    assert seen["events"] == [(T0_NS + 10_000_000, ["X0: gain 20 -> 30"])]


@pytest.mark.parametrize("kind", ["csv", "rrd", "mcap"])
def test_a_cut_recording_is_exported_as_far_as_it_goes(recording: Path, kind: str) -> None:
    recording.write_bytes(recording.read_bytes()[:-700])
    export(recording, recording.with_name(f"a.{kind}"), kind, lambda _f: None)
    assert recording.with_name(f"a.{kind}").stat().st_size > 100


def test_samples_of_one_stream_with_the_same_time_are_all_kept(tmp_path: Path) -> None:
    """A bus that was late delivers runs whose times overlap."""
    path = tmp_path / "a.sdrec"
    writer = RecordingWriter(path, header(2, 1), fail)
    late = ScopeBlock(9, 100.004, 0.001, ("a", "b"), np.arange(20.0).reshape(10, 2))
    writer.put(0, block(0))
    writer.put(0, late)
    writer.close({"reason": "stopped"})
    with run(path, "csv").open(newline="", encoding="utf-8") as file:
        _, *rows = list(csv.reader(file))
    assert len(rows) == 20
    seen = {(float(row[1]), float(row[2])) for row in rows}
    assert seen == {tuple(r) for r in np.concatenate([block(0).samples, late.samples]).tolist()}
    assert [float(row[0]) for row in rows] == sorted(float(row[0]) for row in rows)


def test_many_samples_at_one_time_are_all_kept(tmp_path: Path) -> None:
    path = tmp_path / "a.sdrec"
    writer = RecordingWriter(path, header(2, 2), fail)
    many = np.arange(80.0).reshape(40, 2)
    writer.put(0, ScopeBlock(1, 100.0, 0.0, ("a", "b"), many))
    writer.put(1, block(0))
    writer.close({"reason": "stopped"})
    with run(path, "csv").open(newline="", encoding="utf-8") as file:
        _, *rows = list(csv.reader(file))
    assert [(float(row[1]), float(row[2])) for row in rows if row[1]] == list(map(tuple, many))
    assert sum(1 for row in rows if row[3]) == 10


def test_a_signal_that_is_polled_slowly(tmp_path: Path) -> None:
    path = tmp_path / "a.sdrec"
    writer = RecordingWriter(path, header(2, 1), fail)
    times = np.array([100.0, 103.5, 107.0])
    values = np.arange(6.0).reshape(3, 2)
    writer.put(0, ScopeBlock(1, 100.0, 3.5, ("a", "b"), values, times_s=times))
    writer.close({"reason": "stopped"})
    with run(path, "csv").open(newline="", encoding="utf-8") as file:
        _, *rows = list(csv.reader(file))
    assert [float(row[0]) for row in rows] == [0.0, 3.5, 7.0]
