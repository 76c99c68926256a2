"""Messages about description files, profiles, line settings and additional ports."""

from __future__ import annotations

from typing import Literal

from pydantic import ConfigDict, Field, model_validator

from backend.api.messages.models import Message
from backend.api.station.models import FoundDrive
from backend.tools.wire_message import MessageInfo
from drivers.texts.message import Unsuitable, text

#: Pattern of a profile's name.
PROFILE_NAME = r"^[a-z][a-z0-9_]{0,59}$"


class DescribedDevice(Message):
    """One device of a maker's file, which often contains a whole series."""

    name: str
    product_code: int | None
    revision: int | None


class MotionClass(Message):
    """Whether writing an object can cause motion, with the origin of that classification."""

    motion: Literal["none", "at_enable", "energises"] | None = Field(
        description="null: it cannot be written"
    )
    safe_in_motion: bool = Field(description="at_enable, and may be changed while enabled")
    origin: Literal["standard", "profile", "person", "unclassified"] | None = Field(
        description="unclassified: nobody has said, so that it counts as energises"
    )
    reason: str
    changeable: bool = Field(description="whether a person may give it another class")
    fixed_why: str = Field(description="why not; empty where it is changeable")
    fixed_why_message: MessageInfo | None = Field(default=None, description="of fixed_why")


class MotionClassRequest(Message):
    """The motion class of an object, as stated by the person of the request."""

    model_config = ConfigDict(extra="forbid")

    motion: Literal["none", "at_enable", "energises"]
    safe_in_motion: bool = False
    reason: str = Field(
        min_length=3, max_length=500, description="how the person knows: the manual's page, a test"
    )

    @model_validator(mode="after")
    def _safe_only_at_enable(self) -> MotionClassRequest:
        if self.safe_in_motion and self.motion != "at_enable":
            raise Unsuitable(text("input.safe-only-at-enable"))
        return self


class ImportFinding(Message):
    """An irregularity in a description: its place, what it is, and how it was handled."""

    place: str = Field(description="the file with its line, section or element")
    text: str
    text_message: MessageInfo = Field(description="of text")
    outcome: Literal["repaired", "left out", "noted"]


class ImportedDescription(Message):
    """Result of an import job: the new profile, usable at once."""

    profile: str
    title: str
    vendor_id: int | None
    product_code: int | None
    revision: int | None
    links: list[str]
    parameters: int
    path: str = Field(description="the file to edit on the server's machine")
    summary: str
    summary_message: MessageInfo = Field(description="of summary")
    findings: list[ImportFinding]
    not_listed: int = Field(description="findings beyond those listed")


class ReadDictionaryRequest(Message):
    """Make a profile from the object dictionary of a drive."""

    url: str
    station: int = Field(ge=0, le=65535)
    profile: str = Field(pattern=PROFILE_NAME)


class LineSearchRequest(Message):
    """Search the baud rate and parity of a serial bus; few stations, as each costs time."""

    url: str
    stations: list[int] = Field(default=[1], min_length=1, max_length=16)


class LineSearchResult(Message):
    """Result of a line search: the URL with the settings found; null if nothing answered."""

    url: str | None
    found: list[FoundDrive]


class MissingPort(Message):
    """A port that the drive family has and that is not connected."""

    kind: Literal["ethercat", "canopen", "modbus", "mlink"]
    parameters: int = Field(description="parameters that only this port would reach")
    groups: list[str]
    wiring: str


class ImportedList(Message):
    """A CSV list stored as a parameter set, with the problems of lines that could not be used."""

    file: str
    parameters: int
    problems: list[str]
    problem_messages: list[MessageInfo] = Field(description="the same as codes and facts")


class RowNotExported(Message):
    """A row of a parameter set that a list in another format does not have."""

    key: str
    reason: str
    reason_message: MessageInfo = Field(description="of text, as code and facts")


class ProfileTexts(Message):
    """Texts of a profile in another language."""

    profile: str
    language: Literal["zh"]
    texts: dict[str, str] = Field(
        description="English text of the profile to its translation; what is missing has none"
    )
