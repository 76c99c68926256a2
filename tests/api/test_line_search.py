"""Baud rate and parity are found through the interface, and never on a line in use."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from drivers.virtual.firmware.factory import make_device
from drivers.virtual.wires.modbus import ModbusSlave, TableRegisters
from drivers.virtual.wires.pty import PtyWire
from tests.support.station import Station


@pytest.fixture(scope="module")
def quiet_line(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A DS_C that hears nothing but 19200 baud."""
    path = Path(tmp_path_factory.mktemp("line")) / "tty"
    device = make_device("ds_c")
    slave = ModbusSlave(
        PtyWire(path),
        {1: (device, TableRegisters(device))},
        lock=threading.RLock(),
        client_baudrate=19_200,
    )
    slave.start()
    yield path
    slave.stop()


@pytest.mark.long
def test_the_rate_is_found_and_the_drive_connects(station: Station, quiet_line: Path) -> None:
    url = f"modbus://{quiet_line}?timeout_ms=200"
    # Opened at a wrong rate before: the search closes a bus that nobody uses.
    wrong = station.done(station.http.post("/scan", json={"url": url, "stations": [1]}))
    assert wrong["found"] == []
    result = station.done(station.http.post("/search-line", json={"url": url}))
    assert "baudrate=19200" in result["url"]
    assert [drive["station"] for drive in result["found"]] == [1]
    assert "ds_c" in {match["profile"] for match in result["found"][0]["matches"]}
    drive = station.add(1, result["url"], "ds_c", "Q")
    try:
        busy = station.job(station.http.post("/search-line", json={"url": url}))
        assert busy["state"] == "failed"
        assert "used by Q" in busy["problem"]["detail"]
    finally:
        station.ok(station.http.delete(f"/drives/{drive}"))


def test_nothing_there_is_a_result(station: Station, quiet_line: Path) -> None:
    body = {"url": f"modbus://{quiet_line}?timeout_ms=1", "stations": [9]}
    result = station.done(station.http.post("/search-line", json=body))
    assert result == {"url": None, "found": []}


def test_it_can_be_cancelled(station: Station, quiet_line: Path) -> None:
    body = {"url": f"modbus://{quiet_line}?timeout_ms=500", "stations": list(range(20, 36))}
    job = station.ok(station.http.post("/search-line", json=body))
    ended = station.ok(station.http.delete(f"/jobs/{job['id']}"))
    assert ended["state"] == "cancelled"


def test_wires_without_a_rate_are_refused(station: Station) -> None:
    for url in ("modbus://virtual0", "canopen://virtual0", "ethercat://eth0"):
        job = station.job(station.http.post("/search-line", json={"url": url}))
        assert job["state"] == "failed"
        assert "no baud rate" in job["problem"]["detail"]
