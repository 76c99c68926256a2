"""Rounds and baselines in the database, of either kind."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from sqlalchemy import update

from backend.foundation.store.database import Store
from backend.foundation.store.health_tables import HealthBaseline
from backend.records.library.backup.copy import copy_rows
from backend.tools.watching.health.result import HealthRound, HealthValue
from backend.tools.watching.health.settings import HealthSettings
from backend.tools.watching.trend.records import AxisOf, HealthRecords
from benchmarks.health_trend import fill
from drivers.errors import NotAllowed

X = AxisOf("2e1-30-7", "X", "mms7", 0x2E1, 0x30, None, 7)
Y = AxisOf("2e1-30-8", "Y", "mms7", 0x2E1, 0x30, None, 8)
SETTINGS = HealthSettings(travel_limit=2, speed_limit=900, torque_limit=80)
T0 = datetime(2026, 1, 5, 8, tzinfo=UTC)


def rounds(*friction: float) -> list[HealthRound]:
    return [HealthRound(values=(HealthValue(quantity="friction", value=f),)) for f in friction]


@pytest.fixture
def records(store: Store) -> HealthRecords:
    return HealthRecords(store, "hall 3")


def signed(records: HealthRecords) -> list[int]:
    runs = records.add(X, SETTINGS, rounds(9.9, 10.0, 10.1), {"a.sdmeas": "ab"}, "Ann", T0)
    records.sign(X.key, runs, "Ann", "new belt")
    return runs


def test_a_baseline_says_who_when_what_and_from_which_measurements(records: HealthRecords) -> None:
    runs = signed(records)
    found = records.condition(X).baseline
    assert found is not None
    assert (found.person, found.notes, found.runs) == ("Ann", "new belt", tuple(runs))
    assert found.axis == X
    assert found.measurements == ("a.sdmeas",)
    assert found.intact
    assert len(found.sha256) == 64
    assert abs(found.signed - datetime.now(UTC)) < timedelta(minutes=1)


def test_the_newest_checks_are_compared_on_every_station(
    records: HealthRecords, store: Store
) -> None:
    signed(records)
    assert {each.code for each in records.condition(X).findings} == {"no_check"}
    elsewhere = HealthRecords(store, "hall 4")
    elsewhere.add(X, SETTINGS, rounds(12.1, 12.0), {}, "Ben", T0 + timedelta(days=90))
    (found,) = records.condition(X).findings
    assert (found.code, found.direction) == ("changed", "higher")
    assert [row.station for row in records.condition(X).rows] == ["hall 3"] * 3 + ["hall 4"] * 2
    later = T0 + timedelta(days=91)
    records.add(X, SETTINGS, rounds(10.0, 10.05), {}, "Ben", later)
    (found,) = records.condition(X).findings
    assert found.code == "same", "the two newest count"


def test_other_settings_are_not_compared_and_counted(records: HealthRecords) -> None:
    signed(records)
    other = SETTINGS.model_copy(update={"slowest_rpm": 60.0})
    records.add(X, other, rounds(20.0, 20.0), {}, "Ben", T0 + timedelta(days=1))
    found = records.condition(X)
    assert found.other_settings == 2
    assert {each.code for each in found.findings} == {"no_check"}
    often = SETTINGS.model_copy(update={"rounds": 5, "consent": True})
    records.add(X, often, rounds(10.0, 10.0), {}, "Ben", T0 + timedelta(days=2))
    assert records.condition(X).checks == 2


def test_what_is_no_baseline(records: HealthRecords) -> None:
    runs = records.add(X, SETTINGS, rounds(10, 10), {}, "Ann", T0)
    of_y = records.add(Y, SETTINGS, rounds(10, 10, 10), {}, "Ann", T0)
    other = SETTINGS.model_copy(update={"speeds": 6})
    differing = records.add(X, other, rounds(10), {}, "Ann", T0)

    def code(*chosen: int, person: str = "Ann") -> str:
        with pytest.raises(NotAllowed) as refused:
            records.sign(X.key, chosen, person)
        return refused.value.text.code

    assert code(*runs) == "health.baseline-few-runs"
    assert code(*runs, of_y[0]) == "health.run-not-of-axis"
    assert code(*runs, *differing) == "health.baseline-different-settings"
    assert code(*runs, person="  ") == "health.baseline-needs-name"
    assert records.condition(X).baseline is None


def test_a_baseline_that_was_changed_afterwards_compares_nothing(
    records: HealthRecords, store: Store
) -> None:
    signed(records)
    records.add(X, SETTINGS, rounds(12.0, 12.0), {}, "Ben", T0 + timedelta(days=1))
    with store.writing() as session:
        session.execute(update(HealthBaseline).values(person="Eve"))
    found = records.condition(X)
    assert found.baseline is not None
    assert not found.baseline.intact
    assert not found.findings


def test_a_new_baseline_takes_the_place_of_the_old_one(records: HealthRecords) -> None:
    signed(records)
    again = records.add(X, SETTINGS, rounds(12, 12, 12), {}, "Ben", T0 + timedelta(days=1))
    records.sign(X.key, again, "Ben")
    records.add(X, SETTINGS, rounds(12, 12), {}, "Ben", T0 + timedelta(days=2))
    found = records.condition(X)
    assert found.baseline is not None
    assert found.baseline.person == "Ben"
    assert {each.code for each in found.findings} == {"same"}


def test_the_trend_has_every_axis(records: HealthRecords) -> None:
    signed(records)
    records.add(Y, SETTINGS, rounds(5.0), {}, "Ann", T0)
    assert [each.axis.name for each in records.trend()] == ["X", "Y"]
    assert [each.axis.name for each in records.trend(name="Y")] == ["Y"]
    late = records.trend(since=T0 + timedelta(days=1))
    assert [len(each.rows) for each in late] == [0, 0]
    assert late[0].baseline is not None


def test_condition_goes_with_the_library_to_another_database(
    records: HealthRecords, store: Store, tmp_path: Path, make_store: Callable[[], Store]
) -> None:
    signed(records)
    target = Store(tmp_path / "other")
    copy_rows(store, target)
    moved = HealthRecords(target, "hall 3")
    found = moved.condition(X)
    assert found.baseline is not None
    assert found.baseline.intact
    assert moved.add(Y, SETTINGS, rounds(5.0), {}, "Ann", T0)
    target.close()


def test_the_benchmark_of_the_trend_runs(store: Store) -> None:
    """A smoke test; the figures are printed by ``python -m benchmarks.health_trend``."""
    fill(store, axes=3, runs=12)
    found = HealthRecords(store, "bench").trend()
    assert [len(each.rows) for each in found] == [4, 4, 4]
    assert all(each.baseline is not None and each.baseline.intact for each in found)
    assert all(each.findings for each in found)
