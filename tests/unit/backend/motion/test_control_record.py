"""The log states who gave or kept control of an axis, and only what happened."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

from backend.api.live.control import PeopleControl
from backend.api.live.people_messages import LeaseAnswer, LeaseAsk
from backend.foundation.people.identity import LOCAL, Identity
from backend.foundation.people.lease import ANSWER_WITHIN_S, Leases
from backend.foundation.work.journal import Journal
from backend.records.audit.facts import Fact
from drivers.texts.message import Text


class _Page:
    def __init__(self, name: str) -> None:
        self.id = name
        self.identity: Identity = replace(LOCAL, person=name)
        self.released: list[str | None] = []

    def send(self, message: object) -> None: ...

    def release(self, drive: str | None, reason: Text) -> None:
        del reason
        self.released.append(drive)


async def test_only_the_holder_answers_a_request_for_control() -> None:
    now = 0.0
    facts: list[Fact] = []
    bench: Any = SimpleNamespace(
        leases=Leases(ticks=lambda: now),
        connected=lambda _drive: None,
        connected_drives={},
        journal=Journal(),
        audit=SimpleNamespace(add=facts.append),
    )
    anna, ben, cara = pages = [_Page(name) for name in ("anna", "ben", "cara")]
    control = PeopleControl(bench, SimpleNamespace(), {page.id: page for page in pages})  # type: ignore[arg-type]

    async def act(page: Any, request: LeaseAsk | LeaseAnswer) -> list[tuple[str, str | None]]:
        facts.clear()
        await control.act(page, page.identity, request)
        return [(fact.action, fact.person) for fact in facts]

    bench.leases.take("x", "anna", "anna")
    assert await act(ben, LeaseAsk(drive="x")) == [("asks", "ben")]
    for give in (True, False):
        assert await act(cara, LeaseAnswer(drive="x", give=give)) == []
    assert cara.released == []
    assert await act(anna, LeaseAnswer(drive="x", give=False)) == [("keeps", "anna")]
    assert await act(anna, LeaseAnswer(drive="x", give=False)) == []
    assert await act(ben, LeaseAsk(drive="x")) == [("asks", "ben")]
    now = ANSWER_WITHIN_S
    bench.leases.tick(lambda _drive: False)
    # Control has passed to Ben by itself: an answer that comes now changes nothing.
    for give in (True, False):
        assert await act(anna, LeaseAnswer(drive="x", give=give)) == []
    assert bench.leases.holder("x").person == "ben"
    assert await act(cara, LeaseAsk(drive="x")) == [("asks", "cara")]
    assert await act(ben, LeaseAnswer(drive="x", give=True)) == [("gives", "ben")]
    assert ben.released == ["x"]
    assert bench.leases.holder("x").person == "cara"
