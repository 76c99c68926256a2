"""Settings of an inertia measurement."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from backend.tools.mechanics.inertia.evaluation import InertiaSettings, Scheme
from backend.tools.tool import Option, ToolSettings


class InertiaRequest(ToolSettings):
    """Settings of an inertia and friction measurement."""

    scheme: Scheme = Field(default="free", description="how the axis may travel")
    ends_rev: Annotated[tuple[float, float] | None, Option(("--end-low-rev", "--end-high-rev"))] = (
        Field(default=None, description="taught end")
    )
    search_torque: float = Field(
        default=20.0, gt=0, le=100, description="torque of the search for an end, in % of rated"
    )
    search_speed: float = Field(default=30.0, gt=0, description="speed of the search, in rpm")
    repetitions: int = Field(default=4, ge=1, le=10, description="moves forth and back")
    motor_inertia_kgm2: float | None = Field(
        default=None, gt=0, description="inertia of the motor alone"
    )

    @property
    def inner(self) -> InertiaSettings:
        """The same settings for the tool's inner layers."""
        return InertiaSettings(
            self.envelope, self.scheme, self.ends_rev, self.search_torque, self.search_speed,
            self.repetitions, self.rated_torque_nm, self.motor_inertia_kgm2,
        )  # fmt: skip
