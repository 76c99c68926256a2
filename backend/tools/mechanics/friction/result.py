"""Result of a friction map; torques in % of rated torque, speeds in rpm at the motor."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from backend.tools.tool import Interval, ToolResult

Code = Literal[
    "mapped",
    "standstill_not_measured",
    "stribeck_not_seen",
    "stribeck_not_reached",
    "few_speeds",
    "ripple_not_asked",
    "ripple_needs_revolution",
    "ripple_not_seen",
    "uneven_speeds",
    "fastest_by_travel",
    "slowest_by_time",
    "model_misfit",
    "compensation_in_controller",
]
#: Columns of the compensation table for a controller.
COMPENSATION_COLUMNS = ("position_rev", "torque_percent", "forward_percent", "backward_percent")


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Estimate(_Part):
    """A value with its 95 % interval, in the unit of the field's name."""

    value: float
    ci95: Interval


class FrictionPoint(_Part):
    """Torque at one constant speed, negative backwards; it includes the static torque of a load."""

    speed_rpm: float
    torque_percent: float
    torque_ci95_percent: tuple[float, float]
    revolutions: float = Field(description="that the mean is calculated over")


class Harmonic(_Part):
    """Torque that repeats ``order_per_rev`` times per motor revolution.

    Torque = ``amplitude_percent`` · sin(order · angle + ``phase_deg``), by the angle that the
    drive reports (6064h).
    """

    order_per_rev: int
    amplitude_percent: float
    amplitude_ci95_percent: tuple[float, float]
    phase_deg: float


class Finding(_Part):
    """A result or limitation of the map: a code and the figure that it rests on."""

    code: Code
    value: float | None = None
    unit: Literal["", "rpm", "rev", "s", "%"] = ""


class FrictionResult(ToolResult):
    """The map. ``curve_*`` is the model through the points, over the measured speeds only.

    The model: torque = load + sign(v) · (Coulomb + Stribeck · exp(-(|v|/v_s)^δ)) + viscous · v.
    Parameters are None where the data do not determine them; ``findings`` state why.
    """

    tool: Literal["friction"] = "friction"
    rated_torque_nm: float | None = Field(description="what 100 % is; null where it is not known")
    points: tuple[FrictionPoint, ...]
    curve_speed_rpm: tuple[float, ...]
    curve_percent: tuple[float, ...]
    coulomb_percent: Estimate | None
    viscous_percent_per_rpm: Estimate | None
    stribeck_percent: Estimate | None = Field(description="above Coulomb friction, towards 0 rpm")
    stribeck_speed_rpm: Estimate | None
    load_percent: Estimate | None = Field(description="constant pull of the load (gravity)")
    standstill_percent: Estimate | None = Field(
        default=None, description="break-away torque; null: standstill friction is not measured"
    )
    harmonics: tuple[Harmonic, ...] = Field(description="largest first")
    ripple_speed_rpm: float | None
    ripple_angle_deg: tuple[float, ...] = Field(description="[n] over one motor revolution")
    ripple_forward_percent: tuple[float | None, ...] = Field(description="[n] about its mean")
    ripple_backward_percent: tuple[float | None, ...] = Field(description="[n] about its mean")
    compensation_percent: tuple[float, ...] = Field(
        default=(),
        description="[n] torque that the ripple needs, by its harmonics: for a controller that "
        "adds it to the torque command; empty where no ripple was found",
    )
    findings: tuple[Finding, ...]
    motion_s: float

    def compensation_csv(self) -> str | None:
        """Compensation table over one motor revolution: position in rev, torques in % of rated.

        Both directions are about their mean, as measured; a field is empty where there is no
        sample. None without a ripple.
        """
        if not self.compensation_percent:
            return None
        columns = (
            tuple(angle / 360.0 for angle in self.ripple_angle_deg),
            self.compensation_percent,
            self.ripple_forward_percent,
            self.ripple_backward_percent,
        )
        rows = [
            ",".join("" if each is None else f"{each:.6f}" for each in row)
            for row in zip(*columns, strict=True)
        ]
        return "\n".join([",".join(COMPENSATION_COLUMNS), *rows, ""])
