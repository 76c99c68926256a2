"""A tool that moves two axes asks for the right to move on both: the path names only one."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

from backend.api.tuning import measure
from backend.people.errors import Forbidden
from backend.people.rights import Right, Role
from tests.support.guarded import GuardedServer

LIMITS = {
    "travel_limit": 1.0, "speed_limit": 300.0, "torque_limit": 50.0, "time_limit_s": 30.0,
}  # fmt: skip


@pytest.fixture
def guarded(tmp_path: Path) -> Iterator[GuardedServer]:
    running = GuardedServer(tmp_path).start()
    running.add_people()
    yield running
    running.stop()


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
