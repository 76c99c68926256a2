"""Settings of a vibration at one frequency."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from backend.tools.tool import ToolSettings

By = Literal["speed", "torque"]


class DwellSettings(ToolSettings):
    """A sine of the speed setpoint, or of the torque offset, faded in and out."""

    time_limit_s: float = Field(
        default=70.0, gt=0, le=120, description="longest time of the motion, in s"
    )
    frequency_hz: float = Field(
        default=50.0, ge=1, le=1000, description="frequency of the vibration, in Hz"
    )
    by: By = Field(
        default="speed",
        description="what carries the sine: the speed setpoint, or torque ahead of the speed loop",
    )
    amplitude_rpm: float = Field(
        default=5.0, gt=0, le=300, description="amplitude of the speed setpoint, in rpm"
    )
    amplitude_percent: float = Field(
        default=5.0, gt=0, le=100, description="amplitude of the torque, in % of rated"
    )
    turn_rpm: float = Field(
        default=0.0,
        ge=0,
        le=500,
        description="slow speed to and fro that the vibration is added to; 0: about standstill",
    )
    duration_s: float = Field(default=10.0, ge=1, le=60, description="time at full amplitude, in s")
