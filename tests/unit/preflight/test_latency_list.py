"""Lowering a latency timer: with what it was on the disk, and nothing half done."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from backend.foundation.preflight.adapters import FILE, Adapters, most_reads
from drivers.computer.serial_ports.latency_timer import InForce, LatencyTimers
from drivers.errors import Busy, NotAllowed, OutOfRange
from tests.support.registry import ENUM, PARAMETERS

INSTANCE = r"FTDIBUS\VID_0403+PID_6001+A50285BIA\0000"
KEY = rf"{ENUM}\{INSTANCE}\{PARAMETERS}"


@dataclass
class OnePort:
    """A registry with COM3 at a chip of FTDI."""

    ms: int = 16
    refused: OSError | None = None
    written: list[int] = field(default_factory=list)
    kept_before_write: list[object] = field(default_factory=list)
    folder: Path | None = None

    def keys(self, key: str) -> list[str]:
        below = {
            rf"{ENUM}\FTDIBUS": ["VID_0403+PID_6001+A50285BIA"],
            rf"{ENUM}\FTDIBUS\VID_0403+PID_6001+A50285BIA": ["0000"],
        }
        return below.get(key, [])

    def value(self, key: str, name: str) -> str | int | None:
        return {(KEY, "PortName"): "COM3", (KEY, "LatencyTimer"): self.ms}.get((key, name))

    def write(self, key: str, name: str, number: int) -> None:
        assert (key, name) == (KEY, "LatencyTimer")
        if self.folder is not None:
            self.kept_before_write.append(json.loads((self.folder / FILE).read_text()))
        if self.refused is not None:
            raise self.refused
        self.ms = number
        self.written.append(number)


def adapters(
    folder: Path, registry: OnePort, *, restarts: bool = True, in_use: bool = False
) -> Adapters:
    timers = LatencyTimers(
        registry=registry, restart=lambda _instance: restarts, in_use=lambda _device: in_use
    )
    return Adapters(folder, timers)


def test_it_is_lowered_and_restored(tmp_path: Path) -> None:
    registry = OnePort(folder=tmp_path)
    ours = adapters(tmp_path, registry)
    assert ours.set("COM3", 1, 61.5) is InForce.NOW
    # The earlier value was on the disk first.
    (kept,) = registry.kept_before_write
    assert [(one["before_ms"], one["after_ms"]) for one in kept] == [(16, 1)]  # type: ignore[attr-defined]
    later = adapters(tmp_path, registry)  # another process
    changed = later.look("COM3").changed
    assert changed is not None
    assert (changed.before_ms, changed.reads_before) == (16, 61.5)
    assert later.restore("COM3") is InForce.NOW
    assert registry.ms == 16
    assert later.look("COM3").changed is None
    with pytest.raises(NotAllowed, match="has not changed"):
        later.restore("COM3")


def test_the_value_before_the_first_change_is_the_one_restored(tmp_path: Path) -> None:
    registry = OnePort()
    ours = adapters(tmp_path, registry)
    ours.set("COM3", 4, 61.5)
    ours.set("COM3", 1, 240.0)
    changed = ours.look("COM3").changed
    assert changed is not None
    assert (changed.before_ms, changed.after_ms, changed.reads_before) == (16, 1, 61.5)
    ours.set("COM3", 16)  # back by hand: nothing is left to restore
    assert ours.look("COM3").changed is None


def test_what_somebody_changed_since_is_left(tmp_path: Path) -> None:
    registry = OnePort()
    ours = adapters(tmp_path, registry)
    ours.set("COM3", 1)
    registry.ms = 8
    assert ours.restore("COM3") is None
    assert registry.ms == 8


def test_without_an_administrator_nothing_is_changed_and_both_ways_are_named(
    tmp_path: Path,
) -> None:
    registry = OnePort(refused=PermissionError(13, "Access is denied"))
    with pytest.raises(NotAllowed) as caught:
        adapters(tmp_path, registry).set("COM3", 1)
    assert caught.value.code == "preflight.latency-denied"
    remedy = caught.value.remedy or ""
    assert "administrator" in remedy
    assert "Device Manager" in remedy
    assert json.loads((tmp_path / FILE).read_text()) == []


def test_an_adapter_that_is_gone_meanwhile(tmp_path: Path) -> None:
    registry = OnePort(refused=FileNotFoundError(2, "The system cannot find the file specified"))
    with pytest.raises(NotAllowed, match="cannot find the file"):
        adapters(tmp_path, registry).set("COM3", 1)


def test_a_port_in_use_is_not_restarted(tmp_path: Path) -> None:
    """A program that moves an axis by it would lose it."""
    registry = OnePort()
    with pytest.raises(Busy, match="COM3 is open in a program"):
        adapters(tmp_path, registry, in_use=True).set("COM3", 1)
    assert registry.written == []
    assert adapters(tmp_path, registry).look("COM3").changed is None


def test_what_is_not_in_force_yet_is_said(tmp_path: Path) -> None:
    assert adapters(tmp_path, OnePort(), restarts=False).set("COM3", 1) is InForce.AFTER_REPLUG


def test_limits_of_the_chip(tmp_path: Path) -> None:
    for ms in (0, 256):
        with pytest.raises(OutOfRange, match="is not a latency timer") as caught:
            adapters(tmp_path, OnePort()).set("COM3", ms)
        assert "1…255 ms" in (caught.value.remedy or "")


def test_an_adapter_without_a_timer(tmp_path: Path) -> None:
    ours = adapters(tmp_path, OnePort())
    assert ours.look("COM4").timer is None
    with pytest.raises(NotAllowed, match="no latency timer is known of the adapter COM4"):
        ours.set("COM4", 1)


@pytest.mark.parametrize(
    "forged",
    [
        {"place": r"SOFTWARE\Microsoft\Windows\CurrentVersion\Run"},
        {"place": "etc/shadow"},
        {"before_ms": 70000},
        {"before_ms": "16"},
        {"more": 1},
    ],
)
def test_a_forged_restore_list_is_refused(tmp_path: Path, forged: dict[str, object]) -> None:
    entry = {"device": "COM3", "place": KEY, "before_ms": 16, "after_ms": 16, "reads_before": None}
    (tmp_path / FILE).write_text(json.dumps([entry | forged]))
    registry = OnePort()
    with pytest.raises(NotAllowed, match="cannot be read"):
        adapters(tmp_path, registry).restore("COM3")
    assert registry.written == []


def test_the_bound_is_one_timer_for_each_read() -> None:
    assert (most_reads(16), most_reads(1)) == (62.5, 1000.0)


def test_root_is_named_where_sysfs_refuses(tmp_path: Path) -> None:
    file = tmp_path / "sys/bus/usb-serial/devices/ttyUSB7/latency_timer"
    file.parent.mkdir(parents=True)
    file.write_text("16\n")

    class Denied(LatencyTimers):
        def set(self, timer: object, ms: int) -> InForce:
            raise PermissionError(13, "Permission denied")

    with pytest.raises(NotAllowed) as caught:
        Adapters(tmp_path / "state", Denied(root=tmp_path)).set("/dev/ttyUSB7", 1)
    place = "/sys/bus/usb-serial/devices/ttyUSB7/latency_timer"
    assert f"echo 1 | sudo tee {place}" in (caught.value.remedy or "")
