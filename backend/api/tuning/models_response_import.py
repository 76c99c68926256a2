"""Messages about a recording of another program: its contents and how to evaluate it."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from backend.api.messages.models import Message
from backend.records.response_import.units import InputUnit, OutputUnit


class RecordingColumn(Message):
    """One column of a recording."""

    number: int = Field(description="from 1, as it may be given instead of the name")
    name: str
    first: list[float | None] = Field(description="its first values; null: no number")
    low: float
    high: float
    missing: int = Field(description="rows without a number")
    rises: bool = Field(description="whether every value is above the one before, as a time is")
    unit: str = Field(description="unit of time that its name states: s, ms, us or ns")
    curve: list[float] = Field(description="every n-th value")


class RecordingPreview(Message):
    """Table contained in a file."""

    form: str
    rows: int
    first_line: int = Field(description="line of the file with the first row; 0: no text")
    columns: list[RecordingColumn]
    facts: list[list[str]] = Field(description="pairs that stand before the table")


class ImportQuery(Message):
    """Columns by name or number, units, and the structure of the axis."""

    name: str = Field(max_length=200, description="name of the file, for messages")
    time: str | None = Field(None, max_length=200)
    input: str = Field(max_length=200)
    output: str = Field(max_length=200)
    time_unit: Literal["s", "ms", "us", "ns"] | None = None
    sample_rate_hz: float | None = Field(None, gt=0, description="instead of a time column")
    input_unit: InputUnit = "1"
    output_unit: OutputUnit = "1"
    rated_torque_nm: float | None = Field(None, gt=0)
    torque_constant_nm_a: float | None = Field(None, gt=0)
    structure: Literal["unknown", "motor_speed", "load_speed", "speed_loop"] = "unknown"
    f_min_hz: float | None = Field(None, ge=0)
    f_max_hz: float | None = Field(None, gt=0)
    output_filter_hz: float | None = Field(None, gt=0)
    current_bandwidth_hz: float | None = Field(None, gt=0)
    loop_delay_s: float | None = Field(None, ge=0)
