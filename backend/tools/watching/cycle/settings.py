"""Settings of a cycle load evaluation. Nothing moves: there is no envelope."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field, model_validator

from drivers.texts.message import Unsuitable, text


class CycleSettings(BaseModel):
    """How long to read, or which recording to use; and catalogue data of motor and drive."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    duration_s: float = Field(
        default=60.0, ge=2, le=3600, description="how long the drive is read, in s"
    )
    recording: str | None = Field(
        default=None, description="a recording that is evaluated instead of reading the drive"
    )
    period_s: float | None = Field(
        default=None, gt=0, description="time of one machine cycle in s; found where not given"
    )
    motor_rated_nm: float | None = Field(
        default=None, gt=0, description="rated torque in N·m, if not the drive's"
    )
    motor_rated_rpm: float | None = Field(
        default=None, gt=0, description="rated speed in rpm, if not the drive's"
    )
    peak_percent: float | None = Field(
        default=None,
        gt=0,
        le=1000,
        description="peak torque of the motor, in % of rated; the drive's limit without it",
    )
    overload_percent: float | None = Field(
        default=None,
        gt=100,
        le=1000,
        description="overload that the catalogue permits, in % of rated torque; with --overload-s",
    )
    overload_s: float | None = Field(
        default=None, gt=0, description="for how long it permits it, in s"
    )
    thermal_time_min: float | None = Field(
        default=None,
        gt=0,
        le=600,
        description="thermal time constant of the motor by its catalogue, in min",
    )
    standstill_percent: float | None = Field(
        default=None,
        ge=100,
        le=300,
        description="torque that the motor carries for long at standstill, in % of rated",
    )
    ambient_c: float = Field(
        default=40.0, ge=-20, le=90, description="temperature about the motor, in °C"
    )
    rise_k: float | None = Field(
        default=None,
        ge=30,
        le=160,
        description="rise of the winding at rated torque in K; needed where it is not 40 °C",
    )

    @model_validator(mode="after")
    def _whole(self) -> CycleSettings:
        if (self.overload_percent is None) != (self.overload_s is None):
            raise Unsuitable(text("cycle.overload-half"))
        if self.rise_k is not None and self.ambient_c >= 40.0 + self.rise_k:
            raise Unsuitable(
                text("cycle.ambient-too-warm", ambient_c=self.ambient_c, limit_c=40.0 + self.rise_k)
            )
        return self
