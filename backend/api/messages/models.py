"""Messages of the HTTP interface: the only source of the OpenAPI document and the page's client."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from backend.tools.results import ToolOutcome
from backend.tools.wire_message import MessageInfo

Raw = int | float | str


class Message(BaseModel):
    """Base class: unknown fields are refused, so that a misspelt limit is an error."""

    model_config = ConfigDict(extra="forbid")


#: Above the range of every axis in any unit, and far below floating-point overflow.
_MOST = 1e12
#: A number entered by a person; NaN is refused, as comparisons with a limit would not detect it.
Finite = Annotated[float, Field(ge=-_MOST, le=_MOST, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=1e-9, le=_MOST, allow_inf_nan=False)]


class Problem(BaseModel):
    """RFC 9457 problem details, with the facts that a person needs to act."""

    type: str = Field(examples=["urn:servodeck:out-of-range"])
    title: str = Field(description="of the type, in English, the same for every occurrence")
    status: int
    detail: str
    drive: str | None = None
    parameter: str | None = None
    value: Raw | None = None
    limit: str | None = None
    limit_message: MessageInfo | None = Field(default=None, description="limit as code and facts")
    remedy: str | None = None
    code: str | None = Field(
        default=None, description="what happened, as a stable code", examples=["canopen.not-open"]
    )
    params: dict[str, str | int | float | MessageInfo | None] = Field(
        default_factory=dict, description="facts of the code, by name; the unit ends the name"
    )
    advice: MessageInfo | None = Field(default=None, description="the remedy as code and facts")
    abort_code: int | None = Field(default=None, description="SDO abort or Modbus exception code")


class PlainResult(BaseModel):
    """Result of a job that is not a tool: a scan, reading all parameters, writing a set."""

    model_config = ConfigDict(extra="allow")


class Cancellation(Message):
    """Why a job was cancelled, and the remedy; sentences are in the language of the request."""

    cause: str
    cause_message: MessageInfo = Field(description="of cause, as code and facts")
    remedy: str | None
    remedy_message: MessageInfo | None = Field(description="of remedy, as code and facts")


class JobInfo(Message):
    """A job: long work that runs in the background."""

    id: str
    kind: str
    drive: str | None
    title: str = Field(description="in the language of the request")
    title_message: MessageInfo
    state: Literal["running", "done", "failed", "cancelled"]
    progress: float = Field(ge=0, le=1)
    step: str = Field(description="in the language of the request")
    step_message: MessageInfo
    started: datetime
    ended: datetime | None
    motion: bool
    result: Annotated[ToolOutcome | PlainResult | None, Field(union_mode="left_to_right")] = Field(
        description="of a tool: its result, which its field tool names"
    )
    problem: Problem | None = Field(description="why it failed")
    cancellation: Cancellation | None = Field(
        default=None, description="why it was cancelled, where that is known"
    )


class LogEntry(Message):
    """One entry of the station's log."""

    time: datetime
    level: Literal["info", "warning", "error"]
    drive: str | None
    person: str
    text: str
    message: MessageInfo = Field(description="of text, as code and facts")
