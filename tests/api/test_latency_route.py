"""The latency timer of an adapter by the interface: bounds, measured reads, who is in the way."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from backend.api.station import adapters as routes
from backend.foundation.preflight.adapters import Adapters
from drivers.computer.serial_ports.latency_timer import LatencyTimers
from tests.support.station import Station
from tests.unit.preflight.test_latency_list import OnePort

PATH = "/adapters/latency-timer"
COM3 = {"device": "COM3"}


@pytest.fixture
def port(monkeypatch: pytest.MonkeyPatch) -> OnePort:
    registry = OnePort()

    def here(folder: Path) -> Adapters:
        timers = LatencyTimers(
            registry=registry, restart=lambda _one: True, in_use=lambda _one: False
        )
        return Adapters(folder, timers)

    monkeypatch.setattr(routes, "Adapters", here)
    return registry


@pytest.mark.long
def test_bounds_then_measured_figures(station: Station, port: OnePort) -> None:
    before = station.ok(station.http.get(PATH, params=COM3))
    assert (before["ms"], before["reads_at_most"], before["lowered_reads_at_most"]) == (
        16,
        62.5,
        1000,
    )
    assert (before["reads_measured"], before["before_ms"], before["restarts"]) == (None, None, True)
    bench = station.bench
    assert bench is not None
    url = "modbus://COM3?baudrate=115200"
    link = SimpleNamespace(
        quality=lambda _station: SimpleNamespace(round_trip_ms=16.0), url=url, kind="modbus"
    )
    bench.buses.opened[url] = link  # type: ignore[assignment]
    try:
        assert station.ok(station.http.get(PATH, params=COM3))["reads_measured"] == 62.5
        refused = station.http.put(PATH, json=COM3)
        assert refused.status_code == 409
        assert "COM3 is open in a program" in refused.text
        assert port.written == []
    finally:
        del bench.buses.opened[url]
    bench.buses.last_round_trip_ms[url] = 16.0  # as closing the bus leaves it
    lowered = station.ok(station.http.put(PATH, json=COM3))
    assert (lowered["ms"], lowered["in_force"]) == (1, "now")
    assert (lowered["before_ms"], lowered["reads_before"]) == (16, 62.5)
    restored = station.ok(station.http.delete(PATH, params=COM3))
    assert (restored["ms"], restored["in_force"], restored["before_ms"]) == (16, "now", None)


def test_without_an_administrator_it_is_refused_with_the_way(
    station: Station, port: OnePort
) -> None:
    port.refused = PermissionError(13, "Access is denied")
    answer = station.http.put(PATH, json=COM3)
    assert answer.status_code in (403, 409)
    assert "Device Manager" in answer.text


def test_an_adapter_without_a_timer(station: Station, port: OnePort) -> None:
    shown = station.ok(station.http.get(PATH, params={"device": "/dev/ttyACM0"}))
    assert (shown["ms"], shown["reads_at_most"]) == (None, None)


@pytest.mark.parametrize("device", ["socket://10.0.0.1:1", "../etc/passwd", "NUL", ""])
def test_what_is_no_serial_port_is_refused(station: Station, port: OnePort, device: str) -> None:
    assert station.http.get(PATH, params={"device": device}).status_code == 422
    assert station.http.put(PATH, json={"device": device}).status_code == 422
