from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.station import Station


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    """A station shared by the tests of a module; each adds and removes its own drives."""
    running = Station(Path(tmp_path_factory.mktemp("station")))
    running.start()
    yield running
    running.stop()


@pytest.fixture
def x(station: Station) -> Iterator[str]:
    """The drive at station 1 of the serial wire."""
    drive = station.add(1, name="X")
    yield drive
    station.remove(drive)
