"""Standing by 606Ch and by 6064h; expected values by arithmetic: rpm = Δrev/Δt·60."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from backend.axes.scales.units import AxisUnits
from backend.axes.stopping.speed import Sample, SpeedWatch
from backend.axes.stopping.turning import TurnKind, TurnWatch
from drivers.cia402 import State
from profiles.schema import UnitSpec

COUNTS = 10000
UNITS = AxisUnits(UnitSpec(velocity="rpm"), COUNTS)


def watch(units: AxisUnits | None = UNITS) -> SpeedWatch:
    axis: Any = SimpleNamespace()
    return SpeedWatch(axis, units)


def feed(found: SpeedWatch, rpm: float, reported: int | None, seconds: float = 0.4) -> None:
    for n in range(round(seconds / 0.02) + 1):
        at = 100.0 + n * 0.02
        position = round(rpm / 60.0 * n * 0.02 * COUNTS) + 2**31 - 500
        found.take(
            Sample(at, State.QUICK_STOP_ACTIVE, position - 2**32 * (position > 2**31), reported)
        )


def test_it_stands_where_both_say_so() -> None:
    found = watch()
    feed(found, 0.0, 0)
    assert found.stands()


def test_a_speed_that_is_stuck_at_zero_is_not_believed() -> None:
    found = watch()
    feed(found, 900.0, 0)
    assert not found.stands()
    assert found.speed() == pytest.approx(900.0, rel=0.02)


def test_a_position_that_is_stuck_is_not_believed() -> None:
    found = watch()
    feed(found, 0.0, 300)
    assert not found.stands()
    assert found.speed() == pytest.approx(300.0)


def test_one_moment_of_rest_is_no_standstill() -> None:
    found = watch()
    feed(found, 0.0, 0, seconds=0.12)
    assert not found.stands()


def test_the_position_may_begin_anew() -> None:
    """600 rpm over the end of 32 bits: 10 rev/s, 4 rev in 0.4 s."""
    found = watch()
    feed(found, 600.0, 600)
    assert found.travelled_inc == pytest.approx(4 * COUNTS, rel=0.01)


def test_a_speed_in_rpm_is_not_compared_with_increments_per_second() -> None:
    """300 rpm of an encoder whose resolution is not known: 50 000 inc/s are no 50 000 rpm."""
    found = watch(AxisUnits(UnitSpec(velocity="rpm"), None))
    feed(found, 300.0, 300)
    assert found.turns
    assert found.speed() == pytest.approx(300.0)


# --- turning without a reason ----------------------------------------------------------


def turned(monkeypatch: pytest.MonkeyPatch, allowed: bool, state: State, rpm: float) -> Any:
    """What is reported within one second of polls 50 ms apart."""
    now = [10.0]
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    found = TurnWatch(lambda: allowed)
    last = None
    for n in range(20):
        now[0] = 10.0 + n * 0.05
        position = round(rpm / 60.0 * n * 0.05 * COUNTS)
        last = found.take(UNITS, state, position, round(rpm)) or last
    return last


def test_an_enabled_axis_that_turns_without_a_grant_is_reported(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = turned(monkeypatch, False, State.OPERATION_ENABLED, 120.0)
    assert found is not None
    assert found.kind is TurnKind.WITHOUT_GRANT
    assert found.speed == pytest.approx(120.0, rel=0.1)


def test_a_shaft_that_is_turned_without_power_is_distinguished(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = turned(monkeypatch, False, State.SWITCH_ON_DISABLED, 60.0)
    assert found is not None
    assert found.kind is TurnKind.DISABLED


def test_a_permitted_motion_is_not_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    assert turned(monkeypatch, True, State.OPERATION_ENABLED, 600.0) is None


def test_a_shaft_that_trembles_is_not_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    assert turned(monkeypatch, False, State.OPERATION_ENABLED, 3.0) is None
