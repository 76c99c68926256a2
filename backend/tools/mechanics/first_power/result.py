"""Checklist of the first power; positions in revolutions, torques in % of rated torque."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from backend.tools.tool import ToolResult

CheckName = Literal["supply", "resolution", "counts", "direction", "switches", "brake", "phases"]
Status = Literal["passed", "failed", "open"]
Verdict = Literal["passed", "failed", "incomplete"]
Phases = Literal[
    "right", "not_excluded", "reversed", "phases_reversed", "feedback_inverted", "locks",
    "blocked", "pulled", "no_motion", "short", "no_torque_mode", "counts_first", "supply_first",
    "resolution_first", "not_done",
]  # fmt: skip
"""Finding on the motor phases: see docs/first-power.md."""
Way = Literal["with", "against", "locked", "none", "short"]
"""Motion of the shaft for one sign of the torque; short: still moving when the test ended."""
Guide = Literal["pole_identification", "identification"]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Check(_Part):
    """One line of the checklist. ``finding`` names a text of the tool under the check's name."""

    name: CheckName
    status: Status
    finding: str
    value: float | None = None


class Pulse(_Part):
    """One torque pulse and the position before and after it, from the start."""

    direction: Literal[1, -1]
    torque_percent: float
    from_rev: float
    to_rev: float


class FirstPowerResult(ToolResult):
    """Result; ``measured_at`` is ISO 8601, UTC.

    ``covers_pole_pairs``: with fewer pole pairs, two exchanged phases could stay undetected within
    this travel. ``guide`` is the drive's own procedure for the commutation angle.
    """

    tool: Literal["first-power"] = "first-power"
    verdict: Verdict
    measured_at: str
    checks: tuple[Check, ...]
    pulses: tuple[Pulse, ...] = ()
    travel_rev: float = Field(default=0.0, description="farthest from the start")
    torque_percent: float = Field(default=0.0, description="highest torque that was sent")
    covers_pole_pairs: int | None = None
    guide: Guide | None = None
