"""Stop latency of a jog over the whole chain, and the scope's polling rate and jitter.

From the page's "released" to the first sample in which the drive's demanded speed falls, read
from the drive's wire by the server's own scope. Aim: below 50 ms at p99 on an idle machine.
"""

from __future__ import annotations

import struct
import tempfile
import time
from pathlib import Path

import numpy as np

from tests.support.station import Live, Station

RUNS = 25
JOG = {"speed": 300.0, "acceleration": 3000.0, "travel_limit": 30.0, "torque_limit": 150.0}


def samples(blocks: list[bytes]) -> tuple[np.ndarray, np.ndarray]:
    """Times [n] in s and the first channel [n] of scope frames."""
    times, values = [], []
    for block in blocks:
        rows, columns = struct.unpack_from("<HH", block, 16)
        times.append(np.frombuffer(block, "<f8", rows, 40))
        data = np.frombuffer(block, "<f4", rows * columns, 40 + 8 * rows)
        values.append(data.reshape(rows, columns)[:, 0])
    return np.concatenate(times), np.concatenate(values)


def jog_once(page: Live, x: str, direction: int) -> tuple[float, list[bytes]]:
    """Jog to speed and release; returns the moment of release and the scope frames."""
    page.binary.clear()
    page.send(type="jog_start", drive=x, direction=direction, **JOG)
    end = time.monotonic() + 1.2
    while time.monotonic() < end:
        page.send(type="jog_renew", drive=x)
        time.sleep(0.02)
    released = time.monotonic()
    page.send(type="jog_stop", drive=x)
    page.wait("jog_ended", drive=x)
    return released, list(page.binary)


def main() -> None:
    """Print the figures."""
    folder = tempfile.TemporaryDirectory()
    station = Station(Path(folder.name))
    station.start()
    try:
        x = station.add(1, name="X")
        with station.live() as page:
            key = "606B:00"
            page.send(type="scope_start", subscription=1, channels=[{"drive": x, "key": key}])
            latencies, spacing = [], []
            for run in range(RUNS):
                released, blocks = jog_once(page, x, 1 if run % 2 else -1)
                times, speed = samples(blocks)
                spacing.append(np.diff(times))
                level = np.abs(speed)
                at_speed = np.median(level[(times > released - 0.3) & (times < released)])
                falling = times[(times > released) & (level < 0.97 * at_speed)]
                latencies.append((falling[0] - released) * 1e3)
        gaps = np.concatenate(spacing) * 1e3
        p50, p99 = np.percentile(latencies, [50, 99])
        print(
            f"jog: release to falling speed demand: p50 {p50:.1f} ms, p99 {p99:.1f} ms "
            f"({RUNS} runs)"
        )
        print(
            f"scope, 1 channel polled while jogging: {1e3 / np.median(gaps):.0f} samples/s, "
            f"spacing p50 {np.percentile(gaps, 50):.2f} ms, p99 {np.percentile(gaps, 99):.2f} ms"
        )
    finally:
        station.stop()
        folder.cleanup()


if __name__ == "__main__":
    main()
