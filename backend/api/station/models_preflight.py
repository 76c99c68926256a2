"""What the routes of the preflight take and give."""

from __future__ import annotations

from datetime import datetime

from pydantic import Field

from backend.api.models import Message
from backend.preflight.findings import Code, Fix
from backend.preflight.verdicts import Grade, Purpose


class PreflightRequest(Message):
    """A measurement. Frames that read one register of all slaves go to ``interface``."""

    interface: str = Field(default="", max_length=15, description="empty: wake-ups alone")
    seconds: float = Field(default=10.0, ge=1.0, le=60.0)


class FixRequest(Message):
    """One change of the computer's settings."""

    fix: Fix
    interface: str = Field(default="", max_length=15)


class PreflightFinding(Message):
    """What hinders, the one whose removal would help most first."""

    code: Code
    effect: str = Field(description="blocks, interrupts or delays")
    delay_us: float
    params: dict[str, str | float]
    what: str
    remedy: str
    fix: Fix | None
    fix_name: str


class PreflightVerdict(Message):
    """Whether a purpose can be served, and the figures it rests on."""

    purpose: Purpose
    grade: Grade
    name: str
    words: str
    missed_bound: float | None = Field(description="share of missed cycles, 95 % upper bound")
    allowed: float | None


class PreflightRun(Message):
    """One measured cycle. ``edges_us`` are the upper ends of the classes; one more lies above."""

    period_us: int
    cycles: int
    missed: int
    fifo: bool
    memory_locked: bool
    edges_us: list[float]
    lateness: list[int]
    lateness_median_us: float
    lateness_999_us: float
    lateness_most_us: float
    round_trip: list[int] | None
    round_trip_median_us: float | None
    round_trip_most_us: float | None
    unanswered: int


class PreflightInfo(Message):
    """The computer now, with the last measurement of this interface."""

    interface: str
    kernel: str
    preemption: str
    cores: int
    findings: list[PreflightFinding]
    verdicts: list[PreflightVerdict]
    runs: list[PreflightRun]
    measured: datetime | None
    changed: list[str] = Field(description="settings that were changed and can be restored")


class PreflightUndone(Message):
    """What was restored, and what somebody had changed since and so was left."""

    restored: list[str]
    left: list[str]
