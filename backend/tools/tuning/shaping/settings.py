"""Settings of command shaping: the move that is measured, and the shaper to try."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from backend.tools.tool import Option, ToolSettings
from drivers.texts.message import Unsuitable, text

Choice = Literal["auto", "zv", "zvd", "ei"]


class ShapingSettings(ToolSettings):
    """A move out and back, repeated, first without and then with a shaper."""

    size: float = Field(default=1.0, description="way of the move, in revolutions")
    speed: Annotated[float, Option(("--move-rpm",))] = Field(
        default=600.0, gt=0, description="speed of the move, in rpm"
    )
    acceleration: Annotated[float, Option(("--move-rpm-s",))] = Field(
        default=6000.0, gt=0, description="acceleration of the move, in rpm/s"
    )
    hold_s: float = Field(
        default=2.0, ge=1, le=8, description="time at each end, in which the vibration decays, in s"
    )
    repetitions: int = Field(default=2, ge=2, le=5, description="moves out and back of each kind")
    lowest_hz: float = Field(
        default=2.0, ge=1, le=30, description="lowest frequency that is looked for, in Hz"
    )
    highest_hz: float = Field(
        default=30.0, ge=3, le=60, description="highest frequency that is looked for, in Hz"
    )
    frequency_hz: float | None = Field(
        default=None,
        ge=1,
        le=60,
        description="frequency of the mode in Hz where it is known, such as the anti-resonance of "
        "a response; looked for within 30 %",
    )
    damping: float | None = Field(
        default=None,
        ge=0,
        le=0.4,
        description="damping ratio of that mode; only where the motor does not show it",
    )
    shaper: Choice = Field(
        default="auto", description="the shaper that is played; auto: the shortest that suffices"
    )
    tolerance_percent: float = Field(
        default=5.0, ge=1, le=20, description="vibration that may be left, in % of the unshaped"
    )
    window_rev: float | None = Field(
        default=None,
        gt=0,
        description="settling window of the position in revolutions; without it settling is when "
        "a tenth of the vibration is left",
    )
    verify: bool = Field(default=True, description="play the shaped move, too, and compare")

    @model_validator(mode="after")
    def _in_order(self) -> ShapingSettings:
        if self.size == 0.0:
            raise Unsuitable(text("shaping.no-size"))
        if self.lowest_hz >= self.highest_hz:
            raise Unsuitable(
                text("shaping.band-empty", lowest_hz=self.lowest_hz, highest_hz=self.highest_hz)
            )
        return self
