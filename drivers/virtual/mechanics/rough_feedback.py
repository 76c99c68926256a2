"""Options for non-standard reporting of motion by a virtual drive, as found in real ones."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class RoughFeedbackSpec(BaseModel):
    """Options of the firmware; the defaults have no effect.

    ``velocity_unit`` and ``acceleration_unit`` are codes of 60A9h and 60AAh: the drive's speeds and
    ramps are in these units, also 60FFh and 6081h. ``speed_factor`` multiplies 606Ch alone: 10 for
    a drive that reports 0.1 rpm but states rpm, −1 for the opposite sign, 0 for a constant value.
    ``lacks`` names objects (``6092``) that the drive does not have.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    position_unit: int | None = Field(default=None, gt=0, le=0xFFFFFFFF)
    velocity_unit: int | None = Field(default=None, gt=0, le=0xFFFFFFFF)
    acceleration_unit: int | None = Field(default=None, gt=0, le=0xFFFFFFFF)
    speed_factor: float = 1.0
    speed_step_rpm: float = Field(default=0.0, ge=0, description="606Ch is cut off to these steps")
    speed_late_s: float = Field(default=0.0, ge=0, le=0.1, description="606Ch is so old")
    speed_mean_s: float = Field(default=0.0, ge=0, le=0.1, description="606Ch is a mean over this")
    position_stands: bool = False
    brake_opens_s: float | None = Field(
        default=None, ge=0, le=10, description="the brake opens so long after enabling, silently"
    )
    lacks: tuple[str, ...] = ()
