"""A search resets every slave: none while firmware is loaded or an EEPROM is written."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from drivers.errors import Busy, LinkLost
from drivers.ethercat.process.operations import Operations
from drivers.ethercat.process.stations import roster as watched
from drivers.ethercat.process.stations.station import Station
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


@pytest.mark.parametrize(
    "request_",
    [
        {"op": "scan", "stations": [1]},
        {"op": "foe", "station": 1},
        {"op": "state", "station": 2, "state": "SAFEOP"},
        {"op": "al_request", "station": 2, "control": 1},
    ],
)
def test_no_station_is_touched_while_an_eeprom_is_written(request_: dict[str, Any]) -> None:
    """A scan of known stations searches nothing, but brings each to PREOP and reads its EEPROM.

    In Safe-Op and Op the processor of a drive may use the EEPROM.
    """
    ring: Any = SimpleNamespace(host_lives_until=lambda *_what: None)
    operations = Operations("eth9", ring, lambda _message: None)
    made = operations.roster
    made.stations, made.attached, made.is_open = [Station(1), Station(2)], True, True
    made.held.add(2)
    with pytest.raises(Busy, match="EEPROM of station 2 is being written"):
        operations.handle(request_ | {"id": 1}, lambda _result, _error: None)
    assert not operations.lanes.pending()


def test_a_search_that_fails_is_repeated_and_does_not_end_the_process(clock: Clock) -> None:
    made, wire, _, events = roster(2)
    assert ask(made, 1)
    made.stations[1].badly_found = True
    find = wire.find

    def other_master() -> int:
        raise LinkLost("ethercat.answers-come-too-late", interface="eth9")

    wire.find = other_master  # type: ignore[method-assign]
    for _ in range(20):
        clock.now += 0.25
        made.housekeeping(clock.now)
    assert events.count("fault") == 1, "it is said once"
    wire.find = find  # type: ignore[method-assign]
    clock.now += 1.1
    made.housekeeping(clock.now)
    assert wire.searches == 2
    assert not made.stations[1].badly_found
