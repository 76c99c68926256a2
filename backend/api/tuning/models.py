"""Messages of tuning: measurements, notches, gains, candidates."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal

from pydantic import Field

from backend.api.messages.models import Message
from backend.tools.results import ToolOutcome
from backend.tools.tuning.autotune.result import CandidateInfo
from backend.tools.wire_message import MessageInfo


class ToolInfo(Message):
    """Descriptor of a tool."""

    kind: str
    texts: dict[str, list[str]] = Field(description="English, Chinese")
    settings: dict[str, object] = Field(description="JSON schema of what starting it takes")
    motion: bool = Field(description="whether it enables and moves the axis")


class ExcitationInfo(Message):
    """Excitation of a frequency response, as far as it is known before the axis is measured."""

    unit: str
    time_s: list[float]
    value: list[float] = Field(description="one realisation; extremes of every stretch")
    frequency_hz: list[float]
    amplitude: list[float] = Field(description="of every line, in the same unit")
    peak: float
    crest: float
    duration_s: float = Field(description="of all realisations together")
    realisations: int
    inertia_kgm2: float = Field(description="that was assumed")


class NotchShape(Message):
    """Vendor-neutral notch: centre, −3 dB bandwidth, depth (negative dB)."""

    center_hz: float = Field(gt=0)
    width_hz: float = Field(gt=0)
    depth_db: float = Field(le=0)


class RealisedInfo(Message):
    """Notch that the drive realises after rounding; null where it is not determined."""

    center_hz: float
    width_hz: float | None
    depth_db: float
    dc_gain_db: float | None
    stable: bool


class NotchSlotInfo(Message):
    """One notch of the drive."""

    slot: int
    enabled: bool
    notch: NotchShape | None
    realised: RealisedInfo | None
    raw: dict[str, int]
    note: str = Field(description="what is known of it, or empty")
    note_message: MessageInfo | None = Field(default=None, description="of note")


class NotchPreviewRequest(Message):
    """Wanted notches, one per slot; null is off. Nothing is written."""

    notches: list[NotchShape | None]
    frequency_hz: list[float] = Field(default_factory=list, max_length=5000)


class NotchPreviewInfo(Message):
    """Realised notches, and their combined response at the requested frequencies."""

    slots: list[NotchSlotInfo]
    magnitude_db: list[float]
    phase_deg: list[float]


class NotchWrite(Message):
    """Notches for all slots; those beyond the list are switched off."""

    notches: list[NotchShape | None]


class GainValues(Message):
    """Gains with a physical meaning. ``inertia_kgm2`` is that of the whole axis."""

    speed_bandwidth_hz: float = Field(gt=0)
    integral_hz: float = Field(gt=0)
    position_1_s: float = Field(gt=0)
    inertia_kgm2: float = Field(gt=0)


class GainWrite(Message):
    """Either physical gains or a stiffness level."""

    gains: GainValues | None = None
    level: int | None = None


class GainInfo(Message):
    """Present gains; null where they do not exist or their unit is not documented."""

    convention: str
    position_1_s: float | None
    speed_hz: float | None
    speed_nms: float | None
    integral_hz: float | None
    level: int | None
    levels: list[int] = Field(description="stiffness levels that the drive has; empty: none")
    inertia_kgm2: float | None
    current_bandwidth_hz: float | None
    speed_filter_hz: float | None
    rated_torque_nm: float | None
    raw: dict[str, int]


class Undo(Message):
    """Raw values before a change; writing them back undoes it.

    ``after`` are the values that the change left: if they are given and the drive has other ones
    now, nothing is undone, as somebody has changed them since.
    """

    before: dict[str, int]
    after: dict[str, int] | None = None


class MeasurementInfo(Message):
    """One stored measurement."""

    file: str
    kind: str
    drive: str
    profile: str
    serial: int | None
    saved: datetime | None
    problem: str = ""
    problem_message: MessageInfo | None = Field(default=None, description="of problem")


class MeasurementContent(Message):
    """Settings of a measurement, and its result evaluated again from the raw data."""

    info: MeasurementInfo
    settings: dict[str, object]
    result: Annotated[ToolOutcome | dict[str, object], Field(union_mode="left_to_right")] = Field(
        description="of a tool: its result, which its field tool names"
    )
    agrees: bool | None = Field(
        description="whether the result is the one that was concluded at the time; null: unknown"
    )
    differences: list[str] = Field(description="fields that differ, at most five")
    program: str = Field(description="version of servodeck that measured; empty: not reported")
    profile_version: str = Field(description="digest of the profile it was measured with")


class CandidatesRequest(Message):
    """Request for designs on a stored frequency response of the mechanics."""

    measurement: str
    inertia_kgm2: float = Field(gt=0)
    load: Literal["stiff", "medium", "compliant"] | None = None
    sample_rate_hz: float | None = Field(
        default=None, gt=0, description="only candidates that can be verified at this rate"
    )


class CandidatesInfo(Message):
    """Candidates, fastest first; up to three of them carry a mark."""

    load: str
    candidates: list[CandidateInfo]


class PredictRequest(Message):
    """Notches and gains to predict on a stored frequency response of the mechanics."""

    measurement: str
    notches: list[NotchShape] = Field(default_factory=list)
    gains: GainValues


class PredictionInfo(Message):
    """Predicted speed loop: curves over ``frequency_hz`` and the step response to its reference."""

    frequency_hz: list[float]
    open_db: list[float]
    open_deg: list[float]
    closed_db: list[float]
    closed_deg: list[float]
    sensitivity_db: list[float]
    step_time_s: list[float]
    step: list[float]
    margins: dict[str, float | bool | None]


class SignatureRequest(Message):
    """Person who signs a record where nobody is logged in by name, and notes."""

    person: str = Field(default="", max_length=200)
    notes: str = Field(default="", max_length=4000)
