"""Messages of scope set-ups and snapshots."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from backend.api.messages.models import Finite, Message, Positive
from drivers.texts.message import Unsuitable, text

TraceId = Annotated[str, Field(pattern=r"^[cm][0-9]{1,3}$")]


class ScopeTrace(Message):
    """A channel that is displayed.

    ``show`` selects the drive's unit, the axis' unit, or ``own``: drive's value × ``factor`` +
    ``offset``, in ``unit``.
    """

    id: TraceId
    drive: str = Field(max_length=100)
    key: str = Field(max_length=40)
    show: Literal["drive", "axis", "own"] = "axis"
    factor: Finite = 1.0
    offset: Finite = 0.0
    unit: str = Field(default="", max_length=20)


class ScopeMath(Message):
    """A channel computed from the displayed values of others (language: docs/scope.md)."""

    id: TraceId
    name: str = Field(max_length=60)
    unit: str = Field(default="", max_length=20)
    expression: str = Field(max_length=300)


class ScopeTrigger(Message):
    """Trigger of the scope.

    ``drive`` is for the kinds ``fault`` and ``motion``, ``trace`` for all others; ``before`` is the
    fraction of the window before the trigger.
    """

    mode: Literal["off", "auto", "normal", "single"] = "off"
    kind: Literal[
        "rising", "falling", "either", "above", "below", "enters", "leaves", "bit_set",
        "bit_clear", "change", "fault", "motion",
    ] = "rising"  # fmt: skip
    trace: str = Field(default="", max_length=4)
    drive: str = Field(default="", max_length=100)
    level: Finite = 0.0
    high: Finite = 0.0
    bit: int = Field(default=0, ge=0, le=31)
    before: float = Field(default=0.2, ge=0, le=1)


class ScopeRange(Message):
    """A fixed y scale for the traces of one unit; without one, they are scaled to the plot."""

    unit: str = Field(max_length=40)
    low: Finite
    high: Finite

    @model_validator(mode="after")
    def _of_some_height(self) -> Self:
        if not self.low < self.high:
            raise Unsuitable(text("input.scale-not-upwards", low=self.low, high=self.high))
        return self


class ScopeSetup(Message):
    """All settings of the Scope page."""

    traces: list[ScopeTrace] = Field(default=[], max_length=32)
    maths: list[ScopeMath] = Field(default=[], max_length=16)
    trigger: ScopeTrigger = ScopeTrigger()
    window_s: Positive = 5.0
    persistence: int = Field(default=0, ge=0, le=50)
    ranges: list[ScopeRange] = Field(default=[], max_length=32)


class NamedSetup(Message):
    """A stored set-up."""

    name: str
    saved: datetime
    setup: ScopeSetup


class SnapshotTrace(Message):
    """A trace of a snapshot."""

    label: str
    unit: str
    rows: int = Field(ge=0)
    synchronous: bool


class SnapshotHeader(Message):
    """Header of a snapshot file. ``origin_s`` is the time that was displayed as zero."""

    created: datetime
    notes: str = Field(default="", max_length=4000)
    origin_s: float
    traces: list[SnapshotTrace] = Field(max_length=64)
    setup: ScopeSetup


class SnapshotInfo(Message):
    """A stored snapshot; ``header`` is null if the file is not usable."""

    name: str
    bytes: int
    header: SnapshotHeader | None
