"""Settings of a speed step or a move."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from backend.tools.moving.step.evaluate import StepSettings
from backend.tools.tool import Option, ToolSettings
from drivers.texts.message import Unsuitable, text


class StepRequest(ToolSettings):
    """Settings of a step of speed (rpm) or a move (rev)."""

    kind: Literal["speed", "move"] = Field(default="speed", description="what is commanded")
    size: float = Field(
        default=100.0, description="size of the step in rpm, or way of the move in revolutions"
    )
    hold_s: float = Field(default=0.25, gt=0, le=5, description="time at the end, in s")
    speed: Annotated[float, Option(("--move-rpm",))] = Field(
        default=300.0, gt=0, description="speed of a move, in rpm"
    )
    acceleration: Annotated[float, Option(("--move-rpm-s",))] = Field(
        default=6000.0, gt=0, description="acceleration of a move, in rpm/s"
    )
    window: float | None = Field(
        default=None, gt=0, description="settling window in rpm or revolutions; 2 % of the size"
    )

    @model_validator(mode="after")
    def _some_way(self) -> StepRequest:
        if self.size == 0.0:
            raise Unsuitable(text("step.no-size"))
        return self

    @property
    def inner(self) -> StepSettings:
        """The same settings for the tool's inner layers."""
        return StepSettings(
            self.envelope, self.kind, self.size, self.hold_s, self.speed, self.acceleration,
            self.window, self.rated_torque_nm,
        )  # fmt: skip
