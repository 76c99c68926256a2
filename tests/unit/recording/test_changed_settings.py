"""What counts as a setting that became another one."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from backend.station.recording.changed_settings import ChangedSettings

GAIN, SPEED, TARGET, MODE = "2002:01", "606C:00", "607A:00", "6060:00"
_PARAMETERS = {
    GAIN: SimpleNamespace(name="Gain", unit="1/s", access="rw"),
    SPEED: SimpleNamespace(name="Speed", unit="rpm", access="ro"),
    TARGET: SimpleNamespace(name="Target position", unit="inc", access="rw"),
    MODE: SimpleNamespace(name="Mode", unit="", access="rw"),
}


def reading(key: str, raw: int | None) -> Any:
    return SimpleNamespace(key=key, raw=raw, value=raw)


def bench_with(**known: int) -> Any:
    drive = SimpleNamespace(
        name="X",
        readings={GAIN: reading(GAIN, known["gain"])} if known else {},
        key={"position_target": TARGET, "mode": MODE}.get,
        parameter=_PARAMETERS.__getitem__,
    )
    return SimpleNamespace(connected_drives={"x": SimpleNamespace(drive=drive)})


def among(settings: ChangedSettings, drive: str, readings: list[Any]) -> list[tuple[str, str]]:
    """What changed, in Chinese."""
    return [(key, change.words("zh")) for key, change in settings.among(drive, readings)]


def test_the_first_change_counts_too() -> None:
    settings = ChangedSettings(bench_with(gain=20))
    settings.begin()
    assert among(settings, "x", [reading(GAIN, 20)]) == []
    assert among(settings, "x", [reading(GAIN, 30)]) == [(GAIN, "X：Gain 现为 30 1/s")]
    assert among(settings, "x", [reading(GAIN, 30)]) == []


def test_what_was_never_read_has_not_changed() -> None:
    settings = ChangedSettings(bench_with())
    settings.begin()
    assert among(settings, "x", [reading(GAIN, 30)]) == []
    assert among(settings, "x", [reading(GAIN, None)]) == [], "it could not be read"
    assert among(settings, "x", [reading(GAIN, 31)]) == [(GAIN, "X：Gain 现为 31 1/s")]
    settings.forget()
    assert among(settings, "x", [reading(GAIN, 40)]) == []


def test_commands_and_measured_values_are_no_settings() -> None:
    settings = ChangedSettings(bench_with())
    settings.among("x", [reading(SPEED, 1), reading(TARGET, 1), reading(MODE, 1)])
    changed = among(settings, "x", [reading(SPEED, 2), reading(TARGET, 2), reading(MODE, 8)])
    assert changed == [(MODE, "X：Mode 现为 8")]
    assert among(settings, "gone", [reading(GAIN, 1)]) == []
