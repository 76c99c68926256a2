"""``servodeck latency`` on an adapter of Linux: shown, and changed only when asked to."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from backend import cli
from backend.commands.server import latency
from backend.foundation.preflight.adapters import Adapters
from drivers.computer.serial_ports.latency_timer import LatencyTimers
from drivers.texts.message import speaking

DEVICE = "/dev/ttyUSB7"


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    place = tmp_path / "sys/bus/usb-serial/devices/ttyUSB7/latency_timer"
    place.parent.mkdir(parents=True)
    place.write_text("16\n")

    def here(folder: Path) -> Adapters:
        return Adapters(folder, LatencyTimers(root=tmp_path))

    monkeypatch.setattr(latency, "Adapters", here)
    return place


def said(tmp_path: Path, *arguments: str, code: int = 0) -> str:
    config = str(tmp_path / "state")
    done = CliRunner().invoke(cli.app, ["latency", *arguments, "--config", config])
    assert done.exit_code == code, done.output
    return done.output


def test_showing_changes_nothing_and_states_the_gain_as_computed(
    file: Path, tmp_path: Path
) -> None:
    shown = said(tmp_path, DEVICE)
    assert "latency timer 16 ms" in shown
    assert "at most 62 reads per second" in shown
    assert "--set 1: at most 1000 reads per second (computed, not measured)" in shown
    assert file.read_text() == "16\n"


def test_set_and_undo(file: Path, tmp_path: Path) -> None:
    assert "before servodeck changed it: 16 ms" in said(tmp_path, DEVICE, "--set", "1")
    assert file.read_text() == "1\n"
    data = json.loads(said(tmp_path, DEVICE, "--json"))
    assert (data["timer"]["ms"], data["changed"]["before_ms"]) == (1, 16)
    assert "latency timer 16 ms" in said(tmp_path, DEVICE, "--undo")
    assert file.read_text() == "16\n"


def test_an_adapter_of_another_chip(file: Path, tmp_path: Path) -> None:
    assert "only chips of FTDI" in said(tmp_path, "COM3")
    with speaking("zh"):
        assert "只有 FTDI 芯片有" in said(tmp_path, "COM3")
    assert "is not a serial port" in said(tmp_path, "socket://10.0.0.1:1", code=1)
