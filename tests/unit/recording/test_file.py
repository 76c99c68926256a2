"""The file: what was written is read back bit by bit, also from a file that was cut anywhere."""

from __future__ import annotations

import contextlib
import errno
import os
import resource
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

import numpy as np
import pytest

from backend.foundation.store.files import StorageFailed
from backend.records.recording import chunks
from backend.records.recording import writer as recording_writer
from backend.records.recording.reader import BadRecording, RecordingReader
from backend.records.recording.writer import RecordingWriter
from drivers.errors import NotAllowed
from drivers.link import ScopeBlock
from tests.unit.recording.support import block, header

ROOT = Path(__file__).resolve().parents[3]


def unexpected(error: StorageFailed) -> None:
    raise AssertionError(error.message)


def wait_for(condition: object, what: str, timeout_s: float = 60) -> None:
    assert callable(condition)
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline, what
        time.sleep(0.005)


def written(path: Path, count: int) -> Path:
    writer = RecordingWriter(path, header(), unexpected)
    for n in range(count):
        writer.put(0, block(n))
    writer.close({"reason": "stopped"})
    return path


def test_every_bit_comes_back(tmp_path: Path) -> None:
    rng = np.random.default_rng(7)
    values = rng.standard_normal((5, 2)) * 10.0 ** rng.integers(-300, 300, (5, 2)).astype(float)
    values[1, 0], values[2, 1], values[3, 0] = np.nan, np.inf, -0.0
    polled = ScopeBlock(
        sequence=9,
        t0_s=100.0,
        dt_s=0.01,
        channels=("a", "b"),
        samples=values,
        dropped=3,
        times_s=np.array([100.0, 100.011, 100.019, 100.5, 100.7]),
        valid=np.array([True, False, True, True, False]),
    )
    writer = RecordingWriter(tmp_path / "a.sdrec", header(), unexpected)
    writer.put(0, block(0))
    writer.put(0, polled)
    writer.event({"kind": "note", "text": "µ 轴"})
    total = writer.close({"reason": "stopped"})
    with RecordingReader(tmp_path / "a.sdrec") as reader:
        first, second = reader.blocks()
        assert reader.events() == [{"kind": "note", "text": "µ 轴"}]
        summary = reader.summary()
    assert first.values.tobytes() == block(0).samples.tobytes()
    assert first.times_s == pytest.approx(100.0 + 0.001 * np.arange(10), abs=0)
    assert second.values.tobytes() == values.tobytes()
    assert polled.times_s is not None
    assert second.times_s.tobytes() == polled.times_s.tobytes()
    assert second.valid is not None
    assert second.valid.tolist() == [True, False, True, True, False]
    assert (summary.state, summary.samples, summary.lost) == ("complete", 15, 3)
    assert (summary.first_s, summary.last_s) == (100.0, 100.7)
    assert total.samples == 15


