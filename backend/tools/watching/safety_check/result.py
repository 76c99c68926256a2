"""Record of a safety function; times from its first sign on the bus."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from backend.tools.tool import ToolResult
from backend.tools.watching.safety_check.settings import Function

Verdict = Literal[
    "not_triggered",
    "torque_remains",
    "still_turning",
    "restarted",
    "power_off_at_speed",
    "no_reaction",
    "beyond_limits",
    "not_shown",
    "within_limits",
    "recorded",
]
"""The worst first. ``recorded``: everything was observed, and no limit was given."""
Obstacle = Literal[
    "torque_in_noise", "too_slow", "samples_lost", "stayed_enabled", "quick_stop_cut"
]
"""Reason why a property of the function cannot be shown."""
Sign = Literal["state", "speed"]
"""First sign: the drive left Operation enabled, or the speed left the commanded one."""
Exceeded = Literal["torque_free", "stop_time", "stop_distance", "speed"]


class Signature(BaseModel):
    """Who signed the record, and when. ``intact``: the signed contents still have this checksum."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    person: str
    signed: str
    notes: str = ""
    sha256: str
    intact: bool


class SafetyResult(ToolResult):
    """Times are in ms from the first sign on the bus, distances in revolutions of the motor.

    No time includes the delay from the person's hand to that sign: contacts, the safety relay and
    the drive's own input are not on the bus. ``torque`` values are as the drive reports them, in %
    of the motor's rated torque. ``measured_at`` is ISO 8601, UTC.
    """

    tool: Literal["safety-check"] = "safety-check"
    function: Function
    verdict: Verdict
    exceeded: tuple[Exceeded, ...] = ()
    obstacle: Obstacle | None = None
    sign: Sign | None = None
    device: str
    person: str
    measured_at: str
    reports: tuple[str, ...] = Field(
        default=(),
        description="faults of the drive at the end; one that is no sign of the "
        "function stopped the axis instead of it",
    )
    speed_rpm: float | None = Field(default=None, description="when it was triggered")
    torque_before_percent: float | None = None
    torque_noise_percent: float = Field(description="below it no torque can be distinguished")
    torque_free_ms: float | None = None
    torque_free_ci95_ms: tuple[float, float] | None = None
    torque_after_percent: float | None = Field(
        default=None, description="greatest magnitude after that, until the end"
    )
    speed_at_torque_free_rpm: float | None = None
    stop_ms: float | None = None
    stop_rev: float | None = None
    highest_rpm: float = 0.0
    limited_rpm: float | None = None
    watched_ms: float = Field(default=0.0, description="from the first sign to the end")
    trace_ms: tuple[float, ...] = Field(default=(), description="[n] from the first sign")
    trace_rpm: tuple[float, ...] = Field(default=(), description="[n] by the position")
    trace_commanded_rpm: tuple[float, ...] = Field(default=(), description="[n]")
    trace_torque_percent: tuple[float, ...] = Field(default=(), description="[n]")
    signature: Signature | None = None
