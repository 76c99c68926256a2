"""Messages of the routes of the preflight."""

from __future__ import annotations

from datetime import datetime

from pydantic import Field

from backend.api.models import Message
from backend.preflight.findings import Code, Fix
from backend.preflight.verdicts import Grade, Purpose


class PreflightRequest(Message):
    """Settings of a measurement.

    Frames that read one register of all slaves are sent to ``interface``.
    """

    interface: str = Field(default="", max_length=15, description="empty: wake-ups alone")
    seconds: float = Field(default=10.0, ge=1.0, le=60.0)


class FixRequest(Message):
    """One change of the computer's settings."""

    fix: Fix
    interface: str = Field(default="", max_length=15)


class PreflightFinding(Message):
    """An obstacle to punctual cycles; listed in the order of their effect, largest first."""

    code: Code
    effect: str = Field(description="blocks, interrupts or delays")
    delay_us: float
    params: dict[str, str | float]
    what: str
    remedy: str
    fix: Fix | None
    fix_name: str


class PreflightVerdict(Message):
    """Suitability of the computer for a purpose, and the figures that it rests on."""

    purpose: Purpose
    grade: Grade
    name: str
    words: str
    missed_bound: float | None = Field(description="share of missed cycles, 95 % upper bound")
    allowed: float | None


class PreflightRun(Message):
    """Timing measured at one cycle time.

    ``edges_us`` are the upper limits of the classes; one more class is above them.
    """

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
    """State of the computer now, with the last measurement of this interface."""

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
    """Settings that were restored, and those left because somebody has changed them since."""

    restored: list[str]
    left: list[str]