def test_cut_anywhere_it_holds_every_whole_chunk(tmp_path: Path) -> None:
    whole = written(tmp_path / "whole.sdrec", 3).read_bytes()
    size = len(chunks.samples_chunk(0, block(0)))
    begin = len(chunks.MAGIC) + len(chunks.json_chunk(chunks.HEADER, header()))
    cut = tmp_path / "cut.sdrec"
    for length in range(len(whole)):
        cut.write_bytes(whole[:length])
        if length < begin:
            with pytest.raises(BadRecording):
                RecordingReader(cut)
            continue
        with RecordingReader(cut) as reader:
            blocks = list(reader.blocks())
            summary = reader.summary()
        expected = min(3, (length - begin) // size)
        assert len(blocks) == expected, f"cut at {length}"
        assert summary.state == "interrupted"
        assert summary.samples == 10 * expected
        for n, each in enumerate(blocks):
            assert np.array_equal(each.values, block(n).samples)


def test_a_flipped_bit_is_noticed(tmp_path: Path) -> None:
    path = written(tmp_path / "a.sdrec", 3)
    data = bytearray(path.read_bytes())
    begin = len(chunks.MAGIC) + len(chunks.json_chunk(chunks.HEADER, header()))
    size = len(chunks.samples_chunk(0, block(0)))
    data[begin + size + 40] ^= 0x10  # inside the second block
    path.write_bytes(data)
    with RecordingReader(path) as reader:
        assert len(list(reader.blocks())) == 1, "what cannot be trusted is not shown as good"


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04" + bytes(100), chunks.MAGIC + b"CHNK"])
def test_other_files_are_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.sdrec").write_bytes(content)
    with pytest.raises(BadRecording, match="not a recording"):
        RecordingReader(tmp_path / "a.sdrec")
    with pytest.raises(NotAllowed, match="no recording"):
        RecordingReader(tmp_path / "b.sdrec")


_CHILD = """
import sys, time
from pathlib import Path
from backend.records.recording.writer import RecordingWriter
from tests.unit.recording.support import block, header
writer = RecordingWriter(Path(sys.argv[1]), header(), print)
n = 0
while True:
    writer.put(0, block(n, rows=40, dt_s=0.00025))
    n += 1
    print(n, flush=True)
    time.sleep(0.01)
"""


@pytest.mark.long
def test_killed_process_leaves_all_but_the_last_half_second(tmp_path: Path) -> None:
    path = tmp_path / "a.sdrec"
    child = subprocess.Popen(
        [sys.executable, "-c", _CHILD, str(path)], stdout=subprocess.PIPE, text=True, cwd=ROOT
    )
    assert child.stdout is not None
    try:
        put: list[tuple[float, int]] = []
        while len(put) < 100:
            put.append((time.monotonic(), int(child.stdout.readline())))
    finally:
        child.send_signal(signal.SIGKILL)
        killed = time.monotonic()
        child.wait()
        child.stdout.close()
    due = max(n for t, n in put if t <= killed - 0.5)
    with RecordingReader(path) as reader:
        blocks = list(reader.blocks())
        assert reader.summary().state == "interrupted"
    assert len(blocks) >= due > 20
    for n, each in enumerate(blocks):
        assert np.array_equal(each.values, block(n, rows=40, dt_s=0.00025).samples)


@pytest.fixture
def disk_of_20_kb() -> Iterator[None]:
    """The kernel refuses to write beyond 20 000 bytes, as it does on a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)
    signal.signal(signal.SIGXFSZ, handler)


def test_full_disk_ends_it_with_a_message(tmp_path: Path, disk_of_20_kb: None) -> None:
    failures: list[StorageFailed] = []
    writer = RecordingWriter(tmp_path / "a.sdrec", header(), failures.append)
    n = 0
    deadline = time.monotonic() + 60
    while not failures:
        writer.put(0, block(n))
        n += 1
        assert time.monotonic() < deadline
        time.sleep(0.001)
    assert failures[0].message.startswith("a.sdrec could not be written: File too large")
    assert failures[0].remedy
    wait_for(lambda: not writer._thread.is_alive(), "the thread has ended")
    before = writer.written()
    writer.put(0, block(n))  # nobody is left whom it could wait for
    assert writer.written() == before, "who delivers samples is not disturbed"
    with pytest.raises(StorageFailed):
        writer.close({"reason": "stopped"})
    assert len(failures) == 1
    with RecordingReader(tmp_path / "a.sdrec") as reader:
        blocks = list(reader.blocks())
        state = reader.summary().state
    assert state in ("failed", "interrupted")
    assert len(blocks) >= 50, "what was written before is there"
    for k, each in enumerate(blocks):
        assert np.array_equal(each.values, block(k).samples)


def test_of_a_batch_that_the_disk_took_in_part_the_whole_chunks_count(
    tmp_path: Path, disk_of_20_kb: None
) -> None:
    failures: list[StorageFailed] = []
    writer = RecordingWriter(tmp_path / "a.sdrec", header(), failures.append)
    size = len(chunks.samples_chunk(0, block(0)))
    head = len(chunks.MAGIC) + len(chunks.json_chunk(chunks.HEADER, header()))
    fit = (20_000 - head) // size
    large = replace(block(0), samples=np.zeros((fit * 100, 2)))
    with writer._wake:  # the thread finds all of it at once
        for n in range(fit):
            writer.put(0, block(n))
        writer.put(0, large)
    wait_for(lambda: failures, "the disk is full")
    with RecordingReader(tmp_path / "a.sdrec") as reader:
        assert len(list(reader.blocks())) >= fit - 1, "an end chunk may take the room of the last"


def test_reserve_of_the_disk_is_kept(tmp_path: Path) -> None:
    failures: list[StorageFailed] = []
    left = [10_000_000]
    writer = RecordingWriter(
        tmp_path / "a.sdrec",
        header(),
        failures.append,
        reserve_bytes=1_000_000,
        free=lambda _path: left[0],
    )
    writer.put(0, block(0))
    left[0] = 900_000
    wait_for(lambda: failures, "the guard sees the full disk")
    assert "nearly full" in failures[0].message
    with RecordingReader(tmp_path / "a.sdrec") as reader:
        assert reader.summary().state == "failed", "there was room for the end chunk"
        problem = reader.summary().problem
        assert problem is not None
        assert problem.code == "recording.disk-nearly-full-mib-left"
        assert len(list(reader.blocks())) == 1
    with contextlib.suppress(StorageFailed):
        writer.close({})
    with pytest.raises(StorageFailed, match="nearly full"):
        RecordingWriter(
            tmp_path / "b.sdrec",
            header(),
            failures.append,
            reserve_bytes=1_000_000,
            free=lambda _path: left[0],
        )
    assert not (tmp_path / "b.sdrec").exists()


def test_slow_disk_fails_it_rather_than_dropping(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    failures: list[StorageFailed] = []
    free, stuck = threading.Event(), threading.Event()
    writer = RecordingWriter(
        tmp_path / "a.sdrec", header(), failures.append, max_queued_bytes=10 * (10 * 2 * 8 + 64)
    )

    def hang(_fd: int) -> None:
        stuck.set()
        assert free.wait(60)

    monkeypatch.setattr(os, "fsync", hang)
    assert stuck.wait(60)
    for n in range(10):
        writer.put(0, block(n))
    assert not failures
    writer.put(0, block(10))
    writer.put(0, block(11))
    free.set()
    wait_for(lambda: failures, "it fails")
    assert "is too slow" in failures[0].message
    with pytest.raises(StorageFailed):
        writer.close({})
    with RecordingReader(tmp_path / "a.sdrec") as reader:
        assert [s.sequence for s in reader.blocks()] == list(range(1, 11)), "no gap before the end"
        assert reader.summary().state == "failed"


def test_a_file_has_its_head_from_its_first_moment(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A server that is killed while it begins a recording leaves none that nobody can read."""
    there: list[list[Path]] = []

    def looking(file: BinaryIO, data: bytes) -> None:
        there.append(list(tmp_path.glob("*.sdrec")))
        ordinary(file, data)

    ordinary = recording_writer._write
    monkeypatch.setattr(recording_writer, "_write", looking)
    written(tmp_path / "a.sdrec", 1)
    assert there[0] == []
    assert [path.name for path in tmp_path.iterdir()] == ["a.sdrec"]


@pytest.mark.parametrize("disk", ["ext4", "fat"])
def test_an_existing_file_is_never_overwritten(
    tmp_path: Path, disk: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_paths: Path) -> None:
        raise PermissionError(errno.EPERM, os.strerror(errno.EPERM))

    if disk == "fat":  # which gives no file a second name
        monkeypatch.setattr(os, "link", refused)
    path = written(tmp_path / "a.sdrec", 1)
    before = path.read_bytes()
    with pytest.raises(StorageFailed, match="exists"):
        RecordingWriter(path, header(), unexpected)
    assert path.read_bytes() == before
    assert [each.name for each in tmp_path.iterdir()] == ["a.sdrec"]


@pytest.mark.long
def test_sixteen_channels_at_4_khz_lose_nothing(tmp_path: Path) -> None:
    """Ten seconds of four axes, four times faster than they come; the queue stays small."""
    axes, rows, seconds = 4, 160, 10
    writer = RecordingWriter(tmp_path / "a.sdrec", header(4, axes), unexpected)
    count = 4000 * seconds // rows
    most = 0
    for n in range(count):
        for axis in range(axes):
            writer.put(axis, block(n, rows, 4, 0.00025))
        most = max(most, writer.written().queued_bytes)
        time.sleep(0.01)
    total = writer.close({"reason": "stopped"})
    assert total.samples == 4000 * seconds * axes
    assert most < 8_000_000
    seen = [0] * axes
    with RecordingReader(tmp_path / "a.sdrec") as reader:
        for each in reader.blocks():
            expected = block(seen[each.stream], rows, 4, 0.00025)
            assert np.array_equal(each.values, expected.samples)
            seen[each.stream] += 1
    assert seen == [count] * axes
