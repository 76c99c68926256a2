"""Settings of the first power, with the statements of a person about the axis."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from backend.tools.tool import Option, ToolSettings


class FirstPowerSettings(ToolSettings):
    """Limits of the motion, the parts of the checklist to carry out, and statements on the load.

    The motor is energised only with one of the two statements about what hangs at the axis.
    """

    speed_limit: Annotated[float, Option(("--speed-rpm",), 200.0)] = Field(
        default=200.0, gt=0, le=300, description="highest speed, in rpm"
    )
    travel_limit: Annotated[float, Option(("--travel-rev",), 0.1)] = Field(
        default=0.1, ge=0.02, le=0.1, description="longest way from the start, in revolutions"
    )
    torque_limit: Annotated[float, Option(("--torque-percent",), 10.0)] = Field(
        default=10.0, ge=1, le=10, description="highest torque, in % of rated"
    )
    hand_turn: bool = Field(
        default=False,
        description="you turn the shaft by hand, forwards as the machine counts, when asked",
    )
    hand_revolutions: int = Field(
        default=1, ge=1, le=20, description="whole revolutions that you turn it by, to a mark"
    )
    hand_time_s: float = Field(
        default=60.0, ge=2, le=280, description="time for what is done by hand, in s"
    )
    hand_switches: bool = Field(
        default=False, description="you operate both limit switches by hand meanwhile"
    )
    powered: bool = Field(
        default=True, description="the motor is energised, with small pulses of torque"
    )
    pole_pairs: int | None = Field(
        default=None, ge=1, le=64, description="pole pairs of the motor, where known"
    )
    nothing_hangs: bool = Field(
        default=False, description="you state that no load pulls at the axis"
    )
    load_supported: bool = Field(
        default=False,
        description="you state that the hanging load is supported, cannot fall and cannot be "
        "lifted off its support, and that nobody is below it",
    )
