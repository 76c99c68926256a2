"""The demo's bench with a server, for everything that the documentation names."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.station import Station


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    """What `servodeck demo` starts; the segment follows the frames, however late they come."""
    folder = Path(tmp_path_factory.mktemp("walks"))
    running = Station(folder, segment_options=["--lockstep"], steady=True)
    running.start()
    yield running
    running.stop()


@pytest.fixture
def folder(station: Station) -> Path:
    """Where the commands of a module are called; they use the files of one another."""
    made = station.folder / "work"
    made.mkdir(exist_ok=True)
    return made
