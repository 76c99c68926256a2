"""Settings of a load-side measurement."""

from __future__ import annotations

from pydantic import Field

from backend.tools.tool import ToolSettings


class LoadSideSettings(ToolSettings):
    """The limits of every measurement, the gear, and the motor's own inertia."""

    time_limit_s: float = Field(
        default=90.0, gt=0, le=300, description="longest time of all moves together, in s"
    )
    gear_ratio: float = Field(
        default=1.0,
        gt=0,
        le=1000,
        description="motor revolutions for one revolution of the load encoder",
    )
    motor_inertia_kgm2: float | None = Field(
        default=None,
        gt=0,
        description="inertia of the motor alone by its catalogue in kg·m², if not the drive's",
    )
    slow_rpm: float | None = Field(
        default=None, gt=0, description="speed of the slow passes; chosen by the limits without it"
    )
