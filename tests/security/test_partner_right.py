"""A tool that moves two axes asks for the right to move on both: the path names only one."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from backend.api.tuning import measure
from backend.foundation.people.errors import Forbidden
from backend.foundation.people.rights import Right, Role
from drivers.errors import NotAllowed
from tests.support.guarded import GuardedServer

LIMITS = {
    "travel_limit": 1.0,
    "speed_limit": 300.0,
    "torque_limit": 50.0,
    "time_limit_s": 30.0,
}


def test_the_partner_needs_the_right_too(
    guarded: GuardedServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[object, object]] = []

    def refuse(_people: object, _identity: object, right: Right, drive: str | None) -> None:
        asked.append((right, drive))
        raise Forbidden("people.grant-another-axis", drive=drive)

    partner = SimpleNamespace(drive=SimpleNamespace(id="y"))
    monkeypatch.setattr(measure, "partner_of", lambda *_given: partner)
    monkeypatch.setattr(measure, "require_right", refuse)
    operator = guarded.log_in(Role.OPERATOR)
    answer = operator.ask("POST", "/drives/x/jobs/gantry", json={**LIMITS, "partner": "y"})
    assert answer.status_code == 403, answer.text
    assert asked == [(Right.MEASURE, "y")]
    assert guarded.call(lambda: guarded.bench.jobs.moving("x")) is None


def bench_of(*known: tuple[str, str]) -> tuple[SimpleNamespace, list[SimpleNamespace]]:
    """A bench of drives on one bus by identifier and name, all free."""
    link = object()
    drives = [
        SimpleNamespace(
            drive=SimpleNamespace(id=ident, name=name, ports=[SimpleNamespace(link=link)])
        )
        for ident, name in known
    ]
    free = SimpleNamespace(require=lambda *_given: None, require_idle=lambda *_given: None)
    bench = SimpleNamespace(
        connected_drives={each.drive.id: each for each in drives}, leases=free, motion=free
    )
    return bench, drives


def test_no_axis_is_guessed_where_two_have_the_name_of_the_partner() -> None:
    bench, (left, *_others) = bench_of(("left", "L"), ("right", "R"), ("right-2", "R"))
    with pytest.raises(NotAllowed) as refused:
        measure.partner_of(bench, left, "R", None)  # type: ignore[arg-type]
    assert "right, right-2" in refused.value.message


def test_an_identifier_names_its_drive_whatever_others_are_called() -> None:
    bench, (left, right, _other) = bench_of(("left", "L"), ("r", "R"), ("other", "r"))
    assert measure.partner_of(bench, left, "r", None) is right  # type: ignore[arg-type, comparison-overlap]
