"""A short soak: 16 channels of four axes at 4 kHz to the disk and to two pages, one asleep.

The long one with real browsers is ``python -m benchmarks.scope_soak``. The segment takes its time
from the process data, so that a busy computer takes longer instead of leaving cycles out.
"""

from __future__ import annotations

import itertools
import os
import resource
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import httpx
import numpy as np
import pytest

from backend.api.live import connection as live_connection
from backend.api.live import scope as live_scope
from backend.records.recording.reader import RecordingReader
from backend.station.demo import DemoBench
from drivers.virtual.wires.netns import unavailable
from tests.api.test_scope_streams import heads
from tests.support.station import Live, Station, until

URL = "ethercat://virtual0"
SECONDS = float(os.environ.get("SERVODECK_SHORT_SOAK_S", "10"))
AXES, CYCLE_US = 4, 250
KEYS = ("6064:00", "606C:00", "6077:00", "60F4:00")
#: Blocks of a second of all axes are 0.5 MB; what grows without bound grows by more than this.
MOST_GROWTH_MIB = 60.0


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    if reason := unavailable():
        pytest.skip(f"no private network here: {reason}")
    folder = Path(tmp_path_factory.mktemp("soak"))
    bench = folder / "bench.toml"
    bench.write_text(
        "".join(
            f'[[axis]]\nname = "A{n}"\ndrive = "mms7"\non = "{URL}"\nstation = {n}\n'
            for n in range(1, AXES + 1)
        )
    )
    running = Station(folder, bench)
    running.drives = DemoBench(bench, folder / "wires", folder / "nvm", steady=True)
    running.start()
    yield running
    running.stop()


class Poller(threading.Thread):
    """Asks for an ordinary thing ten times a second, and keeps how long each took."""

    def __init__(self, station: Station) -> None:
        super().__init__(daemon=True)
        self.times_s: list[float] = []
        self.stop = threading.Event()
        self._base = f"{station.url}/api/v1"

    def run(self) -> None:
        with httpx.Client(base_url=self._base, timeout=30) as http:
            while not self.stop.wait(0.1):
                began = time.monotonic()
                http.get("/drives").raise_for_status()
                self.times_s.append(time.monotonic() - began)


def begin(page: Live, axes: list[str]) -> None:
    """A subscription for each axis, as the page makes them."""
    for number, axis in enumerate(axes, 1):
        channels = [{"drive": axis, "key": key} for key in KEYS]
        page.send(type="scope_start", subscription=number, channels=channels)


def unbroken(frames: list[bytes], number: int) -> int:
    """Cycles that came; every one that did not must be counted in the block that follows."""
    blocks = heads(frames, number)
    for before, after in itertools.pairwise(blocks):
        gap = round((after[4] - before[4]) / before[5]) - before[2]
        assert (after[0], after[1]) == (before[0] + 1, gap)
    return sum(block[2] for block in blocks)


@pytest.mark.long
def test_sixteen_channels_at_4_khz(station: Station, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (live_connection, live_scope):
        monkeypatch.setattr(module, "SEND_TIMEOUT_S", 600.0)  # the sleeping one is to wake
    axes = [station.add(n, URL, name=f"A{n}") for n in range(1, AXES + 1)]
    body = {"url": URL, "cycle_us": CYCLE_US}
    until(lambda: station.http.post("/buses/cyclic", json=body).is_success, 60, "it runs")
    recorded = {"name": "soak", "channels": [{"drive": a, "key": k} for a in axes for k in KEYS]}
    poller = Poller(station)
    with station.live() as awake, station.live() as asleep:
        begin(asleep, axes)
        begin(awake, axes)
        station.ok(station.http.post("/recordings", json=recorded))
        poller.start()
        first = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        end = time.monotonic() + SECONDS
        while time.monotonic() < end:
            awake.receive()
        poller.stop.set()
        ended = station.ok(station.http.post("/recordings/soak.sdrec/stop"))
        grown_mib = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - first) / 1024
        for number in range(1, AXES + 1):
            assert unbroken(awake.binary, number) > 1000
        assert sum(h[1] for h in heads(awake.binary)[1:]) == 0, "nobody else's sleep is felt"
        # What waited for the sleeping page comes in order, and then what was lost is reported.
        until(lambda: asleep.receive() and len(heads(asleep.binary)) > 60, 60)
        for number in range(1, AXES + 1):
            unbroken(asleep.binary, number)
    assert ended["state"] == "complete"
    assert ended["lost"] == 0
    with RecordingReader(station.folder / "state/recordings/soak.sdrec") as reader:
        streams: dict[int, list[np.ndarray]] = {}
        for block in reader.blocks():
            streams.setdefault(block.stream, []).append(block.times_s)
    assert len(streams) == AXES
    for parts in streams.values():
        steps = np.diff(np.concatenate(parts))
        assert steps == pytest.approx(CYCLE_US / 1e6, rel=1e-3), "every cycle, once"
    assert grown_mib < MOST_GROWTH_MIB
    # The figure to keep is 50 ms on a computer of its own; here it must not hang.
    assert np.percentile(poller.times_s, 50) < 0.5
