"""Result of a brake test; torques in % of the motor's rated torque, travel in revolutions."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from backend.tools.tool import ToolResult

Verdict = Literal["held", "slipped", "not_closed", "cannot_be_tested"]
Obstacle = Literal[
    "means_unknown",
    "built_in",
    "fixed_output",
    "bus_bit",
    "no_output",
    "output_inverted",
    "output_forced",
    "no_torque_mode",
    "windup_beyond_limit",
    "samples_lost",
]
"""Reason why a brake cannot be tested; none where the drive did not reach the test torque."""
Means = Literal["output", "supply"]
"""What keeps the brake closed: its output has another function, or its supply is disconnected."""


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class BrakeWay(_Part):
    """One direction.

    Travel counts from a preload of a tenth of the test torque, which takes up backlash;
    ``windup_rev`` is elastic and returns with the torque, ``slip_rev`` does not.

    ``torque_percent`` is the torque at the shaft: at the test torque, or where the brake began to
    slip. It includes the friction of the motor's bearings and the static torque of a load.
    """

    direction: Literal[1, -1]
    verdict: Verdict
    torque_percent: float
    torque_ci95_percent: tuple[float, float]
    travel_rev: float
    windup_rev: float
    slip_rev: float
    abort_ms: float | None = Field(
        default=None, description="from the limit of travel until the torque was gone"
    )
    curve_travel_rev: tuple[float, ...] = Field(description="[n] from the preload")
    curve_torque_percent: tuple[float, ...] = Field(description="[n]")


class BrakeResult(ToolResult):
    """Result of both directions; the worse one decides. ``measured_at`` is ISO 8601, UTC."""

    tool: Literal["brake-test"] = "brake-test"
    verdict: Verdict
    obstacle: Obstacle | None = None
    means: Means | None = None
    measured_at: str
    rated_torque_nm: float | None = Field(description="what 100 % is; null where it is not known")
    brake_rated_nm: float | None
    test_percent: float
    slip_limit_rev: float
    torque_percent: float | None = Field(description="of the direction that carried less")
    of_brake_percent: float | None = Field(description="the same, in % of the brake's rated torque")
    ways: tuple[BrakeWay, ...] = ()
