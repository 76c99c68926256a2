"""Messages of recordings and support bundles."""

from __future__ import annotations

from datetime import datetime
from typing import Literal

from pydantic import Field

from backend.api.messages.models import Message
from backend.tools.wire_message import MessageInfo

ExportKind = Literal["csv", "csv_raw", "rrd", "mcap"]


class RecordChannel(Message):
    """A signal to record."""

    drive: str
    key: str


class RecordTrigger(Message):
    """Condition for a recording to begin.

    ``rising``, ``falling`` and ``change`` refer to a recorded signal.
    """

    kind: Literal["rising", "falling", "change", "fault"]
    drive: str = Field(default="", description="fault: empty for any drive")
    key: str = ""
    level: float = Field(default=0.0, allow_inf_nan=False)
    mask: int | None = Field(default=None, ge=1, le=2**32 - 1, description="bits of `change`")


class StartRecording(Message):
    """Settings of a recording."""

    name: str = Field(default="", max_length=100, description="empty: the date and time")
    channels: list[RecordChannel] = Field(min_length=1, max_length=64)
    period_s: float = Field(
        default=0.0, ge=0, le=10, description="of polled signals; 0: as fast as the bus allows"
    )
    duration_s: float | None = Field(default=None, gt=0, le=7 * 86400)
    pre_s: float = Field(default=0.0, ge=0, le=60, description="kept from before the trigger")
    trigger: RecordTrigger | None = None
    notes: str = Field(default="", max_length=4000)
    tags: list[str] = Field(default=[], max_length=20)


class RecordedChannel(Message):
    """A recorded signal. Its samples are in ``unit``."""

    drive: str
    drive_name: str
    key: str
    name: str
    unit: str
    shown_unit: str = Field(description="as the scope shows it, and CSV and rrd are written")
    shown_factor: float = Field(description="from unit to shown_unit")
    synchronous: bool


class RecordedAxis(Message):
    """An axis at the start of the recording."""

    drive: str
    name: str
    profile: str
    title: str
    serial: int | None
    firmware: str
    parameters: int = Field(description="how many are in the file")


class RecordingInfo(Message):
    """A running or stored recording."""

    name: str
    state: Literal["waiting", "recording", "complete", "interrupted", "failed", "unusable"]
    created: datetime | None
    person: str
    notes: str
    tags: list[str]
    kept: bool = Field(description="retention never deletes it")
    channels: list[RecordedChannel]
    axes: list[RecordedAxis]
    samples: int
    lost: int = Field(description="samples lost by the bus before they came to the recorder")
    duration_s: float
    bytes: int
    exports: list[ExportKind]
    reason: str = Field(description="why it ended")
    problem: str
    problem_message: MessageInfo | None = Field(default=None, description="of problem")


class RecordingList(Message):
    """Recordings, newest first, and the free space."""

    recordings: list[RecordingInfo]
    free_bytes: int
    reserve_bytes: int = Field(description="a recording ends when less is free")
    retention: RetentionBounds


class RetentionBounds(Message):
    """Limits above which the oldest recordings are deleted; null: no limit."""

    max_total_bytes: int | None = Field(ge=1_000_000)
    keep_days: float | None = Field(gt=0)


class ChangeRecording(Message):
    """Remarks on a recording; values that are left out stay unchanged."""

    notes: str | None = Field(default=None, max_length=4000)
    tags: list[str] | None = Field(default=None, max_length=20)
    kept: bool | None = None
    base_notes: str | None = Field(
        default=None,
        max_length=4000,
        description="the notes that were changed; refused where they are different by now",
    )
    base_tags: list[str] | None = Field(
        default=None, max_length=20, description="the tags that were changed, in the same way"
    )


class RecordingEvent(Message):
    """An event during a recording; ``t_s`` counts from its first sample."""

    t_s: float
    kind: str
    level: str
    drive: str
    text: str


class RecordedParameter(Message):
    """A parameter value at the start of a recording."""

    key: str
    name: str
    unit: str
    raw: int | float | str | None
    value: int | float | str | None
    time: float | None
    error: str
    error_message: MessageInfo | None = Field(
        default=None, description="error as code and facts; files of earlier versions have none"
    )


class RecordingDetail(Message):
    """A recording with its events and the parameter values of its axes."""

    info: RecordingInfo
    events: list[RecordingEvent]
    parameters: dict[str, list[RecordedParameter]]


class RecordedTrace(Message):
    """Samples [n] of one signal; ``t_s`` counts from the first sample of the recording."""

    drive: str
    key: str
    name: str
    unit: str
    t_s: list[float]
    values: list[float | None] = Field(description="null where the bus had none")


class RecordedSamples(Message):
    """All samples of one section of a recording, without decimation."""

    start: datetime = Field(description="time of the first sample of the recording")
    from_s: float
    until_s: float = Field(description="this moment is the next stretch's")
    more: bool = Field(description="there are samples after this stretch")
    traces: list[RecordedTrace]


class BundleInfo(Message):
    """A support bundle."""

    name: str
    created: datetime
    bytes: int


class BundleList(Message):
    """Support bundles, newest first."""

    bundles: list[BundleInfo]
    armed: bool
    before_s: float
    after_s: float


class ArmRequest(Message):
    """Whether a fault makes a support bundle of the last seconds."""

    armed: bool


class BundleRequest(Message):
    """Reason for making a support bundle."""

    reason: str = Field(default="", max_length=200, description="empty: made by hand")
