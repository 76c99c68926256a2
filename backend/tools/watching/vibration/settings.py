"""Settings of a map of vibration over speed."""

from __future__ import annotations

from pydantic import Field

from backend.tools.tool import ToolSettings


class VibrationSettings(ToolSettings):
    """Speeds of the map; the time limit applies to all moves together."""

    time_limit_s: float = Field(
        default=180.0, gt=0, le=300, description="longest time of all moves together, in s"
    )
    speeds: int = Field(default=10, ge=5, le=40, description="speeds in each direction")
    closer: int = Field(
        default=8,
        ge=0,
        le=20,
        description="further speeds about the one at which an order has its highest level",
    )
    slowest_rpm: float | None = Field(
        default=None, gt=0, description="lowest speed; a twelfth of the highest one without it"
    )
