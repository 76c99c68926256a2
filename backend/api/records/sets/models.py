"""Messages about parameter sets, and about their comparison with a drive."""

from __future__ import annotations

from datetime import datetime
from typing import Literal

from pydantic import Field

from backend.api.messages.models import Message, Raw
from backend.tools.wire_message import MessageInfo


class LoadSetRequest(Message):
    """Write chosen rows of a parameter set to a drive."""

    file: str
    keys: list[str] = Field(max_length=5000)
    version: int | None = Field(default=None, ge=1, description="of the set; the latest if null")
    accept_other_identity: bool = False
    accept_motor_individual: bool = Field(
        default=False, description="write values of one motor into another drive all the same"
    )


class SetFileInfo(Message):
    """A stored parameter set."""

    file: str
    profile: str
    drive_name: str
    serial: int | None
    firmware: str
    author: str
    saved: datetime | None
    notes: str
    count: int
    problem: str = Field(default="", description="why the file cannot be used")
    problem_message: MessageInfo | None = Field(default=None, description="of problem")


class SaveSetRequest(Message):
    """Store the current values of a drive."""

    file: str = Field(pattern=r"^[\w][\w .\-]{0,100}$")
    author: str = Field(default="", max_length=100)
    notes: str = Field(default="", max_length=4000)
    include_motor_individual: bool = False
    overwrite: bool = False


class DiffRow(Message):
    """One parameter whose value differs, or cannot be compared."""

    key: str
    name: str
    group: str
    unit: str
    file_raw: Raw | None
    file_value: Raw | None
    drive_raw: Raw | None
    drive_value: Raw | None
    default_raw: Raw | None
    default_value: Raw | None
    status: Literal[
        "differs", "same", "not_in_drive", "not_in_file", "invalid", "read_only", "energises"
    ]
    problem: str = ""
    problem_message: MessageInfo | None = Field(default=None, description="of problem")
    motor_individual: bool = False
    selected: bool = Field(description="proposed for writing")


class Diff(Message):
    """Comparison of a parameter set with a drive."""

    file: str
    version: int | None = Field(default=None, description="of the file; null for the latest")
    drive: str
    same_profile: bool
    same_serial: bool | None
    warnings: list[str]
    warning_messages: list[MessageInfo] = Field(default_factory=list, description="of warnings")
    rows: list[DiffRow]
