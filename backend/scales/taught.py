"""Scales of an axis that a person stated: stored with the axis, valid for its gear settings."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field


class Taught(BaseModel):
    """Scales of one axis, stated by a person or measured in a small motion.

    ``bound_to``: raw values of the drive (gear, feed, resolution, units) for which they hold; with
    other values they are not used.
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
        """Whether the drive still has the values for which these scales were stated."""
        return all(raws.get(key) == raw for key, raw in self.bound_to.items())
