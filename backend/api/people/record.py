"""Recording of actions of people, in the log of the session and in the audit."""

from __future__ import annotations

from typing import Annotated, Literal

from fastapi import Depends

from backend.api.requests.context import TheBench
from backend.foundation.work.journal import Level
from backend.records.audit.facts import Action, Fact
from backend.station.bench import Bench
from drivers.texts.message import Text


class PeopleRecord:
    """Writes to log and audit."""

    def __init__(self, bench: Bench) -> None:
        self._bench = bench

    def note(
        self,
        kind: Literal["login", "account", "invitation", "lease"],
        action: Action,
        line: Text,
        *,
        target: str = "",
        person: str | None = None,
        drive: str | None = None,
        level: Level = "info",
        outcome: Text | None = None,
        old: str | None = None,
        new: str | None = None,
    ) -> None:
        """Record an action: ``line`` is for the log, the other arguments are for the audit."""
        self._bench.journal.add(line, level=level, drive=drive, person=person or "")
        connected = self._bench.connected_drives.get(drive) if drive else None
        axis = connected.drive.name if connected else ""
        fact = Fact(
            kind, action, axis=axis, target=target, old=old, new=new, outcome=outcome, person=person
        )
        self._bench.audit.add(fact)


async def _record_of(bench: TheBench) -> PeopleRecord:
    return PeopleRecord(bench)


TheRecord = Annotated[PeopleRecord, Depends(_record_of)]
