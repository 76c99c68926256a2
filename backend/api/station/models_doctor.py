"""Messages of the doctor's routes."""

from __future__ import annotations

from pydantic import Field

from backend.api.messages.models import Message
from backend.tools.wire_message import MessageInfo


class DoctorFact(Message):
    """A piece of evidence: actual and expected value (null: not specified).

    ``shown`` and ``shown_expected`` are the same values in the notation of manuals.
    """

    name: str
    label: str
    label_zh: str
    actual: int | str
    expected: int | str | None
    shown: str
    shown_expected: str | None


class DoctorCause(Message):
    """A possible cause, with texts in English and Chinese."""

    code: str
    weight: int
    title: str
    title_zh: str
    remedy: str
    remedy_zh: str
    facts: list[DoctorFact]


class DoctorTrial(Message):
    """A setting of servodeck's own bring-up that may be the cause, and the value to try."""

    setting: str = Field(description="its place in the profile, or cycle")
    before: str = Field(description="as it is; - where the profile has none")
    after: str = Field(description="as it is tried")
    of_profile: bool = Field(
        description="can be kept; the cycle is chosen where the exchange is started"
    )


class StationDiagnosis(Message):
    """Diagnosis of one station; without causes if it is in Operational."""

    station: int
    reached: bool
    causes: list[DoctorCause]
    trials: list[DoctorTrial] = Field(
        default_factory=list, description="for a connected drive; the likeliest first"
    )
    kept: DoctorTrial | None = Field(
        default=None, description="the setting that holds until the drive is connected anew"
    )


class TrialRequest(Message):
    """One of the trials offered by the last examination of this station."""

    url: str
    station: int = Field(ge=1)
    setting: str = Field(max_length=100)
    after: str = Field(max_length=100)


class TrialResult(Message):
    """Result of a trial's job. The setting has been undone."""

    station: int
    setting: str
    after: str
    reached: bool = Field(description="the station was in Operational")
    refusal: MessageInfo | None = Field(description="what the start of the exchange ended with")
