"""Settings of a friction map."""

from __future__ import annotations

from pydantic import Field

from backend.tools.tool import ToolSettings


class FrictionSettings(ToolSettings):
    """Speeds of the map; its limits are those of every measurement.

    The time limit applies to all moves together: slow speeds are left out where it is too short.
    """

    time_limit_s: float = Field(
        default=120.0, gt=0, le=300, description="longest time of all moves together, in s"
    )
    speeds: int = Field(default=10, ge=3, le=24, description="speeds in each direction")
    slowest_rpm: float | None = Field(
        default=None, gt=0, description="lowest speed; as low as the time limit allows without it"
    )
    ripple: bool = Field(default=True, description="one slow revolution each way for the ripple")
    orders: int = Field(
        default=60, ge=4, le=200, description="highest order of the ripple, per revolution"
    )
