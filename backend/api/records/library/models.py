"""Messages of the library and of comparisons with its versions."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal

from pydantic import Field

from backend.api.messages.models import Message, Raw
from backend.api.records.sets.models import SetFileInfo
from backend.tools.wire_message import MessageInfo

LibraryKind = Literal["set", "recording", "measurement", "report"]
TagText = Annotated[str, Field(min_length=1, max_length=60)]


class AxisInfo(Message):
    """Identity of the drive that an item was made with."""

    profile: str
    name: str
    vendor_id: int | None
    product_code: int | None
    revision: int | None
    serial: int | None
    firmware: str


class VersionInfo(Message):
    """One version of an entry; never changed."""

    number: int
    saved: datetime
    author: str
    notes: str
    bytes: int
    sha256: str = Field(description="empty where the file lies in a station's folder")
    axis: AxisInfo
    facts: dict[str, int | float | str | bool | None] = Field(
        description="what a list shows of this kind: parameters, channels, duration_s …"
    )
    problem_message: MessageInfo | None = Field(
        default=None, description="of facts.problem: why the file cannot be used"
    )


class LibraryEntry(Message):
    """One entry of the library."""

    id: int
    kind: LibraryKind
    station: str = Field(description="whose folder it lies in; empty where it is in the store")
    here: bool = Field(description="its contents can be fetched from this station")
    name: str
    notes: str
    tags: list[str]
    changed: datetime
    deleted: datetime | None
    versions: int
    latest: VersionInfo


class LibraryPage(Message):
    """A page of a search, newest first."""

    entries: list[LibraryEntry]
    total: int
    problems: list[str] = Field(description="files that could not be added to the library")
    problem_messages: list[MessageInfo] = Field(default_factory=list, description="of problems")
    shared: bool = Field(description="other stations may have the same library")


class TagCount(Message):
    """A tag and how many entries have it."""

    tag: str
    count: int


class LibraryChange(Message):
    """Change notes or tags; values that are left out stay unchanged."""

    notes: str | None = Field(default=None, max_length=4000)
    tags: list[TagText] | None = Field(default=None, max_length=20)
    deleted: Literal[False] | None = Field(default=None, description="false restores it")
    base_notes: str | None = Field(
        default=None,
        max_length=4000,
        description="the notes that were changed; refused where they are different by now",
    )
    base_tags: list[TagText] | None = Field(
        default=None, max_length=20, description="the tags that were changed, in the same way"
    )


class StoredSet(SetFileInfo):
    """A stored parameter set with its place in the library."""

    entry: int | None = Field(default=None, description="id in the library")
    version: int = 0
    tags: list[str] = Field(default_factory=list)


class ThreeWayRow(Message):
    """One parameter in base, theirs and drive; see ``status``."""

    key: str
    name: str
    group: str
    unit: str
    base_raw: Raw | None
    base_value: Raw | None
    theirs_raw: Raw | None
    theirs_value: Raw | None
    drive_raw: Raw | None
    drive_value: Raw | None
    status: Literal[
        "same",
        "theirs",
        "drive",
        "both",
        "conflict",
        "not_in_theirs",
        "not_in_drive",
        "invalid",
        "read_only",
        "energises",
    ] = Field(description="theirs, drive: changed only there; both: to the same; conflict: not")
    problem: str = ""
    problem_message: MessageInfo | None = Field(default=None, description="of problem")
    motor_individual: bool = False
    selected: bool = Field(description="proposed for writing")


class ThreeWay(Message):
    """Two sets compared with a drive that was read now."""

    base: str
    base_version: int | None
    theirs: str
    theirs_version: int | None
    drive: str
    same_profile: bool
    same_serial: bool | None
    warnings: list[str]
    warning_messages: list[MessageInfo] = Field(default_factory=list, description="of warnings")
    rows: list[ThreeWayRow]
