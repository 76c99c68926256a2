"""Messages of axis condition."""

from __future__ import annotations

from datetime import datetime, time

from pydantic import BaseModel, Field

from backend.api.messages.models import Message
from backend.tools.watching.health.result import HealthValue, Quantity
from backend.tools.watching.trend.compare import Code, Direction
from backend.tools.watching.trend.permission import Cause, Outcome, Weekday
from backend.tools.wire_message import MessageInfo


class HealthFinding(BaseModel):
    """Comparison of one quantity with the baseline; changes are fractions (0.1 is 10 % more).

    ``low`` to ``high`` is the confidence interval of the true change, at 99 %
    for the whole comparison.
    """

    quantity: Quantity
    number: int
    unit: str
    code: Code
    direction: Direction
    before: float | None
    now: float | None
    change: float | None
    low: float | None
    high: float | None
    looked_for: float | None = Field(description="share that must be found; null: not judged")
    message: MessageInfo
    next_step: MessageInfo | None


class HealthRunInfo(BaseModel):
    """One round of a health check."""

    id: int
    station: str
    taken: datetime
    person: str
    comparable: bool = Field(description="measured with the settings of the baseline")
    measurements: list[str]
    values: list[HealthValue]
    missing: list[Quantity]


class HealthBaselineInfo(BaseModel):
    """A signed baseline. ``intact``: its contents still match the checksum of the signature."""

    id: int
    signed: datetime
    person: str
    notes: str
    sha256: str
    intact: bool
    settings: dict[str, object]
    runs: list[int]
    measurements: list[str]


class AxisHealth(BaseModel):
    """Condition of one axis.

    ``changed`` is the number of changed quantities, ``suspected`` the number of those to be
    measured again, ``other_settings`` the number of rounds after the baseline with other settings.
    """

    key: str
    axis: str
    profile: str
    serial: int | None
    baseline: HealthBaselineInfo | None
    findings: list[HealthFinding]
    changed: int
    suspected: int
    other_settings: int
    runs: list[HealthRunInfo] = Field(description="oldest first")


class BaselineRequest(Message):
    """Rounds that form the baseline, and who signs it where nobody is logged in by name."""

    runs: list[int] = Field(min_length=1, max_length=100)
    person: str = Field(default="", max_length=200)
    notes: str = Field(default="", max_length=4000)


class HealthAttempt(BaseModel):
    """One attempted run, scheduled or triggered; lists are newest first."""

    at: datetime
    cause: Cause
    outcome: Outcome = Field(
        description="not_made: something was in the way, nothing moved; missed: servodeck did not "
        "run, or was busy, at the time"
    )
    why: MessageInfo | None
    remedy: MessageInfo | None


class HealthPermissionInfo(BaseModel):
    """Standing permission of an axis' health check. ``ended`` is why it is no longer valid."""

    person: str
    given: datetime
    until: datetime
    ended: MessageInfo | None
    baseline: int
    days: list[Weekday] = Field(description="0 is Monday; empty: no schedule")
    at: time = Field(description="by the station's clock")
    next_due: datetime | None
    trigger: bool = Field(description="a controller may ask for a run")
    pause_min: float = Field(description="least time between two runs, in minutes")
    attempts: list[HealthAttempt]


class HealthPermissionRequest(Message):
    """A permission to give. ``person`` is used on stations without accounts."""

    until: datetime = Field(description="its end, within 366 days")
    days: list[Weekday] = Field(default_factory=list, max_length=7)
    at: time = Field(default=time(2, 0), description="by the station's clock, to the minute")
    trigger: bool = False
    pause_min: float = Field(default=60.0, ge=5.0, le=10080.0)
    person: str = Field(default="", max_length=200)
    secured: bool = Field(
        default=False,
        description="the person states that nobody can be in the danger zone at these times, and "
        "that the axis may move within the limits of the baseline",
    )
