"""Load of a cycle on motor and drive; torques in % of the motor's rated torque."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from backend.tools.tool import Interval, ToolResult

Verdict = Literal["endures", "overloads", "undecided", "idle"]
"""``undecided``: of the motors that match the known data, some would endure it and others not."""
Code = Literal[
    "no_period",
    "few_periods",
    "slow_sampling",
    "gaps",
    "peak_beyond",
    "peak_reached",
    "peak_unknown",
    "speed_beyond_rated",
    "rated_speed_unknown",
    "rated_torque_unknown",
    "time_constant_unknown",
    "overload_unknown",
    "overload_exceeded",
    "ambient_needs_rise",
]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Finding(_Part):
    """Something that limits the validity of the result, or a recommended action."""

    code: Code
    value: float | None = None
    unit: str = ""


class CyclePower(_Part):
    """Mechanical power at the shaft; less braking energy reaches the drive, by the losses."""

    highest_w: float
    mean_w: float
    highest_braking_w: float
    braking_j: float = Field(description="in one period, or in the recording where none is known")
    braking_mean_w: float


class CycleHeat(_Part):
    """Range over the motors that match the catalogue data.

    Times count from a motor at ambient temperature; null: never, or (as the earlier end) not known.
    """

    ambient_c: float
    time_constant_min: float | None
    rise_share: tuple[float, float] = Field(description="highest rise, of the permitted rise")
    trip_s: tuple[float | None, float | None]
    about_s: float | None = Field(description="of a motor in the middle of the range")


class CycleOverload(_Part):
    """The I²t budget of a stated overload; ``trip_s`` is null where it is never exceeded."""

    percent: float
    seconds: float
    used_share: float
    trip_s: float | None


class CycleResult(ToolResult):
    """Result; ``drive_load_percent`` is the load that the drive reports, by its own rule."""

    tool: Literal["cycle"] = "cycle"
    verdict: Verdict
    recording: str | None
    duration_s: float
    samples: int
    sample_rate_hz: float
    longest_gap_s: float
    period_s: float | None
    periods: int
    rated_torque_nm: float | None
    rated_speed_rpm: float | None
    rms_percent: float
    rms_ci95_percent: Interval
    peak_percent: float
    peak_limit_percent: float | None
    peak_limit_stated: bool = Field(description="false: it is the drive's own torque limit")
    above_rated_share: float = Field(description="share of the time above rated torque")
    highest_speed_rpm: float
    mean_speed_rpm: float
    drive_load_percent: float | None
    dc_voltage_v: tuple[float, float] | None = Field(description="lowest and highest that was read")
    power: CyclePower | None
    heat: CycleHeat | None
    overload: CycleOverload | None
    cloud_speed_rpm: tuple[float, ...] = Field(description="[n], rising")
    cloud_torque_percent: tuple[float, ...] = Field(description="[n]")
    findings: tuple[Finding, ...] = ()
