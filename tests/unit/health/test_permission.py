"""When a standing permission is due, what it keeps over restarts, and what ends it."""

from __future__ import annotations

import time as clock
from collections.abc import Iterator
from datetime import UTC, datetime, time, timedelta
from pathlib import Path

import pytest

from backend.foundation.store.files import StorageFailed
from backend.tools.thresholds import trend_permission
from backend.tools.watching.trend.permission import (
    Attempt,
    Permission,
    Permissions,
    due,
    next_due,
    require_term,
)
from drivers.errors import NotAllowed

MONDAY = datetime(2026, 11, 23, tzinfo=UTC)


@pytest.fixture(autouse=True)
def berlin(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The station's clock: UTC+1, in summer UTC+2."""
    monkeypatch.setenv("TZ", "Europe/Berlin")
    clock.tzset()
    yield
    monkeypatch.undo()
    clock.tzset()


def permission(**changed: object) -> Permission:
    known: dict[str, object] = {
        "drive": "x", "axis_key": "k", "person": "Ann", "account": None, "given": MONDAY,
        "until": MONDAY + timedelta(days=365), "baseline": 1, "days": (0, 3), "at": time(2, 30),
        "handled": MONDAY,
    }  # fmt: skip
    return Permission.model_validate({**known, **changed})


def test_due_by_the_stations_clock_once() -> None:
    """02:30 in Berlin is 01:30 UTC in winter."""
    at = MONDAY.replace(hour=1, minute=30)
    assert due(permission(), at - timedelta(seconds=1)) is None
    assert due(permission(), at) == at
    assert due(permission(), at + timedelta(days=2)) == at, "still the newest"
    assert due(permission(handled=at), at + timedelta(days=2)) is None
    thursday = at + timedelta(days=3)
    assert due(permission(handled=at), thursday + timedelta(hours=4)) == thursday
    assert next_due(permission(), at) == thursday
    assert due(permission(days=()), thursday) is None
    assert next_due(permission(days=()), thursday) is None


def test_given_after_todays_time_it_begins_next_time() -> None:
    given = MONDAY.replace(hour=12)
    assert due(permission(handled=given), given + timedelta(hours=1)) is None


def test_a_time_that_the_clock_leaves_out_has_no_run_and_one_that_it_has_twice_has_one() -> None:
    """2026-03-29 02:00 becomes 03:00; 2026-10-25 03:00 becomes 02:00 again."""
    every = tuple(range(7))
    spring = datetime(2026, 3, 29, 12, tzinfo=UTC)
    begun = spring - timedelta(hours=18)
    assert due(permission(days=every, handled=begun), spring) is None
    autumn = datetime(2026, 10, 25, 12, tzinfo=UTC)
    first = datetime(2026, 10, 25, 0, 30, tzinfo=UTC)
    found = permission(days=every, handled=autumn - timedelta(hours=18))
    assert due(found, autumn) == first
    assert due(permission(days=every, handled=first), autumn) is None


def test_nothing_is_due_after_its_end_and_no_term_is_longer_than_a_year() -> None:
    assert next_due(permission(until=MONDAY + timedelta(hours=1)), MONDAY) is None
    require_term(MONDAY, MONDAY + timedelta(days=366))
    for wrong in (MONDAY, MONDAY - timedelta(days=1), MONDAY + timedelta(days=367)):
        with pytest.raises(NotAllowed):
            require_term(MONDAY, wrong)


def test_over_a_restart(tmp_path: Path) -> None:
    file = tmp_path / "permissions.json"
    known = Permissions(file)
    known.put(permission(handled=MONDAY))
    known.change(known.all()[0], lambda p: p.model_copy(update={"handled": MONDAY.replace(hour=5)}))
    running = Attempt(at=MONDAY.replace(hour=1), cause="schedule", outcome="running")
    known.change(known.all()[0], lambda p: p.noted(running))

    again = Permissions(file)
    again.load()
    (found,) = again.all()
    assert found.handled == MONDAY.replace(hour=5)
    assert found.begun == running.at
    assert found.attempts[-1].outcome == "failed", "the power went during it"
    assert found.attempts[-1].why is not None

    gone = again.take_back("x")
    assert gone is not None
    again.change(gone, lambda p: p.noted(running))
    last = Permissions(file)
    last.load()
    assert last.all() == [], "what was taken back does not come back"


def test_a_file_that_cannot_be_read_permits_nothing(tmp_path: Path) -> None:
    file = tmp_path / "permissions.json"
    file.write_text('{"permissions": [{"drive": "x"}]}')
    known = Permissions(file)
    known.load()
    assert known.all() == []


def test_what_cannot_be_stored_does_not_count(tmp_path: Path) -> None:
    (tmp_path / "p").mkdir()
    known = Permissions(tmp_path / "p")
    with pytest.raises(StorageFailed):
        known.put(permission())
    assert known.of("x") is None


def test_the_newest_attempts_are_kept_and_the_pause_outlives_them() -> None:
    found = permission().noted(Attempt(at=MONDAY, cause="trigger", outcome="running"))
    found = found.noted(Attempt(at=MONDAY, cause="trigger", outcome="done"))
    assert [each.outcome for each in found.attempts] == ["done"], "its end takes the beginning's"
    for minute in range(60):
        at = MONDAY + timedelta(minutes=minute)
        found = found.noted(Attempt(at=at, cause="trigger", outcome="not_made"))
    assert len(found.attempts) == trend_permission.KEPT
    assert found.begun == MONDAY
