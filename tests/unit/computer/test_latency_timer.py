"""The latency timer of FTDI's chips: found in a registry and in sysfs, changed there alone."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from drivers.computer import registry as registry_module
from drivers.computer.registry import REGISTRY
from drivers.computer.serial_ports import latency_timer
from drivers.computer.serial_ports.latency_timer import (
    InForce,
    LatencyTimer,
    LatencyTimers,
    restart_device,
)
from tests.support.registry import ENUM, PARAMETERS, Hive, winreg

SINGLE = r"FTDIBUS\VID_0403+PID_6001+A50285BIA\0000"
OLD = r"FTDIBUS\VID_0403+PID_6001+FTVAHDUOA\0000"
#: A chip without a serial number: Windows makes an instance from its place at the hub.
NO_SERIAL = r"FTDIBUS\VID_0403+PID_6011+5&ECB7860&0&2&1\0000"
FOUR = [rf"FTDIBUS\VID_0403+PID_6011+FTURXHQK{letter}\0000" for letter in "ABCD"]


@pytest.fixture
def hive(monkeypatch: pytest.MonkeyPatch) -> Hive:
    """A computer with Windows 11, and adapters of several makers."""
    hive = Hive()
    hive.port(SINGLE, "COM3", 16)
    for number, instance in enumerate(FOUR):
        hive.port(instance, f"COM{10 + number}", 16 if number else 2)
    hive.port(NO_SERIAL, "COM21")
    # CH340 and CP210x: other drivers, below another key.
    hive.port(r"USB\VID_1A86&PID_7523\5&2B1", "COM5", service="CH341SER_A64")
    hive.port(r"USB\VID_10C4&PID_EA60\0001", "COM6", service="silabser")
    hive.put(rf"{ENUM}\FTDIBUS\VID_0403+PID_6001+BROKENA\0000", DeviceDesc="no parameters")
    monkeypatch.setitem(sys.modules, "winreg", winreg(hive))
    windows = SimpleNamespace(
        platform="win32", getwindowsversion=lambda: SimpleNamespace(build=22631)
    )
    monkeypatch.setattr(latency_timer, "sys", windows)
    monkeypatch.setattr(registry_module, "sys", windows)
    return hive


def timers(restarts: bool = True) -> LatencyTimers:
    return LatencyTimers(restart=lambda _instance: restarts, in_use=lambda _device: False)


@pytest.mark.parametrize(
    ("device", "instance", "ms"),
    [
        ("COM3", SINGLE, 16),
        ("com3", SINGLE, 16),
        (r"\\.\COM10", FOUR[0], 2),
        ("COM13", FOUR[3], 16),
        ("COM21", NO_SERIAL, 16),  # no value: the driver's default
    ],
)
def test_the_timer_of_a_port(hive: Hive, device: str, instance: str, ms: int) -> None:
    timer = timers().of(device)
    assert timer is not None
    assert (timer.instance.upper(), timer.ms) == (instance.upper(), ms)


@pytest.mark.parametrize("device", ["COM1", "COM5", "COM6", "COM100", "NUL", ""])
def test_ports_of_other_chips_have_none(hive: Hive, device: str) -> None:
    assert timers().of(device) is None


@pytest.mark.parametrize("stored", ["COM4\0", "COM4\0\0", "com4"])
def test_a_name_with_its_closing_nul(hive: Hive, stored: str) -> None:
    hive.port(r"FTDIBUS\VID_0403+PID_6015+DN05A7QWA\0000", stored, 16)
    timer = timers().of("COM4")
    assert timer is not None
    assert "DN05A7QWA" in timer.instance.upper()


def test_an_adapter_that_was_unplugged_is_not_taken_for_the_present_one(hive: Hive) -> None:
    """Windows keeps its key, and gives its port name to the next adapter."""
    hive.port(OLD, "COM3", 4, present=False)
    timer = timers().of("COM3")
    assert timer is not None
    assert (timer.instance.upper(), timer.ms) == (SINGLE.upper(), 16)


def test_an_unplugged_adapter_alone_has_no_port(hive: Hive) -> None:
    hive.port(OLD, "COM30", 4, present=False)
    assert timers().of("COM30") is None


def test_with_the_last_adapter_gone_the_list_of_its_driver_vanishes(hive: Hive) -> None:
    hive.port(r"FTDIBUS\VID_0403+PID_6001+X1A\0000", "COM31", service="OTHERSER", present=False)
    assert timers().of("COM31") is None


def test_two_adapters_whose_presence_is_not_stated_are_not_guessed(hive: Hive) -> None:
    hive.port(r"FTDIBUS\VID_0403+PID_6001+X1A\0000", "COM32", 16, service=None)
    assert timers().of("COM32") is not None
    hive.port(r"FTDIBUS\VID_0403+PID_6001+X2A\0000", "COM32", 16, service=None)
    assert timers().of("COM32") is None


def test_what_may_not_be_read_is_no_timer(hive: Hive) -> None:
    hive.unreadable.add(rf"{ENUM}\{SINGLE}\{PARAMETERS}")
    assert timers().of("COM3") is None
    hive.unreadable.add(rf"{ENUM}\FTDIBUS")
    assert timers().of("COM10") is None


def test_a_timer_that_is_no_number_is_not_known(hive: Hive) -> None:
    hive.port(SINGLE, "COM3", "sixteen")
    assert timers().of("COM3") is None


def test_setting_it_writes_one_number_and_restarts_that_port_alone(hive: Hive) -> None:
    restarted: list[str] = []

    def restart(instance: str) -> bool:
        restarted.append(instance.upper())
        return True

    found = LatencyTimers(restart=restart, in_use=lambda _device: False)
    timer = found.of("COM11")
    assert timer is not None
    assert found.set(timer, 1) is InForce.NOW
    assert [(name, number) for _, name, number in hive.written] == [("LatencyTimer", 1)]
    assert restarted == [FOUR[1].upper()]
    after = [found.of(f"COM{10 + number}") for number in range(4)]
    assert [one.ms for one in after if one] == [2, 1, 16, 16]


def test_without_a_restart_it_is_in_force_after_the_adapter_was_plugged_in(hive: Hive) -> None:
    found = timers(restarts=False)
    timer = found.of("COM3")
    assert timer is not None
    assert found.set(timer, 1) is InForce.AFTER_REPLUG


def test_only_an_administrator_sets_it(hive: Hive) -> None:
    hive.administrator = False
    timer = timers().of("COM3")
    assert timer is not None  # reading needs none
    with pytest.raises(PermissionError):
        timers().set(timer, 1)
    assert hive.written == []


@pytest.mark.parametrize("ms", [0, -1, 256, 1 << 32])
def test_what_a_chip_cannot_have_is_not_written(hive: Hive, ms: int) -> None:
    timer = timers().of("COM3")
    assert timer is not None
    with pytest.raises(ValueError, match="ms"):
        timers().set(timer, ms)
    assert hive.written == []


@pytest.mark.parametrize(
    "place",
    [
        r"SOFTWARE\Microsoft\Windows\CurrentVersion\Run",
        rf"{ENUM}\FTDIBUS\VID_0403+PID_6001+A\..\Device Parameters",
        rf"{ENUM}\USB\VID_0403+PID_6001+A\0000\Device Parameters",
        rf"{ENUM}\FTDIBUS\VID_0403+PID_6001+A\0000",
        "sys/bus/usb-serial/devices/../../../etc/shadow",
        "etc/shadow",
        "/sys/bus/usb-serial/devices/ttyUSB0/latency_timer",
    ],
)
def test_no_other_place_is_ever_written(place: str) -> None:
    with pytest.raises(ValueError, match="not the place"):
        LatencyTimer("COM3", 16, place)


@pytest.mark.parametrize(("code", "done"), [(0, True), (5, False), (3010, False), (1, False)])
def test_pnputil_restarts_the_device(
    hive: Hive, monkeypatch: pytest.MonkeyPatch, code: int, done: bool
) -> None:
    calls: list[list[str]] = []

    def run(command: list[str], **options: object) -> object:
        calls.append(command)
        assert options["timeout"]
        return SimpleNamespace(returncode=code)

    fake = SimpleNamespace(
        run=run, CREATE_NO_WINDOW=0x08000000, TimeoutExpired=subprocess.TimeoutExpired
    )
    monkeypatch.setattr(latency_timer, "subprocess", fake)
    monkeypatch.setenv("SYSTEMROOT", r"C:\Windows")
    assert restart_device(SINGLE) is done
    (command,) = calls
    assert command[1:] == ["/restart-device", SINGLE]
    # The system's own program by its full path: this process may be an administrator's.
    assert command[0].startswith(r"C:\Windows")
    assert command[0].endswith("pnputil.exe")


def test_windows_before_version_2004_cannot_restart_it(
    hive: Hive, monkeypatch: pytest.MonkeyPatch
) -> None:
    old = SimpleNamespace(platform="win32", getwindowsversion=lambda: SimpleNamespace(build=18363))
    monkeypatch.setattr(latency_timer, "sys", old)
    monkeypatch.setattr(latency_timer, "subprocess", None)  # nothing is started
    assert restart_device(SINGLE) is False


def test_a_system_without_a_registry() -> None:
    registry = REGISTRY
    assert registry.keys(ENUM) == []
    assert registry.value(ENUM, "Count") is None
    with pytest.raises(OSError, match="no registry"):
        registry.write(ENUM, "LatencyTimer", 1)
    assert LatencyTimers().of("COM3") is None


def test_the_timer_of_linux_is_in_force_at_once(tmp_path: Path) -> None:
    file = tmp_path / "sys/bus/usb-serial/devices/ttyUSB7/latency_timer"
    file.parent.mkdir(parents=True)
    file.write_text("16\n")
    found = LatencyTimers(root=tmp_path, in_use=lambda _device: True)
    timer = found.of("/dev/ttyUSB7")
    assert timer == LatencyTimer("/dev/ttyUSB7", 16, str(file.relative_to(tmp_path)))
    assert timer.instance == ""
    assert found.set(timer, 1) is InForce.NOW
    assert file.read_text() == "1\n"


@pytest.mark.parametrize("content", [None, "", "yes"])
def test_an_adapter_of_linux_without_one(tmp_path: Path, content: str | None) -> None:
    folder = tmp_path / "sys/bus/usb-serial/devices/ttyUSB7"
    folder.mkdir(parents=True)
    if content is not None:
        (folder / "latency_timer").write_text(content)
    found = LatencyTimers(root=tmp_path)
    assert found.of("/dev/ttyUSB7") is None
    assert found.of("/dev/ttyACM0") is None
    assert found.of("/dev/ttyUSB7/../../../etc/passwd") is None


def test_a_file_that_is_gone_is_not_created(tmp_path: Path) -> None:
    place = "sys/bus/usb-serial/devices/ttyUSB7/latency_timer"
    (tmp_path / place).parent.mkdir(parents=True)
    with pytest.raises(FileNotFoundError):
        LatencyTimers(root=tmp_path).set(LatencyTimer("/dev/ttyUSB7", 16, place), 1)
    assert not (tmp_path / place).exists()
