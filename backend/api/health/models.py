"""Messages of the axes' condition."""

from __future__ import annotations

from datetime import datetime

from pydantic import BaseModel, Field

from backend.api.models import Message
from backend.health.compare import Code, Direction
from backend.tools.health.result import HealthValue, Quantity
from backend.tools.wire_message import MessageInfo


class HealthFinding(BaseModel):
    """One quantity against the baseline; changes are shares (0.1 is 10 % more).

    ``low`` to ``high`` hold the true change but for the level of the whole comparison (99 %).
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
    """A signed baseline. ``intact``: its contents still have the checksum of the signing."""

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
    """One axis. ``changed`` counts findings that are changes, ``suspected`` those to be repeated.

    ``other_settings`` counts rounds after the baseline that were measured otherwise.
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
    """Which rounds are the baseline, and who signs where nobody is logged in by name."""

    runs: list[int] = Field(min_length=1, max_length=100)
    person: str = Field(default="", max_length=200)
    notes: str = Field(default="", max_length=4000)
