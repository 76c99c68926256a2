"""Settings of a health check: which measurements, and how often."""

from __future__ import annotations

from pydantic import Field, model_validator

from backend.tools.tool import ToolSettings
from drivers.texts.message import Unsuitable, text


class HealthSettings(ToolSettings):
    """One envelope for all measurements; results are comparable only with equal settings.

    The time limit applies to each measurement.
    """

    rounds: int = Field(default=2, ge=1, le=10, description="how often everything is measured")
    response: bool = Field(default=True, description="measure the frequency response")
    friction: bool = Field(default=True, description="measure friction over speed")
    inertia: bool = Field(default=True, description="measure the inertia")
    step_rpm: float = Field(default=0.0, ge=0, description="step of speed in rpm; 0: none")
    lowest_hz: float = Field(default=5.0, gt=0, description="lowest frequency, in Hz")
    speeds: int = Field(default=4, ge=3, le=24, description="speeds of the friction map")
    slowest_rpm: float = Field(default=30.0, gt=0, description="lowest speed of it, in rpm")

    @model_validator(mode="after")
    def _something(self) -> HealthSettings:
        if not (self.response or self.friction or self.inertia or self.step_rpm):
            raise Unsuitable(text("health.nothing-chosen"))
        return self
