"""Messages of the hand-over to a machine's controller."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal

from pydantic import Field

from backend.api.messages.models import Message, Raw

FormatName = Literal["twincat", "codesys", "eni", "lcec", "ros2", "igh", "dcf", "csv", "python"]
ConsequenceName = Literal["motion", "unit", "limit", "gain", "other"]
DefectName = Literal[
    "unknown", "read_only", "size", "range", "twice", "order", "state", "energises", "locks"
]
_MEGABYTES = 1 << 20


#: One ESI file in base64, and the highest number of drives in a request.
_Esi = Annotated[str, Field(max_length=60 * _MEGABYTES)]
_MOST_AXES = 64


class HandoverChoice(Message):
    """Values to export, and the controller's format."""

    format: FormatName
    file: str = Field(pattern=r"^[\w][\w .\-]{0,100}$", description="name of the list to make")
    choice: Literal["all", "tuned", "not_default"] = "all"
    only: list[Annotated[str, Field(max_length=40)]] = Field(default=[], max_length=5000)
    include_motor_individual: bool = False
    esi: list[_Esi] = Field(
        default=[],
        max_length=_MOST_AXES,
        description="ESI files (base64) of the drives, for an ENI that a master can run",
    )


class HandoverRequest(HandoverChoice):
    """Export of the values of one drive's parameter set."""

    set_file: str = Field(max_length=200, description="parameter set of the library")
    version: int | None = Field(default=None, ge=1, description="of the set; the latest if null")


class SegmentAxis(Message):
    """One drive of a segment with its parameter set."""

    drive_id: str = Field(max_length=100)
    set_file: str = Field(max_length=200, description="parameter set of the library")
    version: int | None = Field(default=None, ge=1, description="of the set; the latest if null")


class SegmentHandoverRequest(HandoverChoice):
    """Export of the values of several drives on one bus, as one list."""

    axes: list[SegmentAxis] = Field(
        min_length=1, max_length=_MOST_AXES, description="in the order of the cable"
    )


class HandoverFile(Message):
    """One file of a hand-over."""

    name: str
    sha256: str
    content: str = Field(description="base64")


class LeftOutRow(Message):
    """A row of the set that is not exported, and why."""

    drive: str = Field(description="name of its axis")
    key: str
    reason: str


class HandoverResult(Message):
    """The files of a hand-over; the first one is the list."""

    files: list[HandoverFile]
    writes: int
    left_out: list[LeftOutRow]
    notes: list[str]


class HandoverConflict(Message):
    """A value that differs between controller, set and drive; raw values."""

    key: str
    name: str
    unit: str
    controller: Raw | None
    ours: Raw | None
    drive: Raw | None
    controller_value: Raw | None
    ours_value: Raw | None
    drive_value: Raw | None
    consequence: ConsequenceName
    sentence: str


class HandoverDefect(Message):
    """A defect of a controller's list."""

    kind: DefectName
    key: str
    place: str
    text: str


class HandoverComparison(Message):
    """Comparison of the drive now, our set and the controller's list."""

    format: str
    conflicts: list[HandoverConflict]
    defects: list[HandoverDefect]
    not_written: list[str] = Field(description="of our set, not written by the controller")
    restored: list[str] = Field(description="changed in the drive; the controller writes ours")
    unknown_here: list[str] = Field(description="neither set nor drive gives a value")
    not_read: list[str] = Field(description="the drive was asked and gave no value")
    same: int


class HandedOverInfo(Message):
    """An earlier hand-over of a drive."""

    number: int
    time: datetime
    person: str
    format: str
    file: str
    sha256: str
    set_file: str
    values: int = Field(description="how many")


class HandoverChanges(Message):
    """Values of the drive, read now, that differ from those handed over."""

    changed: list[HandoverConflict]
    not_read: list[str]
    values: int
