"""Settings of a gantry measurement."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from backend.tools.tool import Option, ToolSettings


class GantrySettings(ToolSettings):
    """The limits of every measurement, for both axes, and the data of the pair."""

    partner: Annotated[str, Option(("--partner",))] = Field(
        default="",
        max_length=60,
        description="the other axis: its name on the server, or its station on a bus of one's own",
    )
    mirrored: bool = Field(
        default=False, description="the other motor turns the other way when the beam moves"
    )
    skew_limit_rev: float = Field(
        default=0.05,
        gt=0,
        le=10,
        description="largest change of the difference of both positions, in revolutions",
    )
    resolution_hz: float = Field(
        default=2.0, ge=0.5, le=5.0, description="distance of the lines, in Hz"
    )
    highest_hz: float | None = Field(
        default=None,
        gt=10.0,
        description="highest line, in Hz; a quarter of the bus rate without it",
    )
    lead_mm: float | None = Field(
        default=None, gt=0, description="way of the beam for one motor revolution, in mm"
    )
