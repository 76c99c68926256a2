"""Messages of the audit."""

from __future__ import annotations

from datetime import datetime
from typing import Literal

from pydantic import Field

from backend.api.messages.models import Message
from backend.tools.wire_message import MessageInfo

AuditKind = Literal[
    "write", "procedure", "motion", "job", "stop", "lease", "login", "account", "invitation",
    "file", "station", "audit",
]  # fmt: skip
AuditValue = int | float | str | bool | None


class AuditEvent(Message):
    """One entry of the audit."""

    number: int
    time: datetime
    station: str
    person: str
    kind: AuditKind
    action: str
    axis: str
    target: str
    old: AuditValue = Field(description="raw value before, where it was known")
    new: AuditValue = Field(description="raw value read back")
    outcome: str = Field(description="what went wrong; empty for success")
    outcome_message: MessageInfo | None = Field(description="the same as code and facts")
    title_message: MessageInfo | None = Field(description="what a job is called")
    detail: dict[str, AuditValue]
    hash: str


class AuditPage(Message):
    """Entries, newest first. ``next`` is the value of ``before`` for the following page."""

    events: list[AuditEvent]
    next: int | None


class AuditNames(Message):
    """Values that can be chosen in a filter."""

    persons: list[str]
    axes: list[str]
    stations: list[str]
    kinds: list[str]


class AuditStatus(Message):
    """Whether events reach the database."""

    problem: str = Field(description="why they do not; empty while they do")
    problem_message: MessageInfo | None = Field(description="the same as code and facts")
    pending: int = Field(description="events that wait")
    database: str = Field(description="its address, without a password")


class AuditVerdict(Message):
    """Outcome of a check of the whole chain."""

    ok: bool
    entries: int
    head: str = Field(description="number:hash of the last good entry; note it as an anchor")
    broken: int | None = Field(description="number of the first entry that is wrong")
    why: str
    why_message: MessageInfo | None = Field(description="the same as code and facts")
