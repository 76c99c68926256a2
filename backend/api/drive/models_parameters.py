"""Messages about the parameters of a drive."""

from __future__ import annotations

from datetime import datetime
from typing import Literal

from pydantic import ConfigDict, Field, field_validator

from backend.api.messages.models import Message, Problem, Raw
from backend.tools.wire_message import MessageInfo
from drivers.texts.message import Unsuitable, text


class ParameterInfo(Message):
    """Description of a parameter, as in the profile."""

    key: str
    number: str | None
    name: str
    group: str
    type: str
    access: Literal["ro", "rw", "wo"]
    pdo: str
    unit: str
    scale: float
    offset: float
    min_raw: int | float | None
    max_raw: int | float | None
    default_raw: Raw | None
    enum: dict[int, str]
    bits: dict[str, str]
    effective: str
    settable: str
    motor_individual: bool
    motion: Literal["none", "at_enable", "energises"] = Field(
        description="whether writing it can move the axis: never; only with the power off; or by "
        "itself, so that it is no matter of a parameter table"
    )
    safe_in_motion: bool = Field(description="at_enable, and may be changed with the power on")
    motion_page: Literal["", "motion", "io", "parameters"] = Field(
        description="page on which an object that energises is used; empty for all others"
    )
    motion_how: str = Field(description="what to do there, for an object that energises")
    motion_how_message: MessageInfo | None = Field(default=None, description="of motion_how")
    help: str
    source: str
    also_printed: list[str]
    notes: str
    reachable: bool = Field(description="False when no connected port can carry it")
    unreachable_why: str = ""
    unreachable_why_message: MessageInfo | None = Field(
        default=None, description="of unreachable_why"
    )


class ParameterValue(Message):
    """Last reading of a parameter."""

    key: str
    raw: Raw | None
    value: Raw | None = Field(description="in the parameter's unit")
    time: datetime | None
    error: str = ""
    error_message: MessageInfo | None = Field(default=None, description="of error")
    unused: bool = Field(
        default=False, description="the drive's own count leaves it out: not asked for"
    )
    unsaved: bool = False
    pending: str = Field(
        default="", description="what must happen before it acts: write_settings, reenable …"
    )


class ParameterRow(ParameterInfo):
    """Description and last reading of a parameter."""

    reading: ParameterValue


class ParameterWrite(Message):
    """A new value: exactly one of ``raw`` and ``value``."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    raw: Raw | None = None
    value: Raw | None = None

    @field_validator("raw", "value", mode="before")
    @classmethod
    def _no_truth(cls, given: object) -> object:
        if isinstance(given, bool):
            # It would otherwise become 1 or 0 in the parameter's unit.
            raise Unsuitable(text("input.truth"))
        return given


class MotionSettingWrite(ParameterWrite):
    """A new value of a setting that can start a motion, and the reason for it."""

    reason: str = Field(
        default="", max_length=300, description="why it is set; shown in log and audit"
    )


class ParameterWrites(Message):
    """Several new values, written one after the other; a failure does not stop the rest."""

    values: dict[str, ParameterWrite] = Field(max_length=2000)


class WriteResult(Message):
    """Result of one write, with the value that was read back."""

    key: str
    ok: bool
    reading: ParameterValue
    problem: Problem | None = None


class ReadAllRequest(Message):
    """Read parameters; all readable ones where ``keys`` is None."""

    keys: list[str] | None = None
