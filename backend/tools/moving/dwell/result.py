"""Result of a dwell: the excited vibration as measured at the motor."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from backend.tools.moving.dwell.settings import By
from backend.tools.tool import Interval, ToolResult

Code = Literal[
    "excited",
    "not_seen",
    "not_linear",
    "linear",
    "level_changed",
    "harmonics_beyond_band",
    "turn_slowly",
    "blocks_lost",
    "motor_side",
]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class DwellFinding(_Part):
    """A finding of the dwell: a code and the figure that it rests on."""

    code: Code
    value: float | None = None
    unit: str = ""


class DwellEstimate(_Part):
    """A value with its 95 % interval, in the unit of the field's name."""

    value: float
    ci95: Interval


class DwellHarmonic(_Part):
    """Amplitude at a multiple of the frequency; only a non-linearity causes one."""

    multiple: int
    speed_rpm: float
    speed_ci95_rpm: Interval


class DwellResult(ToolResult):
    """Amplitudes at the excitation frequency, at full amplitude of the excitation.

    The phase is that of the speed relative to the excitation, both as seen on the bus: it includes
    the delay of setpoints and samples on the bus.
    """

    tool: Literal["dwell"] = "dwell"
    frequency_hz: float
    by: By
    excitation: float = Field(description="amplitude that was sent, in rpm or % of rated torque")
    seen: bool = Field(description="whether the speed stands out of the noise")
    speed_rpm: DwellEstimate
    position_deg: DwellEstimate
    torque_percent: DwellEstimate
    phase_deg: DwellEstimate | None = Field(description="null where the speed is not seen")
    harmonics: tuple[DwellHarmonic, ...]
    over_s: float = Field(description="time that the values are of")
    trace_s: tuple[float, ...] = Field(description="[n] middle of each block, from the beginning")
    trace_rpm: tuple[float, ...] = Field(description="[n] amplitude of the speed in each block")
    findings: tuple[DwellFinding, ...]
