"""Messages of the commissioning report."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal

from pydantic import Field

from backend.api.messages.models import Message


class ReportRequest(Message):
    """Contents of the report of an axis."""

    format: Literal["html", "pdf"] = "pdf"
    language: Literal["en", "zh"] = "en"
    person: str = Field(default="", max_length=200)
    machine: str = Field(default="", max_length=200)
    notes: str = Field(default="", max_length=8000)
    measurements: list[Annotated[str, Field(max_length=200)]] | None = Field(
        default=None,
        max_length=40,
        description="files; null: the newest of each kind, with the one before tuning",
    )


class ReportInfo(Message):
    """One stored report."""

    file: str
    format: Literal["html", "pdf"]
    made: datetime
    size_bytes: int
