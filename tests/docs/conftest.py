"""The demo's bench with a server, for everything that the documentation names."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.station import Station

ROOT = Path(__file__).resolve().parents[2]
STANDARD_BENCH = ROOT / "drivers" / "virtual" / "standard_bench.toml"


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    """The drives of `servodeck demo` that the pages use.

    The segment follows the frames, however late they come.
    """
    folder = Path(tmp_path_factory.mktemp("walks"))
    head, *axes = STANDARD_BENCH.read_text("utf-8").split("[[axis]]")
    used = [axis for axis in axes if 'drive = "mms7"' in axis or 'drive = "ds_c"' in axis]
    assert len(used) == 5
    bench = folder / "bench.toml"
    bench.write_text("[[axis]]".join([head, *used]), "utf-8")
    running = Station(folder, bench, segment_options=["--lockstep"], steady=True)
    running.start()
    yield running
    running.stop()


@pytest.fixture
def folder(station: Station) -> Path:
    """Where the commands of a module are called; they use the files of one another."""
    made = station.folder / "work"
    made.mkdir(exist_ok=True)
    return made
