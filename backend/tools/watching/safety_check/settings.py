"""Settings of a safety check: the function, the motion meanwhile, and the limits to be met."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from backend.tools.tool import Option, ToolSettings

Function = Literal["sto", "ss1", "limit_positive", "limit_negative", "speed_limit"]
"""Names of IEC 61800-5-2: safe torque off, safe stop 1; limit switches; safely-limited speed."""


class SafetySettings(ToolSettings):
    """Settings for one function: after a person has stopped the axis, nothing moves it by itself.

    Limits that are None are not judged; the values are only recorded.
    """

    function: Function = Field(default="sto", description="the function that you trigger")
    device: str = Field(
        default="",
        max_length=100,
        description="what you trigger it with, such as emergency stop S1 or guard switch B3",
    )
    person: str = Field(
        default="", max_length=100, description="who triggers it and watches the axis"
    )
    speed_rpm: Annotated[float, Option(("--test-rpm",))] = Field(
        default=100.0, gt=0, description="speed at which it is triggered, in rpm"
    )
    wait_s: float = Field(
        default=10.0, ge=2, le=120, description="time in which you trigger it, in s"
    )
    watch_s: float = Field(
        default=3.0, ge=1, le=30, description="time that is watched after that, in s"
    )
    limited_rpm: float | None = Field(
        default=None, gt=0, description="the speed limit, in rpm; of the speed limit only"
    )
    torque_free_limit_ms: float | None = Field(
        default=None, gt=0, description="longest time until no torque is left, in ms"
    )
    stop_limit_ms: float | None = Field(
        default=None, gt=0, description="longest time to standstill, in ms"
    )
    stop_limit_rev: float | None = Field(
        default=None, gt=0, description="longest way to standstill, in revolutions"
    )
    nothing_hangs: bool = Field(
        default=False,
        description="you state that no load pulls at the axis, so that it stays without torque",
    )
    load_supported: bool = Field(
        default=False,
        description="you state that the hanging load is supported, cannot fall and cannot be "
        "lifted off its support, and that nobody is below it",
    )
