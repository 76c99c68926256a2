"""Result from both encoders; angles in degrees at the load, stiffness at the load."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from backend.tools.tool import Interval, ToolResult

Code = Literal[
    "measured",
    "flank_kept",
    "backlash_not_seen",
    "stiffness_not_seen",
    "motor_inertia_unknown",
    "rated_torque_unknown",
    "load_light",
    "pull_large",
    "setpoints_held",
    "revolution_not_covered",
]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Estimate(_Part):
    """A value with its 95 % interval, in the unit of the field's name."""

    value: float
    ci95: Interval


class ErrorOrder(_Part):
    """Transmission error of ``order_per_rev`` periods per revolution of the load."""

    order_per_rev: float
    amplitude_deg: float
    amplitude_ci95_deg: Interval


class Finding(_Part):
    """A result or limitation of the measurement: a code and the figure that it rests on."""

    code: Code
    value: float | None = None
    unit: str = ""


class LoadSideResult(ToolResult):
    """Result of a load-side measurement.

    ``lost_motion_deg`` is the difference of slow passes in both directions: backlash plus the twist
    by friction. ``backlash_deg`` is the gap alone. Values are None where the data do not show them;
    ``findings`` state why.
    """

    tool: Literal["load-side"] = "load-side"
    gear_ratio: float
    counts_per_load_rev: float = Field(description="measured; negative: counts the other way")
    lost_motion_deg: Estimate
    backlash_deg: Estimate | None
    backlash_motor_rev: Estimate | None
    stiffness_nm_per_rad: Estimate | None = Field(description="at the load")
    stiffness_at_least_nm_per_rad: float | None = Field(
        description="at the load, where it is too stiff for a value"
    )
    locked_motor_hz: Estimate | None = Field(
        description="frequency of the load while the motor is held: the anti-resonance"
    )
    load_inertia_kgm2: Estimate | None = Field(description="at the motor shaft")
    error_span_deg: Estimate = Field(description="transmission error, peak to peak")
    error_orders: tuple[ErrorOrder, ...]
    error_angle_deg: tuple[float, ...] = Field(description="[n] at the load, of the motor angle")
    error_deg: tuple[float, ...] = Field(description="[n] load behind the motor")
    residual_deg: float = Field(description="root mean square of what the model leaves")
    findings: tuple[Finding, ...]
    motion_s: float
