"""Recorder throughput next to the disk's own and compared with plain rerun over gRPC, on the same
data.

16 channels of four axes in blocks of 40 ms at 4 kHz, as fast as each takes them. The disk's figure
is one process that writes the same bytes and syncs every half second. rerun's is ``send_columns``
to a server on the loopback (``rerun --serve-web``), one multi-scalar entity for each axis, until
it has taken everything. Disk and recorder take turns, and the median of each counts, since a
disk's rate is not the same twice. Aims: half the disk's rate or more, more than rerun's, and
50 times the 0.51 MB/s that 16 channels × 4 kHz need.

Run it: ``python -m benchmarks.recording``.
"""

from __future__ import annotations

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from backend.records.recording.chunks import samples_chunk
from backend.records.recording.export import export
from backend.records.recording.rerun_assets import free_port
from backend.records.recording.writer import MAX_QUEUED_BYTES, RecordingWriter
from benchmarks._aims import Aim, print_verdict
from drivers.link import ScopeBlock

AXES, CHANNELS, RATE_HZ, BLOCK = 4, 4, 4000, 160
#: Samples in memory, and how often they are written: together long enough for the disk to matter.
SECONDS, ROUNDS = 120, 4
TURNS = 3
NEEDED_MB_S = AXES * CHANNELS * RATE_HZ * 8 / 1e6


def header() -> dict[str, object]:
    """As the recorder writes it."""
    return {
        "format": 1,
        "clock": {"sample_s": 0.0, "epoch_s": 1.7e9},
        "axes": [],
        "streams": [
            {
                "synchronous": True,
                "channels": [
                    {
                        "drive": f"x{a}",
                        "drive_name": f"X{a}",
                        "key": f"60{c:02X}:00",
                        "name": f"X{a} {c}",
                        "unit": "inc",
                    }
                    for c in range(CHANNELS)
                ],
            }
            for a in range(AXES)
        ],
    }


def blocks() -> list[tuple[int, ScopeBlock]]:
    """``SECONDS`` of all axes."""
    rng = np.random.default_rng(1)
    names = tuple(f"60{c:02X}:00" for c in range(CHANNELS))
    valid = np.ones(BLOCK, bool)
    result = []
    for n in range(SECONDS * RATE_HZ // BLOCK):
        t0 = n * BLOCK / RATE_HZ
        for axis in range(AXES):
            values = rng.standard_normal((BLOCK, CHANNELS))
            result.append((axis, ScopeBlock(n, t0, 1 / RATE_HZ, names, values, valid=valid)))
    return result


def timed(label: str, mega: float, work: Callable[[], object]) -> float:
    """Run it, print its rate in MB/s of samples and the CPU that real time would cost."""
    before = resource.getrusage(resource.RUSAGE_SELF)
    began = time.perf_counter()
    work()
    took = time.perf_counter() - began
    after = resource.getrusage(resource.RUSAGE_SELF)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    real_time_s = mega / NEEDED_MB_S
    print(f"{label:<34}{mega / took:>10.1f}{cpu / real_time_s:>18.2%}")
    return mega / took


def disk(path: Path, data: list[tuple[int, ScopeBlock]]) -> None:
    """The same bytes, written plainly."""
    synced = time.monotonic()
    with path.open("wb", buffering=0) as file:
        for axis, block in data * ROUNDS:
            file.write(samples_chunk(axis, block))
            if time.monotonic() - synced > 0.5:
                os.fsync(file.fileno())
                synced = time.monotonic()
        os.fsync(file.fileno())


def recorder(path: Path, data: list[tuple[int, ScopeBlock]]) -> None:
    """Through the recorder, waiting only where its queue is nearly full."""

    def fail(error: Exception) -> None:
        raise error

    writer = RecordingWriter(path, header(), fail, reserve_bytes=0)
    for axis, block in data * ROUNDS:
        while writer.written().queued_bytes > MAX_QUEUED_BYTES // 2:
            time.sleep(0.001)
        writer.put(axis, block)
    total = writer.close({"reason": "done"})
    assert total.samples == SECONDS * RATE_HZ * AXES * ROUNDS


def exported(path: Path, kind: str) -> None:
    """An export as the page asks for it, without the process of its own."""
    export(path, path.with_suffix(f".{kind}"), kind, lambda _fraction: None)


def rerun_grpc(data: list[tuple[int, ScopeBlock]], port: int) -> None:
    """Plain rerun: send_columns over gRPC."""
    import rerun as rr

    stream = rr.RecordingStream("benchmark")
    stream.connect_grpc(f"rerun+http://127.0.0.1:{port}/proxy")
    for axis, block in data * ROUNDS:
        times = np.rint((block.t0_s + block.dt_s * np.arange(BLOCK)) * 1e9).astype("datetime64[ns]")
        rr.send_columns(
            f"x{axis}",
            indexes=[rr.TimeColumn("time", timestamp=times)],
            columns=rr.Scalars.columns(scalars=block.samples),
            recording=stream,
        )
    stream.flush(timeout_sec=120)
    stream.disconnect()


def with_server(work: Callable[[int], object]) -> None:
    """Run with a rerun server on the loopback."""
    spec = find_spec("rerun_cli")
    assert spec is not None
    assert spec.submodule_search_locations
    program = str(Path(spec.submodule_search_locations[0]) / "rerun")
    port = free_port()
    with tempfile.TemporaryDirectory() as home:
        process = subprocess.Popen(
            [program, "--serve-web", "--web-viewer-port", str(free_port()), "--port", str(port),
             "--bind", "127.0.0.1", "--server-memory-limit", "1GB"],
            env=os.environ | {"HOME": home}, cwd=home,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        try:
            time.sleep(3)
            assert process.poll() is None, "rerun's server does not start"
            work(port)
        finally:
            process.kill()
            process.wait()


def main() -> None:
    """Measure and print the table."""
    data = blocks()
    mega = sum(block.samples.nbytes for _, block in data) / 1e6
    whole = mega * ROUNDS
    print(f"{whole:.0f} MB of samples; 16 channels × 4 kHz need {NEEDED_MB_S:.2f} MB/s\n")
    print(f"{'':<34}{'MB/s':>10}{'CPU in real time':>18}")
    with tempfile.TemporaryDirectory(dir=Path.home()) as name:
        folder = Path(name)
        plain, ours = [], []
        for turn in range(TURNS):
            plain.append(
                timed("disk, plain writes", whole, lambda n=turn: disk(folder / f"plain{n}", data))
            )
            (folder / f"plain{turn}").unlink()
            path = folder / f"{turn}.sdrec"
            ours.append(timed("recorder", whole, lambda p=path: recorder(p, data)))
            if turn:
                path.unlink()
        for kind in ("csv", "rrd", "mcap"):
            if kind == "rrd" or "--exports" in sys.argv:
                timed(f"export {kind}", whole, lambda k=kind: exported(folder / "0.sdrec", k))
    rates: list[float] = []
    with_server(
        lambda port: rates.append(
            timed("rerun send_columns over gRPC", whole, lambda: rerun_grpc(data, port))
        )
    )
    share = statistics.median(ours) / statistics.median(plain)
    times = statistics.median(ours) / NEEDED_MB_S
    print()
    print_verdict(
        [
            Aim(f"the recorder takes {share:.0%} of the disk's rate, half or more", share >= 0.5),
            Aim(f"{times:.0f} times what is needed, 50 or more", times >= 50),
            Aim(
                f"{statistics.median(ours):.0f} MB/s beside rerun's {rates[0]:.0f} MB/s",
                statistics.median(ours) > rates[0],
            ),
        ]
    )


if __name__ == "__main__":
    main()
