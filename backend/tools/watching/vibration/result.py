"""Result of a map of vibration over speed; speeds are those of the motor."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from backend.tools.tool import ToolResult

Place = Literal["whole", "not_whole", "unknown"]
"""Whether an order is a whole number per motor revolution: ``whole`` belongs to the motor or to
what turns with its shaft, ``not_whole`` to something else."""
Code = Literal[
    "resonance",
    "orders_only",
    "nothing_seen",
    "band",
    "highest_order",
    "fixed_frequency",
    "unassigned",
    "highest_at_end",
    "not_closer",
    "uneven_speeds",
    "fastest_by_travel",
    "samples_lost",
    "motor_side",
    "listen",
]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class VibrationFinding(_Part):
    """A result or limitation of the map: a code and the figure that it rests on."""

    code: Code
    value: float | None = None
    unit: str = ""


class VibrationPart(_Part):
    """One sinusoid at one speed: amplitudes of speed and torque."""

    frequency_hz: float
    order_per_rev: float
    speed_rpm: float
    torque_percent: float


class VibrationSpeed(_Part):
    """One constant speed, negative backwards. RMS about the mean and a slow drift."""

    speed_rpm: float
    speed_rms_rpm: float = Field(description="of the measured speed, encoder steps included")
    torque_rms_percent: float = Field(description="of the torque that the drive reports")
    highest_order: float = Field(description="orders above lie beyond the band at this speed")
    parts: tuple[VibrationPart, ...] = Field(description="largest first")


class VibrationOrder(_Part):
    """A component of ``order_per_rev`` periods per motor revolution, and where it is largest."""

    order_per_rev: float
    order_ci95: tuple[float, float]
    place: Place
    speeds: int = Field(description="speeds that show it")
    largest_rpm: float = Field(description="amplitude of the speed")
    at_rpm: float
    torque_percent: float = Field(description="amplitude of the torque there")
    level_speed_rpm: tuple[float, ...] = Field(description="[n] both directions, absolute")
    level_rpm: tuple[float, ...] = Field(description="[n] amplitude of the speed")


class VibrationFrequency(_Part):
    """A component whose frequency does not depend on the speed, and where it is largest."""

    frequency_hz: float
    frequency_ci95_hz: tuple[float, float]
    speeds: int
    largest_rpm: float
    at_rpm: float
    torque_percent: float


class SpeedRange(_Part):
    """Speeds at which this order excites a resonance to more than half of its highest level."""

    order_per_rev: float
    speed_rpm: float
    low_rpm: float
    high_rpm: float


class VibrationResonance(_Part):
    """A mode of the axis with its present loops, excited where order · speed matches it."""

    frequency_hz: float
    frequency_ci95_hz: tuple[float, float]
    height: float = Field(description="highest level over that about it")
    avoid: tuple[SpeedRange, ...] = Field(description="largest first, inside the speeds measured")


class VibrationResult(ToolResult):
    """The map. Frequencies above ``band_hz`` are aliased by the sampling and are not stated."""

    tool: Literal["vibration"] = "vibration"
    sample_rate_hz: float
    band_hz: tuple[float, float]
    speeds: tuple[VibrationSpeed, ...] = Field(description="slowest first, backwards and forwards")
    orders: tuple[VibrationOrder, ...] = Field(description="largest first")
    frequencies: tuple[VibrationFrequency, ...] = Field(description="largest first")
    resonances: tuple[VibrationResonance, ...] = Field(description="highest first")
    findings: tuple[VibrationFinding, ...]
    motion_s: float
