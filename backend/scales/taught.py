"""What a person has said of the scales of an axis: kept with the axis, bound to its gear."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field


class Taught(BaseModel):
    """Scales of one axis by a person or by a measured small motion.

    ``bound_to`` are raw values of the drive (gear, feed, resolution, units) under which this was
    said: with others it says nothing any more.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    counts_per_rev: float | None = Field(
        default=None, gt=0, description="position increments per motor revolution"
    )
    raw_per_rpm: float | None = Field(default=None, gt=0, description="raw speed of one rpm")
    raw_per_rpm_s: float | None = Field(default=None, gt=0, description="raw ramp of one rpm/s")
    velocity_origin: Literal["user", "measured"] = "user"
    bound_to: dict[str, int] = Field(
        default_factory=dict, description="raw values of the drive that it holds for"
    )

    def holds(self, raws: Mapping[str, int]) -> bool:
        """Whether the drive still has the values under which this was said."""
        return all(raws.get(key) == raw for key, raw in self.bound_to.items())
