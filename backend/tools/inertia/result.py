"""What an inertia measurement concludes; SI units at the motor shaft, where ``unit`` says so."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from backend.tools.tool import Interval, ToolResult


class InertiaIntervals(BaseModel):
    """95 % intervals of the fields of the same names."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    inertia_kgm2: Interval
    viscous_nms: Interval
    coulomb_nm: Interval
    gravity_nm: Interval
    load_ratio: Interval | None


class InertiaAnswer(ToolResult):
    """Values are None where they are not finite; they count only where ``identifiable``."""

    tool: Literal["inertia"] = "inertia"
    method: str
    inertia_kgm2: float | None
    viscous_nms: float | None
    coulomb_nm: float | None
    gravity_nm: float | None
    load_ratio: float | None
    load_ratio_against: str = Field(description="what it compares with; empty without a ratio")
    ci95: InertiaIntervals
    place_nm: float | None = Field(
        default=None, description="half the span of a torque by place: spring, arm, imbalance"
    )
    place_periods_rev: tuple[float, ...] = ()
    fan_nm: float | None = Field(
        default=None, description="torque by the square of the speed, at the highest: fan, pump"
    )
    r2: float
    verdict: str
    identifiable: bool
    unit: Literal["SI", "torque as a share of rated torque"]
    ends_rev: tuple[float, float] | None
    motion_s: float
