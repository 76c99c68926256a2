"""Settings of a brake test."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from backend.axes.motion.envelope import Envelope
from backend.tools.tool import Option, ToolSettings


class BrakeSettings(ToolSettings):
    """Test torque, slip limit, and what a person states about brake and load.

    The travel from the start is limited by ``slip_limit_rev`` and ``travel_limit``, whichever is
    less. The test torque is ``test_torque_nm``, else ``test_percent`` of ``brake_rated_nm``, else
    ``test_percent`` of the motor's rated torque.
    """

    speed_limit: Annotated[float, Option(("--speed-rpm",), 120.0)] = Field(
        default=120.0, gt=0, description="highest speed, in rpm"
    )
    travel_limit: Annotated[float, Option(("--travel-rev",), 0.02)] = Field(
        default=0.02, gt=0, description="longest way from the start, in revolutions"
    )
    torque_limit: Annotated[float, Option(("--torque-percent",), 130.0)] = Field(
        default=130.0, gt=0, le=400, description="highest torque, in % of rated"
    )
    test_percent: float = Field(
        default=100.0,
        gt=0,
        le=400,
        description="test torque in % of the brake's rated torque, or of the motor's without it",
    )
    test_torque_nm: float | None = Field(default=None, gt=0, description="test torque, in N·m")
    brake_rated_nm: float | None = Field(
        default=None, gt=0, description="rated holding torque of the brake, in N·m"
    )
    slip_limit_rev: float = Field(
        default=0.02, gt=0, le=0.1, description="travel that aborts the test, in revolutions"
    )
    ramp_s: float = Field(
        default=1.0, ge=0.2, le=10, description="time in which the torque rises, in s"
    )
    brake_supply_cut: bool = Field(
        default=False,
        description="you have disconnected the brake's supply, so that nothing can open the brake",
    )
    nothing_hangs: bool = Field(
        default=False,
        description="you state that no load pulls at the axis, whether its brake holds or not",
    )
    load_supported: bool = Field(
        default=False,
        description="you state that the hanging load is supported, cannot fall and cannot be "
        "lifted off its support, and that nobody is below it",
    )

    @property
    def envelope(self) -> Envelope:
        """The limits of the motion."""
        return Envelope(
            min(self.travel_limit, self.slip_limit_rev),
            self.speed_limit,
            self.torque_limit,
            self.time_limit_s,
        )
