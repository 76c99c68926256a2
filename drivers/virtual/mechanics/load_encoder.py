"""A second encoder, on the last inertia of the chain."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class LoadEncoderSpec(BaseModel):
    """The drive's second encoder, on the load.

    One revolution of the load is ``gear`` revolutions of the motor, and ``counts_per_rev`` counts.
    Mounted off its centre by ``eccentricity_rad`` (amplitude of the error at the load, once per
    load revolution), with an error of ``second_rad`` twice per revolution, both at ``phase_rad``.
    ``noise_counts`` is the standard deviation of white noise before it is rounded down to counts.
    ``late_s`` is the age of the reported value.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    counts_per_rev: int = Field(default=2**20, ge=16)
    gear: float = Field(default=1.0, gt=0, le=1000)
    inverted: bool = False
    offset_counts: int = 0
    eccentricity_rad: float = Field(default=0.0, ge=0, le=0.1)
    second_rad: float = Field(default=0.0, ge=0, le=0.1)
    phase_rad: float = 0.0
    noise_counts: float = Field(default=0.0, ge=0)
    late_s: float = Field(default=0.0, ge=0, le=0.02)
