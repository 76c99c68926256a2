"""Result of a speed step or a move; curves and figures in the unit of ``unit``."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from backend.tools.tool import ToolResult


class _Numbers(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class StepNumbers(_Numbers):
    """Figures of a speed step; times from the command, None where never reached.

    None also where a figure depends on samples that were not received; ``unknown`` of the answer
    then names it.
    """

    initial: float
    final: float
    overshoot_percent: float | None
    rise_s: float | None
    settling_s: float | None
    peak_time_s: float | None


class MoveNumbers(_Numbers):
    """Figures of a move; ``settling_s`` counts from the end of the commanded motion.

    None as in `StepNumbers`.
    """

    following_peak: float
    following_rms: float
    overshoot: float | None
    settling_s: float | None
    torque_peak: float | None = Field(description="in % of rated torque")
    torque_rms: float | None = Field(description="in % of rated torque")


class StepAnswer(ToolResult):
    """Curves [n] over ``time_s``, and the figures read from them."""

    tool: Literal["step"] = "step"
    kind: Literal["speed", "move"]
    unit: Literal["rpm", "rev"] = Field(description="of demand, actual, noise and window")
    time_s: tuple[float, ...]
    demand: tuple[float, ...]
    actual: tuple[float, ...]
    torque_percent: tuple[float, ...] = Field(description="of rated torque")
    step: StepNumbers | None
    move: MoveNumbers | None
    noise: float = Field(
        description="standard deviation of a held speed, or of the position at the end of a move"
    )
    window: float | None = Field(description="settling window")
    widened: bool = Field(description="whether noise asked for a wider window than usual")
    torque_peak_percent: float
    torque_rms_percent: float
    lost_percent: float = Field(
        default=0.0, description="share of the samples that were not received"
    )
    unknown: tuple[str, ...] = Field(
        default=(), description="figures that depend on samples that were not received"
    )
