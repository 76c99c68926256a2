"""A search resets every slave: none while firmware is loaded or an EEPROM is written."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from drivers.errors import Busy
from drivers.ethercat.process import roster as watched
from tests.wire.ethercat_host.test_roster import Clock, ask, roster


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    fake = SimpleNamespace(monotonic=clock, monotonic_ns=lambda: 0, sleep=lambda _s: None)
    monkeypatch.setattr(watched, "time", fake)
    return clock


def test_no_search_ends_a_download_of_firmware(clock: Clock) -> None:
    """Another station that was found in part had the segment searched every second."""
    made, wire, _, _ = roster(2)
    assert ask(made, 1)
    made.stations[1].badly_found = True
    made.loading.add(1)
    for _ in range(20):
        clock.now += 0.25
        made.housekeeping(clock.now)
    assert wire.searches == 1
    with pytest.raises(Busy, match="station 1 is being loaded with firmware"):
        made.attach()
    made.loading.clear()
    clock.now += 1.1
    made.housekeeping(clock.now)
    assert wire.searches == 2
